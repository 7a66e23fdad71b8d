//! Cuts the host's bytes into CyberGlove commands.

use crate::glove::cyberglove::protocol::{POLL, QUERY, REINITIALISE, RESTART, STOP, STREAM};

/// One command of the host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Command {
    Stop,
    Restart,
    Reinitialise,
    /// One sample.
    Sample {
        ascii: bool,
    },
    Stream {
        ascii: bool,
    },
    /// A question about the upper-case letter.
    Query {
        letter: u8,
        ascii: bool,
    },
    /// The human-readable text.
    Information,
    /// A setting: upper-case letter and operands in their binary form.
    Set {
        letter: u8,
        operands: Vec<u8>,
        ascii: bool,
    },
    Unknown,
}

/// Longest command: on-board calibration of 22 sensors.
pub(crate) const MAX_COMMAND: usize = 2 + 2 * 24;

/// The first command in `bytes` and its length; `None` when it is incomplete.
pub(crate) fn next_command(bytes: &[u8], n_sensors: usize) -> Option<(Command, usize)> {
    let first = *bytes.first()?;
    let single = |command| Some((command, 1));
    match first {
        STOP => single(Command::Stop),
        RESTART => single(Command::Restart),
        REINITIALISE => single(Command::Reinitialise),
        POLL => single(Command::Sample { ascii: false }),
        b'g' => single(Command::Sample { ascii: true }),
        STREAM => single(Command::Stream { ascii: false }),
        b's' => single(Command::Stream { ascii: true }),
        QUERY => {
            let letter = *bytes.get(1)?;
            let command = match letter {
                b'i' => Command::Information,
                letter => Command::Query {
                    letter: letter.to_ascii_uppercase(),
                    ascii: letter.is_ascii_lowercase(),
                },
            };
            Some((command, 2))
        }
        b'A'..=b'Z' => binary_setting(bytes, first, n_sensors),
        b'a'..=b'z' => ascii_setting(bytes, first.to_ascii_uppercase()),
        _ => single(Command::Unknown),
    }
}

const fn operand_length(letter: u8) -> Option<usize> {
    match letter {
        b'B' | b'D' | b'F' | b'J' | b'L' | b'N' | b'Q' | b'U' | b'Y' => Some(1),
        b'M' | b'P' => Some(3),
        b'T' => Some(4),
        _ => None,
    }
}

fn binary_setting(bytes: &[u8], letter: u8, n_sensors: usize) -> Option<(Command, usize)> {
    let n_operands = match (letter, operand_length(letter)) {
        (_, Some(n_operands)) => n_operands,
        (b'A', None) => match *bytes.get(1)? {
            0xFF => 7,
            n_pairs => 1 + 2 * usize::from(n_pairs.min(6)),
        },
        (b'C', None) => match *bytes.get(1)? {
            b'A' => 1 + 2 * n_sensors,
            _ => 3,
        },
        _ => return Some((Command::Unknown, 1)),
    };
    let operands = bytes.get(1..=n_operands)?.to_vec();
    let command = Command::Set {
        letter,
        operands,
        ascii: false,
    };
    Some((command, 1 + n_operands))
}

/// Decimal operands up to CR; the two of `t` become two bytes each, all others one.
fn ascii_setting(bytes: &[u8], letter: u8) -> Option<(Command, usize)> {
    let Some(n_operands) = operand_length(letter) else {
        return Some((Command::Unknown, 1));
    };
    let end = bytes.iter().position(|byte| *byte == b'\r')?;
    let numbers: Option<Vec<u16>> = bytes[1..end]
        .split(|byte| *byte == b' ')
        .filter(|word| !word.is_empty())
        .map(|word| std::str::from_utf8(word).ok()?.parse().ok())
        .collect();
    let operands = numbers.and_then(|numbers| {
        if letter == b'T' {
            Some(
                numbers
                    .iter()
                    .flat_map(|number| number.to_be_bytes())
                    .collect(),
            )
        } else {
            numbers
                .iter()
                .map(|number| u8::try_from(*number).ok())
                .collect::<Option<Vec<u8>>>()
        }
    });
    let command = match operands {
        Some(operands) if operands.len() == n_operands => Command::Set {
            letter,
            operands,
            ascii: true,
        },
        // A bad number; the operands are left empty for the device to refuse.
        _ => Command::Set {
            letter,
            operands: Vec::new(),
            ascii: true,
        },
    };
    Some((command, end + 1))
}
