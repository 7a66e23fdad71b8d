//! A LucidGlove: a board that streams lines, waits for lines, and turns servos. **No real glove has been compared with
//! it.**

use std::collections::VecDeque;

use crate::emulate::Emulator;
use crate::emulate::line_fault::LineFaults;
use crate::emulate::lucidglove_line::{ControlsNow, FingersNow, sample_line};
use crate::glove::calibrate::Handedness;
use crate::glove::lucidglove::protocol::{Encoding, LINE_END, MAX_12_BITS, N_FINGERS};
use crate::glove::sensor::GloveSensor;

/// Pause between two rounds of the firmware, ns.
const LOOP_NS: u64 = 1_000_000;
/// How long the firmware waits for a line of the host, ns.
const READ_WAITS_NS: u64 = 1_000_000_000;
/// How far back the lines go that a host gets at once, ns.
const MAX_BACKLOG_NS: u64 = 50_000_000;
/// How long the board boots, ns.
const BOOT_NS: u64 = 2_000_000_000;
/// Time of a byte on the line at 115200 bit/s, ns: the firmware waits until its line is out.
const BYTE_NS: u64 = 86_806;
/// The longest line that the firmware reads; the rest is taken for the next one.
const MAX_HEARD: usize = 100;
/// Bytes that wait to be read; what comes beyond is lost.
const MAX_INPUT: usize = 256;
/// Shorter lines are ignored.
const LEAST_HEARD: usize = 5;
/// Commands that are kept for whoever looks.
const KEPT: usize = 4096;
/// What an ESP32 says when it is reset.
const BOOT_TEXT: &[u8] = b"ets Jun  8 2016 00:22:57\r\n\r\n\
rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\n\
configsip: 0, SPIWP:0xee\r\n\
clk_drv:0x00,q_drv:0x00,d_drv:0x00,cs0_drv:0x00,hd_drv:0x00,wp_drv:0x00\r\n\
mode:DIO, clock div:1\r\n\
load:0x3fff0018,len:4\r\nload:0x3fff001c,len:1044\r\nload:0x40078000,len:8896\r\n\
entry 0x400806b4\r\n";

/// How a glove was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LucidGloveBuild {
    /// How it says what.
    pub encoding: Encoding,
    /// Its number for a full curl: 4095 for an ESP32, 1023 for an AVR.
    pub max: u16,
    /// Whether it has splay sensors.
    pub splay: bool,
    /// Whether it has a sensor at each joint. Lines are then written as the stand-alone library does.
    pub joints: bool,
    /// What ends its lines: `\n`, `\r\n`, or `\n\r\n` over Wi-Fi.
    pub line_end: &'static str,
    /// Whether it has servos, and so waits for a line of the host after each of its own.
    pub force_feedback: bool,
    /// The hand that its information line names; `None` is a firmware without such a line.
    pub info: Option<Handedness>,
}

impl Default for LucidGloveBuild {
    /// An ESP32 with five curls and servos, as the published firmware makes it.
    fn default() -> Self {
        Self {
            encoding: Encoding::Alpha,
            max: MAX_12_BITS,
            splay: false,
            joints: false,
            line_end: "\n",
            force_feedback: true,
            info: None,
        }
    }
}

/// A line that the host sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heard {
    /// When its last byte came, ns.
    pub at_ns: u64,
    /// Its bytes, without the line feed.
    pub line: Vec<u8>,
}

/// A LucidGlove as a state machine, seen from its side of the line.
#[derive(Debug, Clone)]
pub struct LucidGloveEmulator {
    /// What goes wrong on the line.
    pub faults: LineFaults,
    build: LucidGloveBuild,
    fingers: FingersNow,
    controls: ControlsNow,
    output: Vec<u8>,
    /// Bytes of the host that make no line yet.
    input: Vec<u8>,
    /// Lines of the host that the firmware has not read yet.
    unread: VecDeque<Vec<u8>>,
    heard: VecDeque<Heard>,
    n_blank: u64,
    limits: [i32; N_FINGERS],
    vibrations: Vec<String>,
    /// When the firmware begins its next round, ns.
    round_ns: u64,
    /// Until when it waits for the host, ns; `None` while it does not.
    waits_until_ns: Option<u64>,
    /// Whether the information line was sent.
    introduced: bool,
}

