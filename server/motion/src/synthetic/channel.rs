//! One number over time: a sum of smooth changes that may overlap.
//!
//! ```text
//!   value           ┌────        Step: goes to another value, jerk least (Flash & Hogan 1985).
//!        ──────────/                    Overlapping ones blend as submovements do (Flash & Henis 1991).
//!   rate        ┌──┐             Ramp: the same for its rate; two of them make a stretch of constant speed,
//!        ──────/    \────               which is what a throw lets go in.
//! ```

/// One smooth change.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    start_s: f64,
    duration_s: f64,
    amount: f64,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// `amount` is added to the value.
    Step,
    /// `amount` per second is added to the rate.
    Ramp,
}

/// One number over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Channel {
    start: f64,
    changes: Vec<Change>,
    goal: f64,
}

impl Channel {
    /// A channel that stays at a value.
    pub(super) fn new(start: f64) -> Self {
        Self {
            start,
            changes: Vec::new(),
            goal: start,
        }
    }

    /// The value at which it ends up.
    pub(super) fn goal(&self) -> f64 {
        self.goal
    }

    /// Goes from its goal so far to another value, from a time on, for a while (seconds, above 0).
    pub(super) fn go(&mut self, start_s: f64, duration_s: f64, goal: f64) {
        let amount = goal - self.goal;
        self.goal = goal;
        if amount != 0.0 {
            self.changes.push(Change {
                start_s,
                duration_s,
                amount,
                kind: Kind::Step,
            });
        }
    }

    /// Moves with a rate (per second) that comes up within `up_s`, stays for `hold_s` and goes down within `down_s`.
    pub(super) fn surge(&mut self, start_s: f64, [up_s, hold_s, down_s]: [f64; 3], rate: f64) {
        let down_from_s = start_s + up_s + hold_s;
        self.changes.push(Change {
            start_s,
            duration_s: up_s,
            amount: rate,
            kind: Kind::Ramp,
        });
        self.changes.push(Change {
            start_s: down_from_s,
            duration_s: down_s,
            amount: -rate,
            kind: Kind::Ramp,
        });
        self.goal += surge_length([up_s, hold_s, down_s]) * rate;
    }

    /// The value at a time in seconds.
    pub(super) fn at(&self, t_s: f64) -> f64 {
        self.start
            + self
                .changes
                .iter()
                .map(|change| change.at(t_s))
                .sum::<f64>()
    }
}

/// How long a surge of rate one would take at full rate, in seconds: its length per rate.
pub(super) fn surge_length([up_s, hold_s, down_s]: [f64; 3]) -> f64 {
    0.5 * up_s + hold_s + 0.5 * down_s
}

impl Change {
    fn at(&self, t_s: f64) -> f64 {
        let share = ((t_s - self.start_s) / self.duration_s).clamp(0.0, 1.0);
        match self.kind {
            Kind::Step => self.amount * minimum_jerk(share),
            Kind::Ramp => {
                let after = (t_s - self.start_s - self.duration_s).max(0.0);
                self.amount * (self.duration_s * minimum_jerk_area(share) + after)
            }
        }
    }
}

/// The way of least jerk from 0 to 1 (Flash & Hogan 1985, equation (3)).
fn minimum_jerk(share: f64) -> f64 {
    share * share * share * (10.0 + share * (6.0 * share - 15.0))
}

/// The area under it from 0.
fn minimum_jerk_area(share: f64) -> f64 {
    let fourth = share * share * share * share;
    fourth * (2.5 + share * (share - 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_at_their_goals_and_overlap_without_a_jolt() {
        let mut channel = Channel::new(1.0);
        channel.go(0.0, 1.0, 2.0);
        channel.go(0.5, 1.0, -1.0);
        assert_eq!((channel.at(-1.0), channel.at(0.0)), (1.0, 1.0));
        assert!((channel.at(9.0) + 1.0).abs() < 1e-15);
        let dt = 1e-3;
        let mut last = 0.0;
        for i in 0..1600 {
            let t = f64::from(i) * dt;
            let bend = (channel.at(t + dt) - 2.0 * channel.at(t) + channel.at(t - dt)) / (dt * dt);
            assert!((bend - last).abs() < 0.3, "acceleration jumps at {t}");
            last = bend;
        }
    }

    #[test]
    fn a_surge_holds_its_rate() {
        let mut channel = Channel::new(0.5);
        channel.surge(1.0, [0.4, 0.2, 0.2], 3.0);
        let rate = |t: f64| (channel.at(t + 1e-4) - channel.at(t - 1e-4)) / 2e-4;
        assert!(rate(0.9).abs() < 1e-9 && rate(2.0).abs() < 1e-9);
        assert!((rate(1.5) - 3.0).abs() < 1e-9 && (rate(1.41) - 3.0).abs() < 1e-9);
        assert!((channel.at(5.0) - channel.goal()).abs() < 1e-12);
        assert!((channel.goal() - 0.5 - 3.0 * 0.5).abs() < 1e-12);
    }
}
