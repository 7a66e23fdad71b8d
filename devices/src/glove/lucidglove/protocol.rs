//! The wire as a table: keys, limits, times, and the lines that go back to the glove.
//!
//! From the firmware, the SteamVR driver and the stand-alone library as published. What builders changed since is
//! their own; nothing here depends on the order of keys.

use crate::feedback::Vibration;

/// Device family, as it is named in events.
pub const FAMILY: &str = "LucidGlove";
/// The line rate of the firmware, bit/s; 8 data bits, no parity, 1 stop bit.
pub const BAUD: u32 = 115_200;

/// Fingers: thumb, index, middle, ring, little.
pub const N_FINGERS: usize = 5;
/// Joints of a finger, from the base: metacarpal, MCP, PIP, DIP; of the thumb CMC, MCP, IP and one unused.
pub const N_JOINTS: usize = 4;

/// Ends a line, in both directions.
pub const LINE_END: u8 = b'\n';
/// Longest line that is believed, bytes; one with all splays and joints has about 290.
pub const MAX_LINE: usize = 512;
/// Greatest number of any key.
pub const MAX_NUMBER: u32 = 65_535;
/// Full curl on a board with a converter of 10 bits (AVR).
pub const MAX_10_BITS: u16 = 1_023;
/// Full curl on a board with a converter of 12 bits (ESP32).
pub const MAX_12_BITS: u16 = 4_095;

/// Bit of [`Controls::buttons`](crate::reading::Controls::buttons): the trigger button, or the trigger gesture (`I`).
pub const BUTTON_TRIGGER: u32 = 1 << 0;
/// Bit: A (`J`).
pub const BUTTON_A: u32 = 1 << 1;
/// Bit: B (`K`).
pub const BUTTON_B: u32 = 1 << 2;
/// Bit: menu (`N`).
pub const BUTTON_MENU: u32 = 1 << 3;
/// Bit: the stick is pressed (`H`).
pub const BUTTON_STICK: u32 = 1 << 4;
/// Bit: the grab gesture, found by the firmware (`L`).
pub const BUTTON_GRAB: u32 = 1 << 5;
/// Bit: the pinch gesture, found by the firmware (`M`).
pub const BUTTON_PINCH: u32 = 1 << 6;
/// Bit: the firmware's own calibration is asked for (`O`).
pub const BUTTON_CALIBRATE: u32 = 1 << 7;

/// Index into [`Controls::axes`](crate::reading::Controls::axes): the stick to the side, -1 to 1.
pub const AXIS_STICK_X: usize = 0;
/// Index: the stick forward and back, -1 to 1.
pub const AXIS_STICK_Y: usize = 1;
/// Index: the analogue trigger, 0 to 1.
pub const AXIS_TRIGGER: usize = 2;

/// The flags of the alpha encoding with their bits.
pub const FLAGS: [(u8, u32); 8] = [
    (b'H', BUTTON_STICK),
    (b'I', BUTTON_TRIGGER),
    (b'J', BUTTON_A),
    (b'K', BUTTON_B),
    (b'L', BUTTON_GRAB),
    (b'M', BUTTON_PINCH),
    (b'N', BUTTON_MENU),
    (b'O', BUTTON_CALIBRATE),
];
/// The last six fields of the legacy encoding with their bits.
pub const LEGACY_FLAGS: [u32; 6] = [
    BUTTON_STICK,
    BUTTON_TRIGGER,
    BUTTON_A,
    BUTTON_B,
    BUTTON_GRAB,
    BUTTON_PINCH,
];
/// Least and greatest number of fields of the legacy encoding.
pub const LEGACY_FIELDS: (usize, usize) = (5, 13);

/// How long a board may take after its port is opened, ns: raising DTR resets many of them, and they boot for 2 s.
pub const LISTEN_NS: u64 = 5_000_000_000;
/// Time without a good line after which the glove counts as stalled, ns. A firmware that waits in vain for a line of
/// ours still sends one in a second.
pub const SILENCE_NS: u64 = 1_500_000_000;
/// How long a stalled glove is listened to before its port is opened again, ns: longer than it takes to boot.
pub const STALL_NS: u64 = 4_000_000_000;

/// How one line says what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Encoding {
    /// Keys with numbers: `A0B2047`.
    #[default]
    Alpha,
    /// Fields: `0&2047`.
    Legacy,
}

/// The line that sets how far each finger is stopped: thumb, index, middle, ring, little, 0 is free.
///
/// Always all five: the firmware takes a missing one for 0.
#[must_use]
pub fn limits_line(encoding: Encoding, limits: [u16; N_FINGERS]) -> Vec<u8> {
    let [a, b, c, d, e] = limits;
    match encoding {
        Encoding::Alpha => format!("A{a}B{b}C{c}D{d}E{e}\n"),
        Encoding::Legacy => format!("{a}&{b}&{c}&{d}&{e}\n"),
    }
    .into_bytes()
}

/// The line that begins a vibration: frequency in Hz, duration in s, amplitude 0 to 1.
#[must_use]
pub fn vibration_line(vibration: &Vibration) -> Vec<u8> {
    let Vibration {
        frequency_hz,
        duration_s,
        amplitude,
    } = vibration;
    format!("F{frequency_hz:.2}G{duration_s:.2}H{amplitude:.2}\n").into_bytes()
}

/// What leaves every finger free.
#[must_use]
pub const fn free_line(encoding: Encoding) -> &'static [u8] {
    match encoding {
        Encoding::Alpha => b"A0B0C0D0E0\n",
        Encoding::Legacy => b"0&0&0&0&0\n",
    }
}
