//! The wire as a table. Commands do not mind case, and all but [`POLL`] end with CR.

/// Line rates in the order in which they are worth a try, bit/s; 8 data bits, no parity, 1 stop bit.
pub const BAUDS: [u32; 3] = [115_200, 57_600, 9_600];
/// Most stations of one unit, numbered from 1.
pub const N_STATIONS: usize = 16;

/// Send one frame for each station; also ends a stream.
pub const POLL: u8 = b'P';
/// Send frames until [`POLL`].
pub const CONTINUOUS: &[u8] = b"C\r";
/// ASCII output.
pub const ASCII: &[u8] = b"F0\r";
/// Binary output.
pub const BINARY: &[u8] = b"F1\r";
/// Centimetres.
pub const CENTIMETRES: &[u8] = b"U1\r";
/// Set the counters of time and frames to 0.
pub const ZERO_COUNTERS: &[u8] = b"Q0\r";
/// `^V`: who are you?
pub const WHO_AM_I: &[u8] = b"\x16\r";
/// `^E0`: no echo.
pub const NO_ECHO: &[u8] = b"\x050\r";
/// `^Y`: reset, about 10 s.
pub const RESET: &[u8] = b"\x19\r";
/// What a Patriot prints after its reset.
pub const READY: &[u8] = b"Patriot Ready!";

/// Bytes before the items of a frame.
pub const HEADER_LENGTH: usize = 8;
/// Error byte of a good frame.
pub const GOOD: u8 = b' ';
/// The trailer of our lists.
pub const TRAILER: u8 = b' ';
/// Shortest text that counts as an answer to [`WHO_AM_I`]; units send 196 to 247 bytes.
pub const MIN_WHO_LENGTH: usize = 100;

/// The units that speak this.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// 4 to 16 stations, 240 frames/s each.
    #[default]
    Liberty,
    /// 2 stations, 60 frames/s each.
    Patriot,
    /// Wireless markers.
    Latus,
}

impl Model {
    /// Every model.
    pub const ALL: [Self; 3] = [Self::Liberty, Self::Patriot, Self::Latus];

    /// The family's name in messages.
    #[must_use]
    pub const fn family(self) -> &'static str {
        match self {
            Self::Liberty => "Liberty",
            Self::Patriot => "Patriot",
            Self::Latus => "Latus",
        }
    }

    /// The first two bytes of its frames.
    #[must_use]
    pub const fn preamble(self) -> [u8; 2] {
        match self {
            Self::Liberty => *b"LY",
            Self::Patriot => *b"PA",
            Self::Latus => *b"LU",
        }
    }

    /// The model of a preamble; `None` for letters that are not known.
    #[must_use]
    pub fn from_preamble(letters: [u8; 2]) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|model| model.preamble() == letters)
    }

    /// Frames of one station in a second; `None` where it is not known.
    #[must_use]
    pub const fn rate_hz(self) -> Option<u64> {
        match self {
            Self::Liberty => Some(240),
            Self::Patriot => Some(60),
            Self::Latus => None,
        }
    }
}
