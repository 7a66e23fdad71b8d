//! What is wrong with a device that is there: each warning has a code, plain words, and a threshold to begin that is
//! apart from the one to end. Pure.

use std::collections::VecDeque;

use tsukamu_devices::glove::sensor::GloveSensor;

/// Nanoseconds per second.
const SECOND_NS: u64 = 1_000_000_000;
/// Without a sample for so long a device that runs is silent, seconds; or for so many of its periods.
const SILENT_S: f64 = 1.0;
const SILENT_PERIODS: f64 = 5.0;
/// The same while it is being started, seconds: some take ten to reset.
const START_S: f64 = 15.0;
/// Shares of the expected rate below which a device is slow, and above which it no longer is.
const SLOW: f64 = 0.8;
const NOT_SLOW: f64 = 0.9;
/// How long a rate must be so, nanoseconds.
const RATE_FOR_NS: u64 = 3 * SECOND_NS;
/// Lost steps per second above which a device is noisy, and below which it no longer is.
const NOISY_HZ: f64 = 1.0;
const NOT_NOISY_HZ: f64 = 0.2;
/// Time over which they are counted, nanoseconds.
const NOISE_NS: u64 = 10 * SECOND_NS;
/// Share of the samples of one sensor beyond its range above which it is told, and below which it no longer is.
const BEYOND: f64 = 0.6;
const NOT_BEYOND: f64 = 0.3;
/// How far from straight a joint that moves stays for a minute, degrees, for its zero to have drifted, and to be good again.
const DRIFTED_DEG: f64 = 20.0;
const NOT_DRIFTED_DEG: f64 = 12.0;

/// What can be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// It is there and no sample comes.
    Silent,
    /// Its rate is below what it is set to.
    Slow,
    /// Its decoder loses step again and again.
    Noisy,
    /// A sensor is mostly beyond its calibrated range.
    OutOfRange,
    /// A joint moves and never straightens.
    Drifted,
}

impl Code {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Silent,
        Self::Slow,
        Self::Noisy,
        Self::OutOfRange,
        Self::Drifted,
    ];

    /// The name on the wire and in metrics.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Silent => "silent",
            Self::Slow => "slow",
            Self::Noisy => "noisy",
            Self::OutOfRange => "out_of_range",
            Self::Drifted => "drifted",
        }
    }
}

/// How a device does at one time.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// Monotonic time, nanoseconds.
    pub now_ns: u64,
    /// Its state by name.
    pub state: &'static str,
    /// What its session says is wrong, or nothing.
    pub error: &'a str,
    /// Age of its newest sample, seconds; negative without one.
    pub age_s: f64,
    /// Samples per second, over some seconds.
    pub rate_hz: f64,
    /// What that should be.
    pub expected_hz: Option<f64>,
    /// Times that its decoder lost step, since the start.
    pub n_resyncs: u64,
    /// The sensor that is most often beyond its range, and in which share of the samples.
    pub worst: Option<(GloveSensor, f64)>,
    /// The joint that moves and stays farthest from straight, and by how many degrees.
    pub zero_shift: Option<(GloveSensor, f64)>,
}

/// A warning that began or ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Which.
    pub code: Code,
    /// In plain words; `None` when it ended.
    pub text: Option<String>,
}

/// The warnings of one device.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    /// Those that stand, by code.
    texts: [Option<String>; Code::ALL.len()],
    /// Since when the rate has been other than its warning says.
    rate_since_ns: Option<u64>,
    /// Since when the device is there.
    present_ns: Option<u64>,
    /// Counts of lost steps at some times.
    resyncs: VecDeque<(u64, u64)>,
}

impl Warnings {
    /// Looks at the device, a few times per second; what begins and ends comes back. Those of a device that is not there
    /// end without a word: its loss says all.
    pub fn look(&mut self, seen: &Observed<'_>) -> Vec<Change> {
        let is_present = !matches!(seen.state, "absent" | "opening" | "ended");
        if !is_present {
            *self = Self::default();
            return Vec::new();
        }
        self.present_ns.get_or_insert(seen.now_ns);
        self.count_resyncs(seen);
        let texts = [
            self.silent(seen),
            self.slow(seen),
            self.noisy(),
            self.out_of_range(seen),
            self.drifted(seen),
        ];
        let mut changes = Vec::new();
        for (code, (old, new)) in Code::ALL.into_iter().zip(self.texts.iter().zip(&texts)) {
            if old.is_some() != new.is_some() {
                let text = new.clone();
                changes.push(Change { code, text });
            }
        }
        self.texts = texts;
        changes
    }

