//! One line of a LucidGlove, in either encoding.
//!
//! There is no check sum: a digit that turned into another digit goes unnoticed. Everything else that cannot be a
//! glove's line is refused, never repaired: a character that has no place, a key given twice, a number that is too
//! large, no finger at all.

use thiserror::Error;

use crate::glove::calibrate::Handedness;
use crate::glove::lucidglove::protocol::{
    Encoding, FLAGS, LEGACY_FIELDS, LEGACY_FLAGS, MAX_LINE, MAX_NUMBER, N_FINGERS, N_JOINTS,
};

/// The numbers of one line; `None` is what it does not name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sample {
    /// The encoding that it came in.
    pub encoding: Encoding,
    /// Curl of each finger: 0 is straight.
    pub curls: [Option<u16>; N_FINGERS],
    /// Curl of each joint of each finger, from the base.
    pub joints: [[Option<u16>; N_JOINTS]; N_FINGERS],
    /// Sideways swing of each finger: half of the greatest number is straight.
    pub splays: [Option<u16>; N_FINGERS],
    /// The stick, x and y: half of the greatest number is the middle.
    pub stick: [Option<u16>; 2],
    /// The analogue trigger. The firmware's arithmetic makes it 1 greater than the greatest number.
    pub trigger: Option<u16>,
    /// Pressed buttons, by the bits of the protocol.
    pub buttons: u32,
}

/// What a glove says about itself, once or now and then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Info {
    /// Firmware version.
    pub firmware: Option<u16>,
    /// Device type; 0 is a LucidGlove.
    pub device_type: Option<u16>,
    /// The hand that it is made for.
    pub hand: Option<Handedness>,
}

impl Info {
    /// Takes over what a newer line says.
    pub fn update(&mut self, newer: &Self) {
        self.firmware = newer.firmware.or(self.firmware);
        self.device_type = newer.device_type.or(self.device_type);
        self.hand = newer.hand.or(self.hand);
    }
}

/// One decoded line: a sample, information, or both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line {
    /// The sample, if it names a finger.
    pub sample: Option<Sample>,
    /// The information, if it has any.
    pub info: Option<Info>,
}

/// Why bytes are no line of a glove.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LineFault {
    /// Longer than any line.
    #[error("line of {0} bytes")]
    Length(usize),
    /// A byte that neither encoding has.
    #[error("byte {0:#04X} where a key has to be")]
    Byte(u8),
    /// A bracket that is not closed, or with other than one to three capital letters inside.
    #[error("malformed key in brackets")]
    Bracket,
    /// A key that needs a number has none, or a field of the legacy encoding is empty.
    #[error("a number is missing")]
    NoNumber,
    /// A number that no glove sends there.
    #[error("number {0} is too large")]
    Number(u32),
    /// A key stands there twice.
    #[error("a key is given twice")]
    Twice,
    /// Too few or too many fields of the legacy encoding.
    #[error("{0} fields")]
    Fields(usize),
    /// Neither a finger nor information is named.
    #[error("no finger is named")]
    NoFinger,
}

/// Decodes one line, given without its line feed; white space around it is ignored.
///
/// # Errors
/// A [`LineFault`] that names the first check that failed.
pub fn decode_line(bytes: &[u8]) -> Result<Line, LineFault> {
    if bytes.len() > MAX_LINE {
        return Err(LineFault::Length(bytes.len()));
    }
    let line = bytes.trim_ascii();
    if line.first().is_some_and(u8::is_ascii_digit) {
        decode_legacy(line).map(|sample| Line {
            sample: Some(sample),
            info: None,
        })
    } else {
        decode_alpha(line)
    }
}

fn decode_legacy(line: &[u8]) -> Result<Sample, LineFault> {
    let mut numbers = [None; LEGACY_FIELDS.1];
    let mut n_fields = 0;
    for field in line.split(|byte| matches!(byte, b'&' | b',')) {
        let (number, rest) = number(field.trim_ascii())?;
        if let Some(byte) = rest.first() {
            return Err(LineFault::Byte(*byte));
        }
        let number = number.ok_or(LineFault::NoNumber)?;
        if let Some(place) = numbers.get_mut(n_fields) {
            *place = Some(number);
        }
        n_fields += 1;
    }
    if !(LEGACY_FIELDS.0..=LEGACY_FIELDS.1).contains(&n_fields) {
        return Err(LineFault::Fields(n_fields));
    }
    let mut sample = Sample {
        encoding: Encoding::Legacy,
        ..Sample::default()
    };
    let (values, flags) = numbers.split_at(N_FINGERS + sample.stick.len());
    sample.curls.copy_from_slice(&values[..N_FINGERS]);
    sample.stick.copy_from_slice(&values[N_FINGERS..]);
    for (flag, bit) in flags.iter().zip(LEGACY_FLAGS) {
        sample.buttons |= bit_of_flag(*flag, bit, 0)?;
    }
    Ok(sample)
}

