//! From a glove's and a tracker's readings to joint angles and wrist poses. Pure.

use nalgebra::Isometry3;
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_devices::timing::Stamped;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::{FingerAngles, JointAngles, ThumbAngles};

use super::sources::{Arrived, Seen};

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

/// What the readings of devices say about one hand.
#[derive(Clone, Debug)]
pub struct Assembly {
    side: Side,
    mount: Mount,
}

impl Assembly {
    /// A hand of that side, with its tracker there.
    pub const fn new(side: Side, mount: Mount) -> Self {
        Self { side, mount }
    }

    /// The tracker is somewhere else from now on.
    pub const fn set_mount(&mut self, mount: Mount) {
        self.mount = mount;
    }

    /// What a glove's reading says; `None` when it is of the other hand.
    pub fn of_glove(&self, stamped: Stamped, reading: &GloveReading) -> Option<Arrived> {
        let is_ours = reading.hand.is_none_or(|hand| match hand {
            Handedness::Left => self.side == Side::Left,
            Handedness::Right => self.side == Side::Right,
        });
        is_ours.then(|| arrived(stamped, Seen::Fingers(joint_angles(reading))))
    }

    /// What a tracker's reading says.
    pub fn of_tracker(&self, stamped: Stamped, reading: &TrackerReading) -> Arrived {
        let wrist = reading.world_from_sensor().map(|world_from_sensor| {
            self.mount.world_from_transmitter
                * world_from_sensor
                * self.mount.wrist_from_sensor.inverse()
        });
        arrived(stamped, Seen::Wrist(wrist))
    }
}

fn arrived(stamped: Stamped, seen: Seen) -> Arrived {
    Arrived {
        source_ns: 0,
        arrival_ns: stamped.arrival_ns,
        fitted_ns: stamped.fitted_ns,
        ticks: stamped.ticks,
        seen,
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

    fn wrist(arrived: &Arrived) -> Option<Isometry3<f64>> {
        match &arrived.seen {
            Seen::Wrist(wrist) => *wrist,
            other => panic!("a tracker speaks of a wrist: {other:?}"),
        }
    }

    #[test]
    fn a_tracker_s_reading_is_a_wrist_in_the_world() {
        let hand = Assembly::new(Side::Right, mount());
        let arrived = hand.of_tracker(at(MS), &tracker(MS, true));
        assert_eq!(arrived.arrival_ns, MS);
        let found = wrist(&arrived).expect("it is valid").translation.vector;
        // Transmitter (0.1, 0.2, 0.3) is world axes (0.2, -0.3, -0.1); turned a quarter about y and shifted it is
        // (1 - 0.1, -0.3, -0.2); the wrist is 2 cm below the sensor.
        let expected = Vector3::new(0.9, -0.32, -0.2);
        assert!((found - expected).norm() < 1e-12, "{found}");
        let blind = hand.of_tracker(at(MS), &tracker(MS, false));
        assert_eq!(wrist(&blind), None, "the tracker sees nothing");
    }

    #[test]
    fn a_reading_of_the_other_hand_is_left_out() {
        let hand = Assembly::new(Side::Right, mount());
        for (of, is_ours) in [
            (None, true),
            (Some(Handedness::Right), true),
            (Some(Handedness::Left), false),
        ] {
            let reading = GloveReading {
                hand: of,
                ..glove(0, &[])
            };
            let arrived = hand.of_glove(at(0), &reading);
            assert_eq!(arrived.is_some(), is_ours, "{of:?}");
            let angles = Seen::Fingers(Some(JointAngles::default()));
            assert!(arrived.is_none_or(|arrived| arrived.seen == angles));
        }
    }
}
