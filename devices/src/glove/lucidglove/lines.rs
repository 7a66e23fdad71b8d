//! The lines of a LucidGlove: which are believed, and what they make of the newest reading.

use crate::fault::Fault;
use crate::glove::calibrate::Handedness;
use crate::glove::lucidglove::decode::{Sample, decode_line};
use crate::glove::lucidglove::posture::Shape;
use crate::glove::lucidglove::protocol::{FAMILY, LINE_END, MAX_LINE};
use crate::glove::lucidglove::range::Verdict;
use crate::glove::lucidglove::session::{LucidGloveSession, Stage, filled};
use crate::reading::GloveReading;
use crate::session::SessionState;

impl LucidGloveSession {
    /// Takes every whole line in the buffer; the newest reading among them.
    pub(super) fn take_lines(&mut self, now_ns: u64, newest: &mut Option<GloveReading>) {
        loop {
            let bytes = self.buffer.as_slice();
            let Some(end) = bytes.iter().position(|byte| *byte == LINE_END) else {
                let n_bytes = bytes.len();
                if self.mid_line {
                    self.buffer.consume(n_bytes);
                } else if n_bytes > MAX_LINE {
                    self.reject(n_bytes);
                    self.mid_line = true;
                    self.buffer.consume(n_bytes);
                }
                return;
            };
            let stamp_ns = self.buffer.stamp_ns(end);
            // A link may put blank lines between the glove's; they are not the glove's and want no answer.
            let is_blank = bytes[..end].trim_ascii().is_empty();
            if !is_blank {
                self.flow.heard(now_ns);
            }
            let line = decode_line(&bytes[..end]).ok();
            if let Some(info) = line.and_then(|line| line.info) {
                self.info.update(&info);
            }
            // The end of a sample looks like a whole one.
            if std::mem::take(&mut self.mid_line) || is_blank {
                self.buffer.consume(end + 1);
                continue;
            }
            match line.map(|line| line.sample) {
                Some(Some(sample)) if self.believes(&sample) => {
                    *newest = Some(self.accept(stamp_ns, &sample));
                }
                Some(None) => self.note_good(stamp_ns),
                _ => self.reject(end),
            }
            self.buffer.consume(end + 1);
        }
    }

    /// Whether a line that decodes is the glove's: it has the numbers that the last one had, within the range. A line
    /// that is otherwise is believed when the next one agrees.
    fn believes(&mut self, sample: &Sample) -> bool {
        match self.range.judge(sample) {
            Verdict::Fits => {}
            Verdict::Raised => self.calibration = filled(&self.worn, self.range.max()),
            Verdict::Doubtful => return false,
        }
        let shape = Shape::of(sample);
        let doubtful = self.doubtful.take();
        if self.shape.is_none_or(|known| known == shape) || doubtful == Some(shape) {
            self.shape = Some(shape);
            return true;
        }
        self.doubtful = Some(shape);
        false
    }

    fn accept(&mut self, stamp_ns: u64, sample: &Sample) -> GloveReading {
        self.posture.take(sample);
        self.note_good(stamp_ns);
        let max = self.range.max();
        GloveReading {
            sensors: self.calibration.angles(&self.posture.raw(max)),
            angles_valid: true,
            hand: self.hand(),
            controls: self.posture.controls(max),
            ..GloveReading::empty(stamp_ns, self.sequence)
        }
    }

    pub(super) fn hand(&self) -> Option<Handedness> {
        self.settings.hand.or(self.info.hand)
    }

    fn note_good(&mut self, stamp_ns: u64) {
        self.core.stats.records += 1;
        self.in_step = true;
        self.last_good_ns = stamp_ns;
        self.stage = Stage::Running;
        let fault = self.range.is_set_wrong().then(|| Fault::Reported {
            device: FAMILY,
            code: format!("numbers beyond {}", self.range.max()),
            meaning: "its setting `max` is too small",
        });
        self.core.enter(stamp_ns, SessionState::Running, fault);
    }

    /// A line that cannot be the glove's: the first `n_bytes` of the buffer.
    fn reject(&mut self, n_bytes: usize) {
        let shown = n_bytes.min(64);
        self.bad_bytes.clear();
        self.bad_bytes
            .extend_from_slice(&self.buffer.as_slice()[..shown]);
        // What comes before the first good line is the board's boot text.
        if !matches!(self.stage, Stage::Listening { .. }) {
            self.core.stats.dropped_records += 1;
            self.core.stats.resyncs += u64::from(self.in_step);
        }
        self.in_step = false;
    }
}