fn decode_alpha(line: &[u8]) -> Result<Line, LineFault> {
    let (mut sample, mut info) = (Sample::default(), Info::default());
    let mut seen_flags = 0;
    let mut rest = line;
    while !rest.is_empty() {
        let (key, behind) = key(rest)?;
        let (number, behind) = number(behind)?;
        rest = behind;
        match key {
            [letter @ b'H'..=b'O'] => {
                let bit = FLAGS[usize::from(letter - b'H')].1;
                if seen_flags & bit != 0 {
                    return Err(LineFault::Twice);
                }
                seen_flags |= bit;
                sample.buttons |= bit_of_flag(number, bit, bit)?;
            }
            [b'Z', letter] => take_info(&mut info, *letter, number)?,
            key => {
                if let Some(place) = place(&mut sample, key) {
                    put(place, number)?;
                }
            }
        }
    }
    let has_finger = sample.curls.iter().any(Option::is_some);
    let has_info = info != Info::default();
    if !has_finger && !has_info {
        return Err(LineFault::NoFinger);
    }
    Ok(Line {
        sample: has_finger.then_some(sample),
        info: has_info.then_some(info),
    })
}

/// The key at the front, without its brackets, and what is behind it.
fn key(bytes: &[u8]) -> Result<(&[u8], &[u8]), LineFault> {
    match bytes {
        [b'A'..=b'Z', ..] => Ok(bytes.split_at(1)),
        [b'(', rest @ ..] => {
            let n_letters = rest.iter().take_while(|b| b.is_ascii_uppercase()).count();
            match rest.get(n_letters) {
                Some(b')') if (1..=3).contains(&n_letters) => {
                    Ok((&rest[..n_letters], &rest[n_letters + 1..]))
                }
                _ => Err(LineFault::Bracket),
            }
        }
        [byte, ..] => Err(LineFault::Byte(*byte)),
        [] => Err(LineFault::NoFinger),
    }
}

/// The decimal number at the front, if there is one, and what is behind it.
fn number(bytes: &[u8]) -> Result<(Option<u16>, &[u8]), LineFault> {
    let n_digits = bytes
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    let (digits, rest) = bytes.split_at(n_digits);
    let value = digits.iter().fold(0_u32, |value, digit| {
        value
            .saturating_mul(10)
            .saturating_add(u32::from(digit - b'0'))
    });
    if value > MAX_NUMBER {
        return Err(LineFault::Number(value));
    }
    Ok(((n_digits > 0).then_some(value as u16), rest))
}

/// Where the number of a key goes; `None` for a key that nobody knows.
fn place<'s>(sample: &'s mut Sample, key: &[u8]) -> Option<&'s mut Option<u16>> {
    let finger = |letter: &u8| usize::from(letter - b'A');
    match key {
        [letter @ b'A'..=b'E'] => Some(&mut sample.curls[finger(letter)]),
        [letter @ b'F'..=b'G'] => Some(&mut sample.stick[usize::from(letter - b'F')]),
        [b'P'] => Some(&mut sample.trigger),
        [letter @ b'A'..=b'E', b'B'] => Some(&mut sample.splays[finger(letter)]),
        [letter @ b'A'..=b'E', b'A', joint @ b'A'..=b'D'] => {
            Some(&mut sample.joints[finger(letter)][usize::from(joint - b'A')])
        }
        _ => None,
    }
}

fn put(place: &mut Option<u16>, number: Option<u16>) -> Result<(), LineFault> {
    let number = number.ok_or(LineFault::NoNumber)?;
    match place.replace(number) {
        None => Ok(()),
        Some(_) => Err(LineFault::Twice),
    }
}

fn take_info(info: &mut Info, letter: u8, number: Option<u16>) -> Result<(), LineFault> {
    match letter {
        b'V' => put(&mut info.firmware, number),
        b'G' => put(&mut info.device_type, number),
        b'H' => {
            let hand = match number {
                Some(0) => Handedness::Left,
                Some(1) => Handedness::Right,
                Some(other) => return Err(LineFault::Number(u32::from(other))),
                None => return Err(LineFault::NoNumber),
            };
            match info.hand.replace(hand) {
                None => Ok(()),
                Some(_) => Err(LineFault::Twice),
            }
        }
        // Commands of the library such as `(ZA)`, echoed by whoever does.
        _ => Ok(()),
    }
}

/// The bit of a flag that is 1, none where it is 0, `bare` where it has no number.
const fn bit_of_flag(number: Option<u16>, bit: u32, bare: u32) -> Result<u32, LineFault> {
    match number {
        None => Ok(bare),
        Some(0) => Ok(0),
        Some(1) => Ok(bit),
        Some(other) => Err(LineFault::Number(other as u32)),
    }
}
