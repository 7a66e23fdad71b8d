//! From a glove's and a tracker's readings to hand samples. Pure: readings in, samples out.

use nalgebra::Isometry3;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_devices::timing::Stamped;
use tsukamu_world::hand::sample::{FingerAngles, FingerPose, HandSample, JointAngles, ThumbAngles};

use super::sources::{Arrived, News};

/// How old one half may be when the other arrives, in nanoseconds: beyond it there is no hand.
const HALF_AGE_MAX_NS: u64 = 250_000_000;
/// Flexion of a DIP that has no sensor, as a share of the PIP's: the tendons couple them.
const DIP_PER_PIP: f64 = 2.0 / 3.0;

/// Where the tracker is in the world and on the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// `world_from_transmitter`, in the y-up space in which the tracker's driver reports.
    pub world_from_transmitter: Isometry3<f64>,
    /// `wrist_from_sensor`: the wearer's mount offset.
    pub wrist_from_sensor: Isometry3<f64>,
}

/// The newest glove reading and the newest tracker reading of one hand.
#[derive(Clone, Debug)]
pub struct Assembly {
    mount: Mount,
    glove: Option<(u64, Option<JointAngles>)>,
    tracker: Option<(u64, Option<Isometry3<f64>>)>,
}

impl Assembly {
    /// A hand of which nothing was seen yet.
    pub const fn new(mount: Mount) -> Self {
        Self {
            mount,
            glove: None,
            tracker: None,
        }
    }

    /// The sample that a glove's reading makes with the tracker's newest.
    pub fn push_glove(&mut self, stamped: Stamped, reading: &GloveReading) -> Option<Arrived> {
        self.glove = Some((stamped.arrival_ns, joint_angles(reading)));
        self.sample(stamped, News::Fingers)
    }

    /// The sample that a tracker's reading makes with the glove's newest.
    pub fn push_tracker(&mut self, stamped: Stamped, reading: &TrackerReading) -> Option<Arrived> {
        let sensor = reading.world_from_sensor();
        let wrist = sensor.map(|pose| {
            self.mount.world_from_transmitter * pose * self.mount.wrist_from_sensor.inverse()
        });
        self.tracker = Some((stamped.arrival_ns, wrist));
        self.sample(stamped, News::Wrist)
    }

    /// `None` while one half is missing or old; a sample without a hand where one half says that it sees none.
    fn sample(&self, now: Stamped, news: News) -> Option<Arrived> {
        let ((glove_ns, angles), (tracker_ns, wrist)) =
            (self.glove.as_ref()?, self.tracker.as_ref()?);
        let is_old = |stamp: u64| now.arrival_ns.saturating_sub(stamp) > HALF_AGE_MAX_NS;
        if is_old(*glove_ns) || is_old(*tracker_ns) {
            return None;
        }
        let sample = angles
            .as_ref()
            .zip(wrist.as_ref())
            .map(|(angles, wrist)| HandSample {
                wrist: *wrist,
                fingers: FingerPose::Angles(*angles),
            });
        Some(Arrived {
            source_ns: 0,
            arrival_ns: now.arrival_ns,
            fitted_ns: now.fitted_ns,
            ticks: now.ticks,
            sample,
            news,
        })
    }
}

