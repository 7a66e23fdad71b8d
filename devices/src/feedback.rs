//! What a glove can give back to the hand in it.

/// How long forces stand without being asked for again, ns. Then the fingers are freed: whoever asked has stopped.
pub const FORCES_LAST_NS: u64 = 1_000_000_000;
/// Least time between two changes of the forces at a glove, ns: 50 in a second. A servo is no faster, and a firmware
/// that was told more has been seen to stop.
pub const FORCES_PERIOD_NS: u64 = 20_000_000;
/// How late a vibration may begin, ns; after that it is left out.
const VIBRATION_WAITS_NS: u64 = 100_000_000;

/// Forces and vibration for one glove. Fingers are thumb, index, middle, ring, little.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// How strongly each finger is kept from bending further: 0 is free, 1 is blocked. It has to be asked for again
    /// within [`FORCES_LAST_NS`], or the fingers are freed.
    pub resistance: [f64; 5],
    /// A vibration of the whole hand, when one begins.
    pub vibration: Option<Vibration>,
}

/// A vibration that ends by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vibration {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Strength, 0 to 1.
    pub amplitude: f64,
}

impl Feedback {
    /// No force, no vibration: what a glove is told when nobody asks for anything any more.
    pub const FREE: Self = Self {
        resistance: [0.0; 5],
        vibration: None,
    };

    /// The same, taking over the vibration of an earlier request that nobody has read.
    #[must_use]
    pub fn after(self, unread: Option<Self>) -> Self {
        let vibration = self
            .vibration
            .or_else(|| unread.and_then(|unread| unread.vibration));
        Self { vibration, ..self }
    }
}

/// What a session is to give to a glove, and when: on change, not too often, and not for ever.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Giving {
    wanted: [f64; 5],
    /// When that was asked for last, ns.
    wanted_ns: u64,
    /// What the glove was told last, and when; `None` when that is not known.
    given: Option<([u16; 5], u64)>,
    vibration: Option<(Vibration, u64)>,
}

impl Giving {
    /// Takes a request. What is no number is taken as 0.
    pub(crate) fn ask(&mut self, now_ns: u64, feedback: Feedback) {
        self.wanted = feedback.resistance.map(|share| bounded(share, 1.0));
        self.wanted_ns = now_ns;
        if let Some(vibration) = feedback.vibration {
            let vibration = Vibration {
                frequency_hz: bounded(vibration.frequency_hz, 1_000.0),
                duration_s: bounded(vibration.duration_s, 10.0),
                amplitude: bounded(vibration.amplitude, 1.0),
            };
            self.vibration = Some((vibration, now_ns));
        }
    }

    /// The levels to send now, 0 to `full`; `None` when the glove knows them, or was told others just before.
    pub(crate) fn due(&mut self, now_ns: u64, full: u16) -> Option<[u16; 5]> {
        if now_ns.saturating_sub(self.wanted_ns) > FORCES_LAST_NS {
            self.wanted = [0.0; 5];
        }
        let levels = self
            .wanted
            .map(|share| (share * f64::from(full)).round() as u16);
        if let Some((given, given_ns)) = self.given
            && (given == levels || now_ns < given_ns + FORCES_PERIOD_NS)
        {
            return None;
        }
        self.given = Some((levels, now_ns));
        Some(levels)
    }

    /// The vibration to begin now.
    pub(crate) fn vibration(&mut self, now_ns: u64) -> Option<Vibration> {
        let (vibration, asked_ns) = self.vibration.take()?;
        (now_ns.saturating_sub(asked_ns) <= VIBRATION_WAITS_NS).then_some(vibration)
    }

    /// What the glove was told is void: it is told again.
    pub(crate) const fn repeat(&mut self) {
        self.given = None;
    }

    /// The glove has gone, or says nothing: whatever it is told next, it begins free.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }
}

/// From 0 to `greatest`; 0 for what is no number.
fn bounded(value: f64, greatest: f64) -> f64 {
    if value > 0.0 {
        value.min(greatest)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::{FORCES_LAST_NS, FORCES_PERIOD_NS, Feedback, Giving, Vibration};

    const MS: u64 = 1_000_000;

    fn resistance(resistance: [f64; 5]) -> Feedback {
        Feedback {
            resistance,
            vibration: None,
        }
    }

    #[test]
    fn forces_are_given_on_change_and_not_too_often() {
        let mut giving = Giving::default();
        assert_eq!(giving.due(0, 1000), Some([0; 5]), "first of all it is free");
        assert_eq!(giving.due(MS, 1000), None);
        giving.ask(5 * MS, resistance([0.5, 1.0, 7.0, -1.0, f64::NAN]));
        assert_eq!(giving.due(5 * MS, 1000), None, "too soon");
        let levels = Some([500, 1000, 1000, 0, 0]);
        assert_eq!(giving.due(FORCES_PERIOD_NS, 1000), levels);
        giving.ask(30 * MS, resistance([0.5, 1.0, 7.0, -1.0, f64::NAN]));
        assert_eq!(giving.due(90 * MS, 1000), None, "nothing has changed");
        giving.repeat();
        assert_eq!(giving.due(90 * MS, 4095), Some([2048, 4095, 4095, 0, 0]));
    }

    #[test]
    fn forces_end_when_nobody_asks_for_them_any_more() {
        let mut giving = Giving::default();
        giving.ask(0, resistance([1.0; 5]));
        assert_eq!(giving.due(0, 1000), Some([1000; 5]));
        assert_eq!(giving.due(FORCES_LAST_NS, 1000), None);
        assert_eq!(giving.due(FORCES_LAST_NS + 1, 1000), Some([0; 5]));
    }

    #[test]
    fn a_vibration_is_given_once_soon_or_never_and_not_lost_before_it_is_read() {
        let vibration = Vibration {
            frequency_hz: 150.0,
            duration_s: 0.05,
            amplitude: 2.0,
        };
        let begins = Feedback {
            vibration: Some(vibration),
            ..Feedback::FREE
        };
        let mut giving = Giving::default();
        giving.ask(0, Feedback::FREE.after(Some(begins)));
        let bounded = Vibration {
            amplitude: 1.0,
            ..vibration
        };
        assert_eq!(giving.vibration(99 * MS), Some(bounded));
        assert_eq!(giving.vibration(99 * MS), None);
        giving.ask(100 * MS, begins);
        assert_eq!(giving.vibration(201 * MS), None);
    }
}
