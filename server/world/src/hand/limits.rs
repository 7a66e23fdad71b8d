//! How far the joints of a human hand move; to clamp the angles of a badly calibrated glove.

use super::sample::{FingerAngles, JointAngles, ThumbAngles};

/// The least and the greatest angle of every joint, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Least angles.
    pub min: JointAngles,
    /// Greatest angles.
    pub max: JointAngles,
}

/// Active ranges of motion of a healthy adult, rounded outward so that no real pose is cut.
pub const ADULT_LIMITS: JointLimits = JointLimits {
    min: JointAngles {
        thumb: ThumbAngles {
            opposition: -0.6,
            abduction: -0.5,
            mcp_flexion: -0.35,
            ip_flexion: -0.5,
        },
        fingers: [FINGER_MIN; 4],
        palm_arch: 0.0,
    },
    max: JointAngles {
        thumb: ThumbAngles {
            opposition: 1.8,
            abduction: 1.4,
            mcp_flexion: 1.2,
            ip_flexion: 1.6,
        },
        fingers: [FINGER_MAX; 4],
        palm_arch: 0.7,
    },
};

const FINGER_MIN: FingerAngles = FingerAngles {
    mcp_flexion: -0.6,
    pip_flexion: -0.2,
    dip_flexion: -0.35,
    abduction: -0.5,
};
const FINGER_MAX: FingerAngles = FingerAngles {
    mcp_flexion: 1.7,
    pip_flexion: 2.0,
    dip_flexion: 1.6,
    abduction: 0.5,
};

impl JointLimits {
    /// The nearest angles within the limits; not a number stays not a number.
    #[must_use]
    pub fn clamped(&self, angles: &JointAngles) -> JointAngles {
        let (min, max) = (&self.min, &self.max);
        let mut fingers = angles.fingers;
        for ((finger, low), high) in fingers.iter_mut().zip(&min.fingers).zip(&max.fingers) {
            *finger = FingerAngles {
                mcp_flexion: finger.mcp_flexion.clamp(low.mcp_flexion, high.mcp_flexion),
                pip_flexion: finger.pip_flexion.clamp(low.pip_flexion, high.pip_flexion),
                dip_flexion: finger.dip_flexion.clamp(low.dip_flexion, high.dip_flexion),
                abduction: finger.abduction.clamp(low.abduction, high.abduction),
            };
        }
        let thumb = &angles.thumb;
        JointAngles {
            thumb: ThumbAngles {
                opposition: thumb
                    .opposition
                    .clamp(min.thumb.opposition, max.thumb.opposition),
                abduction: thumb
                    .abduction
                    .clamp(min.thumb.abduction, max.thumb.abduction),
                mcp_flexion: thumb
                    .mcp_flexion
                    .clamp(min.thumb.mcp_flexion, max.thumb.mcp_flexion),
                ip_flexion: thumb
                    .ip_flexion
                    .clamp(min.thumb.ip_flexion, max.thumb.ip_flexion),
            },
            fingers,
            palm_arch: angles.palm_arch.clamp(min.palm_arch, max.palm_arch),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_within_stay_and_angles_outside_move_to_the_limit() {
        let rest = JointAngles::default();
        assert_eq!(ADULT_LIMITS.clamped(&rest), rest);
        let mut wild = rest;
        wild.thumb.opposition = 9.0;
        wild.fingers[2].pip_flexion = -9.0;
        wild.palm_arch = -1.0;
        let clamped = ADULT_LIMITS.clamped(&wild);
        assert_eq!(clamped.thumb.opposition, 1.8);
        assert_eq!(clamped.fingers[2].pip_flexion, -0.2);
        assert_eq!(clamped.palm_arch, 0.0);
    }
}
