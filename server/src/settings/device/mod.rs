//! One `[[device]]`: a glove or a tracker.

mod cyberglove;
mod fastrak;

use std::path::Path;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::place::{NoPlace, Place};

use super::calibration;
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// One device as it is set up.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceSettings {
    /// Its name, unique.
    pub name: String,
    /// Where it is.
    pub port: Place,
    /// Line rates in bit/s, tried in turn; never empty.
    pub bauds: Vec<u32>,
    /// What it is, and what it is asked for.
    pub driver: Driver,
    /// Its wearer's calibration; the default where it is no glove.
    pub calibration: Box<GloveCalibration>,
    /// `world_from_transmitter`, where "transmitter" is the y-up space of the tracker's origin; the identity where it is
    /// no tracker.
    pub world_from_transmitter: Isometry3<f64>,
}

/// Line rates that any port may have.
const BAUD: Bounds = Bounds::within(50.0, 4_000_000.0, "bit/s");
/// Most line rates that are tried.
const BAUDS_MAX: usize = 8;
/// Reads the keys of one kind; `None` after a mistake that leaves nothing to go on with.
type Reader = fn(&mut Keys<'_>, &mut Sheet<'_>) -> Option<Driver>;

/// Every kind by name.
const KINDS: [(&str, Reader); 2] = [("cyberglove", cyberglove::read), ("fastrak", fastrak::read)];

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
                format!("is \"{}\", which another device is on", device.port),
            );
        }
        devices.push(device);
    }
    devices
}

fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>, folder: &Path) -> Option<DeviceSettings> {
    let kinds = KINDS.map(|(name, _)| name);
    keys.require(sheet, "name", "a text, unique among devices");
    keys.require(sheet, "kind", &kinds.join(", "));
    keys.require(
        sheet,
        "port",
        "the port's path, or udp:PORT, tcp:HOST:PORT or tcp-listen:PORT",
    );
    let name = keys.text(sheet, "name");
    let port = place(keys, sheet);
    let bauds = keys.wholes(sheet, "bauds", BAUD, BAUDS_MAX);
    let kind = keys.choice(sheet, "kind", &kinds)?;
    let (_, reader) = KINDS.iter().find(|(name, _)| *name == kind)?;
    let driver = reader(keys, sheet)?;
    let calibration = if driver.role().is_glove() {
        calibration(keys, sheet, folder)?
    } else {
        GloveCalibration::default()
    };
    let world_from_transmitter = if driver.role().is_tracker() {
        transmitter(keys, sheet)
    } else {
        Isometry3::identity()
    };
    Some(DeviceSettings {
        name: name?,
        port: port?,
        bauds: bauds.unwrap_or_else(|| driver.usual_bauds().to_vec()),
        driver,
        calibration: Box::new(calibration),
        world_from_transmitter,
    })
}

/// Where the device is.
fn place(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Place> {
    let place = keys.text(sheet, "port")?.parse();
    place
        .map_err(|fault: NoPlace| keys.fault(sheet, "port", fault.to_string()))
        .ok()
}

/// The wearer's calibration: that of the file, or the default where none is named.
fn calibration(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    folder: &Path,
) -> Option<GloveCalibration> {
    let file = keys.text(sheet, "calibration");
    match file.map(|file| calibration::load(&folder.join(file))) {
        None => Some(GloveCalibration::default()),
        Some(Ok(calibration)) => Some(calibration),
        Some(Err(mistakes)) => {
            mistakes
                .0
                .into_iter()
                .for_each(|mistake| sheet.fault_elsewhere(mistake));
            None
        }
    }
}

/// Where the tracker's origin stands.
fn transmitter(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Isometry3<f64> {
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
    Isometry3::from_parts(Translation3::from(position), rotation)
}
