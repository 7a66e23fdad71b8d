//! The filter of a whole hand, as a client or a file gives it: its wrist, and each joint in the wrist's space (or the joint
//! angles together), by themselves.

use nalgebra::{Isometry3, Point3};
use tsukamu_world::hand::joint::N_JOINTS;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles, N_ANGLES};

use super::one_euro::{Filter, OneEuro};

/// A filter of one hand.
#[derive(Clone, Debug)]
pub struct HandFilter {
    settings: OneEuro,
    wrist: Filter<Isometry3<f64>, 6>,
    angles: Filter<JointAngles, N_ANGLES>,
    /// `None` where the joint was not tracked in the last sample.
    joints: [Option<Filter<Point3<f64>, 3>>; N_JOINTS],
}

impl HandFilter {
    /// A filter that has seen nothing.
    pub const fn new(settings: OneEuro) -> Self {
        Self {
            settings,
            wrist: Filter::new(settings),
            angles: Filter::new(settings),
            joints: [const { None }; N_JOINTS],
        }
    }

    /// The filtered sample of a finite one that was taken at a monotonic time in nanoseconds.
    pub fn filtered(&mut self, sample: &HandSample, at_ns: u64) -> HandSample {
        let wrist = self.wrist.filtered(&sample.wrist, at_ns);
        let settings = self.settings;
        let fingers = match &sample.fingers {
            FingerPose::Angles(angles) => FingerPose::Angles(self.angles.filtered(angles, at_ns)),
            FingerPose::Points(points) => FingerPose::Points(std::array::from_fn(|joint| {
                let Some(point) = &points[joint] else {
                    self.joints[joint] = None;
                    return None;
                };
                let local = sample.wrist.inverse_transform_point(point);
                let filter = self.joints[joint].get_or_insert_with(|| Filter::new(settings));
                Some(wrist * filter.filtered(&local, at_ns))
            })),
        };
        HandSample { wrist, fingers }
    }

    /// How far the filter runs behind a steady motion at present, in seconds: the largest of its time constants.
    pub fn lag_s(&self) -> f64 {
        let joints = self.joints.iter().flatten().map(Filter::lag_s);
        joints
            .chain([self.wrist.lag_s(), self.angles.lag_s()])
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::super::one_euro::DERIVATIVE_CUTOFF_HZ;
    use super::*;

    const SETTINGS: OneEuro = OneEuro {
        min_cutoff_hz: 1.0,
        beta: 10.0,
        derivative_cutoff_hz: DERIVATIVE_CUTOFF_HZ,
    };
    const STEP_NS: u64 = 10_000_000;

    fn sample(x: f64, turn: f64, flexion: f64) -> HandSample {
        let mut angles = JointAngles::default();
        angles.fingers[0].mcp_flexion = flexion;
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, turn, 0.0));
        let wrist = Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation);
        HandSample {
            wrist,
            fingers: FingerPose::Angles(angles),
        }
    }

    fn flexion(sample: &HandSample) -> f64 {
        match &sample.fingers {
            FingerPose::Angles(angles) => angles.fingers[0].mcp_flexion,
            FingerPose::Points(_) => f64::NAN,
        }
    }

    #[test]
    fn noise_shrinks_and_a_step_is_reached() {
        let mut filter = HandFilter::new(OneEuro {
            beta: 0.0,
            ..SETTINGS
        });
        let noise = |k: u64| if k.is_multiple_of(2) { 0.001 } else { -0.001 };
        let mut last = filter.filtered(&sample(0.0, 0.0, 0.0), 0);
        for k in 1..500 {
            last = filter.filtered(&sample(noise(k), noise(k), noise(k)), k * STEP_NS);
        }
        let parts = [
            last.wrist.translation.x,
            last.wrist.rotation.angle(),
            flexion(&last),
        ];
        assert!(parts.iter().all(|part| part.abs() < 0.0001), "{parts:?}");
        for k in 500..1000 {
            last = filter.filtered(&sample(0.5, 1.0, 0.7), k * STEP_NS);
        }
        let parts = [
            last.wrist.translation.x - 0.5,
            last.wrist.rotation.angle() - 1.0,
            flexion(&last) - 0.7,
        ];
        assert!(parts.iter().all(|part| part.abs() < 1e-6), "{parts:?}");
    }

    #[test]
    fn the_reported_lag_is_the_lag_of_a_steady_motion() {
        // At a constant speed v a low-pass of time constant τ stands v τ behind. It moves and turns alike.
        for beta in [0.0, 10.0] {
            let mut filter = HandFilter::new(OneEuro { beta, ..SETTINGS });
            let speed = 0.5;
            let mut behind = 0.0;
            for k in 0..1000 {
                let x = speed * k as f64 * 0.01;
                behind = x - filter
                    .filtered(&sample(x, x, 0.0), k * STEP_NS)
                    .wrist
                    .translation
                    .x;
            }
            let position = filter.wrist.lag_s();
            assert!(
                (behind / speed - position).abs() < 0.003,
                "β {beta}: {} s, said {position} s",
                behind / speed
            );
            assert!(filter.lag_s() >= position);
        }
    }

    #[test]
    fn a_long_silence_is_forgotten_and_equal_stamps_do_no_harm() {
        let mut filter = HandFilter::new(SETTINGS);
        filter.filtered(&sample(0.0, 0.0, 0.0), 0);
        let same = filter.filtered(&sample(1.0, 1.0, 1.0), 0);
        assert!(same.is_finite());
        let after = filter.filtered(&sample(2.0, 1.0, 1.0), 10_000_000_000);
        assert_eq!(after.wrist.translation.x, 2.0);
    }
}
