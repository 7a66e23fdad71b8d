//! The start-up of a CyberGlove as a list of questions and settings.

use crate::glove::calibrate::Handedness;
use crate::glove::cyberglove::protocol::{PARAMETER_TOUCH, QUERY, period_words};
use crate::glove::cyberglove::settings::CyberGloveSettings;
use crate::glove::sensor::SensorMask;

/// One question or setting of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Ready,
    Count,
    HardwareMask,
    Hand,
    Version,
    Parameters,
    Status,
    Filter,
    NoStamp,
    Period,
    SoftwareMask,
    SampledCount,
}

/// In the order in which the open drivers converge; `?N` and `?D` are left out, being unreliable on the III.
pub(super) const SCRIPT: [Step; 12] = [
    Step::Ready,
    Step::Count,
    Step::HardwareMask,
    Step::Hand,
    Step::Version,
    Step::Parameters,
    Step::Status,
    Step::Filter,
    Step::NoStamp,
    Step::Period,
    Step::SoftwareMask,
    Step::SampledCount,
];

/// What the glove said so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Answers {
    pub(super) n_sensors: Option<u8>,
    pub(super) hardware_mask: Option<SensorMask>,
    pub(super) hand: Option<Handedness>,
    pub(super) version: Option<[u8; 4]>,
    /// Whether it has vibrators.
    pub(super) vibrates: bool,
    /// Whether the status byte was acknowledged.
    pub(super) status: bool,
}

impl Answers {
    /// The sensors of a record: the forced ones, else those of the mask if the count agrees, else those of the count.
    pub(super) fn mask(&self, forced: Option<SensorMask>) -> Option<SensorMask> {
        let n_sensors = self.n_sensors.map(usize::from);
        let hardware = self
            .hardware_mask
            .filter(|mask| n_sensors.is_none_or(|count| count == mask.count()))
            .filter(|mask| mask.count() > 0);
        forced
            .or(hardware)
            .or_else(|| n_sensors.and_then(SensorMask::from_count))
    }
}

/// A command with the shape of its answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Command {
    pub(super) bytes: Vec<u8>,
    /// Bytes of the command that the answer repeats.
    pub(super) n_echo: usize,
    /// Bytes of data between the echo and NUL.
    pub(super) n_data: usize,
}

impl Command {
    fn query(letter: u8, n_data: usize) -> Self {
        Self {
            bytes: vec![QUERY, letter],
            n_echo: 2,
            n_data,
        }
    }

    fn set(letter: u8, operands: &[u8]) -> Self {
        let mut bytes = vec![letter];
        bytes.extend_from_slice(operands);
        Self {
            bytes,
            n_echo: 1,
            n_data: 0,
        }
    }
}

/// The command of a step; `None` when the settings or earlier answers make it needless.
pub(super) fn command(
    step: Step,
    settings: &CyberGloveSettings,
    answers: &Answers,
) -> Option<Command> {
    let mask = answers.mask(settings.forced_mask());
    match step {
        Step::Ready => Some(Command::query(b'G', 1)),
        Step::Count => Some(Command::query(b'S', 1)),
        Step::HardwareMask => Some(Command::query(b'K', 3)),
        Step::Hand => Some(Command::query(b'R', 1)),
        Step::Version => Some(Command::query(b'V', 4)),
        Step::Parameters => Some(Command::query(b'P', 3)),
        Step::Status => Some(Command::set(b'U', &[u8::from(settings.status)])),
        Step::Filter => Some(Command::set(b'F', &[u8::from(settings.filter)])),
        Step::NoStamp => Some(Command::set(b'D', &[0])),
        Step::Period => settings.rate_hz.and_then(period_words).map(|(w1, w2)| {
            let ([a, b], [c, d]) = (w1.to_be_bytes(), w2.to_be_bytes());
            Command::set(b'T', &[a, b, c, d])
        }),
        Step::SoftwareMask => mask.map(|mask| Command::set(b'M', &mask.to_wire())),
        // At most 24, the number of slots.
        Step::SampledCount => mask.map(|mask| Command::set(b'N', &[mask.count() as u8])),
    }
}

/// Takes the data of an answer; the answer of [`Step::Ready`] is the session's own business.
pub(super) fn take_answer(
    step: Step,
    data: &[u8],
    settings: &CyberGloveSettings,
    answers: &mut Answers,
) {
    match (step, data) {
        (Step::Count, [count]) => answers.n_sensors = Some(*count),
        (Step::HardwareMask, [a, b, c]) => {
            answers.hardware_mask = Some(SensorMask::from_wire([*a, *b, *c]));
        }
        (Step::Hand, [0]) => answers.hand = Some(Handedness::Left),
        (Step::Hand, [1]) => answers.hand = Some(Handedness::Right),
        (Step::Version, [a, b, c, d]) => answers.version = Some([*a, *b, *c, *d]),
        (Step::Parameters, [_, _, last]) => answers.vibrates = last & PARAMETER_TOUCH != 0,
        (Step::Status, []) => answers.status = settings.status,
        _ => {}
    }
}
