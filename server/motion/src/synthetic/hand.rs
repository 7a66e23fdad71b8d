//! A synthetic hand: channels over time, and the sample they make at any one.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};

use super::channel::Channel;
use super::posture::{Postures, grip_from_wrist};
use super::variation::Tremor;
use crate::track::{HandTrack, TrackHand, angles_between};

/// A posture that is laid over the pinch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Overlay {
    pub(super) angles: JointAngles,
    /// From 0 (not at all) to 1 (in its place).
    pub(super) weight: Channel,
}

/// The grip frame (see [`super::posture`]) over time, as of a right hand; a left one is its mirror image at x = 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Motion {
    /// Its origin, world space, metres.
    pub(super) place: [Channel; 3],
    /// Its turn about y, radians.
    pub(super) yaw: Channel,
    /// Its turn about its own x after that, radians: positive lifts the fingers.
    pub(super) pitch: Channel,
    /// Of the pinch, metres.
    pub(super) aperture: Channel,
    /// Each laid over those before.
    pub(super) overlays: Vec<Overlay>,
}

/// A hand that is computed: a closed form in time, smooth to the acceleration.
#[derive(Clone, Debug, PartialEq)]
pub struct SyntheticHand {
    pub(super) side: Side,
    pub(super) motion: Motion,
    pub(super) tremor: Tremor,
    pub(super) postures: Postures,
    pub(super) duration_s: f64,
    pub(super) period_s: Option<f64>,
}

impl SyntheticHand {
    /// Left or right.
    pub fn side(&self) -> Side {
        self.side
    }

    /// When the last movement is over and what was thrown has had time to come to rest, in seconds.
    /// The hand may be asked for later times: it stays where it is.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// For a show that goes on for ever: after so many seconds the world is to be reset and the hand's time to begin at
    /// 0 again. The hand is then where it began.
    pub fn period_s(&self) -> Option<f64> {
        self.period_s
    }

    /// The hand at a time in seconds: wrist in world space, fingers as joint angles.
    pub fn sample_at(&self, t_s: f64) -> HandSample {
        let motion = &self.motion;
        let place = Vector3::from(motion.place.each_ref().map(|channel| channel.at(t_s)))
            + self.tremor.at(t_s);
        let turn = turned(motion.yaw.at(t_s), motion.pitch.at(t_s));
        let world_from_grip = Isometry3::from_parts(Translation3::from(place), turn);
        let mut angles = self.postures.pinch(motion.aperture.at(t_s));
        for overlay in &motion.overlays {
            let weight = overlay.weight.at(t_s);
            if weight != 0.0 {
                angles = angles_between(&angles, &overlay.angles, weight);
            }
        }
        let wrist = world_from_grip * grip_from_wrist();
        let wrist = if self.side == Side::Left {
            mirrored(&wrist)
        } else {
            wrist
        };
        HandSample {
            wrist,
            fingers: FingerPose::Angles(angles),
        }
    }

    /// The whole motion as samples at a rate in Hz, from 0 to its duration.
    pub fn track(&self, rate_hz: f64) -> HandTrack {
        let n = (self.duration_s * rate_hz).ceil().max(0.0) as u64 + 1;
        let times_s: Vec<f64> = (0..n).map(|index| index as f64 / rate_hz).collect();
        let samples = times_s.iter().map(|t_s| self.sample_at(*t_s)).collect();
        HandTrack {
            hands: vec![TrackHand {
                side: self.side,
                times_s,
                samples,
            }],
        }
    }
}

/// The turn of the grip frame for a yaw and a pitch in radians.
pub(super) fn turned(yaw: f64, pitch: f64) -> UnitQuaternion<f64> {
    let about_y = Quaternion::new(libm::cos(0.5 * yaw), 0.0, libm::sin(0.5 * yaw), 0.0);
    let about_x = Quaternion::new(libm::cos(0.5 * pitch), libm::sin(0.5 * pitch), 0.0, 0.0);
    UnitQuaternion::new_normalize(about_y * about_x)
}

/// A pose seen in a mirror at x = 0.
pub(super) fn mirrored(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let (place, q) = (pose.translation.vector, pose.rotation.coords);
    Isometry3::from_parts(
        Translation3::new(-place.x, place.y, place.z),
        UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.x, -q.y, -q.z)),
    )
}
