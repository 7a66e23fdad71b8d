//! The Fastrak's wire as a table: commands, record items, times. From the Fastrak manual, revision G, as cited by
//! several independent open drivers.

/// Device family, as it is named in events.
pub const FAMILY: &str = "Fastrak";
/// Line rates in the order in which they are worth a try, bit/s; 8 data bits, no parity, 1 stop bit.
pub const BAUDS: [u32; 4] = [115_200, 9_600, 38_400, 19_200];
/// Stations (receivers) of one unit, numbered from 1.
pub const N_STATIONS: usize = 4;

/// First byte of a data record.
pub const DATA: u8 = b'0';
/// First byte of every other record: status, answers, errors.
pub const CONTROL: u8 = b'2';
/// Error byte of a good record.
pub const GOOD: u8 = b' ';
/// Bytes before the items of a data record: `0`, station, error.
pub const HEADER_LENGTH: usize = 3;

/// Send one record per active station.
pub const POLL: u8 = b'P';
/// Send records until [`QUIET`].
pub const CONTINUOUS: u8 = b'C';
/// Stop sending records.
pub const QUIET: u8 = b'c';
/// ASCII output.
pub const ASCII: u8 = b'F';
/// Binary output.
pub const BINARY: u8 = b'f';
/// Inches, the power-on default.
pub const INCHES: u8 = b'U';
/// Centimetres.
pub const CENTIMETRES: u8 = b'u';
/// Send a status record.
pub const STATUS: u8 = b'S';
/// `^Y`: re-initialise, about 10 s.
pub const REINITIALISE: u8 = 0x19;
/// `^K`: save the settings.
pub const SAVE: u8 = 0x0B;
/// Restore the factory's settings.
pub const DEFAULTS: u8 = b'W';
/// `^S`: suspend output.
pub const SUSPEND: u8 = 0x13;
/// `^Q`: resume output.
pub const RESUME: u8 = 0x11;

/// Bit of the status flags: binary output.
pub const FLAG_BINARY: u16 = 1;
/// Bit of the status flags: centimetres.
pub const FLAG_CENTIMETRES: u16 = 1 << 1;
/// Bit of the status flags: continuous output.
pub const FLAG_CONTINUOUS: u16 = 1 << 3;
/// The flags that read as set on every unit known.
pub const FLAGS_ALWAYS: u16 = 0x3F0;

/// Length of the status record; InterSense units send 54.
pub const STATUS_LENGTH: usize = 55;
/// Longest record that is not data; the alignment answer has 68 bytes.
pub const MAX_CONTROL: usize = 128;

/// Position in m for a full 16-bit value of 32768: 300 cm.
pub const METRES_PER_PACKED_RANGE: f64 = 3.0;

/// Records in a second, shared by the active stations.
pub const TOTAL_RATE_HZ: u64 = 120;

/// Wait after a reset while old input is thrown away, ns.
pub const DRAIN_NS: u64 = 100_000_000;
/// Wait for the status record, ns; it takes 57 ms at 9600 bit/s.
pub const STATUS_NS: u64 = 500_000_000;
/// Times that the settings are sent before a refusal counts.
pub const ATTEMPTS: u32 = 3;

/// What is sent at each attempt to start a unit, and how often it is then asked for its status: ever stronger. The first
/// carriage return ends a command that another program has begun, which would otherwise take what follows for its
/// operands. A unit that re-initialises is deaf for 10 s.
pub const RESETS: [(&[u8], usize); 6] = [
    (b"\rc", 1),
    (b"c\r", 5),
    (b"c\r\x19", 21),
    (b"c\r\x19", 21),
    (b"c\r\x19t", 21),
    (b"c\r\x19tY", 21),
];

/// What an error letter of a record or a status means.
#[must_use]
pub const fn error_meaning(letter: u8) -> &'static str {
    match letter {
        b'a'..=b'g' => "self-calibration fault",
        b'j' => "signal saturated: receiver too near the transmitter",
        b'k' => "signal too low: receiver too far away or unplugged",
        b'l' => "maximum element is zero",
        b'm' => "EEPROM fault",
        b's' => "unit was reset",
        b't' | b'u' => "compensation fault",
        b'v' => "no CRT synchronisation",
        b'w' => "EEPROM write fault",
        b'x' => "outside the motion box",
        b'y' => "outside the attitude envelope",
        _ => "unknown error letter",
    }
}

/// Whether data with this error letter are still good: a limit of the user's own that was left, or a note about
/// the unit rather than about the receiver.
#[must_use]
pub const fn data_usable(letter: u8) -> bool {
    matches!(letter, b's' | b'w' | b'x' | b'y')
}
