//! Every device that can be emulated: one row each.

use std::io;

use tsukamu_devices::driver::Role;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_devices::glove::delimited::settings::DelimitedSettings;
use tsukamu_devices::glove::fivedt::settings::Model as FiveDtModel;
use tsukamu_devices::glove::opencyberglove::format::BAUD;
use tsukamu_devices::tracker::flock::protocol::BAUDS as FLOCK_BAUDS;
use tsukamu_devices::tracker::isotrak::protocol::{BAUDS as ISOTRAK_BAUDS, Model as IsotrakModel};
use tsukamu_devices::tracker::liberty::protocol::Model as LibertyModel;

use super::cyberglove::spawn_cyberglove;
use super::delimited::{five_numbers, spawn_delimited};
use super::fastrak::spawn_fastrak;
use super::fivedt::spawn_fivedt;
use super::flock::spawn_flock;
use super::isotrak::spawn_isotrak;
use super::liberty::spawn_liberty;
use super::lucidglove::spawn_lucidglove;
use super::network::{spawn_rokoko, spawn_udcap, spawn_vmc};
use super::opencyberglove::spawn_opencyberglove;
use super::{Plugged, Worn};

/// A kind of device that can be emulated.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// The name of the kind, as in settings.
    pub name: &'static str,
    /// What it is, for the help.
    pub about: &'static str,
    /// What it can be to a hand.
    pub role: Role,
    /// Its models, the usual one first; each name is used by one kind only. Never empty: one without choice has `""`.
    pub models: &'static [&'static str],
    /// Line rate of a model as delivered, bit/s.
    pub baud: fn(&str) -> u32,
    /// Lines of a `[[device]]` that the model needs, beyond name, kind and port.
    pub settings: fn(&str) -> String,
    /// Plugs one in.
    pub spawn: Spawn,
}

/// Plugs a device in; fails when the system has no pseudo-terminal or thread to give, or the link cannot be made.
pub type Spawn = fn(Worn) -> io::Result<Box<dyn Plugged>>;

