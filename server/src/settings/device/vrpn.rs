//! `kind = "vrpn"`

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::place::Place;
use tsukamu_devices::tracker::space::TrackerSpace;
use tsukamu_devices::vrpn::body::MAX_CHANNELS;
use tsukamu_devices::vrpn::settings::{ChannelUnit, VrpnSettings};

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;

/// The word for a channel that is of no use.
const UNUSED: &str = "-";

/// Reads the keys of this kind.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Option<Driver> {
    // What is wrong with the text is said by whoever reads places.
    let place = keys.text(sheet, "port").and_then(|text| text.parse().ok());
    let address = match place {
        Some(Place::Vrpn(address)) => Some(address),
        Some(_) => {
            let message = "must be a device of a VRPN server, such as Tracker0@tcp://host:3883 or Tracker0@host";
            keys.fault(sheet, "port", message);
            None
        }
        None => None,
    };
    let space = match keys.choice(sheet, "space", &["y_up", "z_up", "z_down"]) {
        Some("z_up") => TrackerSpace::ZUp,
        Some("z_down") => TrackerSpace::ZDown,
        _ => TrackerSpace::YUp,
    };
    let scale = keys.number(sheet, "scale", Bounds::above(0.0, 1000.0, "m per unit"));
    let channels = channels(keys, sheet);
    let unit = match keys.choice(sheet, "unit", &["degrees", "radians", "raw"]) {
        Some("radians") => ChannelUnit::Radians,
        Some("raw") => ChannelUnit::Raw,
        _ => ChannelUnit::Degrees,
    };
    if keys.has("unit") && !keys.has("channels") {
        keys.fault(sheet, "unit", "does nothing without channels");
    }
    Some(Driver::Vrpn(VrpnSettings {
        address: address?,
        space,
        scale: scale.unwrap_or(1.0),
        channels,
        unit,
    }))
}

/// What each channel measures, from channel 0.
fn channels(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> Vec<Option<GloveSensor>> {
    let Some(texts) = keys.texts(sheet, "channels") else {
        return Vec::new();
    };
    if texts.len() > MAX_CHANNELS {
        let message = format!(
            "has {} entries; VRPN has {MAX_CHANNELS} channels",
            texts.len()
        );
        keys.fault(sheet, "channels", message);
    }
    let names_none = texts.iter().all(|(_, text)| text == UNUSED);
    let mut channels = Vec::new();
    for (span, text) in texts {
        if text == UNUSED {
            channels.push(None);
            continue;
        }
        let sensor = GloveSensor::from_name(&text);
        let is_double = sensor.is_some() && channels.contains(&sensor);
        if sensor.is_none() || is_double {
            let names = GloveSensor::ALL.map(GloveSensor::name).join(", ");
            let message = if is_double {
                format!("is {text:?}, which another channel measures")
            } else {
                format!("is {text:?}; it must be {UNUSED:?} or one of {names}")
            };
            sheet.fault(&span, keys.path_of("channels"), message);
        }
        channels.push(sensor);
    }
    if names_none && !channels.is_empty() {
        keys.fault(sheet, "channels", "name no sensor");
    }
    channels
}

#[cfg(test)]
#[path = "vrpn_tests.rs"]
mod tests;
