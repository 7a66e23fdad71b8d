//! What sources of hands share: counters, silence, and readings from what their datagrams hold.

use std::fmt;

use nalgebra::{Isometry3, Point3};

use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::glove::calibrate::{GloveCalibration, Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::reading::{GloveReading, TrackerReading};
use crate::session::{DeviceEvent, DeviceInfo, Session, SessionState};
use crate::source::rokoko::decode::Rokoko;
use crate::source::rokoko::settings::RokokoSettings;
use crate::source::udcap::Udcap;
use crate::source::vmc::decode::Vmc;
use crate::tracker::space::TrackerSpace;

/// Without a hand for so long a source is stalled, ns. The slowest sends 30 frames a second.
const SILENCE_NS: u64 = 1_000_000_000;

/// The station of a source's wrist.
#[must_use]
pub const fn station_of(hand: Handedness) -> u16 {
    match hand {
        Handedness::Left => 1,
        Handedness::Right => 2,
    }
}

/// One hand of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FoundHand {
    /// Which.
    pub(super) hand: Handedness,
    /// When the last of it was read, ns.
    pub(super) stamp_ns: u64,
    /// What each sensor reads by slot, before calibration; `None` when there are no fingers.
    pub(super) raw: Option<[Option<f64>; GloveSensor::N_SLOTS]>,
    /// `world_from_wrist` in the sender's space with y up, m.
    pub(super) world_from_wrist: Option<Isometry3<f64>>,
    /// The sender's own time, in its ticks.
    pub(super) device_ticks: Option<u64>,
}

/// What a kind of source differs in.
pub(super) trait Decoder: fmt::Debug + Send {
    /// Its name in messages.
    fn family(&self) -> &'static str;

    /// The calibration of a sensor that the wearer's file does not name.
    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration;

    /// Takes a datagram; the hands that it completes go to `found`. What is wrong with it otherwise.
    fn take(
        &mut self,
        stamp_ns: u64,
        datagram: &[u8],
        found: &mut Vec<FoundHand>,
    ) -> Result<(), String>;

    /// What the sender is found to be, whenever that has changed.
    fn news(&mut self) -> Option<DeviceInfo>;

    /// The link was lost.
    fn forget(&mut self);
}

/// A source of hands as a state machine. **Emulated, not yet tried with a real sender.**
#[derive(Debug)]
pub struct SourceSession {
    decoder: Box<dyn Decoder>,
    calibration: GloveCalibration,
    core: Core,
    /// `None` while the link is closed.
    deadline_ns: Option<u64>,
    found: Vec<FoundHand>,
    sequence: u64,
    /// Of the two stations.
    sequences: [u64; 2],
    /// Whether the last datagram was good.
    in_step: bool,
    /// Since the last hand: whether good datagrams came.
    heard: bool,
    /// Since the last hand: what was wrong with the first bad datagram, and its first bytes.
    bad: Option<(String, String)>,
}

impl SourceSession {
    /// A sender of the VMC protocol.
    #[must_use]
    pub fn vmc(calibration: GloveCalibration) -> Self {
        Self::new(Box::new(Vmc::default()), calibration)
    }

    /// Rokoko Studio's custom streaming.
    #[must_use]
    pub fn rokoko(settings: &RokokoSettings, calibration: GloveCalibration) -> Self {
        Self::new(Box::new(Rokoko::new(settings)), calibration)
    }

    /// The bridge of UDCAP gloves.
    #[must_use]
    pub fn udcap(calibration: GloveCalibration) -> Self {
        Self::new(Box::new(Udcap::default()), calibration)
    }

    fn new(decoder: Box<dyn Decoder>, calibration: GloveCalibration) -> Self {
        let calibration = calibration.filled(|sensor| decoder.default_of(sensor));
        Self {
            decoder,
            calibration,
            core: Core::new(),
            deadline_ns: None,
            found: Vec::new(),
            sequence: 0,
            sequences: [0; 2],
            in_step: true,
            heard: false,
            bad: None,
        }
    }