/// Every kind.
pub const KINDS: &[Kind] = &[
    Kind {
        name: "cyberglove",
        about: "A CyberGlove",
        role: Role::Glove,
        models: &["18", "22"],
        baud: usual,
        settings: nothing,
        spawn: |worn| {
            let sensors = if worn.model == "22" {
                SensorCount::TwentyTwo
            } else {
                SensorCount::Eighteen
            };
            let glove = spawn_cyberglove(worn.played, sensors, worn.calibration, worn.plug)?;
            Ok(Box::new(glove))
        },
    },
    Kind {
        name: "lucidglove",
        about: "A LucidGlove with a sensor at each joint, splay and force feedback",
        role: Role::Glove,
        models: &[""],
        baud: usual,
        settings: nothing,
        spawn: |worn| {
            let glove = spawn_lucidglove(worn.played, worn.calibration, worn.plug)?;
            Ok(Box::new(glove))
        },
    },
    Kind {
        name: "5dt",
        about: "A 5DT glove of 5 flexures (5, wireless 5w), of 14 or of 16",
        role: Role::Glove,
        models: &["5", "5w", "14", "16"],
        baud: |model| fivedt(model).baud(),
        settings: |model| format!("model = {model:?}\n"),
        spawn: |worn| {
            let model = fivedt(worn.model);
            let glove = spawn_fivedt(worn.played, model, worn.calibration, worn.plug)?;
            Ok(Box::new(glove))
        },
    },
    Kind {
        name: "delimited",
        about: "A board that prints lines of numbers: a time and five flexures, or as a LeRobot Homunculus",
        role: Role::Glove,
        models: &["sketch", "homunculus"],
        baud: usual,
        settings: |model| match model {
            "homunculus" => "layout = \"homunculus\"\n".to_owned(),
            _ => FIVE_COLUMNS.to_owned(),
        },
        spawn: |worn| {
            let settings = match worn.model {
                "homunculus" => DelimitedSettings::homunculus(),
                _ => five_numbers(),
            };
            let glove = spawn_delimited(worn.played, settings, worn.calibration, worn.plug)?;
            Ok(Box::new(glove))
        },
    },
    Kind {
        name: "opencyberglove",
        about: "An OpenCyberGlove",
        role: Role::Glove,
        models: &[""],
        baud: |_model| BAUD,
        settings: nothing,
        spawn: |worn| {
            let glove = spawn_opencyberglove(worn.played, worn.calibration, worn.plug)?;
            Ok(Box::new(glove))
        },
    },
    Kind {
        name: "fastrak",
        about: "A Fastrak with a receiver on the wrist",
        role: Role::Tracker,
        models: &[""],
        baud: usual,
        settings: nothing,
        spawn: |worn| {
            let tracker = spawn_fastrak(worn.played, worn.place, worn.plug)?;
            Ok(Box::new(tracker))
        },
    },
    Kind {
        name: "vmc",
        about: "A program that sends the wearer's bones by the VMC protocol",
        role: Role::Both,
        models: &[""],
        baud: usual,
        settings: nothing,
        spawn: |worn| Ok(Box::new(spawn_vmc(worn)?)),
    },
    Kind {
        name: "rokoko",
        about: "Rokoko Studio, its JSON plain or compressed (lz4)",
        role: Role::Both,
        models: &["json", "lz4"],
        baud: usual,
        settings: nothing,
        spawn: |worn| Ok(Box::new(spawn_rokoko(worn)?)),
    },
    Kind {
        name: "udcap",
        about: "The bridge of UDCAP gloves",
        role: Role::Glove,
        models: &[""],
        baud: usual,
        settings: nothing,
        spawn: |worn| Ok(Box::new(spawn_udcap(worn)?)),
    },
    Kind {
        name: "isotrak",
        about: "An Isotrak II (isotrak2) or 3SPACE Tracker (3space) with a receiver on the wrist",
        role: Role::Tracker,
        models: &["isotrak2", "3space"],
        baud: |_model| ISOTRAK_BAUDS[0],
        settings: |model| format!("model = {model:?}\n"),
        spawn: |worn| {
            let model = match worn.model {
                "3space" => IsotrakModel::ThreeSpace,
                _ => IsotrakModel::IsotrakTwo,
            };
            let tracker = spawn_isotrak(worn.played, model, worn.place, worn.plug)?;
            Ok(Box::new(tracker))
        },
    },
    Kind {
        name: "liberty",
        about: "A Liberty, Patriot or Latus with a sensor on the wrist",
        role: Role::Tracker,
        models: &["liberty", "patriot", "latus"],
        baud: usual,
        settings: nothing,
        spawn: |worn| {
            let model = match worn.model {
                "patriot" => LibertyModel::Patriot,
                "latus" => LibertyModel::Latus,
                _ => LibertyModel::Liberty,
            };
            let tracker = spawn_liberty(worn.played, model, worn.place, worn.plug)?;
            Ok(Box::new(tracker))
        },
    },
    Kind {
        name: "flock",
        about: "A Flock of Birds: one bird (bird) or two on a bus (flock), the first on the wrist",
        role: Role::Tracker,
        models: &["bird", "flock"],
        baud: |_model| FLOCK_BAUDS[0],
        settings: |model| match model {
            "flock" => "birds = [1, 2]\n".to_owned(),
            _ => String::new(),
        },
        spawn: |worn| {
            let group = (worn.model == "flock").then_some(2);
            let tracker = spawn_flock(worn.played, group, worn.place, worn.plug)?;
            Ok(Box::new(tracker))
        },
    },
];

/// The kind of that name.
pub fn named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// The settings of [`five_numbers`].
const FIVE_COLUMNS: &str =
    "columns = [\"time\", \"thumb\", \"index\", \"middle\", \"ring\", \"little\"]\n";

const fn usual(_model: &str) -> u32 {
    115_200
}

fn fivedt(model: &str) -> FiveDtModel {
    match model {
        "5w" => FiveDtModel::FiveWireless,
        "14" => FiveDtModel::Fourteen,
        "16" => FiveDtModel::Sixteen,
        _ => FiveDtModel::Five,
    }
}

fn nothing(_model: &str) -> String {
    String::new()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::KINDS;
    use crate::document::mistake::Mistakes;
    use crate::settings::overrides::Overrides;
    use crate::settings::parse;

    /// Kinds that come as datagrams.
    const ON_NETWORK: [&str; 3] = ["vmc", "rokoko", "udcap"];

    #[test]
    fn the_settings_of_every_kind_are_without_mistakes() {
        for kind in KINDS {
            assert!(!kind.models.is_empty(), "{}", kind.name);
            for model in kind.models {
                let port = if ON_NETWORK.contains(&kind.name) {
                    "udp:1"
                } else {
                    "/dev/x"
                };
                let text = format!(
                    "[[device]]\nname = 'x'\nkind = {:?}\nport = '{port}'\n{}",
                    kind.name,
                    (kind.settings)(model)
                );
                let settings = parse("test.toml", &text, Path::new(""), &Overrides::default())
                    .unwrap_or_else(|mistakes: Mistakes| panic!("{text}\n{mistakes}"));
                let driver = &settings.devices[0].driver;
                assert_eq!((driver.name(), driver.role()), (kind.name, kind.role));
            }
        }
    }
}
