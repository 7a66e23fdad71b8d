//! One `[[hand]]`: a glove and a tracker that make a hand.

use tsukamu_devices::driver::Role;
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::skeleton::HandModel;

use super::device::DeviceSettings;
use super::stream;
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;
use crate::input::fusion::FusionSettings;

/// A hand driven by devices.
#[derive(Clone, Debug, PartialEq)]
pub struct HandSettings {
    /// Its name, unique.
    pub name: String,
    /// Index of its glove in the settings' devices.
    pub glove: usize,
    /// Index of its tracker in the settings' devices.
    pub tracker: usize,
    /// Station of that tracker, from 1.
    pub station: u16,
    /// The wearer's hand.
    pub model: HandModel,
    /// How its two streams are filtered, predicted and joined.
    pub fusion: FusionSettings,
    /// Share of its glove's full force with which a finger that touches something is stopped, 0 to 1.
    pub feedback_strength: f64,
}

/// Every hand. One with a mistake is left out, and the sheet says why.
pub(super) fn read_all(
    top: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    devices: &[DeviceSettings],
) -> Vec<HandSettings> {
    let mut hands: Vec<HandSettings> = Vec::new();
    for mut keys in top.tables(sheet, "hand") {
        let hand = read(&mut keys, sheet, devices);
        keys.finish(sheet);
        let Some(hand) = hand else { continue };
        if hands.iter().any(|other| other.name == hand.name) {
            keys.fault(
                sheet,
                "name",
                format!("is {:?}, which another hand carries", hand.name),
            );
        }
        hands.push(hand);
    }
    hands
}

fn read(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    devices: &[DeviceSettings],
) -> Option<HandSettings> {
    keys.require(sheet, "name", "a text, unique among hands");
    keys.require(sheet, "side", "left or right");
    let name = keys.text(sheet, "name");
    let side = keys.choice(sheet, "side", &["left", "right"]);
    let glove = device(keys, sheet, devices, "glove", Role::is_glove);
    let tracker = device(keys, sheet, devices, "tracker", Role::is_tracker);
    let station = keys
        .whole(sheet, "station", Bounds::within(1.0, 1024.0, ""))
        .map(|station| station as u16);
    let scale = keys
        .number(sheet, "scale", Bounds::within(0.5, 2.0, ""))
        .unwrap_or(1.0);
    let point_radius = keys
        .number(sheet, "point_radius", Bounds::within(0.0, 0.05, "m"))
        .unwrap_or(0.0);
    let palm_contacts = keys.flag(sheet, "palm_contacts").unwrap_or(false);
    let fusion = stream::read(keys, sheet);
    let feedback_strength = keys
        .number(sheet, "feedback_strength", Bounds::within(0.0, 1.0, ""))
        .unwrap_or(1.0);
    let adult = HandModel::adult(if side? == "left" {
        Side::Left
    } else {
        Side::Right
    });
    let model = HandModel {
        skeleton: adult.skeleton.scaled(scale),
        point_radius,
        palm_contacts,
        ..adult
    };
    if let Err(fault) = model.validate() {
        keys.fault(sheet, "scale", fault.to_string());
    }
    let tracker = tracker?;
    let hand = match model.side {
        Side::Left => Handedness::Left,
        Side::Right => Handedness::Right,
    };
    let station = station.unwrap_or_else(|| devices[tracker].driver.usual_station(hand));
    if !devices[tracker].driver.has_station(station) {
        keys.fault(
            sheet,
            "station",
            format!("is {station}, which the tracker's stations leave out"),
        );
    }
    Some(HandSettings {
        name: name?,
        glove: glove?,
        tracker,
        station,
        model,
        fusion,
        feedback_strength,
    })
}

/// Index of the device that a key names.
fn device(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    devices: &[DeviceSettings],
    key: &'static str,
    suits: fn(Role) -> bool,
) -> Option<usize> {
    keys.require(sheet, key, &format!("the name of a {key}"));
    let name = keys.text(sheet, key)?;
    let found = devices
        .iter()
        .position(|device| device.name == name && suits(device.driver.role()));
    if found.is_none() {
        keys.fault(
            sheet,
            key,
            format!("is {name:?}; there is no {key} of that name without mistakes"),
        );
    }
    found
}
