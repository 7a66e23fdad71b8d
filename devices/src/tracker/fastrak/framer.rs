//! Cuts a Fastrak's bytes into records, and finds the next one after bad bytes.
//!
//! A header can occur inside float bytes, so after losing step a record is trusted only when another record
//! begins where it ends.

use crate::buffer::StampedBuffer;
use crate::tracker::fastrak::decode::{RecordFormat, Sample, decode_record, is_header};
use crate::tracker::fastrak::protocol::{CONTROL, HEADER_LENGTH, MAX_CONTROL, N_STATIONS};
use crate::tracker::fastrak::status::{ControlRecord, parse_control};

/// What the bytes hold next.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Piece {
    Data {
        stamp_ns: u64,
        sample: Sample,
    },
    Control(ControlRecord),
    /// Bytes that are no record; `lost_step` when the decoder was in step until here.
    Skipped {
        n_bytes: u64,
        lost_step: bool,
    },
}

#[derive(Debug, Default)]
pub(super) struct Framer {
    buffer: StampedBuffer,
    in_step: bool,
}

enum Verdict {
    Record(usize, Sample),
    Control(usize, ControlRecord),
    NeedMore,
    Skip,
}

impl Framer {
    pub(super) fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.buffer.push(stamp_ns, bytes);
    }

    pub(super) fn clear(&mut self) {
        self.buffer.clear();
        self.in_step = false;
    }

    /// The next piece; `None` when more bytes are needed.
    pub(super) fn next(&mut self, format: &RecordFormat) -> Option<Piece> {
        let mut n_skipped = 0;
        loop {
            let verdict = judge(
                self.buffer.as_slice(),
                format,
                self.in_step && n_skipped == 0,
            );
            if matches!(verdict, Verdict::Skip) {
                self.buffer.consume(1);
                n_skipped += 1;
                continue;
            }
            if n_skipped > 0 {
                let lost_step = self.in_step;
                self.in_step = false;
                return Some(Piece::Skipped {
                    n_bytes: n_skipped,
                    lost_step,
                });
            }
            return match verdict {
                Verdict::Record(length, sample) => {
                    let stamp_ns = self.buffer.stamp_ns(length - 1);
                    self.buffer.consume(length);
                    self.in_step = true;
                    Some(Piece::Data { stamp_ns, sample })
                }
                Verdict::Control(length, control) => {
                    self.buffer.consume(length);
                    Some(Piece::Control(control))
                }
                Verdict::NeedMore | Verdict::Skip => None,
            };
        }
    }
}

fn judge(bytes: &[u8], format: &RecordFormat, in_step: bool) -> Verdict {
    match bytes.first() {
        None => Verdict::NeedMore,
        Some(&CONTROL) => judge_control(bytes),
        Some(_) if is_header(bytes) => judge_data(bytes, format, in_step),
        Some(_) => Verdict::Skip,
    }
}

fn judge_data(bytes: &[u8], format: &RecordFormat, in_step: bool) -> Verdict {
    let length = format.length();
    let Some(record) = bytes.get(..length) else {
        return Verdict::NeedMore;
    };
    let Ok(sample) = decode_record(record, format) else {
        return Verdict::Skip;
    };
    let after = &bytes[length..];
    let followed = is_header(after) || after.first() == Some(&CONTROL);
    match (in_step, followed) {
        (true, _) => Verdict::Record(length, sample),
        (false, false) => Verdict::Skip,
        (false, true) if after.len() < HEADER_LENGTH => Verdict::NeedMore,
        (false, true) => Verdict::Record(length, sample),
    }
}

fn judge_control(bytes: &[u8]) -> Verdict {
    let station = |byte: &u8| *byte == b' ' || (b'1'..b'1' + N_STATIONS as u8).contains(byte);
    let kind = |byte: &u8| *byte == b' ' || byte.is_ascii_alphabetic();
    if !bytes.get(1).is_none_or(station) || !bytes.get(2).is_none_or(kind) {
        return Verdict::Skip;
    }
    let window = &bytes[..bytes.len().min(MAX_CONTROL)];
    let text = |byte: &u8| matches!(byte, b' '..=b'~' | b'\r' | b'\n');
    let Some(end) = window.iter().position(|byte| *byte == b'\n' || !text(byte)) else {
        return if bytes.len() < MAX_CONTROL {
            Verdict::NeedMore
        } else {
            Verdict::Skip
        };
    };
    parse_control(&bytes[..=end])
        .map_or(Verdict::Skip, |control| Verdict::Control(end + 1, control))
}
