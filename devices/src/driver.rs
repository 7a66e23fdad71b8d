//! Every kind of device by name, and how a session is made for it.

use crate::glove::calibrate::{GloveCalibration, Handedness};
use crate::glove::cyberglove::session::CyberGloveSession;
use crate::glove::cyberglove::settings::{CyberGloveSettings, Sampling};
use crate::glove::delimited::format::DelimitedSession;
use crate::glove::delimited::settings::DelimitedSettings;
use crate::glove::fivedt::format::FiveDtSession;
use crate::glove::fivedt::settings::{FiveDtSettings, Model};
use crate::glove::lucidglove::session::LucidGloveSession;
use crate::glove::lucidglove::settings::LucidGloveSettings;
use crate::glove::opencyberglove::format::{
    OpenCyberGloveSession, OpenCyberGloveSettings, RATE_HZ as OPENCYBERGLOVE_RATE_HZ,
};
use crate::session::Session;
use crate::source::rokoko::settings::RokokoSettings;
use crate::source::session::{SourceSession, station_of};
use crate::source::{rokoko, udcap, vmc};
use crate::tracker::fastrak;
use crate::tracker::fastrak::session::FastrakSession;
use crate::tracker::fastrak::settings::FastrakSettings;
use crate::tracker::flock::protocol::BAUDS as FLOCK_BAUDS;
use crate::tracker::flock::session::FlockSession;
use crate::tracker::flock::settings::FlockSettings;
use crate::tracker::isotrak::protocol::{BAUDS as ISOTRAK_BAUDS, TOTAL_RATE_HZ as ISOTRAK_RATE_HZ};
use crate::tracker::isotrak::session::IsotrakSession;
use crate::tracker::isotrak::settings::IsotrakSettings;
use crate::tracker::liberty::session::LibertySession;
use crate::tracker::liberty::settings::LibertySettings;
use crate::vrpn::session::VrpnSession;
use crate::vrpn::settings::{MAX_SENSORS, VrpnSettings};

