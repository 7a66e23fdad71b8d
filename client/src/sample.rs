use nalgebra::Isometry3;
use tsukamu_proto::v1;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};

/// The sample as a wire message, with the client's own stamp in nanoseconds.
pub fn to_wire(sample: &HandSample, source_ns: u64) -> v1::HandSample {
    let (joints, angles) = match &sample.fingers {
        FingerPose::Angles(angles) => (Vec::new(), angles_to_wire(angles)),
        FingerPose::Points(points) => {
            let xyz = |point: &Option<nalgebra::Point3<f64>>| {
                point.map_or([f64::NAN; 3], |p| [p.x, p.y, p.z])
            };
            (points.iter().flat_map(xyz).collect(), Vec::new())
        }
    };
    v1::HandSample {
        source_ns,
        wrist: Some(pose_to_wire(&sample.wrist)),
        joints,
        angles,
        valid: true,
    }
}

/// What is sent while the source has lost the hand: keeps the lane alive, moves nothing.
pub fn lost(source_ns: u64) -> v1::HandSample {
    v1::HandSample {
        source_ns,
        wrist: None,
        joints: Vec::new(),
        angles: Vec::new(),
        valid: false,
    }
}

fn pose_to_wire(pose: &Isometry3<f64>) -> v1::Pose {
    let position = pose.translation;
    let rotation = pose.rotation;
    v1::Pose {
        position: Some(v1::Vec3 {
            x: position.x,
            y: position.y,
            z: position.z,
        }),
        rotation: Some(v1::Quat {
            x: rotation.i,
            y: rotation.j,
            z: rotation.k,
            w: rotation.w,
        }),
    }
}

/// The 21 angles in their wire order: the thumb's four, four of each other finger, the palm arch.
fn angles_to_wire(angles: &JointAngles) -> Vec<f64> {
    let thumb = &angles.thumb;
    let mut wire = vec![
        thumb.opposition,
        thumb.abduction,
        thumb.mcp_flexion,
        thumb.ip_flexion,
    ];
    for finger in &angles.fingers {
        wire.extend([
            finger.mcp_flexion,
            finger.pip_flexion,
            finger.dip_flexion,
            finger.abduction,
        ]);
    }
    wire.push(angles.palm_arch);
    wire
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
    use tsukamu_world::hand::joint::N_JOINTS;
    use tsukamu_world::hand::sample::{FingerAngles, ThumbAngles};

    use super::*;

    fn wrist() -> Isometry3<f64> {
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
        Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), half_turn)
    }

    #[test]
    fn joints_keep_their_order_and_gaps() {
        let mut points = [None; N_JOINTS];
        points[0] = Some(Point3::new(0.1, 0.2, 0.3));
        points[19] = Some(Point3::new(0.4, 0.5, 0.6));
        let wire = to_wire(
            &HandSample {
                wrist: wrist(),
                fingers: FingerPose::Points(points),
            },
            42,
        );
        assert_eq!(
            (
                wire.source_ns,
                wire.valid,
                wire.joints.len(),
                wire.angles.len()
            ),
            (42, true, 60, 0)
        );
        assert_eq!(wire.joints[..3], [0.1, 0.2, 0.3]);
        assert!(wire.joints[3..57].iter().all(|x| x.is_nan()));
        assert_eq!(wire.joints[57..], [0.4, 0.5, 0.6]);
        let pose = wire.wrist.unwrap();
        assert_eq!(
            pose.position,
            Some(v1::Vec3 {
                x: 1.0,
                y: 2.0,
                z: 3.0
            })
        );
        assert!((pose.rotation.unwrap().y - 1.0).abs() < 1e-12);
    }

    #[test]
    fn angles_keep_their_order() {
        let finger = |n: f64| FingerAngles {
            mcp_flexion: n,
            pip_flexion: n + 1.0,
            dip_flexion: n + 2.0,
            abduction: n + 3.0,
        };
        let angles = JointAngles {
            thumb: ThumbAngles {
                opposition: 0.0,
                abduction: 1.0,
                mcp_flexion: 2.0,
                ip_flexion: 3.0,
            },
            fingers: [finger(4.0), finger(8.0), finger(12.0), finger(16.0)],
            palm_arch: 20.0,
        };
        let wire = to_wire(
            &HandSample {
                wrist: wrist(),
                fingers: FingerPose::Angles(angles),
            },
            0,
        );
        assert_eq!(wire.angles, (0..21).map(f64::from).collect::<Vec<_>>());
        assert!(wire.joints.is_empty());
    }

    #[test]
    fn a_lost_hand_is_not_valid() {
        assert_eq!(
            lost(7),
            v1::HandSample {
                source_ns: 7,
                valid: false,
                ..v1::HandSample::default()
            }
        );
    }
}
