//! From a hand's joint angles to what a glove's sensors would read, and from its wrist to a tracker's pose: the inverse
//! of [`crate::input::assemble`].

use nalgebra::{Isometry3, Point3};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::tracker::space::TrackerSpace;
use tsukamu_world::hand::joint::{N_JOINTS, Side};
use tsukamu_world::hand::kinematics::angles_from_points;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};
use tsukamu_world::hand::skeleton::Skeleton;

use super::TrackerPlace;

/// The joint angles of a sample: its own, or those at which an adult's hand has the same posture. `None` where a joint
/// is not tracked.
pub fn joint_angles_of(sample: &HandSample, side: Side) -> Option<JointAngles> {
    let points = match &sample.fingers {
        FingerPose::Angles(angles) => return Some(*angles),
        FingerPose::Points(points) => points,
    };
    let mut in_wrist = [Point3::origin(); N_JOINTS];
    for (place, point) in in_wrist.iter_mut().zip(points) {
        *place = sample.wrist.inverse_transform_point(point.as_ref()?);
    }
    Some(angles_from_points(&Skeleton::adult(side), side, &in_wrist))
}

/// What the sensors of a glove measure on a hand, radians by wire slot. The wrist's own sensors stay in their middle.
pub fn sensor_angles(angles: &JointAngles) -> [Option<f64>; GloveSensor::N_SLOTS] {
    use GloveSensor as S;
    let [index, middle, ring, little] = &angles.fingers;
    let thumb = &angles.thumb;
    let list = [
        (S::ThumbRotation, thumb.opposition),
        (S::ThumbMcp, thumb.mcp_flexion),
        (S::ThumbIp, thumb.ip_flexion),
        (S::ThumbAbduction, thumb.abduction),
        (S::IndexMcp, index.mcp_flexion),
        (S::IndexPip, index.pip_flexion),
        (S::IndexDip, index.dip_flexion),
        (S::MiddleMcp, middle.mcp_flexion),
        (S::MiddlePip, middle.pip_flexion),
        (S::MiddleDip, middle.dip_flexion),
        // The glove measures between neighbours; the hand counts from the middle finger's line.
        (S::MiddleIndexAbduction, index.abduction - middle.abduction),
        (S::RingMcp, ring.mcp_flexion),
        (S::RingPip, ring.pip_flexion),
        (S::RingDip, ring.dip_flexion),
        (S::RingMiddleAbduction, ring.abduction + middle.abduction),
        (S::LittleMcp, little.mcp_flexion),
        (S::LittlePip, little.pip_flexion),
        (S::LittleDip, little.dip_flexion),
        (S::LittleRingAbduction, little.abduction - ring.abduction),
        (S::PalmArch, angles.palm_arch),
        (S::WristFlexion, 0.0),
        (S::WristAbduction, 0.0),
    ];
    let mut slots = [None; GloveSensor::N_SLOTS];
    for (sensor, angle) in list {
        slots[sensor.slot()] = Some(angle);
    }
    slots
}

/// What the tracker reports, in its own axes, of a receiver on this wrist.
pub fn transmitter_from_sensor(
    world_from_wrist: &Isometry3<f64>,
    place: &TrackerPlace,
) -> Isometry3<f64> {
    let world_from_sensor = world_from_wrist * place.wrist_from_sensor;
    TrackerSpace::ZDown.from_world(&(place.world_from_transmitter.inverse() * world_from_sensor))
}

#[cfg(test)]
mod tests {
    use tsukamu_devices::reading::{GloveReading, SensorReading};
    use tsukamu_world::hand::sample::{FingerAngles, ThumbAngles};

    use super::*;
    use crate::input::assemble::joint_angles;

    #[test]
    fn a_worn_glove_reads_the_hand_that_wears_it() {
        let finger = |k: f64| FingerAngles {
            mcp_flexion: 0.1 + k,
            pip_flexion: 0.2 + k,
            dip_flexion: 0.3 + k,
            abduction: 0.05 * k,
        };
        let angles = JointAngles {
            thumb: ThumbAngles {
                opposition: 0.4,
                abduction: 0.3,
                mcp_flexion: 0.2,
                ip_flexion: 0.1,
            },
            fingers: [finger(0.1), finger(0.0), finger(0.3), finger(0.4)],
            palm_arch: 0.15,
        };
        let slots = sensor_angles(&angles);
        let mut reading = GloveReading {
            angles_valid: true,
            ..GloveReading::empty(0, 0)
        };
        for (sensor, angle) in reading.sensors.iter_mut().zip(slots) {
            *sensor = angle.map(|angle_rad| SensorReading {
                raw: 1.0,
                angle_rad,
                clamped: false,
            });
        }
        let read = joint_angles(&reading).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1.0e-12;
        for (finger, expected) in read.fingers.iter().zip(&angles.fingers) {
            assert!(
                near(finger.abduction, expected.abduction)
                    && near(finger.dip_flexion, expected.dip_flexion)
            );
        }
        assert_eq!(
            (read.thumb, read.palm_arch),
            (angles.thumb, angles.palm_arch)
        );
    }
}