    /// Those that stand, in plain words.
    pub fn standing(&self) -> impl Iterator<Item = (Code, &str)> {
        let texts = self.texts.iter().map(Option::as_deref);
        let all = Code::ALL.into_iter().zip(texts);
        all.filter_map(|(code, text)| Some((code, text?)))
    }

    /// Times per second that the decoder lost step, over the last ten seconds.
    pub fn resync_rate_hz(&self) -> f64 {
        match (self.resyncs.front(), self.resyncs.back()) {
            (Some((_, before)), Some((_, now))) => {
                now.saturating_sub(*before) as f64 * 1.0e9 / NOISE_NS as f64
            }
            _ => 0.0,
        }
    }

    fn stands(&self, code: Code) -> bool {
        self.texts[code as usize].is_some()
    }

    fn silent(&self, seen: &Observed<'_>) -> Option<String> {
        let present_s = seen
            .now_ns
            .saturating_sub(self.present_ns.unwrap_or(seen.now_ns)) as f64
            * 1.0e-9;
        let age_s = if seen.age_s < 0.0 {
            present_s
        } else {
            // What is older than the device itself says nothing.
            seen.age_s.min(present_s)
        };
        let periods_s = seen.expected_hz.map_or(0.0, |hz| SILENT_PERIODS / hz);
        let limit_s = match seen.state {
            "running" | "stalled" => SILENT_S.max(periods_s),
            _ => START_S.max(periods_s),
        };
        (age_s > limit_s).then(|| match seen.error {
            "" => format!("it is there, and no sample came for {age_s:.1} s"),
            error => format!("no sample came for {age_s:.1} s: {error}"),
        })
    }

    fn slow(&mut self, seen: &Observed<'_>) -> Option<String> {
        let stands = self.stands(Code::Slow);
        let limit = if stands { NOT_SLOW } else { SLOW };
        // What is silent is not slow as well, and what is being started has no rate yet.
        let expected_hz = seen
            .expected_hz
            .filter(|_| seen.state == "running" && seen.age_s >= 0.0 && seen.age_s <= SILENT_S)?;
        let is_slow = seen.rate_hz < limit * expected_hz;
        if is_slow == stands {
            self.rate_since_ns = None;
        } else {
            let since_ns = *self.rate_since_ns.get_or_insert(seen.now_ns);
            if seen.now_ns.saturating_sub(since_ns) < RATE_FOR_NS {
                return stands.then(|| slow_text(seen.rate_hz, expected_hz));
            }
            self.rate_since_ns = None;
        }
        is_slow.then(|| slow_text(seen.rate_hz, expected_hz))
    }

    fn count_resyncs(&mut self, seen: &Observed<'_>) {
        // A session begun anew counts from 0.
        if self
            .resyncs
            .back()
            .is_some_and(|(_, before)| *before > seen.n_resyncs)
        {
            self.resyncs.clear();
        }
        self.resyncs.push_back((seen.now_ns, seen.n_resyncs));
        while self
            .resyncs
            .front()
            .is_some_and(|(at_ns, _)| at_ns + NOISE_NS < seen.now_ns)
        {
            self.resyncs.pop_front();
        }
    }

    fn noisy(&self) -> Option<String> {
        let rate_hz = self.resync_rate_hz();
        let limit_hz = if self.stands(Code::Noisy) {
            NOT_NOISY_HZ
        } else {
            NOISY_HZ
        };
        (rate_hz > limit_hz).then(|| {
            format!(
                "bytes are lost or spoilt {rate_hz:.1} times per second; look at the cable, the baud rate and what \
                 runs beside the line"
            )
        })
    }

    fn out_of_range(&self, seen: &Observed<'_>) -> Option<String> {
        let (sensor, share) = seen.worst?;
        let limit = if self.stands(Code::OutOfRange) {
            NOT_BEYOND
        } else {
            BEYOND
        };
        (share > limit).then(|| {
            format!(
                "{} is beyond its calibrated range in {:.0} % of the samples; calibrate this wearer anew",
                sensor.name(),
                share * 100.0
            )
        })
    }

    fn drifted(&self, seen: &Observed<'_>) -> Option<String> {
        let (sensor, shift_deg) = seen.zero_shift?;
        let limit_deg = if self.stands(Code::Drifted) {
            NOT_DRIFTED_DEG
        } else {
            DRIFTED_DEG
        };
        (shift_deg > limit_deg).then(|| {
            format!(
                "{} moves and never comes nearer to straight than {shift_deg:.0}°; has the glove slipped? \
                 `tsukamu calibrate` takes 15 s",
                sensor.name()
            )
        })
    }
}