    fn take_hands(&mut self, stamp_ns: u64) {
        self.core.stats.records += 1;
        self.heard = false;
        self.bad = None;
        self.deadline_ns = Some(stamp_ns + SILENCE_NS);
        if let Some(info) = self.decoder.news() {
            self.core.emit(DeviceEvent::Identified(info));
        }
        self.core.enter(stamp_ns, SessionState::Running, None);
        for found in std::mem::take(&mut self.found) {
            self.emit(&found);
        }
    }

    fn emit(&mut self, found: &FoundHand) {
        let stamp_ns = found.stamp_ns;
        if let Some(raw) = &found.raw {
            let reading = GloveReading {
                sensors: self.calibration.angles(raw),
                angles_valid: true,
                device_ticks: found.device_ticks,
                hand: Some(found.hand),
                ..GloveReading::empty(stamp_ns, self.sequence)
            };
            self.sequence += 1;
            self.core.emit(DeviceEvent::Glove(reading));
        }
        if let Some(pose) = &found.world_from_wrist {
            let station = station_of(found.hand);
            let sequence = &mut self.sequences[usize::from(station) - 1];
            let reading = TrackerReading {
                stamp_ns,
                sequence: *sequence,
                station,
                space: TrackerSpace::YUp,
                position: Some(Point3::from(pose.translation.vector)),
                rotation: Some(pose.rotation),
                position_valid: true,
                rotation_valid: true,
                error: None,
                device_ticks: found.device_ticks,
                stylus_pressed: None,
            };
            *sequence += 1;
            self.core.emit(DeviceEvent::Tracker(reading));
        }
    }

    /// Why there is no hand.
    fn why_none(&self) -> Fault {
        let device = self.decoder.family();
        match &self.bad {
            Some((detail, first_bytes)) if !self.heard => Fault::Undecodable {
                device,
                detail: detail.clone(),
                first_bytes: first_bytes.clone(),
            },
            _ if self.heard => Fault::NoHand { device },
            _ => Fault::NothingArrives { device },
        }
    }
}

impl Session for SourceSession {
    fn core(&self) -> &Core {
        &self.core
    }

    fn core_mut(&mut self) -> &mut Core {
        &mut self.core
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.core.forget_port();
        self.decoder.forget();
        self.in_step = true;
        self.heard = false;
        self.bad = None;
        self.deadline_ns = Some(now_ns + SILENCE_NS);
        self.core.enter(now_ns, SessionState::Querying, None);
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.deadline_ns = None;
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        if self.deadline_ns.is_none() {
            return;
        }
        self.found.clear();
        match self.decoder.take(stamp_ns, bytes, &mut self.found) {
            Ok(()) => {
                self.in_step = true;
                self.heard = true;
            }
            Err(detail) => {
                self.core.stats.dropped_records += 1;
                self.core.stats.resyncs += u64::from(std::mem::take(&mut self.in_step));
                self.bad.get_or_insert_with(|| (detail, hex(bytes)));
            }
        }
        if !self.found.is_empty() {
            self.take_hands(stamp_ns);
        }
    }

    fn deadline(&self) -> Option<u64> {
        self.deadline_ns
    }

    fn handle_timeout(&mut self, now_ns: u64) {
        if self
            .deadline_ns
            .is_none_or(|deadline_ns| now_ns < deadline_ns)
        {
            return;
        }
        // There is nothing to restart: whoever sends is on its own. The fault says what comes meanwhile.
        let fault = self.why_none();
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.heard = false;
        self.bad = None;
        self.deadline_ns = Some(now_ns + SILENCE_NS);
    }

    fn set_calibration(&mut self, calibration: GloveCalibration) {
        self.calibration = calibration.filled(|sensor| self.decoder.default_of(sensor));
    }
}
