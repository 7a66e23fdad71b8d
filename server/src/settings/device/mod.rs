//! One `[[device]]`: a glove or a tracker.

mod cyberglove;
mod fastrak;
mod lucidglove;

use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::place::{NoPlace, Place};

use super::{calibration, room};
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
    /// The file that it came from, and goes to when it is saved.
    pub calibration_file: Option<PathBuf>,
    /// `world_from_transmitter`, where "transmitter" is the y-up space of the tracker's origin; the identity where it is
    /// no tracker.
    pub world_from_transmitter: Isometry3<f64>,
    /// The file that it came from, and goes to when it is saved.
    pub room_file: Option<PathBuf>,
}

/// Line rates that any port may have.
const BAUD: Bounds = Bounds::within(50.0, 4_000_000.0, "bit/s");
/// Most line rates that are tried.
const BAUDS_MAX: usize = 8;
/// Reads the keys of one kind; `None` after a mistake that leaves nothing to go on with.
type Reader = fn(&mut Keys<'_>, &mut Sheet<'_>) -> Option<Driver>;

/// Every kind by name.
const KINDS: [(&str, Reader); 3] = [
    ("cyberglove", cyberglove::read),
    ("lucidglove", lucidglove::read),
    ("fastrak", fastrak::read),
];

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
    let (calibration, calibration_file) = if driver.role().is_glove() {
        calibration(keys, sheet, folder)?
    } else {
        (GloveCalibration::default(), None)
    };
    let (world_from_transmitter, room_file) = if driver.role().is_tracker() {
        room::read(keys, sheet, folder)
    } else {
        (Isometry3::identity(), None)
    };
    Some(DeviceSettings {
        name: name?,
        port: port?,
        bauds: bauds.unwrap_or_else(|| driver.usual_bauds().to_vec()),
        driver,
        calibration: Box::new(calibration),
        calibration_file,
        world_from_transmitter,
        room_file,
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
) -> Option<(GloveCalibration, Option<PathBuf>)> {
    let Some(file) = keys.text(sheet, "calibration") else {
        return Some((GloveCalibration::default(), None));
    };
    let file = folder.join(file);
    match calibration::load(&file) {
        Ok(calibration) => Some((calibration, Some(file))),
        Err(mistakes) => {
            mistakes
                .0
                .into_iter()
                .for_each(|mistake| sheet.fault_elsewhere(mistake));
            None
        }
    }
}
