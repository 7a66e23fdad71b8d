//! The poses of a glove's calibration, one after the other: what an emulated wearer does while `tsukamu calibrate` runs.

use tsukamu_world::hand::sample::{FingerAngles, JointAngles, ThumbAngles};

use super::channel::Channel;
use super::hand::{Overlay, SyntheticHand};
use super::script::Script;
use super::spec::Spec;

/// Seconds that the hand lies flat at first, and holds every other pose: a calibration needs 1.5 s of each.
const HOLD_S: (f64, f64) = (4.0, 3.2);
/// Seconds from one pose to the next.
const MOVE_S: f64 = 0.6;

/// The thumb's opposition, abduction, MCP and IP flexion; MCP, PIP, DIP flexion of every finger; abduction of index, ring
/// and little finger; the arch of the palm; all in degrees.
type Pose = ([f64; 4], [f64; 3], [f64; 3], f64);

/// Everything straight and together.
const FLAT: Pose = ([0.0; 4], [0.0; 3], [0.0; 3], 0.0);
/// The poses after it, as far as most hands go.
const POSES: [Pose; 3] = [
    (
        [35.0, 10.0, 60.0, 80.0],
        [90.0, 100.0, 80.0],
        [0.0; 3],
        10.0,
    ),
    ([60.0, 15.0, 40.0, 30.0], [0.0; 3], [0.0; 3], 40.0),
    ([0.0, 60.0, 0.0, 0.0], [0.0; 3], [25.0, 15.0, 28.0], 0.0),
];

/// Flat, fist, thumb across the palm, spread, and flat again.
pub(super) fn poses(mut script: Script, spec: &Spec) -> SyntheticHand {
    let laid = |pose: &Pose, weight: f64| Overlay {
        angles: angles(pose),
        weight: Channel::new(weight),
    };
    script.motion.overlays = vec![laid(&FLAT, 1.0)];
    script
        .motion
        .overlays
        .extend(POSES.iter().map(|pose| laid(pose, 0.0)));
    script.wait(HOLD_S.0);
    // Each is laid over the one before; that one goes when it is no longer seen.
    for index in 1..script.motion.overlays.len() {
        let now_s = script.now_s;
        script.motion.overlays[index].weight.go(now_s, MOVE_S, 1.0);
        if index > 1 {
            script.motion.overlays[index - 1]
                .weight
                .go(now_s + MOVE_S, MOVE_S, 0.0);
        }
        script.wait(MOVE_S + HOLD_S.1);
    }
    let now_s = script.now_s;
    if let Some(last) = script.motion.overlays.last_mut() {
        last.weight.go(now_s, MOVE_S, 0.0);
    }
    script.wait(MOVE_S);
    script.finish(spec, 0.0)
}

fn angles((thumb, flexion, abduction, arch): &Pose) -> JointAngles {
    let [opposition, thumb_abduction, thumb_mcp, thumb_ip] = thumb.map(f64::to_radians);
    let [mcp_flexion, pip_flexion, dip_flexion] = flexion.map(f64::to_radians);
    let [index, ring, little] = abduction.map(f64::to_radians);
    JointAngles {
        thumb: ThumbAngles {
            opposition,
            abduction: thumb_abduction,
            mcp_flexion: thumb_mcp,
            ip_flexion: thumb_ip,
        },
        fingers: [index, 0.0, ring, little].map(|abduction| FingerAngles {
            mcp_flexion,
            pip_flexion,
            dip_flexion,
            abduction,
        }),
        palm_arch: arch.to_radians(),
    }
}

#[cfg(test)]
mod tests {
    use tsukamu_world::hand::limits::ADULT_LIMITS;

    use super::{FLAT, POSES, angles};

    #[test]
    fn every_pose_is_one_that_a_hand_can_take() {
        for pose in POSES.iter().chain([&FLAT]) {
            let angles = angles(pose);
            assert_eq!(ADULT_LIMITS.clamped(&angles), angles, "{pose:?}");
        }
    }
}
