//! One `[[device]]`: a glove or a tracker on a serial port.

use std::path::Path;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, Sampling, SensorCount};
use tsukamu_devices::tracker::fastrak::decode::Encoding;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;

use super::calibration;
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// One device as it is set up.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceSettings {
    /// Its name, unique.
    pub name: String,
    /// Path of its port.
    pub port: String,
    /// Line rates in bit/s, tried in turn; never empty.
    pub bauds: Vec<u32>,
    /// What it is.
    pub kind: DeviceKind,
}

/// What a device is.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviceKind {
    /// A glove.
    CyberGlove {
        /// How it is asked.
        settings: CyberGloveSettings,
        /// Its wearer's calibration.
        calibration: Box<GloveCalibration>,
    },
    /// A tracker.
    Fastrak {
        /// How it is asked.
        settings: FastrakSettings,
        /// `world_from_transmitter`, where "transmitter" is the y-up space in which the driver reports.
        world_from_transmitter: Isometry3<f64>,
    },
}

impl DeviceKind {
    /// The name in settings and on the wire.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::CyberGlove { .. } => "cyberglove",
            Self::Fastrak { .. } => "fastrak",
        }
    }
}

/// Line rates that any port may have.
const BAUD: Bounds = Bounds::within(50.0, 4_000_000.0, "bit/s");
/// Line rate of both devices as delivered.
const BAUD_DEFAULT: u32 = 115_200;
/// Most line rates that are tried.
const BAUDS_MAX: usize = 8;
/// Time between questions of a polled glove, in nanoseconds: 100 Hz.
const POLL_PERIOD_NS: u64 = 10_000_000;

/// Every device. One with a mistake is left out, and the sheet says why.
pub(super) fn read_all(
    top: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    folder: &Path,
) -> Vec<DeviceSettings> {
    let mut devices: Vec<DeviceSettings> = Vec::new();
    for mut keys in top.tables(sheet, "device") {
        let device = read(&mut keys, sheet, folder);
        keys.finish(sheet);
        let Some(device) = device else { continue };
        if devices.iter().any(|other| other.name == device.name) {
            keys.fault(
                sheet,
                "name",
                format!("is {:?}, which another device carries", device.name),
            );
        }
        if devices.iter().any(|other| other.port == device.port) {
            keys.fault(
                sheet,
                "port",
                format!("is {:?}, which another device is on", device.port),
            );
        }
        devices.push(device);
    }
    devices
}

fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, folder: &Path) -> Option<DeviceSettings> {
    keys.require(sheet, "name", "a text, unique among devices");
    keys.require(sheet, "kind", "cyberglove or fastrak");
    keys.require(sheet, "port", "the port's path");
    let name = keys.text(sheet, "name");
    let port = keys.text(sheet, "port");
    let bauds = keys.wholes(sheet, "bauds", BAUD, BAUDS_MAX);
    let kind = match keys.choice(sheet, "kind", &["cyberglove", "fastrak"])? {
        "cyberglove" => glove(keys, sheet, folder)?,
        _ => tracker(keys, sheet),
    };
    Some(DeviceSettings {
        name: name?,
        port: port?,
        bauds: bauds.unwrap_or_else(|| vec![BAUD_DEFAULT]),
        kind,
    })
}

fn glove(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, folder: &Path) -> Option<DeviceKind> {
    let default = CyberGloveSettings::default();
    let forced_sensors = match keys.whole(sheet, "sensors", Bounds::within(18.0, 22.0, "sensors")) {
        Some(18) => Some(SensorCount::Eighteen),
        Some(22) => Some(SensorCount::TwentyTwo),
        Some(other) => {
            keys.fault(
                sheet,
                "sensors",
                format!("is {other}; gloves have 18 or 22"),
            );
            None
        }
        None => None,
    };
    let sampling = match keys.choice(sheet, "sampling", &["stream", "poll"]) {
        Some("poll") => Sampling::Poll {
            period_ns: POLL_PERIOD_NS,
        },
        _ => Sampling::Stream,
    };
    let rate = keys.number(sheet, "sample_rate_hz", Bounds::within(0.01, 1000.0, "Hz"));
    let file = keys.text(sheet, "calibration");
    let calibration = match file.map(|file| calibration::load(&folder.join(file))) {
        None => GloveCalibration::default(),
        Some(Ok(calibration)) => calibration,
        Some(Err(mistakes)) => {
            mistakes
                .0
                .into_iter()
                .for_each(|mistake| sheet.fault_elsewhere(mistake));
            return None;
        }
    };
    let settings = CyberGloveSettings {
        forced_sensors,
        sampling,
        rate_hz: rate.or(default.rate_hz),
        ..default
    };
    Some(DeviceKind::CyberGlove {
        settings,
        calibration: Box::new(calibration),
    })
}

fn tracker(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> DeviceKind {
    let mut settings = FastrakSettings::default();
    let n_stations = settings.stations.len();
    if let Some(stations) = keys.wholes(
        sheet,
        "stations",
        Bounds::within(1.0, n_stations as f64, ""),
        n_stations,
    ) {
        settings.stations = std::array::from_fn(|index| stations.contains(&(index as u32 + 1)));
    }
    if keys.choice(sheet, "encoding", &["binary", "ascii"]) == Some("ascii") {
        settings.encoding = Encoding::Ascii;
    }
    settings.hemisphere = keys.numbers::<3>(
        sheet,
        "hemisphere",
        "[x, y, z]",
        Bounds::within(-1.0, 1.0, ""),
    );
    if settings
        .hemisphere
        .is_some_and(|direction| Vector3::from(direction).norm() < 1.0e-6)
    {
        keys.fault(sheet, "hemisphere", "is no direction");
    }
    let metres = Bounds::within(-100.0, 100.0, "m");
    let degrees = Bounds::within(-360.0, 360.0, "°");
    let position = keys
        .numbers::<3>(sheet, "transmitter_position", "[x, y, z]", metres)
        .unwrap_or_default();
    let turns = keys.numbers::<3>(
        sheet,
        "transmitter_rotation_deg",
        "[yaw, pitch, roll]",
        degrees,
    );
    let [yaw, pitch, roll] = turns.unwrap_or_default().map(f64::to_radians);
    let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    let rotation = about(Vector3::y_axis(), yaw)
        * about(Vector3::x_axis(), pitch)
        * about(Vector3::z_axis(), roll);
    let world_from_transmitter = Isometry3::from_parts(Translation3::from(position), rotation);
    DeviceKind::Fastrak {
        settings,
        world_from_transmitter,
    }
}
