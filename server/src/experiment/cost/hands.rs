//! Two hands that each hold an object, or nothing, while they move smoothly and for ever.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::{FingerAngles, FingerPose, HandSample, JointAngles, ThumbAngles};
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::{Command, HandInput, StepInput};
use tsukamu_world::state::HandId;

/// The two sides, in the order of their ids.
const SIDES: [Side; 2] = [Side::Left, Side::Right];
/// Place of the object in the wrist's space, metres: under the palm, in front of the thumb.
const WRIST_FROM_OBJECT: Vector3<f64> = Vector3::new(0.0, -0.055, -0.106);
/// Half the distance between the hands at the start, metres.
const HALF_GAP_M: f64 = 0.25;
/// Seconds in which the fingers close.
const CLOSING_S: f64 = 0.25;
/// Seconds in which the hand then rises.
const RISING_S: f64 = 0.5;
/// How high it rises, metres.
const RISE_M: f64 = 0.5;
/// Seconds of one round of the motion that follows.
const ROUND_S: f64 = 1.0;
/// Half the width of that motion, metres.
const SWAY_M: f64 = 0.08;
/// How far the wrist turns in it, radians.
const TURN_RAD: f64 = 0.5;
/// By how much the closed fingers squeeze and ease in it, as a share of their closing.
const SQUEEZE: f64 = 0.02;

/// The inputs of a run: first those that bring the hands there, then a round that may be repeated for ever.
#[derive(Clone, Debug)]
pub struct Script {
    /// Enter, close, rise.
    pub approach: Vec<StepInput>,
    /// One round of a smooth motion that ends where it began.
    pub round: Vec<StepInput>,
}

/// Where the object that a hand is to hold has its centre, for an object whose centre is `height` above the floor.
pub fn object_place(hand_index: usize, height: f64) -> Point3<f64> {
    let x = if hand_index == 0 {
        -HALF_GAP_M
    } else {
        HALF_GAP_M
    };
    Point3::new(x, height, 0.0)
}

/// The script of both hands at a step rate, around objects whose centres are `height` above the floor.
pub fn script(rate_hz: f64, height: f64) -> Script {
    let n_approach = ((CLOSING_S + RISING_S) * rate_hz).round() as usize;
    let n_round = (ROUND_S * rate_hz).round() as usize;
    let step = |tick: usize| StepInput {
        commands: Vec::new(),
        hands: both(tick as f64 / rate_hz, height),
    };
    let mut approach: Vec<StepInput> = (0..n_approach).map(step).collect();
    if let Some(first) = approach.first_mut() {
        first.commands = (0_u32..).zip(SIDES).map(enter).collect();
    }
    Script {
        approach,
        round: (n_approach..n_approach + n_round).map(step).collect(),
    }
}

fn enter((index, side): (u32, Side)) -> Command {
    Command::AddHand {
        hand: HandId(index),
        model: Box::new(HandModel::adult(side)),
    }
}

fn both(time_s: f64, height: f64) -> Vec<HandInput> {
    (0..SIDES.len())
        .map(|index| HandInput {
            hand: HandId(index as u32),
            sample: Some(sample(index, time_s, height)),
        })
        .collect()
}

fn sample(hand_index: usize, time_s: f64, height: f64) -> HandSample {
    let closing = smooth(time_s / CLOSING_S);
    let rising = smooth((time_s - CLOSING_S) / RISING_S);
    let angle = TAU * ((time_s - CLOSING_S - RISING_S) / ROUND_S).max(0.0);
    let (sine, cosine) = angle.sin_cos();
    let start = object_place(hand_index, height).coords - WRIST_FROM_OBJECT;
    let sway = Vector3::new(
        SWAY_M * sine,
        RISE_M * rising + 0.5 * SWAY_M * (2.0 * angle).sin(),
        SWAY_M * (1.0 - cosine),
    );
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 1.0, 0.5) * (TURN_RAD * sine));
    HandSample {
        wrist: Isometry3::from_parts(Translation3::from(start + sway), turn),
        fingers: FingerPose::Angles(grip(closing * (1.0 + SQUEEZE * sine))),
    }
}

/// The fingers between open (0) and closed around an object of some 5 cm (1).
fn grip(closing: f64) -> JointAngles {
    let finger = FingerAngles {
        mcp_flexion: 0.15 + 0.50 * closing,
        pip_flexion: 0.10 + 0.85 * closing,
        dip_flexion: 0.05 + 0.45 * closing,
        abduction: 0.0,
    };
    JointAngles {
        thumb: ThumbAngles {
            opposition: 1.0,
            abduction: 1.40 - 0.10 * closing,
            mcp_flexion: 0.80 * closing,
            ip_flexion: 0.70 * closing,
        },
        fingers: [finger; 4],
        palm_arch: 0.0,
    }
}

/// From 0 to 1 without a jerk.
fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * share * (10.0 - 15.0 * share + 6.0 * share * share)
}