/// A kind of device with what it is to be asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Driver {
    /// CyberGlove I, II and III.
    CyberGlove(CyberGloveSettings),
    /// LucidGloves and others that speak the OpenGloves protocol.
    LucidGlove(LucidGloveSettings),
    /// 5DT data gloves of 5, 14 and 16.
    FiveDt(FiveDtSettings),
    /// A glove that prints lines of numbers.
    Delimited(DelimitedSettings),
    /// OpenCyberGlove.
    OpenCyberGlove(OpenCyberGloveSettings),
    /// Polhemus Fastrak.
    Fastrak(FastrakSettings),
    /// Polhemus Isotrak II and 3SPACE Tracker.
    Isotrak(IsotrakSettings),
    /// Polhemus Liberty, Patriot and Latus.
    Liberty(LibertySettings),
    /// Ascension Flock of Birds.
    Flock(FlockSettings),
    /// A tracker, an analog or buttons of a VRPN server.
    Vrpn(VrpnSettings),
    /// A program that sends an avatar's bones by the VMC protocol.
    Vmc,
    /// Rokoko Studio.
    Rokoko(RokokoSettings),
    /// The bridge of UDCAP gloves.
    Udcap,
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
            Self::FiveDt(_) => "5dt",
            Self::Delimited(_) => "delimited",
            Self::OpenCyberGlove(_) => "opencyberglove",
            Self::Fastrak(_) => "fastrak",
            Self::Isotrak(_) => "isotrak",
            Self::Liberty(_) => "liberty",
            Self::Flock(_) => "flock",
            Self::Vrpn(_) => "vrpn",
            Self::Vmc => "vmc",
            Self::Rokoko(_) => "rokoko",
            Self::Udcap => "udcap",
        }
    }

    /// What the device can be to a hand.
    #[must_use]
    pub const fn role(&self) -> Role {
        match self {
            Self::CyberGlove(_)
            | Self::LucidGlove(_)
            | Self::FiveDt(_)
            | Self::Delimited(_)
            | Self::OpenCyberGlove(_)
            | Self::Udcap => Role::Glove,
            Self::Fastrak(_) | Self::Isotrak(_) | Self::Liberty(_) | Self::Flock(_) => {
                Role::Tracker
            }
            Self::Vrpn(settings) => settings.role(),
            Self::Vmc | Self::Rokoko(_) => Role::Both,
        }
    }

    /// Whether a tracker set up so reports that station, numbered from 1; false for a glove alone.
    #[must_use]
    pub fn has_station(&self, station: u16) -> bool {
        match self {
            Self::CyberGlove(_)
            | Self::LucidGlove(_)
            | Self::FiveDt(_)
            | Self::Delimited(_)
            | Self::OpenCyberGlove(_)
            | Self::Udcap => false,
            Self::Fastrak(settings) => settings.has_station(station),
            Self::Isotrak(settings) => settings.has_station(station),
            Self::Liberty(settings) => settings.has_station(station),
            Self::Flock(settings) => settings.has_station(station),
            Self::Vrpn(_) => (1..=MAX_SENSORS as u16).contains(&station),
            Self::Vmc | Self::Rokoko(_) => (1..=2).contains(&station),
        }
    }

    /// The station of a hand where none is named: a source that reports both hands has one for each.
    #[must_use]
    pub const fn usual_station(&self, hand: Handedness) -> u16 {
        match self {
            Self::Vmc | Self::Rokoko(_) => station_of(hand),
            _ => 1,
        }
    }

    /// The port that its sender usually sends to; `None` for whatever does not come as datagrams, and only as such.
    #[must_use]
    pub const fn usual_datagram_port(&self) -> Option<u16> {
        match self {
            Self::Vmc => Some(vmc::USUAL_PORT),
            Self::Rokoko(_) => Some(rokoko::USUAL_PORT),
            Self::Udcap => Some(udcap::USUAL_PORT),
            _ => None,
        }
    }

    /// Line rates of a serial device as delivered, bit/s, the likeliest first.
    #[must_use]
    pub const fn usual_bauds(&self) -> &'static [u32] {
        match self {
            // There is no line.
            Self::Vrpn(_) | Self::Vmc | Self::Rokoko(_) | Self::Udcap => &[],
            Self::CyberGlove(_) | Self::LucidGlove(_) | Self::Fastrak(_) | Self::Liberty(_) => {
                &[115_200]
            }
            // No rate of these is certain: one is a matter of switches, the other's is not known.
            Self::Flock(_) => &FLOCK_BAUDS,
            Self::Isotrak(_) => &ISOTRAK_BAUDS,
            Self::FiveDt(settings) => match settings.model {
                Model::FiveWireless => &[9_600],
                Model::Five | Model::Fourteen | Model::Sixteen => &[19_200],
            },
            // The second is what most sketches begin with.
            Self::Delimited(_) => &[115_200, 9_600],
            Self::OpenCyberGlove(_) => &[1_000_000],
        }
    }

    /// The model within the kind, as settings name it; `None` where a kind is one protocol.
    #[must_use]
    pub const fn model(&self) -> Option<&'static str> {
        match self {
            Self::FiveDt(settings) => Some(settings.model.name()),
            _ => None,
        }
    }

    /// Every kind of serial device that can be told from the others by what it sends, with what it is asked for by default.
    /// First those that speak without being asked.
    #[must_use]
    pub fn recognisable() -> Vec<Self> {
        let fivedt = |model| {
            Self::FiveDt(FiveDtSettings {
                model,
                ..FiveDtSettings::default()
            })
        };
        vec![
            Self::LucidGlove(LucidGloveSettings::default()),
            Self::OpenCyberGlove(OpenCyberGloveSettings::default()),
            fivedt(Model::Sixteen),
            fivedt(Model::FiveWireless),
            Self::CyberGlove(CyberGloveSettings::default()),
            Self::Fastrak(FastrakSettings::default()),
            Self::Isotrak(IsotrakSettings::default()),
            Self::Liberty(LibertySettings::default()),
            fivedt(Model::Five),
            Self::Flock(FlockSettings::default()),
        ]
    }

    /// Line rates at which it may be found, bit/s, the likeliest first.
    #[must_use]
    pub fn possible_bauds(&self) -> &'static [u32] {
        match self {
            Self::CyberGlove(_) => &[115_200, 38_400, 19_200, 9_600],
            Self::Fastrak(_) => &[115_200, 9_600, 19_200, 38_400],
            other => other.usual_bauds(),
        }
    }

    /// Samples per second that a device set up so sends, all its stations together; `None` where that depends on more
    /// than its settings.
    #[must_use]
    pub fn nominal_rate_hz(&self) -> Option<f64> {
        match self {
            Self::CyberGlove(settings) => match settings.sampling {
                Sampling::Stream => settings.rate_hz,
                Sampling::Poll { period_ns } => Some(1.0e9 / period_ns.max(1) as f64),
            },
            Self::Fastrak(_) => Some(fastrak::protocol::TOTAL_RATE_HZ as f64),
            Self::Isotrak(_) => Some(ISOTRAK_RATE_HZ as f64),
            Self::OpenCyberGlove(_) => Some(OPENCYBERGLOVE_RATE_HZ as f64),
            _ => None,
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
            Self::FiveDt(settings) => Box::new(FiveDtSession::new(settings.clone(), calibration)),
            Self::Delimited(settings) => {
                Box::new(DelimitedSession::new(settings.clone(), calibration))
            }
            Self::OpenCyberGlove(settings) => {
                Box::new(OpenCyberGloveSession::new(settings.clone(), calibration))
            }
            Self::Fastrak(settings) => Box::new(FastrakSession::new(settings.clone())),
            Self::Isotrak(settings) => Box::new(IsotrakSession::new(settings.clone())),
            Self::Liberty(settings) => Box::new(LibertySession::new(settings.clone())),
            Self::Flock(settings) => Box::new(FlockSession::new(settings.clone())),
            Self::Vrpn(settings) => Box::new(VrpnSession::new(settings.clone(), calibration)),
            Self::Vmc => Box::new(SourceSession::vmc(calibration)),
            Self::Rokoko(settings) => Box::new(SourceSession::rokoko(settings, calibration)),
            Self::Udcap => Box::new(SourceSession::udcap(calibration)),
        }
    }
}