impl LucidGloveEmulator {
    /// A straight hand in a glove that is running.
    #[must_use]
    pub fn new(build: LucidGloveBuild) -> Self {
        Self {
            faults: LineFaults::none(),
            build,
            fingers: FingersNow::straight(build.max),
            controls: ControlsNow::resting(build.max),
            output: Vec::new(),
            input: Vec::new(),
            unread: VecDeque::new(),
            heard: VecDeque::new(),
            n_blank: 0,
            limits: [0; N_FINGERS],
            vibrations: Vec::new(),
            round_ns: 0,
            waits_until_ns: None,
            introduced: false,
        }
    }

    /// Bends whole fingers: counts of thumb, index, middle, ring, little.
    pub fn set_curls(&mut self, curls: [u16; N_FINGERS]) {
        self.fingers.set_curls(curls, self.build.max);
    }

    /// Bends the glove: raw counts by wire slot, as [`GloveCalibration::counts`] gives them with the defaults of
    /// [`default_of`](crate::glove::lucidglove::defaults::default_of). A finger's curl is the mean of its joints.
    ///
    /// [`GloveCalibration::counts`]: crate::glove::calibrate::GloveCalibration::counts
    pub fn set_slots(&mut self, raw: &[u16; GloveSensor::N_SLOTS]) {
        self.fingers.set_slots(raw, self.build.max);
    }

    /// Moves the stick, x and y in counts, and presses buttons, by the bits of the protocol.
    pub const fn set_controls(&mut self, stick: [u16; 2], buttons: u32) {
        self.controls = ControlsNow { stick, buttons };
    }

    /// Resets the board, in mid-line if it is sending: boot text, then the stream begins again with free servos.
    pub fn reset(&mut self, now_ns: u64) {
        self.output.extend_from_slice(BOOT_TEXT);
        self.input.clear();
        self.unread.clear();
        self.limits = [0; N_FINGERS];
        self.introduced = false;
        self.waits_until_ns = None;
        self.round_ns = now_ns + BOOT_NS;
    }

    /// The newest commands of the host, oldest first; blank lines are only counted.
    #[must_use]
    pub const fn heard(&self) -> &VecDeque<Heard> {
        &self.heard
    }

    /// Lines without anything in them so far.
    #[must_use]
    pub const fn n_blank(&self) -> u64 {
        self.n_blank
    }

    /// Lines of the host that wait to be read by the firmware.
    #[must_use]
    pub fn n_unread(&self) -> usize {
        self.unread.len()
    }

    /// The limits that the firmware wrote last, thumb to little finger: 0 is free, 1000 is blocked.
    #[must_use]
    pub const fn limits(&self) -> [i32; N_FINGERS] {
        self.limits
    }

    /// The angles of the servos, degrees, of a glove whose servos are not flipped.
    #[must_use]
    pub fn servos_deg(&self) -> [f64; N_FINGERS] {
        self.limits.map(|limit| f64::from(limit) * 180.0 / 1000.0)
    }

    /// The vibrations that were asked for so far, as text.
    #[must_use]
    pub fn vibrations(&self) -> &[String] {
        &self.vibrations
    }

    fn say(&mut self, bytes: Vec<u8>) -> u64 {
        let n_bytes = bytes.len() as u64;
        let bytes = self.faults.apply(bytes);
        self.output.extend(bytes);
        n_bytes * BYTE_NS
    }

