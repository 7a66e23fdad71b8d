//! A tracker's sensor that is held still: at a point of the table, or on a hand that lies flat.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::reading::TrackerReading;

/// How long the sensor has to be still, ns.
pub const TRACKER_HOLD_NS: u64 = 1_000_000_000;
/// Readings closer together than this are left out, ns.
const SPACING_NS: u64 = 1_000_000;
/// Fewest readings that make a mean: a slow tracker with four stations sends so many in a second.
const READINGS_MIN: usize = 5;
/// How far from the mean a still sensor may be, m.
const STILL_M: f64 = 0.004;
/// How far from the mean a still sensor may be turned, rad.
const STILL_RAD: f64 = 0.04;

/// The mean of a sensor that was still.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldSensor {
    /// `transmitter_from_sensor` in the y-up space of [`TrackerReading::world_from_sensor`], m.
    pub pose: Isometry3<f64>,
    /// Root mean square distance of the readings from that position, m.
    pub noise_m: f64,
    /// Root mean square angle of the readings from that rotation, rad.
    pub noise_rad: f64,
    /// Readings that went into it.
    pub n_readings: usize,
}

/// How far a hold is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TrackerProgress {
    /// The tracker sends no valid pose.
    Blind,
    /// The sensor moves.
    Moving,
    /// It is still; the share of the time that is over, 0 to 1.
    Holding(f64),
    /// It was held to the end.
    Done(HeldSensor),
}

/// Waits until a sensor is still.
#[derive(Debug, Clone, Default)]
pub struct TrackerHold {
    poses: VecDeque<(u64, Isometry3<f64>)>,
}

impl TrackerHold {
    /// Takes a reading of the one station that is meant.
    pub fn push(&mut self, reading: &TrackerReading) -> TrackerProgress {
        let Some(pose) = reading.world_from_sensor() else {
            self.poses.clear();
            return TrackerProgress::Blind;
        };
        let now_ns = reading.stamp_ns;
        let is_close = |(stamp, _): &(u64, _)| now_ns < stamp.saturating_add(SPACING_NS);
        if !self.poses.back().is_some_and(is_close) {
            self.poses.push_back((now_ns, pose));
        }
        let is_old = |(stamp, _): &(u64, _)| now_ns.saturating_sub(*stamp) > TRACKER_HOLD_NS;
        let mut is_full = false;
        while self.poses.front().is_some_and(is_old) {
            self.poses.pop_front();
            is_full = true;
        }
        // What is kept ends with this reading: whatever is far from it was before the sensor came to rest.
        let is_far = |(_, other): &(u64, Isometry3<f64>)| !is_near(other, &pose);
        if let Some(last_far) = self.poses.iter().rposition(is_far) {
            self.poses.drain(..=last_far);
            return TrackerProgress::Moving;
        }
        let held_ns = self
            .poses
            .front()
            .map_or(0, |(stamp, _)| now_ns.saturating_sub(*stamp));
        if !is_full || self.poses.len() < READINGS_MIN {
            return TrackerProgress::Holding((held_ns as f64 / TRACKER_HOLD_NS as f64).min(1.0));
        }
        TrackerProgress::Done(held(self.poses.iter().map(|(_, pose)| pose)))
    }
}

/// Twice the distance from the mean.
fn is_near(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    let apart = (a.translation.vector - b.translation.vector).norm();
    apart <= 2.0 * STILL_M && a.rotation.angle_to(&b.rotation) <= 2.0 * STILL_RAD
}

fn held<'p>(poses: impl Iterator<Item = &'p Isometry3<f64>> + Clone) -> HeldSensor {
    let n_readings = poses.clone().count();
    let n = n_readings.max(1) as f64;
    let position = poses
        .clone()
        .map(|pose| pose.translation.vector)
        .sum::<Vector3<f64>>()
        / n;
    let first = poses
        .clone()
        .next()
        .map_or_else(UnitQuaternion::identity, |pose| pose.rotation);
    // q and -q are one rotation: all on the side of the first.
    let aligned = poses.clone().map(|pose| {
        let q = pose.rotation.into_inner();
        if q.coords.dot(&first.coords) < 0.0 {
            -q
        } else {
            q
        }
    });
    let sum = aligned.fold(Quaternion::new(0.0, 0.0, 0.0, 0.0), |sum, q| sum + q);
    let rotation = UnitQuaternion::try_new(sum, 1e-9).unwrap_or(first);
    let mean_of = |square: &dyn Fn(&Isometry3<f64>) -> f64| {
        (poses.clone().map(square).sum::<f64>() / n).sqrt()
    };
    HeldSensor {
        pose: Isometry3::from_parts(Translation3::from(position), rotation),
        noise_m: mean_of(&|pose| (pose.translation.vector - position).norm_squared()),
        noise_rad: mean_of(&|pose| pose.rotation.angle_to(&rotation).powi(2)),
        n_readings,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::{TrackerHold, TrackerProgress};
    use crate::reading::TrackerReading;
    use crate::tracker::space::TrackerSpace;

    fn reading(ms: u64, x: f64, yaw: f64) -> TrackerReading {
        TrackerReading {
            stamp_ns: ms * 1_000_000,
            sequence: ms,
            station: 1,
            space: TrackerSpace::YUp,
            position: Some(Point3::new(x, 0.2, 0.3)),
            rotation: Some(nalgebra::UnitQuaternion::from_euler_angles(0.0, yaw, 0.0)),
            position_valid: true,
            rotation_valid: true,
            error: None,
            device_ticks: None,
            stylus_pressed: None,
        }
    }

    #[test]
    fn a_sensor_that_comes_to_rest_is_averaged() {
        let mut hold = TrackerHold::default();
        for ms in (0..500).step_by(10) {
            hold.push(&reading(ms, ms as f64 * 1e-3, 0.0));
        }
        let mut done = None;
        for ms in (500..2000).step_by(10) {
            let wobble = if (ms / 10) % 2 == 0 { 1e-3 } else { -1e-3 };
            match hold.push(&reading(ms, 0.5 + wobble, wobble)) {
                TrackerProgress::Done(held) => {
                    done = Some((ms, held));
                    break;
                }
                progress => assert!(progress != TrackerProgress::Blind),
            }
        }
        let (ms, held) = done.expect("it was still for 1.5 s");
        assert!((1490..=1560).contains(&ms), "{ms}");
        assert!((held.pose.translation.x - 0.5).abs() < 1e-4);
        assert!((held.noise_m - 1e-3).abs() < 1e-4 && (held.noise_rad - 1e-3).abs() < 1e-4);
    }

    #[test]
    fn a_sensor_that_moves_or_is_not_seen_is_not_held() {
        let mut hold = TrackerHold::default();
        for ms in (0..5000).step_by(10) {
            let progress = hold.push(&reading(ms, ms as f64 * 1e-4, 0.0));
            assert!(
                !matches!(progress, TrackerProgress::Done(_)),
                "0.1 m/s at {ms}"
            );
        }
        let blind = TrackerReading {
            position_valid: false,
            ..reading(6000, 0.0, 0.0)
        };
        assert_eq!(hold.push(&blind), TrackerProgress::Blind);
        assert_eq!(
            hold.push(&reading(6010, 0.0, 0.0)),
            TrackerProgress::Holding(0.0)
        );
    }
}
