//! The packet: 132 bytes, little-endian, without a header. It is found by its CRC.

/// Length of a packet.
pub const LENGTH: usize = 132;
/// Stretch sensors.
pub const N_VALUES: usize = 19;
/// Greatest value of a stretch sensor.
pub const RAW_MAX: f64 = 16_380.0;
/// Bytes from the front that the CRC guards; eight unused ones follow.
const GUARDED: usize = 120;
/// Where the time stamp is.
const TIME: usize = 116;

/// What is used of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet {
    /// Stretch values in the order of the packet.
    pub values: [i32; N_VALUES],
    /// The glove's own time, ms.
    pub time_ms: u32,
}

impl Packet {
    /// From 132 bytes; `None` when the CRC is wrong.
    #[must_use]
    pub fn decode(bytes: &[u8; LENGTH]) -> Option<Self> {
        let sent = u32::from_le_bytes(*bytes.last_chunk()?);
        if crc32(&bytes[..GUARDED]) != sent {
            return None;
        }
        let mut values = [0; N_VALUES];
        for (value, word) in values.iter_mut().zip(bytes.chunks_exact(4)) {
            *value = i32::from_le_bytes(*word.first_chunk()?);
        }
        let time_ms = u32::from_le_bytes(*bytes[TIME..].first_chunk()?);
        Some(Self { values, time_ms })
    }

    /// The 132 bytes, with inertial sensors at rest (1 g along z, 25 °C).
    #[must_use]
    pub fn encode(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        for (word, value) in bytes.chunks_exact_mut(4).zip(self.values) {
            word.copy_from_slice(&value.to_le_bytes());
        }
        let at_rest = [0.0, 0.0, 9.81, 0.0, 0.0, 0.0, 20.0, 0.0, -40.0, 25.0_f32];
        for (word, value) in bytes[4 * N_VALUES..TIME].chunks_exact_mut(4).zip(at_rest) {
            word.copy_from_slice(&value.to_le_bytes());
        }
        bytes[TIME..GUARDED].copy_from_slice(&self.time_ms.to_le_bytes());
        let crc = crc32(&bytes[..GUARDED]);
        bytes[LENGTH - 4..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }
}

/// CRC-32 by the polynomial of zlib, bits reversed.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc = (crc >> 8) ^ TABLE[usize::from(crc as u8 ^ byte)];
    }
    !crc
}

const TABLE: [u32; 256] = table();

const fn table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut index = 0;
    while index < table.len() {
        let mut crc = index as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 {
                (crc >> 1) ^ 0xEDB8_8320
            } else {
                crc >> 1
            };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
}
