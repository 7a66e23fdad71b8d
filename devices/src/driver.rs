//! Every kind of device by name, and how a session is made for it.

use crate::glove::calibrate::GloveCalibration;
use crate::glove::cyberglove::session::CyberGloveSession;
use crate::glove::cyberglove::settings::CyberGloveSettings;
use crate::glove::lucidglove::session::LucidGloveSession;
use crate::glove::lucidglove::settings::LucidGloveSettings;
use crate::session::Session;
use crate::tracker::fastrak::session::FastrakSession;
use crate::tracker::fastrak::settings::FastrakSettings;

/// A kind of device with what it is to be asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Driver {
    /// CyberGlove I, II and III.
    CyberGlove(CyberGloveSettings),
    /// LucidGloves and others that speak the OpenGloves protocol.
    LucidGlove(LucidGloveSettings),
    /// Polhemus Fastrak.
    Fastrak(FastrakSettings),
}

/// What a device can be to a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It reports finger angles.
    Glove,
    /// It reports poses.
    Tracker,
    /// It reports both.
    Both,
}

impl Role {
    /// Whether finger angles come from it.
    #[must_use]
    pub const fn is_glove(self) -> bool {
        matches!(self, Self::Glove | Self::Both)
    }

    /// Whether poses come from it.
    #[must_use]
    pub const fn is_tracker(self) -> bool {
        matches!(self, Self::Tracker | Self::Both)
    }
}

impl Driver {
    /// The name of the kind, in settings, on the wire and in messages.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::CyberGlove(_) => "cyberglove",
            Self::LucidGlove(_) => "lucidglove",
            Self::Fastrak(_) => "fastrak",
        }
    }

    /// What the device can be to a hand.
    #[must_use]
    pub const fn role(&self) -> Role {
        match self {
            Self::CyberGlove(_) | Self::LucidGlove(_) => Role::Glove,
            Self::Fastrak(_) => Role::Tracker,
        }
    }

    /// Whether a tracker set up so reports that station, numbered from 1; false for a glove alone.
    #[must_use]
    pub fn has_station(&self, station: u16) -> bool {
        match self {
            Self::CyberGlove(_) | Self::LucidGlove(_) => false,
            Self::Fastrak(settings) => station
                .checked_sub(1)
                .and_then(|index| settings.stations.get(usize::from(index)))
                .is_some_and(|used| *used),
        }
    }

    /// Line rates of a serial device as delivered, bit/s, the likeliest first.
    #[must_use]
    pub const fn usual_bauds(&self) -> &'static [u32] {
        match self {
            Self::CyberGlove(_) | Self::LucidGlove(_) | Self::Fastrak(_) => &[115_200],
        }
    }

    /// A session for a port that is not open yet. A tracker has no use for the calibration.
    #[must_use]
    pub fn session(&self, calibration: GloveCalibration) -> Box<dyn Session + Send> {
        match self {
            Self::CyberGlove(settings) => {
                Box::new(CyberGloveSession::new(settings.clone(), calibration))
            }
            Self::LucidGlove(settings) => {
                Box::new(LucidGloveSession::new(settings.clone(), calibration))
            }
            Self::Fastrak(settings) => Box::new(FastrakSession::new(settings.clone())),
        }
    }
}
