//! One `[[device]]`: a glove or a tracker.

mod cyberglove;
mod delimited;
mod fastrak;
mod fivedt;
mod flock;
mod isotrak;
mod liberty;
mod lucidglove;
mod opencyberglove;
mod polhemus;
mod rokoko;
mod udcap;
mod vmc;
mod vrpn;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::place::{NoPlace, Place};
use tsukamu_devices::ports::{find, is_numbered};

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
    /// Samples per second that it should have, where that is not what its driver asks for.
    pub expected_rate_hz: Option<f64>,
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
/// Rates that a device may have, all its stations together.
const RATE: Bounds = Bounds::within(0.1, 10_000.0, "Hz");
/// Reads the keys of one kind; `None` after a mistake that leaves nothing to go on with.
type Reader = fn(&mut Keys<'_>, &mut Sheet<'_>) -> Option<Driver>;

/// Every kind by name.
pub(super) const KINDS: &[(&str, Reader)] = &[
    ("cyberglove", cyberglove::read),
    ("lucidglove", lucidglove::read),
    ("fastrak", fastrak::read),
    ("vrpn", vrpn::read),
    ("isotrak", isotrak::read),
    ("liberty", liberty::read),
    ("flock", flock::read),
    ("5dt", fivedt::read),
    ("delimited", delimited::read),
    ("opencyberglove", opencyberglove::read),
    ("vmc", vmc::read),
    ("rokoko", rokoko::read),
    ("udcap", udcap::read),
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
    let kinds: Vec<&'static str> = KINDS.iter().map(|(name, _)| *name).collect();
    keys.require(sheet, "name", "a text, unique among devices");
    keys.require(sheet, "kind", &kinds.join(", "));
    keys.require(
        sheet,
        "port",
        "the port's path, or udp:PORT, tcp:HOST:PORT, tcp-listen:PORT or DEVICE@HOST of VRPN",
    );
    let name = keys.text(sheet, "name");
    let port = place(keys, sheet);
    let bauds = keys.wholes(sheet, "bauds", BAUD, BAUDS_MAX);
    let expected_rate_hz = keys.number(sheet, "expected_rate_hz", RATE);
    let kind = keys.choice(sheet, "kind", &kinds)?;
    let (_, reader) = KINDS.iter().find(|(name, _)| *name == kind)?;
    let driver = reader(keys, sheet)?;
    if let Some(wanted) = port.as_ref().and_then(|port| misplaced(&driver, port)) {
        keys.fault(sheet, "port", wanted);
    }
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
        expected_rate_hz,
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
    let place = place
        .map_err(|fault: NoPlace| keys.fault(sheet, "port", fault.to_string()))
        .ok()?;
    if let Place::Serial(path) = &place
        && is_numbered(path)
    {
        let lasting = find(Path::new(path)).and_then(|port| port.links.first().cloned());
        let instead = lasting.map_or_else(
            || {
                "name it by a link in /dev/serial/by-id or /dev/serial/by-path (`tsukamud devices` lists them), or one of your own"
                    .to_owned()
            },
            |link| format!("write {:?}", link.display().to_string()),
        );
        keys.fault(
            sheet,
            "port",
            format!("is {path:?}: the number is the order of plugging, and another device's tomorrow; {instead}"),
        );
        return None;
    }
    Some(place)
}

/// What is wrong with the place of such a device, if anything is.
fn misplaced(driver: &Driver, place: &Place) -> Option<String> {
    if matches!(place, Place::Vrpn(_)) && !matches!(driver, Driver::Vrpn(_)) {
        return Some(format!(
            "is \"{place}\", a device of a VRPN server; its kind is vrpn"
        ));
    }
    let usual = driver.usual_datagram_port()?;
    let wanted = format!("its sender sends datagrams: give udp:PORT, such as udp:{usual}");
    (!place.is_datagram()).then(|| format!("is \"{place}\"; {wanted}"))
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
