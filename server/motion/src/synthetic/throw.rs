//! Grasp and throw (Funahashi et al. 1998, Fig. 10), as one throws a dart: the hand upright, the palm behind the object.
//!
//! ```text
//!      fingers ▔▔╲        v     The line from thumb to fingers is at right angles to the throw, so that the tips
//!        palm │   ■ ───>        leave the object to both sides. They do so while the hand goes straight at a constant
//!       thumb ▁▁╱               velocity: then the object's velocity does not depend on when in a step it is let go.
//! ```

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};

use super::script::Script;

/// Seconds in which the hand comes to speed, and stops.
const SURGE_S: (f64, f64) = (0.22, 0.16);
/// Seconds from the beginning of constant speed to that of opening.
const OPEN_AFTER_S: f64 = 0.04;
/// Seconds in which the hand opens as wide as it can.
const OPEN_S: f64 = 0.10;
/// Seconds from the beginning of opening until the tips are off the object, with some in hand.
const OFF_S: f64 = 0.03;
/// Seconds in which the hand comes to fall behind the object, and stops, so that the object does not fall on the thumb.
const FALL_S: [f64; 3] = [0.10, 0.04, 0.25];
/// How fast it falls then, m/s.
const FALL_RATE: f64 = 1.2;
/// Widest opening, metres.
const OPEN_M: f64 = 0.105;
/// Seconds for what is thrown to come to rest.
pub(super) const REST_S: f64 = 2.5;

/// Where an object leaves the hand and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Throw {
    /// Centre of gravity at about the time of release, metres.
    pub(super) from: Point3<f64>,
    /// In m/s.
    pub(super) velocity: Vector3<f64>,
}

impl Throw {
    /// A throw from a place at a speed and a rise above level (radians), toward -z turned by `yaw` about y.
    pub(super) fn toward(from: Point3<f64>, speed: f64, rise: f64, yaw: f64) -> Self {
        let level = speed * libm::cos(rise);
        let velocity = Vector3::new(
            -libm::sin(yaw) * level,
            speed * libm::sin(rise),
            -libm::cos(yaw) * level,
        );
        Self { from, velocity }
    }

    /// The throw that leads to a place in a given time, seconds.
    pub(super) fn through(
        from: Point3<f64>,
        to: &Point3<f64>,
        gravity: &Vector3<f64>,
        flight_s: f64,
    ) -> Self {
        Self {
            from,
            velocity: (to - from) / flight_s - gravity * (0.5 * flight_s),
        }
    }

    fn yaw(&self) -> f64 {
        libm::atan2(-self.velocity.x, -self.velocity.z)
    }

    fn rise(&self) -> f64 {
        libm::atan2(
            self.velocity.y,
            libm::hypot(self.velocity.x, self.velocity.z),
        )
    }
}

/// Takes an object and throws it.
pub(super) fn grasp_and_throw(script: &mut Script, index: usize, throw: &Throw) {
    let height = script.clear_height(index);
    script.grasp(index);
    // At right angles to the throw: a pitch of 90 degrees lifts the fingers to the top.
    let pitch = FRAC_PI_2 + throw.rise();
    let hold_s = OPEN_AFTER_S + OFF_S;
    let back = throw.from - throw.velocity * (0.5 * SURGE_S.0 + hold_s);
    let here = script.place();
    let (up_s, back_s) = (script.paced(0.5), script.paced(0.95));
    script.go(0.0, up_s, &Point3::new(here.x, height.max(here.y), here.z));
    script.wait(0.6 * up_s);
    // The object is turned with the hand: it keeps to the grip's middle, which is where it is thrown from.
    script.go(0.0, back_s, &back);
    script.turn(back_s, throw.yaw(), pitch);
    script.wait(back_s + 0.12);
    for (axis, channel) in script.motion.place.iter_mut().enumerate() {
        channel.surge(
            script.now_s,
            [SURGE_S.0, hold_s, SURGE_S.1],
            throw.velocity[axis],
        );
    }
    let open_s = script.now_s + SURGE_S.0 + OPEN_AFTER_S;
    script.motion.aperture.go(open_s, OPEN_S, OPEN_M);
    script.motion.place[1].surge(open_s + OFF_S, FALL_S, -FALL_RATE);
    script.wait(SURGE_S.0 + hold_s + FALL_S.iter().sum::<f64>());
}