fn slow_text(rate_hz: f64, expected_hz: f64) -> String {
    format!("{rate_hz:.1} samples per second, and {expected_hz:.1} are expected")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(second: f64) -> Observed<'static> {
        Observed {
            now_ns: (second * 1.0e9) as u64,
            state: "running",
            error: "",
            age_s: 0.01,
            rate_hz: 100.0,
            expected_hz: Some(100.0),
            n_resyncs: 0,
            worst: None,
            zero_shift: None,
        }
    }

    /// Looks twice per second at what `at` gives, and writes down what begins (+) and ends (-).
    fn told(seconds: u32, at: impl Fn(f64) -> Observed<'static>) -> Vec<String> {
        let mut warnings = Warnings::default();
        let mut told = Vec::new();
        for half in 0..seconds * 2 {
            let second = f64::from(half) / 2.0;
            for change in warnings.look(&at(second)) {
                let sign = if change.text.is_some() { '+' } else { '-' };
                told.push(format!("{sign}{} {second}", change.code.name()));
            }
            let standing = warnings.standing().all(|(_, text)| !text.is_empty());
            assert!(standing, "each has its words");
        }
        told
    }

    #[test]
    fn a_good_device_is_left_alone() {
        assert!(told(60, seen).is_empty());
    }

    #[test]
    fn silence_is_told_once_and_its_end() {
        let at = |second| Observed {
            age_s: if (10.0..20.0).contains(&second) {
                second - 10.0
            } else {
                0.01
            },
            ..seen(second)
        };
        assert_eq!(told(30, at), ["+silent 11.5", "-silent 20"]);
    }

    #[test]
    fn a_device_that_starts_has_its_time_and_one_that_never_answers_has_not() {
        let at = |second| Observed {
            state: "resetting",
            age_s: -1.0,
            ..seen(second)
        };
        assert_eq!(told(30, at), ["+silent 15"]);
    }

    #[test]
    fn a_rate_must_be_low_for_a_while_and_high_for_a_while() {
        let at = |second| Observed {
            rate_hz: match second {
                // A dip is none; then really slow; then between the thresholds; then good again.
                s if (5.0..7.0).contains(&s) => 40.0,
                s if (10.0..20.0).contains(&s) => 60.0,
                s if (20.0..30.0).contains(&s) => 85.0,
                _ => 98.0,
            },
            ..seen(second)
        };
        assert_eq!(told(50, at), ["+slow 13", "-slow 33"]);
        let unknown = |second| Observed {
            expected_hz: None,
            ..at(second)
        };
        assert!(told(50, unknown).is_empty());
    }

    #[test]
    fn noise_is_lost_steps_per_second() {
        let at = |second: f64| Observed {
            n_resyncs: (second.clamp(10.0, 30.0) * 3.0) as u64,
            ..seen(second)
        };
        let told = told(60, at);
        assert_eq!(told, ["+noisy 14", "-noisy 39.5"]);
    }

    #[test]
    fn a_sensor_beyond_its_range_is_named() {
        let mut warnings = Warnings::default();
        let at = |second, share| Observed {
            worst: Some((GloveSensor::RingPip, share)),
            ..seen(second)
        };
        assert!(warnings.look(&at(0.0, 0.5)).is_empty());
        let began = warnings.look(&at(1.0, 0.7));
        let text = began[0].text.as_deref().unwrap_or_default();
        assert!(text.starts_with("ring_pip is beyond"), "{text}");
        assert!(warnings.look(&at(2.0, 0.4)).is_empty());
        assert_eq!(warnings.look(&at(3.0, 0.2))[0].text, None);
    }

    #[test]
    fn a_zero_that_drifted_is_told_with_the_joint() {
        let mut warnings = Warnings::default();
        let at = |second, shift_deg| Observed {
            zero_shift: Some((GloveSensor::IndexPip, shift_deg)),
            ..seen(second)
        };
        assert!(warnings.look(&at(0.0, 15.0)).is_empty());
        let began = warnings.look(&at(1.0, 26.0));
        let text = began[0].text.as_deref().unwrap_or_default();
        assert!(
            text.starts_with("index_pip moves") && text.contains("26°"),
            "{text}"
        );
        assert!(warnings.look(&at(2.0, 15.0)).is_empty());
        assert_eq!(warnings.look(&at(3.0, 5.0))[0].text, None);
    }

    #[test]
    fn what_is_lost_is_not_warned_of_besides() {
        let at = |second| Observed {
            state: if second < 10.0 { "running" } else { "absent" },
            age_s: second,
            ..seen(second)
        };
        assert_eq!(told(30, at), ["+silent 1.5"]);
    }
}
