//! What each device reads, and what is in force for it: filled by the ports' threads, asked by the services.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Isometry3;
use tokio::sync::watch;
use tsukamu_devices::driver::Role;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::port_thread::SessionHandle;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_devices::session::DeviceEvent;

use super::fault::CalibrationFault;
use crate::input::assemble::{Assembly, Mount};
use crate::settings::device::DeviceSettings;

/// The newest readings of a tracker, by station.
pub type Stations = BTreeMap<u16, TrackerReading>;

/// Every device and hand of the settings; cheap to clone.
#[derive(Clone, Debug, Default)]
pub struct Taps(Arc<Mutex<Registry>>);

#[derive(Debug, Default)]
struct Registry {
    devices: BTreeMap<String, Arc<Tap>>,
    hands: Vec<HandPlace>,
}

/// One device: its newest readings and what is in force.
#[derive(Debug)]
pub struct Tap {
    name: String,
    role: Role,
    glove: watch::Sender<Option<GloveReading>>,
    tracker: watch::Sender<Stations>,
    wearing: Mutex<Wearing>,
}

#[derive(Debug)]
struct Wearing {
    calibration: GloveCalibration,
    calibration_file: Option<PathBuf>,
    session: Option<SessionHandle>,
    world_from_transmitter: Isometry3<f64>,
    room_file: Option<PathBuf>,
}

/// A hand whose tracker may turn out to be elsewhere.
#[derive(Debug)]
struct HandPlace {
    glove: String,
    tracker: String,
    station: u16,
    mount: Mount,
    assembly: Arc<Mutex<Assembly>>,
}

impl Taps {
    /// A device, from its settings.
    pub fn add(&self, device: &DeviceSettings) -> Arc<Tap> {
        let wearing = Wearing {
            calibration: (*device.calibration).clone(),
            calibration_file: device.calibration_file.clone(),
            session: None,
            world_from_transmitter: device.world_from_transmitter,
            room_file: device.room_file.clone(),
        };
        let tap = Arc::new(Tap {
            name: device.name.clone(),
            role: device.driver.role(),
            glove: watch::Sender::new(None),
            tracker: watch::Sender::new(Stations::new()),
            wearing: Mutex::new(wearing),
        });
        lock(&self.0)
            .devices
            .insert(tap.name.clone(), Arc::clone(&tap));
        tap
    }

    /// A hand of a glove and a tracker's station.
    pub fn add_hand(
        &self,
        (glove, tracker): (&str, &str),
        station: u16,
        mount: Mount,
        assembly: Arc<Mutex<Assembly>>,
    ) {
        lock(&self.0).hands.push(HandPlace {
            glove: glove.to_owned(),
            tracker: tracker.to_owned(),
            station,
            mount,
            assembly,
        });
    }

    fn device(&self, name: &str) -> Result<Arc<Tap>, CalibrationFault> {
        let registry = lock(&self.0);
        registry.devices.get(name).cloned().ok_or_else(|| {
            let known: Vec<&str> = registry.devices.keys().map(String::as_str).collect();
            let known = if known.is_empty() {
                "none".to_owned()
            } else {
                known.join(", ")
            };
            let name = name.to_owned();
            CalibrationFault::NoDevice { name, known }
        })
    }

    /// The glove of that name.
    ///
    /// # Errors
    /// When there is none, or it is no glove.
    pub fn glove(&self, name: &str) -> Result<Arc<Tap>, CalibrationFault> {
        let tap = self.device(name)?;
        if tap.role.is_glove() {
            Ok(tap)
        } else {
            Err(CalibrationFault::NoGlove(name.to_owned()))
        }
    }

    /// The tracker of that name.
    ///
    /// # Errors
    /// When there is none, or it is no tracker.
    pub fn tracker(&self, name: &str) -> Result<Arc<Tap>, CalibrationFault> {
        let tap = self.device(name)?;
        if tap.role.is_tracker() {
            Ok(tap)
        } else {
            Err(CalibrationFault::NoTracker(name.to_owned()))
        }
    }