/// The joint angles of a glove's reading; `None` while they are not valid.
///
/// The glove measures abduction between neighbouring fingers, the hand counts it from the middle finger's line: the
/// little finger's is the sum of two. A joint without a sensor is straight; a DIP without one follows its PIP.
pub fn joint_angles(reading: &GloveReading) -> Option<JointAngles> {
    if !reading.angles_valid {
        return None;
    }
    let angle = |sensor| reading.angle_rad(sensor);
    let or_straight = |sensor| angle(sensor).unwrap_or(0.0);
    let finger = |[mcp, pip, dip]: [GloveSensor; 3], abduction: f64| {
        let pip_flexion = or_straight(pip);
        FingerAngles {
            mcp_flexion: or_straight(mcp),
            pip_flexion,
            dip_flexion: angle(dip).unwrap_or(DIP_PER_PIP * pip_flexion),
            abduction,
        }
    };
    let ring = or_straight(GloveSensor::RingMiddleAbduction);
    let index = or_straight(GloveSensor::MiddleIndexAbduction);
    let little = ring + or_straight(GloveSensor::LittleRingAbduction);
    Some(JointAngles {
        thumb: ThumbAngles {
            opposition: or_straight(GloveSensor::ThumbRotation),
            abduction: or_straight(GloveSensor::ThumbAbduction),
            mcp_flexion: or_straight(GloveSensor::ThumbMcp),
            ip_flexion: or_straight(GloveSensor::ThumbIp),
        },
        fingers: [
            finger(
                [
                    GloveSensor::IndexMcp,
                    GloveSensor::IndexPip,
                    GloveSensor::IndexDip,
                ],
                index,
            ),
            finger(
                [
                    GloveSensor::MiddleMcp,
                    GloveSensor::MiddlePip,
                    GloveSensor::MiddleDip,
                ],
                0.0,
            ),
            finger(
                [
                    GloveSensor::RingMcp,
                    GloveSensor::RingPip,
                    GloveSensor::RingDip,
                ],
                ring,
            ),
            finger(
                [
                    GloveSensor::LittleMcp,
                    GloveSensor::LittlePip,
                    GloveSensor::LittleDip,
                ],
                little,
            ),
        ],
        palm_arch: or_straight(GloveSensor::PalmArch),
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
    use tsukamu_devices::reading::SensorReading;
    use tsukamu_devices::tracker::space::TrackerSpace;

    use super::*;

    const MS: u64 = 1_000_000;

    fn at(arrival_ns: u64) -> Stamped {
        Stamped::on_arrival(arrival_ns)
    }

    fn glove(stamp_ns: u64, angles: &[(GloveSensor, f64)]) -> GloveReading {
        let mut reading = GloveReading {
            angles_valid: true,
            ..GloveReading::empty(stamp_ns, 0)
        };
        for (sensor, angle_rad) in angles {
            reading.sensors[sensor.slot()] = Some(SensorReading {
                raw: 1.0,
                angle_rad: *angle_rad,
                clamped: false,
            });
        }
        reading
    }

    fn tracker(stamp_ns: u64, is_good: bool) -> TrackerReading {
        TrackerReading {
            stamp_ns,
            sequence: 0,
            station: 1,
            space: TrackerSpace::ZDown,
            device_ticks: None,
            position: Some(Point3::new(0.1, 0.2, 0.3)),
            rotation: Some(UnitQuaternion::identity()),
            position_valid: is_good,
            rotation_valid: is_good,
            error: None,
            stylus_pressed: None,
        }
    }

    fn mount() -> Mount {
        let quarter = UnitQuaternion::from_scaled_axis(Vector3::y() * std::f64::consts::FRAC_PI_2);
        Mount {
            world_from_transmitter: Isometry3::from_parts(
                Translation3::new(1.0, 0.0, 0.0),
                quarter,
            ),
            wrist_from_sensor: Isometry3::from_parts(
                Translation3::new(0.0, 0.02, 0.0),
                UnitQuaternion::identity(),
            ),
        }
    }

    #[test]
    fn eighteen_sensors_make_a_whole_hand() {
        let reading = glove(
            0,
            &[
                (GloveSensor::IndexPip, 0.9),
                (GloveSensor::RingPip, 0.6),
                (GloveSensor::RingDip, 0.1),
                (GloveSensor::MiddleIndexAbduction, 0.1),
                (GloveSensor::RingMiddleAbduction, 0.2),
                (GloveSensor::LittleRingAbduction, 0.3),
                (GloveSensor::ThumbRotation, 0.4),
                (GloveSensor::PalmArch, 0.05),
            ],
        );
        let angles = joint_angles(&reading).expect("valid");
        assert!(
            (angles.fingers[0].dip_flexion - 0.6).abs() < 1e-12,
            "2/3 of the PIP"
        );
        assert_eq!(angles.fingers[2].dip_flexion, 0.1, "a sensor is believed");
        let abductions = angles.fingers.map(|finger| finger.abduction);
        assert_eq!(
            abductions,
            [0.1, 0.0, 0.2, 0.5],
            "from the middle finger's line"
        );
        assert_eq!((angles.thumb.opposition, angles.palm_arch), (0.4, 0.05));
        assert_eq!(
            joint_angles(&GloveReading {
                angles_valid: false,
                ..reading
            }),
            None
        );
    }

    #[test]
    fn both_halves_make_a_sample_in_the_world() {
        let mut hand = Assembly::new(mount());
        assert!(
            hand.push_glove(at(0), &glove(0, &[])).is_none(),
            "no tracker yet"
        );
        let arrived = hand
            .push_tracker(at(MS), &tracker(MS, true))
            .expect("both are there");
        assert_eq!(arrived.arrival_ns, MS);
        let wrist = arrived.sample.expect("both are valid").wrist;
        // Transmitter (0.1, 0.2, 0.3) is world axes (0.2, -0.3, -0.1); turned a quarter about y and shifted it is
        // (1 - 0.1, -0.3, -0.2); the wrist is 2 cm below the sensor.
        let expected = Vector3::new(0.9, -0.32, -0.2);
        assert!(
            (wrist.translation.vector - expected).norm() < 1e-12,
            "{}",
            wrist.translation.vector
        );
    }

    #[test]
    fn a_half_that_is_blind_or_silent_leaves_no_hand() {
        let mut hand = Assembly::new(mount());
        hand.push_glove(at(0), &glove(0, &[]));
        let blind = hand
            .push_tracker(at(MS), &tracker(MS, false))
            .expect("it says something");
        assert_eq!(blind.sample, None, "the tracker sees nothing");
        assert!(
            hand.push_tracker(at(251 * MS), &tracker(251 * MS, true))
                .is_none(),
            "the glove is silent"
        );
        assert!(
            hand.push_glove(at(252 * MS), &glove(252 * MS, &[]))
                .is_some_and(|arrived| arrived.sample.is_some())
        );
    }
}
