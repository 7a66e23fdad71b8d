//! What a hand does, one after the other: reach, grasp, carry, let go. Each adds changes to the channels of a motion.

use nalgebra::{Point3, Vector3};

use super::channel::Channel;
use super::hand::{Motion, Overlay, SyntheticHand, turned};
use super::posture::Postures;
use super::spec::Spec;
use super::thing::{Grip, Thing};
use super::variation::{Tremor, Variation};

/// Where the hand begins and ends, above the floor, metres, as of a right hand.
const HOME: Point3<f64> = Point3::new(0.12, 0.24, -0.06);
/// Aperture of a hand at ease, metres.
const EASE_M: f64 = 0.05;
/// How much wider than the object the hand opens before it, metres.
const PRESHAPE_M: f64 = 0.030;
/// How deep a fingertip goes into a face that it holds, metres.
const DEPTH_M: f64 = 0.0045;
/// How far above a grip the hand comes before it goes down, metres.
const HOVER_M: f64 = 0.10;
/// Height at which an object is let go of over what it is put on, metres.
const DROP_M: f64 = 0.0008;

/// A motion in the making. Places are those of the grip frame, as of a right hand.
#[derive(Debug)]
pub(super) struct Script {
    /// Seconds at which the next movement begins.
    pub(super) now_s: f64,
    pub(super) motion: Motion,
    pub(super) postures: Postures,
    pub(super) things: Vec<Thing>,
    pub(super) floor_height: f64,
    pub(super) variation: Variation,
    /// Durations are multiplied by it.
    pace: f64,
    /// Where the object in hand is from the grip frame's origin, metres, world axes.
    in_hand: Vector3<f64>,
}

impl Script {
    /// A hand at home that has not begun.
    pub(super) fn new(spec: &Spec, things: Vec<Thing>, floor_height: f64) -> Self {
        let mut variation = Variation::new(spec.seed);
        let home = HOME + Vector3::y() * floor_height;
        let motion = Motion {
            place: [home.x, home.y, home.z].map(Channel::new),
            yaw: Channel::new(0.15),
            pitch: Channel::new(0.25),
            aperture: Channel::new(EASE_M),
            overlays: Vec::new(),
        };
        let pace = variation.around(1.0, 0.07);
        Self {
            now_s: spec.start_s,
            motion,
            postures: Postures::adult(),
            things,
            floor_height,
            variation,
            pace,
            in_hand: Vector3::zeros(),
        }
    }

    /// The hand that does all this.
    pub(super) fn finish(mut self, spec: &Spec, after_s: f64) -> SyntheticHand {
        SyntheticHand {
            side: spec.side,
            tremor: Tremor::new(&mut self.variation),
            motion: self.motion,
            postures: self.postures,
            duration_s: self.now_s + after_s,
            period_s: None,
        }
    }

    /// A duration at this hand's pace, seconds.
    pub(super) fn paced(&mut self, duration_s: f64) -> f64 {
        self.pace * self.variation.around(duration_s, 0.04 * duration_s)
    }

    /// Where the grip frame ends up so far.
    pub(super) fn place(&self) -> Point3<f64> {
        let [x, y, z] = &self.motion.place;
        Point3::new(x.goal(), y.goal(), z.goal())
    }

    /// Moves to a place within `duration_s`, from `now_s + delay_s` on. The script's time stays.
    pub(super) fn go(&mut self, delay_s: f64, duration_s: f64, to: &Point3<f64>) {
        for (axis, channel) in self.motion.place.iter_mut().enumerate() {
            channel.go(self.now_s + delay_s, duration_s, to[axis]);
        }
    }

    /// Turns to a yaw and a pitch within `duration_s`. The script's time stays.
    pub(super) fn turn(&mut self, duration_s: f64, yaw: f64, pitch: f64) {
        self.motion.yaw.go(self.now_s, duration_s, yaw);
        self.motion.pitch.go(self.now_s, duration_s, pitch);
    }

    /// Lets time pass.
    pub(super) fn wait(&mut self, duration_s: f64) {
        self.now_s += duration_s;
    }

    /// Comes from where it is to above a place, then down to it; the last tenth of a second or so is a rest.
    pub(super) fn come_down_to(&mut self, place: &Point3<f64>, yaw: f64, pitch: f64) {
        let hover = place + Vector3::y() * self.variation.around(HOVER_M, 0.012);
        let (over_s, down_s) = (self.paced(0.85), self.paced(0.55));
        self.go(0.0, over_s, &hover);
        self.turn(over_s, yaw, pitch);
        self.go(0.75 * over_s, down_s, place);
        self.wait(0.75 * over_s + down_s + 0.06);
    }

