//! The wire as a table: single bytes with raw operands, no line ends, no acknowledgements.

/// Line rates in the order in which they are worth a try, bit/s (switches on each unit choose one); 8 data bits, no
/// parity, 1 stop bit.
pub const BAUDS: [u32; 5] = [115_200, 38_400, 57_600, 19_200, 9_600];
/// Addresses on one bus, from 1; an extended-range controller uses one up.
pub const N_ADDRESSES: usize = 14;

/// Send one record of each bird; also ends a stream.
pub const POINT: u8 = b'B';
/// Send records until [`POINT`].
pub const STREAM: u8 = b'@';
/// Run.
pub const RUN: u8 = b'F';
/// Sleep.
pub const SLEEP: u8 = b'G';
/// Records of position and angles.
pub const POSITION_ANGLES: u8 = b'Y';
/// Records of position and quaternion.
pub const POSITION_QUATERNION: u8 = b']';
/// Button mode; the operand is 1 for a button byte in each record.
pub const BUTTON_MODE: u8 = b'M';
/// Hemisphere; the operands are axis and sign.
pub const HEMISPHERE: u8 = b'L';
/// A record of a stream at each measurement; `R`, `S` and `T` are every 2nd, 8th and 32nd.
pub const EVERY_MEASUREMENT: u8 = b'Q';
/// Changes a parameter.
pub const CHANGE: u8 = b'P';
/// Examines a parameter.
pub const EXAMINE: u8 = b'O';
/// What is added to an address for the prefix that sends the next command there.
pub const TO_BIRD: u8 = 0xF0;

/// Parameter: configure the bus for so many units.
pub const AUTO_CONFIGURE: u8 = 0x32;
/// Parameter: one point or stream command for the whole group.
pub const GROUP_MODE: u8 = 0x23;
/// Parameter: firmware revision, 2 bytes.
pub const FIRMWARE: u8 = 0x01;
/// Parameter: frequency of the crystal in MHz, 2 bytes.
pub const CRYSTAL: u8 = 0x02;
/// Parameter: count of the measurement rate, 2 bytes.
pub const RATE: u8 = 0x06;
/// Parameter: the last error, 1 byte; reading clears it.
pub const ERROR: u8 = 0x0A;
/// Parameter: name of the model, 10 bytes.
pub const MODEL: u8 = 0x0F;
/// Parameter: status of the bus, one byte for each of 14 addresses.
pub const BUS: u8 = 0x24;

/// Bit of a unit's byte of the bus status: it answers and flies.
pub const UNIT_FLIES: u8 = 1 << 7;
/// Bit of a unit's byte of the bus status: it runs.
pub const UNIT_RUNS: u8 = 1 << 6;
/// Bit of a unit's byte of the bus status: it has a sensor.
pub const UNIT_HAS_SENSOR: u8 = 1 << 5;

/// Bits that a button byte may have.
pub const BUTTON_BITS: u8 = 0x70;
/// Positions, angles and quaternions are fractions of full range in this many steps.
pub const FULL_RANGE: f64 = 32_768.0;

/// Length of the answer to examining a parameter; `None` for those that this driver does not ask for.
#[must_use]
pub const fn answer_length(parameter: u8) -> Option<usize> {
    match parameter {
        FIRMWARE | CRYSTAL | RATE => Some(2),
        ERROR => Some(1),
        MODEL => Some(10),
        BUS => Some(N_ADDRESSES),
        _ => None,
    }
}

/// Measurements in a second, from the answers to [`RATE`] and [`CRYSTAL`]; `None` when one of them is 0.
#[must_use]
pub fn rate_hz(count: u16, crystal_mhz: u16) -> Option<f64> {
    (count > 0 && crystal_mhz > 0).then(|| {
        let period_ms = 4.0 * f64::from(count) * (8.0 / f64::from(crystal_mhz)) / 1000.0 + 0.3;
        1000.0 / period_ms
    })
}

/// What an error code means.
#[must_use]
pub const fn error_meaning(code: u8) -> &'static str {
    match code {
        1 => "memory fault",
        2 => "settings could not be written",
        3 => "EEPROM fault",
        4 => "transmitter not configured",
        5 => "receiver not configured",
        6 => "invalid command",
        7 => "this unit is not the master",
        8 => "no bird answers on the bus",
        9 => "a bird is not initialised",
        10 => "bus reception fault",
        11 => "serial line overrun or framing fault",
        12 | 13 => "no answer of a bird on the bus",
        14..=16 => "bus fault while running",
        17 => "no data from a bird",
        18 => "wrong line rate",
        19 => "a bird does not acknowledge",
        20..=27 => "processor fault; switch the unit off and on",
        28 => "no CRT synchronisation",
        29 => "transmitter not active",
        30 => "extended-range transmitter missing",
        31 => "processor time overflow",
        32 => "sensor saturated: too near the transmitter",
        33 => "a bird is not configured",
        34 => "watchdog",
        35 => "too hot",
        _ => "unknown error code",
    }
}
