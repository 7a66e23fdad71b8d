//! Every device that can be emulated: one row each.

use std::io;

use tsukamu_devices::driver::Role;
use tsukamu_devices::glove::cyberglove::settings::SensorCount;

use super::cyberglove::spawn_cyberglove;
use super::fastrak::spawn_fastrak;
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
    /// Line rate of such a device, bit/s.
    pub baud: u32,
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
        baud: 115_200,
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
        name: "fastrak",
        about: "A Fastrak with a receiver on the wrist",
        role: Role::Tracker,
        models: &[""],
        baud: 115_200,
        settings: nothing,
        spawn: |worn| {
            let tracker = spawn_fastrak(worn.played, worn.place, worn.plug)?;
            Ok(Box::new(tracker))
        },
    },
];

/// The kind of that name.
pub fn named(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
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

    #[test]
    fn the_settings_of_every_kind_are_without_mistakes() {
        for kind in KINDS {
            assert!(!kind.models.is_empty(), "{}", kind.name);
            for model in kind.models {
                let text = format!(
                    "[[device]]\nname = 'x'\nkind = {:?}\nport = '/dev/x'\n{}",
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