    /// Sends a sample, and the information before the first.
    fn speak(&mut self) -> u64 {
        let mut time_ns = 0;
        if let Some(hand) = self.build.info.filter(|_| !self.introduced) {
            let hand = u8::from(hand == Handedness::Right);
            let text = format!("(ZV)5(ZG)0(ZH){hand}{}", self.build.line_end);
            time_ns += self.say(text.into_bytes());
        }
        self.introduced = true;
        let mut line = sample_line(&self.build, &self.fingers, &self.controls);
        line.push_str(self.build.line_end);
        time_ns + self.say(line.into_bytes())
    }

    /// What the firmware does with a line: the same as the published one, which writes every servo for any line that
    /// is long enough, with 0 for a finger that is not named.
    fn obey(&mut self, line: &[u8]) {
        if line.len() < LEAST_HEARD || !self.build.force_feedback {
            return;
        }
        let text = String::from_utf8_lossy(line).into_owned();
        if text.starts_with('F') && self.vibrations.len() < KEPT {
            self.vibrations.push(text.clone());
        }
        let mut limits = [0; N_FINGERS];
        match self.build.encoding {
            Encoding::Alpha => {
                for (limit, letter) in limits.iter_mut().zip('A'..) {
                    *limit = text.split_once(letter).map_or(0, |(_, rest)| leading(rest));
                }
            }
            Encoding::Legacy => {
                for (limit, field) in limits.iter_mut().zip(text.split('&')) {
                    *limit = leading(field);
                }
            }
        }
        for (limit, wanted) in self.limits.iter_mut().zip(limits) {
            if wanted >= 0 {
                *limit = wanted;
            }
        }
    }

    fn hear(&mut self, now_ns: u64, line: Vec<u8>) {
        if line.is_empty() {
            self.n_blank += 1;
        } else {
            if self.heard.len() == KEPT {
                self.heard.pop_front();
            }
            self.heard.push_back(Heard {
                at_ns: now_ns,
                line: line.clone(),
            });
        }
        let n_waiting: usize = self.unread.iter().map(|line| line.len() + 1).sum();
        if n_waiting + line.len() < MAX_INPUT {
            self.unread.push_back(line);
        }
    }
}

impl Emulator for LucidGloveEmulator {
    fn push(&mut self, now_ns: u64, bytes: &[u8]) {
        if self.faults.is_frozen() {
            return;
        }
        for byte in bytes {
            if *byte != LINE_END {
                self.input.push(*byte);
            }
            if *byte == LINE_END || self.input.len() == MAX_HEARD {
                let line = std::mem::take(&mut self.input);
                self.hear(now_ns, line);
            }
        }
    }

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        // Who has not asked for long gets no backlog.
        self.round_ns = self.round_ns.max(now_ns.saturating_sub(MAX_BACKLOG_NS));
        loop {
            if let Some(until_ns) = self.waits_until_ns {
                match self.unread.pop_front() {
                    Some(line) => {
                        self.obey(&line);
                        self.round_ns = self.round_ns.max(now_ns) + LOOP_NS;
                    }
                    None if until_ns <= now_ns => self.round_ns = until_ns + LOOP_NS,
                    None => break,
                }
                self.waits_until_ns = None;
            }
            if self.round_ns > now_ns {
                break;
            }
            let sending_ns = self.speak();
            self.round_ns += sending_ns;
            if self.build.force_feedback {
                self.waits_until_ns = Some(self.round_ns + READ_WAITS_NS);
            } else {
                self.unread.clear();
                self.round_ns += LOOP_NS;
            }
        }
        std::mem::take(&mut self.output)
    }

    fn deadline(&self) -> Option<u64> {
        let due_now = !self.output.is_empty() || !self.unread.is_empty();
        let own_ns = self.waits_until_ns.unwrap_or(self.round_ns);
        Some(if due_now { 0 } else { own_ns })
    }
}

/// The whole number at the front of a text as C's `atoi` reads it: 0 where there is none.
fn leading(text: &str) -> i32 {
    let text = text.trim_start();
    let n_sign = usize::from(text.starts_with('-'));
    let n_digits = text[n_sign..]
        .bytes()
        .take_while(u8::is_ascii_digit)
        .count();
    text[..n_sign + n_digits].parse().unwrap_or(0)
}
