//! The CyberGlove's wire as a table: letters, lengths, times.
//!
//! From the CyberGlove and CGIU manuals as cited by several independent open drivers. Upper-case letters are the
//! binary form of a command, lower-case the ASCII form; every reply is the echo of the command, data, and NUL.

/// Device family, as it is named in events.
pub const FAMILY: &str = "CyberGlove";
/// Line rates in the order in which they are worth a try, bit/s; 8 data bits, no parity, 1 stop bit.
pub const BAUDS: [u32; 4] = [115_200, 38_400, 19_200, 9_600];

/// Ends every reply and every record; never inside a record's sensors.
pub const TERMINATOR: u8 = 0x00;
/// `^C`: stop streaming, abort; answered by itself and NUL.
pub const STOP: u8 = 0x03;
/// `^I`: initialise the glove anew.
pub const REINITIALISE: u8 = 0x09;
/// `^R`: restart the firmware; answered after about 1.75 s, and not by every generation.
pub const RESTART: u8 = 0x12;
/// First byte of a question.
pub const QUERY: u8 = b'?';
/// First byte of an error reply.
pub const ERROR: u8 = b'e';
/// Send one sample; first byte of that sample.
pub const POLL: u8 = b'G';
/// Send samples until `^C`; first byte of each of them.
pub const STREAM: u8 = b'S';

/// Sets the vibrators of a CyberTouch; answered by itself and NUL.
pub const TOUCH: u8 = b'A';
/// Behind it: six strengths follow, thumb to little finger and palm, 0 to 255.
pub const TOUCH_ALL: u8 = 0xFF;
/// Bit of the last byte of the `?P` answer: the glove is a CyberTouch. From one source only.
pub const PARAMETER_TOUCH: u8 = 0b10;

/// Bit of the `?G` answer: the box has initialised the glove.
pub const READY_INITIALISED: u8 = 0b01;
/// Bit of the `?G` answer: a glove is plugged in.
pub const READY_PLUGGED_IN: u8 = 0b10;

/// Bit of the status byte: a glove is plugged in.
pub const STATUS_PLUGGED_IN: u8 = 0b0000_0001;
/// Bit of the status byte: the wrist switch is on.
pub const STATUS_SWITCH: u8 = 0b0000_0010;
/// Bit of the status byte: the wrist light is on.
pub const STATUS_LIGHT: u8 = 0b0000_0100;
/// Bit of the status byte, and by analogy of the time stamp's mask, that is always 1 so that neither can be NUL.
pub const ALWAYS_ONE: u8 = 0b1000_0000;

/// Error code: unknown command.
pub const ERROR_UNKNOWN: u8 = b'?';
/// Error code: bad number.
pub const ERROR_NUMBER: u8 = b'n';
/// Error code: external synchronisation too fast.
pub const ERROR_SYNC: u8 = b'y';
/// Error code: no glove plugged into the box.
pub const ERROR_NO_GLOVE: u8 = b'g';
/// Error code: sampling too fast; the data are still valid.
pub const ERROR_TOO_FAST: u8 = b's';
/// Every error code.
pub const ERROR_CODES: [u8; 5] = [
    ERROR_UNKNOWN,
    ERROR_NUMBER,
    ERROR_SYNC,
    ERROR_NO_GLOVE,
    ERROR_TOO_FAST,
];

/// Length of the time stamp in a record: the mask byte and four bytes, least significant first.
pub const STAMP_LENGTH: usize = 5;
/// Longest record without its NUL: letter, 24 sensors, stamp, status, error.
pub const MAX_RECORD: usize = 1 + 24 + STAMP_LENGTH + 1 + 2;

/// The clock that sample periods divide, Hz: rate = 115200 / (w1 · w2).
pub const PERIOD_CLOCK_HZ: f64 = 115_200.0;

/// Wait after `^C` while old input is thrown away, ns.
pub const DRAIN_NS: u64 = 100_000_000;
/// Wait for the answer to a question or setting, ns.
pub const REPLY_NS: u64 = 250_000_000;
/// Wait for the answer to `^R`, ns; the firmware needs about 1.75 s.
pub const RESTART_NS: u64 = 2_500_000_000;
/// Silence after which a stream counts as stalled, ns.
pub const SILENCE_NS: u64 = 1_000_000_000;
/// How often a box without a glove is asked again, ns.
pub const REPLUG_NS: u64 = 1_000_000_000;
/// How long each question is asked before it is skipped or the firmware restarted.
pub const ATTEMPTS: u32 = 2;
/// Restarts of the firmware before the port is closed and opened again.
pub const MAX_RESTARTS: u32 = 3;
/// Bad records in a row after which the stream is stopped and started again.
pub const MAX_BAD_RECORDS: u32 = 3;
/// Records in a row that may have lost a byte each; as many of one length, and it is a length of the glove's own.
pub const MAX_LOST_BYTES: u32 = 5;
/// Records' worth of bad bytes that it takes as well: a burst of noise with many NULs is not worth the 0.1 s.
pub const MAX_BAD_LENGTHS: usize = 5;

/// What an error code means.
#[must_use]
pub const fn error_meaning(code: u8) -> &'static str {
    match code {
        ERROR_UNKNOWN => "unknown command",
        ERROR_NUMBER => "bad number",
        ERROR_SYNC => "external synchronisation too fast",
        ERROR_NO_GLOVE => "glove not plugged into the box",
        ERROR_TOO_FAST => "sampling too fast",
        _ => "unknown code",
    }
}

/// Bytes of data in the answer to a binary question; `None` for a letter whose answer has no fixed length.
///
/// The answer has to be cut by this length: NUL occurs inside it.
#[must_use]
pub const fn query_data_length(letter: u8) -> Option<usize> {
    match letter {
        b'B' | b'D' | b'F' | b'G' | b'J' | b'L' | b'N' | b'Q' | b'R' | b'S' | b'U' | b'W'
        | b'Y' => Some(1),
        b'K' | b'M' | b'P' => Some(3),
        b'T' | b'V' => Some(4),
        _ => None,
    }
}

/// The operands of `T` for a sample rate in Hz; `None` unless 0.01 ≤ rate ≤ 1000.
#[must_use]
pub fn period_words(rate_hz: f64) -> Option<(u16, u16)> {
    if !(0.01..=1000.0).contains(&rate_hz) {
        return None;
    }
    let product = PERIOD_CLOCK_HZ / rate_hz;
    let second = (product / f64::from(u16::MAX)).ceil().max(1.0);
    // Both are in 1..=65535 by the bounds above.
    Some(((product / second).round() as u16, second as u16))
}

#[cfg(test)]
mod tests {
    use super::period_words;

    #[test]
    fn periods_are_those_of_the_manual() {
        let cases = [
            (100.0, Some((1152, 1))),
            (90.0, Some((1280, 1))),
            (45.0, Some((2560, 1))),
            (10.0, Some((11_520, 1))),
            (1.0, Some((57_600, 2))),
            (0.0, None),
            (f64::NAN, None),
        ];
        for (rate_hz, words) in cases {
            assert_eq!(period_words(rate_hz), words, "{rate_hz} Hz");
        }
    }
}