    /// The glove of the hand that wears a tracker's station.
    ///
    /// # Errors
    /// When no hand does.
    pub fn glove_on(&self, tracker: &str, station: u16) -> Result<Arc<Tap>, CalibrationFault> {
        let glove = {
            let registry = lock(&self.0);
            let worn = |hand: &&HandPlace| hand.tracker == tracker && hand.station == station;
            registry
                .hands
                .iter()
                .find(worn)
                .map(|hand| hand.glove.clone())
        };
        let device = tracker.to_owned();
        self.glove(&glove.ok_or(CalibrationFault::NoHand { device, station })?)
    }

    /// From now on a calibration is in force for a glove: its angles, and the mount of the hands that wear it.
    pub fn apply_calibration(&self, tap: &Tap, calibration: GloveCalibration) {
        let wrist_from_sensor = calibration.mount.wrist_from_sensor();
        tap.show_with(calibration.clone());
        tap.wearing().calibration = calibration;
        self.place_hands(|hand| {
            if hand.glove == tap.name {
                hand.mount.wrist_from_sensor = wrist_from_sensor;
            }
        });
    }

    /// From now on a tracker's transmitter stands there.
    pub fn apply_room(&self, tap: &Tap, world_from_transmitter: Isometry3<f64>) {
        tap.wearing().world_from_transmitter = world_from_transmitter;
        self.place_hands(|hand| {
            if hand.tracker == tap.name {
                hand.mount.world_from_transmitter = world_from_transmitter;
            }
        });
    }

    fn place_hands(&self, change: impl Fn(&mut HandPlace)) {
        for hand in &mut lock(&self.0).hands {
            let before = hand.mount;
            change(hand);
            if hand.mount != before {
                lock(&hand.assembly).set_mount(hand.mount);
            }
        }
    }
}

impl Tap {
    /// Its name in the settings.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The port's thread is there, and takes calibrations.
    pub fn set_session(&self, session: SessionHandle) {
        self.wearing().session = Some(session);
    }

    /// Shows a reading to whoever looks; called by the port's thread, and never waits for a slow reader.
    pub fn offer(&self, event: &DeviceEvent) {
        match event {
            DeviceEvent::Glove(reading) => {
                self.glove.send_replace(Some(*reading));
            }
            DeviceEvent::Tracker(reading) => self.tracker.send_modify(|stations| {
                stations.insert(reading.station, *reading);
            }),
            DeviceEvent::State(_) | DeviceEvent::Identified(_) => {}
        }
    }

    /// The newest reading of a glove, again and again. What came before now is not news.
    pub fn glove_readings(&self) -> watch::Receiver<Option<GloveReading>> {
        let mut readings = self.glove.subscribe();
        readings.mark_unchanged();
        readings
    }

    /// The newest readings of a tracker, again and again. What came before now is not news.
    pub fn tracker_readings(&self) -> watch::Receiver<Stations> {
        let mut readings = self.tracker.subscribe();
        readings.mark_unchanged();
        readings
    }

    /// The calibration in force.
    pub fn calibration(&self) -> GloveCalibration {
        self.wearing().calibration.clone()
    }

    /// Its calibration file.
    pub fn calibration_file(&self) -> Option<PathBuf> {
        self.wearing().calibration_file.clone()
    }

    /// `world_from_transmitter` in force.
    pub fn world_from_transmitter(&self) -> Isometry3<f64> {
        self.wearing().world_from_transmitter
    }

    /// Its room file.
    pub fn room_file(&self) -> Option<PathBuf> {
        self.wearing().room_file.clone()
    }

    /// Lets the device use a calibration that is not in force for all that: while a run looks at every sensor.
    pub fn show_with(&self, calibration: GloveCalibration) {
        if let Some(session) = &self.wearing().session {
            session.set_calibration(calibration);
        }
    }

    fn wearing(&self) -> MutexGuard<'_, Wearing> {
        lock(&self.wearing)
    }
}

/// A panic elsewhere leaves whole values.
fn lock<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}