    /// Reaches for an object from above and closes thumb, index and middle finger on it.
    pub(super) fn grasp(&mut self, index: usize) {
        let Some(grip) = self.things[index].grip() else {
            return;
        };
        let centre = self.things[index].centre();
        let slip = [0.0015, 0.0015].map(|spread| self.variation.around(0.0, spread));
        let right = turned(grip.yaw, 0.0) * Vector3::x();
        let place = grip.centre + right * slip[0] + Vector3::y() * slip[1];
        self.in_hand = centre - place;
        let open = (grip.width + self.variation.around(PRESHAPE_M, 0.003)).min(0.104);
        let open_s = self.paced(0.8);
        self.motion.aperture.go(self.now_s, open_s, open);
        self.come_down_to(&place, grip.yaw, 0.0);
        self.close(&grip);
    }

    fn close(&mut self, grip: &Grip) {
        let depth = self.variation.around(DEPTH_M, 0.001);
        let close_s = self.paced(0.32);
        self.motion
            .aperture
            .go(self.now_s, close_s, grip.width - 2.0 * depth);
        self.wait(close_s + 0.08);
    }

    /// Carries the object in hand to where its centre of gravity is to be: up, across at a height (of that centre), down.
    pub(super) fn carry(&mut self, to: &Point3<f64>, height: f64) {
        let target = to - self.in_hand;
        let here = self.place();
        let up = height - self.in_hand.y;
        let (up_s, across_s, down_s) = (self.paced(0.6), self.paced(0.9), self.paced(0.7));
        self.go(0.0, up_s, &Point3::new(here.x, up, here.z));
        self.go(0.6 * up_s, across_s, &Point3::new(target.x, up, target.z));
        self.go(0.6 * up_s + 0.8 * across_s, down_s, &target);
        self.wait(0.6 * up_s + 0.8 * across_s + down_s + 0.08);
    }

    /// Moves the object in hand to where its centre of gravity is to be, straight, within `duration_s`.
    pub(super) fn carry_straight(&mut self, to: &Point3<f64>, duration_s: f64) {
        let target = to - self.in_hand;
        self.go(0.0, duration_s, &target);
        self.wait(duration_s);
    }

    /// From now on the object whose centre of gravity is there is in hand.
    pub(super) fn hold_at(&mut self, centre: Point3<f64>) {
        self.in_hand = centre - self.place();
    }

    /// Opens the hand and goes up from the object.
    pub(super) fn let_go(&mut self) {
        let open_s = self.paced(0.3);
        let open = (self.motion.aperture.goal() + 2.0 * DEPTH_M + PRESHAPE_M).min(0.105);
        self.motion.aperture.go(self.now_s, open_s, open);
        self.wait(0.9 * open_s);
        let up_s = self.paced(0.5);
        let up = self.place() + Vector3::y() * HOVER_M;
        self.go(0.0, up_s, &up);
        self.wait(0.8 * up_s);
    }

    /// Goes home and relaxes.
    pub(super) fn go_home(&mut self) {
        let home = HOME + Vector3::y() * self.floor_height;
        let home_s = self.paced(0.9);
        self.go(0.0, home_s, &home);
        self.turn(home_s, 0.15, 0.25);
        self.motion.aperture.go(self.now_s, home_s, EASE_M);
        self.wait(home_s);
    }

    /// Takes an object, puts it where its centre of gravity is to be and leaves it there.
    pub(super) fn put(&mut self, index: usize, to: &Point3<f64>) {
        let height = self.clear_height(index);
        self.grasp(index);
        self.carry(to, height);
        self.let_go();
        self.things[index].put(to);
    }

    /// Where the centre of gravity of an object is when it stands, as it does now, on a height at x, z.
    pub(super) fn standing(&self, index: usize, [x, z]: [f64; 2], height: f64) -> Point3<f64> {
        let thing = &self.things[index];
        Point3::new(x, height + thing.centre().y - thing.heights().0 + DROP_M, z)
    }

    /// A height (of an object's centre of gravity) at which it passes above everything else within reach.
    pub(super) fn clear_height(&self, index: usize) -> f64 {
        let tops = self
            .things
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index)
            .map(|(_, thing)| thing.heights().1);
        let top = tops
            .fold(self.floor_height + 0.06, f64::max)
            .min(self.floor_height + 0.5);
        let (low, _) = self.things[index].heights();
        top + 0.04 + self.things[index].centre().y - low
    }

    /// Lays a posture over the pinch; its weight begins at 0.
    pub(super) fn overlay(&mut self, angles: tsukamu_world::hand::sample::JointAngles) -> usize {
        self.motion.overlays.push(Overlay {
            angles,
            weight: Channel::new(0.0),
        });
        self.motion.overlays.len() - 1
    }

    /// Changes how much of an overlay there is, within `duration_s`. The script's time stays.
    pub(super) fn blend(&mut self, overlay: usize, duration_s: f64, weight: f64) {
        self.motion.overlays[overlay]
            .weight
            .go(self.now_s, duration_s, weight);
    }
}
