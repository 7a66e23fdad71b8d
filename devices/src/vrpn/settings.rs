//! What the user may choose about a VRPN device.

use super::address::Address;
use crate::driver::Role;
use crate::glove::sensor::GloveSensor;
use crate::tracker::space::TrackerSpace;

/// Sensors of a tracker beyond this number are not taken: nobody has so many, and each is remembered.
pub const MAX_SENSORS: i32 = 1024;

/// What the user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct VrpnSettings {
    /// The device and its server.
    pub address: Address,
    /// Which way the axes of its poses point: VRPN leaves that to the device.
    pub space: TrackerSpace,
    /// Metres per unit of its positions: 1 by VRPN's own rule, 0.01 for a server that sends centimetres.
    pub scale: f64,
    /// What each analog channel measures, from channel 0; `None` is of no use here. Empty: it is no glove.
    pub channels: Vec<Option<GloveSensor>>,
    /// What the numbers of the channels are.
    pub unit: ChannelUnit,
}

/// What the numbers of an analog device are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ChannelUnit {
    /// Angles in degrees.
    #[default]
    Degrees,
    /// Angles in radians.
    Radians,
    /// Counts, to be calibrated.
    Raw,
}

impl VrpnSettings {
    /// A tracker in y-up metres.
    #[must_use]
    pub const fn tracker(address: Address) -> Self {
        Self {
            address,
            space: TrackerSpace::YUp,
            scale: 1.0,
            channels: Vec::new(),
            unit: ChannelUnit::Degrees,
        }
    }

    /// What it can be to a hand: a tracker always, a glove when channels are mapped.
    #[must_use]
    pub const fn role(&self) -> Role {
        if self.channels.is_empty() {
            Role::Tracker
        } else {
            Role::Both
        }
    }

    /// Whether any channel is mapped to a sensor of a glove.
    #[must_use]
    pub fn is_glove(&self) -> bool {
        self.channels.iter().any(Option::is_some)
    }
}
