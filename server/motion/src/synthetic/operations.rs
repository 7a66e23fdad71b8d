//! The operations as scripts.

use nalgebra::{Point3, Vector3};
use tsukamu_world::hand::joint::{Finger, Side};
use tsukamu_world::hand::sample::JointAngles;

use super::hand::{SyntheticHand, turned};
use super::posture::scissor_centre;
use super::script::Script;
use super::spec::Spec;
use super::throw::{REST_S, Throw, grasp_and_throw};
use super::{Name, PlanFault, SceneInfo};
use crate::track::angles_between;

/// Seconds that a motion goes on after its last movement.
const AFTER_S: f64 = 0.5;

/// The object asked for, or the first that the test lets through.
fn chosen(
    script: &Script,
    spec: &Spec,
    reason: &'static str,
    fits: impl Fn(&Script, usize) -> bool,
) -> Result<usize, PlanFault> {
    let hand = spec.name.text();
    let Some(name) = &spec.object else {
        let first = (0..script.things.len()).find(|index| fits(script, *index));
        return first.ok_or(PlanFault::TooFew {
            hand,
            wanted: "an object that the hand can take",
            found: 0,
        });
    };
    let names = || {
        script
            .things
            .iter()
            .map(|thing| thing.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    let index = script.things.iter().position(|thing| thing.name == *name);
    let index = index.ok_or_else(|| PlanFault::NoSuchObject {
        hand,
        object: name.clone(),
        known: names(),
    })?;
    let unfit = || PlanFault::Unfit {
        hand,
        object: name.clone(),
        reason,
    };
    if fits(script, index) {
        Ok(index)
    } else {
        Err(unfit())
    }
}

fn pinchable(script: &Script, spec: &Spec) -> Result<usize, PlanFault> {
    let reason = "has no two faces that thumb and fingers could hold, 8 to 78 mm apart";
    chosen(script, spec, reason, |script, index| {
        script.things[index].can_be_taken()
    })
}

/// A place as the plan sees it.
fn seen(spec: &Spec, [x, z]: [f64; 2]) -> [f64; 2] {
    if spec.side == Side::Left {
        [-x, z]
    } else {
        [x, z]
    }
}

/// Where an object is to be put: as asked for, or a way off from where it is.
fn goal(script: &Script, spec: &Spec, index: usize, off: [f64; 2]) -> [f64; 2] {
    let centre = script.things[index].centre();
    spec.to
        .map_or([centre.x + off[0], centre.z + off[1]], |to| seen(spec, to))
}

pub(super) fn free(mut script: Script, spec: &Spec) -> Result<SyntheticHand, PlanFault> {
    let index = pinchable(&script, spec)?;
    let to = goal(&script, spec, index, [0.14, 0.02]);
    let place = script.standing(index, to, script.floor_height);
    let height = script.clear_height(index) + 0.02;
    script.grasp(index);
    let start = script.things[index].centre();
    let lifted = Point3::new(start.x, height, start.z);
    let lift_s = script.paced(0.7);
    script.carry_straight(&lifted, lift_s);
    // A loop of four strokes that run into each other, with a turn of the wrist there and back.
    let yaw = script.motion.yaw.goal();
    for (corner, turn) in [
        ([-0.05, 0.05], 0.3),
        ([0.0, 0.10], 0.0),
        ([0.05, 0.05], -0.3),
        ([0.0, 0.0], 0.0),
    ] {
        let stroke_s = script.paced(0.7);
        script.turn(stroke_s, yaw + turn, 0.0);
        script.carry_straight(
            &(lifted + Vector3::new(corner[0], corner[1], 0.0)),
            stroke_s,
        );
        script.wait(-0.25 * stroke_s);
    }
    script.wait(0.25);
    script.carry(&place, height);
    script.let_go();
    script.things[index].put(&place);
    push_with_fingertip(&mut script, index, 0.05);
    script.go_home();
    Ok(script.finish(spec, AFTER_S))
}

/// Pushes an object away from the body with the tip of the index finger, along its middle.
fn push_with_fingertip(script: &mut Script, index: usize, way_m: f64) {
    let posture = script.postures.pointing(0.35, 0.30);
    let pointing = script.overlay(posture);
    let tip = script.postures.tip(&posture, Finger::Index);
    let thing = &script.things[index];
    let near = thing
        .exit(&Vector3::zeros(), &Vector3::z())
        .map_or_else(|| thing.reach(), |(distance, _)| distance);
    let (pitch, centre) = (0.6, thing.centre());
    let tip = turned(0.0, pitch) * tip.coords;
    let before = centre + Vector3::z() * (near + 0.03) - tip;
    let point_s = script.paced(0.8);
    script.blend(pointing, point_s, 1.0);
    script.come_down_to(&before, 0.0, pitch);
    let push_s = script.paced(1.2);
    script.go(0.0, push_s, &(before - Vector3::z() * (0.03 + way_m)));
    script.wait(push_s + 0.1);
    let back_s = script.paced(0.5);
    script.go(0.0, back_s, &(before + Vector3::y() * 0.03));
    script.wait(back_s);
    let relax_s = script.paced(0.6);
    script.blend(pointing, relax_s, 0.0);
    let mut moved = centre;
    moved.z -= way_m;
    script.things[index].put(&moved);
}

/// How much wider than the object index and middle finger are spread before it, metres.
const SPREAD_M: f64 = 0.032;
/// Thickest object that they hold between them, metres.
const SCISSOR_MAX_M: f64 = 0.032;

/// Thickness of an object along x at its centre, and its middle, if index and middle finger can hold it there.
fn scissor_grip(script: &Script, index: usize) -> Option<(f64, Point3<f64>)> {
    let thing = &script.things[index];
    let [right, left] =
        [1.0, -1.0].map(|sign| thing.exit(&Vector3::zeros(), &(Vector3::x() * sign)));
    let ((right, right_normal), (left, left_normal)) = (right?, left?);
    let level = right_normal.x > 0.9 && left_normal.x < -0.9;
    let thickness = right + left;
    let middle = thing.centre() + Vector3::x() * (0.5 * (right - left));
    (level && thickness <= SCISSOR_MAX_M).then_some((thickness, middle))
}

pub(super) fn no_thumb(mut script: Script, spec: &Spec) -> Result<SyntheticHand, PlanFault> {
    let reason = "is not between two faces that look along x, up to 32 mm apart";
    let index = chosen(&script, spec, reason, |script, index| {
        scissor_grip(script, index).is_some()
    })?;
    let found = scissor_grip(&script, index);
    let (thickness, middle) = found.ok_or_else(|| PlanFault::TooFew {
        hand: spec.name.text(),
        wanted: "an object",
        found: 0,
    })?;
    let to = goal(&script, spec, index, [0.08, 0.0]);
    let place = script.standing(index, to, script.floor_height);
    let height = script.clear_height(index);
    let [spread, closed] = [thickness + SPREAD_M, thickness - 2.0 * 0.0035]
        .map(|width| script.postures.scissor(width));
    let (spread, closed) = (script.overlay(spread), script.overlay(closed));
    let pitch = -0.25;
    let at = middle + Vector3::y() * 0.004 - turned(0.0, pitch) * scissor_centre().coords;
    let spread_s = script.paced(0.8);
    script.blend(spread, spread_s, 1.0);
    script.come_down_to(&at, 0.0, pitch);
    let close_s = script.paced(0.35);
    script.blend(closed, close_s, 1.0);
    script.wait(close_s + 0.1);
    script.hold_at(script.things[index].centre());
    let lifted = Point3::new(middle.x, height + 0.04, middle.z);
    let (lift_s, open_s, up_s) = (script.paced(0.9), script.paced(0.35), script.paced(0.6));
    script.carry_straight(&lifted, lift_s);
    script.wait(1.6);
    script.carry(&place, height + 0.04);
    script.blend(closed, open_s, 0.0);
    script.wait(0.9 * open_s);
    let up = script.place() + Vector3::y() * 0.12;
    script.go(0.0, up_s, &up);
    script.wait(up_s);
    let relax_s = script.paced(0.7);
    script.blend(spread, relax_s, 0.0);
    script.go_home();
    Ok(script.finish(spec, AFTER_S))
}

/// The index finger before a flick and after it: flexion of MCP and PIP, radians. With these the tip comes to the object
/// level, swings up while it is fast and so leaves it: a tip that stopped in front of the object would stop it as well,
/// for what is pushed goes no farther than the finger (model §5.1).
const FLICK: [[f64; 2]; 2] = [[1.136, 0.733], [-0.239, 0.357]];
/// How far the hand is pitched up meanwhile, radians.
const FLICK_PITCH: f64 = 0.345;
/// Share of the way at which the tip comes to the object.
const FLICK_SHARE: f64 = 0.363;
/// Height of that point, as a share of the centre of gravity's: below it, so that the push lifts.
const FLICK_HEIGHT: f64 = 0.13;
/// Seconds that a flick takes unless told otherwise; the tip then reaches about 2 m/s.
const FLICK_S: f64 = 0.093;
/// A flick begins so long after a whole number of beats, seconds. At 60 steps per second it lasts five steps, and how
/// far the object goes (0 to 60 cm) depends on where they fall: on a beat that is the same for every seed.
const FLICK_BEAT_S: f64 = 0.05;
/// See [`FLICK_BEAT_S`].
const FLICK_AFTER_S: f64 = 0.007;
/// Peak speed over mean speed on a way of least jerk.
const PEAK_SHARE: f64 = 1.875;

pub(super) fn flick(mut script: Script, spec: &Spec) -> Result<SyntheticHand, PlanFault> {
    let index = chosen(&script, spec, "cannot be flicked", |_, _| true)?;
    let thing = &script.things[index];
    let (centre, (low, _)) = (thing.centre(), thing.heights());
    let offset = Vector3::y() * ((FLICK_HEIGHT - 1.0) * (centre.y - low));
    let near = thing
        .exit(&offset, &Vector3::z())
        .map_or_else(|| thing.reach(), |(distance, _)| distance);
    let contact = centre + offset + Vector3::z() * near;
    let [cocked, extended] = FLICK.map(|[mcp, pip]| script.postures.pointing(mcp, pip));
    let tip = |angles: &JointAngles| {
        Point3::from(turned(0.0, FLICK_PITCH) * script.postures.tip(angles, Finger::Index).coords)
    };
    let place = contact - tip(&angles_between(&cocked, &extended, FLICK_SHARE)).coords;
    let way_m = (tip(&extended) - tip(&cocked)).norm();
    let flick_s = spec
        .speed
        .map_or(FLICK_S, |speed| PEAK_SHARE * way_m / speed);
    let (cocked, extended) = (script.overlay(cocked), script.overlay(extended));
    let (point_s, nearer_s, relax_s) = (script.paced(0.7), script.paced(0.4), script.paced(0.6));
    script.blend(cocked, point_s, 1.0);
    script.come_down_to(&(place + Vector3::z() * 0.06), 0.0, FLICK_PITCH);
    script.go(0.0, nearer_s, &place);
    script.wait(nearer_s + 0.15);
    script.now_s = (script.now_s / FLICK_BEAT_S).ceil() * FLICK_BEAT_S + FLICK_AFTER_S;
    script.blend(extended, flick_s, 1.0);
    script.wait(flick_s + 0.35);
    script.blend(extended, relax_s, 0.0);
    script.blend(cocked, relax_s, 0.0);
    script.go_home();
    Ok(script.finish(spec, REST_S))
}

/// Speed of a throw unless told otherwise, m/s, and its rise above level, radians.
const THROW: (f64, f64) = (2.2, 0.5);
/// Where an object leaves the hand: above the floor and before the body, metres.
const RELEASE: (f64, f64) = (0.60, -0.40);

pub(super) fn grasp_throw(mut script: Script, spec: &Spec) -> Result<SyntheticHand, PlanFault> {
    let index = pinchable(&script, spec)?;
    let centre = script.things[index].centre();
    let from = Point3::new(
        centre.x.clamp(-0.1, 0.2),
        script.floor_height + RELEASE.0,
        RELEASE.1,
    );
    let yaw = spec.to.map_or(0.0, |to| {
        let [x, z] = seen(spec, to);
        libm::atan2(from.x - x, from.z - z)
    });
    let speed = spec
        .speed
        .unwrap_or_else(|| script.variation.around(THROW.0, 0.1));
    let throw = Throw::toward(from, speed, script.variation.around(THROW.1, 0.06), yaw);
    grasp_and_throw(&mut script, index, &throw);
    script.go_home();
    Ok(script.finish(spec, REST_S))
}

pub(super) fn target_game(
    mut script: Script,
    spec: &Spec,
    scene: &SceneInfo,
) -> Result<SyntheticHand, PlanFault> {
    let index = pinchable(&script, spec)?;
    let target = scene
        .targets
        .first()
        .ok_or_else(|| PlanFault::NoTarget(spec.name.text()))?;
    let [x, z] = seen(spec, [target.centre.x, target.centre.z]);
    let centre = script.things[index].centre();
    let from = Point3::new(
        centre.x.clamp(-0.1, 0.2),
        script.floor_height + RELEASE.0,
        RELEASE.1,
    );
    let level = libm::hypot(x - from.x, z - from.z);
    let speed = spec.speed.unwrap_or(3.4);
    let to = Point3::new(
        script.variation.around(x, 0.02),
        script.variation.around(target.centre.y, 0.02),
        z,
    );
    let throw = Throw::through(from, &to, &scene.gravity, level / speed);
    grasp_and_throw(&mut script, index, &throw);
    script.go_home();
    Ok(script.finish(spec, REST_S))
}

/// Objects of a stack.
const STACK: usize = 3;

pub(super) fn stack(mut script: Script, spec: &Spec) -> Result<SyntheticHand, PlanFault> {
    let hand = Name::Stack.text();
    let base = pinchable(&script, spec)?;
    let others = (0..script.things.len())
        .filter(|index| *index != base && script.things[*index].can_be_taken());
    let others: Vec<usize> = others.take(STACK - 1).collect();
    if others.len() < STACK - 1 {
        return Err(PlanFault::TooFew {
            hand,
            wanted: "three objects that the hand can take",
            found: others.len() + 1,
        });
    }
    if let Some(to) = spec.to {
        let place = script.standing(base, seen(spec, to), script.floor_height);
        script.put(base, &place);
    }
    stack_on(&mut script, base, &others);
    script.go_home();
    Ok(script.finish(spec, AFTER_S))
}

fn stack_on(script: &mut Script, base: usize, others: &[usize]) {
    let foot = script.things[base].centre();
    let mut below = base;
    for &index in others {
        let height = script.things[below].heights().1;
        let place = script.standing(index, [foot.x, foot.z], height);
        script.put(index, &place);
        below = index;
    }
}

pub(super) fn demo(mut script: Script, spec: &Spec) -> Result<SyntheticHand, PlanFault> {
    let hand = Name::Demo.text();
    let fit: Vec<usize> = (0..script.things.len())
        .filter(|index| script.things[*index].can_be_taken())
        .collect();
    let &[first, second, .., last] = fit.as_slice() else {
        return Err(PlanFault::TooFew {
            hand,
            wanted: "three objects that the hand can take",
            found: fit.len(),
        });
    };
    let to = goal(&script, spec, first, [0.05, 0.15]);
    let place = script.standing(first, to, script.floor_height);
    script.put(first, &place);
    stack_on(&mut script, first, &[second]);
    let from = Point3::new(0.0, script.floor_height + RELEASE.0, RELEASE.1);
    let throw = Throw::toward(from, spec.speed.unwrap_or(THROW.0), THROW.1, 0.25);
    grasp_and_throw(&mut script, last, &throw);
    script.go_home();
    let mut hand = script.finish(spec, REST_S);
    hand.period_s = Some(hand.duration_s);
    Ok(hand)
}
