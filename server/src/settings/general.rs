//! The keys of the first table, from the file or from what overrides it.

use std::net::SocketAddr;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::overrides::{Given, Overrides};
use super::vrpn::{self, VrpnSettings};
use super::{
    LISTEN_DEFAULT, Mode, PublishSettings, RecordingSettings, Settings, WorldSettings, device, hand,
};
use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::{Mistake, Sheet};
use crate::scene_file::hands::HandSourceSpec;
use crate::scene_file::keys::{GRACE, RATE};

/// Keyframe intervals.
const KEYFRAME: Bounds = Bounds::within(0.05, 60.0, "s");
/// Sizes of the event log: about 100 bytes each.
const EVENT_LOG: Bounds = Bounds::within(16.0, 10_000_000.0, "events");
/// Events kept unless told otherwise.
const EVENT_LOG_DEFAULT: u32 = 65_536;

/// One reading of all settings: the file's table, what stands above it, and the list of mistakes.
struct Reader<'r, 'k, 's> {
    top: &'r mut Keys<'k>,
    sheet: &'r mut Sheet<'s>,
    overrides: &'r Overrides,
}

/// Reads everything; `None` when a value without which there are no settings is wrong.
pub(super) fn read(
    top: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    folder: &Path,
    overrides: &Overrides,
) -> Option<Settings> {
    let mut reader = Reader {
        top,
        sheet,
        overrides,
    };
    let listen = reader.listen();
    let world = reader.world(folder);
    let publish = PublishSettings {
        keyframe_interval_s: reader
            .number("keyframe_interval_s", KEYFRAME)
            .unwrap_or(1.0),
        event_log: reader
            .number("event_log", EVENT_LOG)
            .map_or(EVENT_LOG_DEFAULT, |n| n as u32) as usize,
    };
    let recording = RecordingSettings {
        dir: PathBuf::from(
            reader
                .text("recording_dir")
                .unwrap_or_else(|| "recordings".to_owned()),
        ),
        from_start: reader.flag("record").unwrap_or(false),
        frames: reader.flag("record_frames").unwrap_or(false),
        raw: reader.flag("record_raw").unwrap_or(false),
    };
    let vrpn = reader.vrpn();
    let log = reader.text("log").unwrap_or_else(|| "info".to_owned());
    let sources = reader.sources(folder);
    let devices = device::read_all(top, sheet, folder);
    let hands = hand::read_all(top, sheet, &devices);
    Some(Settings {
        listen: listen?,
        world,
        publish,
        recording,
        vrpn,
        log,
        sources,
        devices,
        hands,
    })
}

impl Reader<'_, '_, '_> {
    fn listen(&mut self) -> Option<SocketAddr> {
        let text = self
            .text("listen")
            .unwrap_or_else(|| LISTEN_DEFAULT.to_owned());
        let address = text.parse().ok();
        if address.is_none() {
            let message =
                format!("is {text:?}; it must be an address with a port, such as {LISTEN_DEFAULT}");
            self.fault("listen", message);
        }
        address
    }

    fn vrpn(&mut self) -> Option<VrpnSettings> {
        let text = self.text("vrpn");
        let rate_hz = self.number("vrpn_rate_hz", vrpn::RATE);
        let axes = self.choice("vrpn_axes", &vrpn::AXES);
        let text = text.filter(|text| text != vrpn::OFF)?;
        let Ok(listen) = text.parse() else {
            let message = format!(
                "is {text:?}; it must be an address with a port, such as {}, or \"off\"",
                vrpn::ADDRESS_DEFAULT
            );
            self.fault("vrpn", message);
            return None;
        };
        Some(VrpnSettings {
            rate_hz: rate_hz.unwrap_or(vrpn::RATE_DEFAULT_HZ),
            axes: vrpn::axes_from(axes),
            ..VrpnSettings::new(listen)
        })
    }

    fn world(&mut self, folder: &Path) -> WorldSettings {
        let in_file = self.overrides.get("scene").is_none();
        let mut scene = self.text("scene").unwrap_or_else(|| "demo".to_owned());
        // A scene file named in a settings file stands beside it; one named in a flag, in the working folder.
        if in_file && crate::scene_file::builtin::text(&scene).is_none() {
            scene = folder.join(scene).display().to_string();
        }
        let mode = match self.choice("mode", &[Mode::Realtime.name(), Mode::Lockstep.name()]) {
            Some("lockstep") => Mode::Lockstep,
            _ => Mode::Realtime,
        };
        let rate_hz = self.number("rate_hz", RATE);
        WorldSettings {
            scene,
            rate_hz,
            mode,
            tracking_grace_s: self.number("tracking_grace_s", GRACE),
        }
    }

    fn sources(&mut self, folder: &Path) -> Option<Vec<HandSourceSpec>> {
        let in_file = self.top.texts(self.sheet, "hands");
        let (texts, folder) = match self.overrides.get("hands") {
            Some(given) => (
                given
                    .text
                    .split(';')
                    .map(|text| (0..0, text.to_owned()))
                    .collect(),
                Path::new(""),
            ),
            None => (in_file?, folder),
        };
        Some(
            texts
                .into_iter()
                .filter_map(|(span, text)| self.source(&span, &text, folder))
                .collect(),
        )
    }

    fn source(&mut self, span: &Range<usize>, text: &str, folder: &Path) -> Option<HandSourceSpec> {
        let fault = match HandSourceSpec::parse(text, folder) {
            Ok(HandSourceSpec::Csv(path)) if !path.is_file() => {
                format!("names {text:?}; there is no such file, and no synthetic:NAME")
            }
            Ok(spec) => return Some(spec),
            Err(fault) => fault.to_string(),
        };
        match self.overrides.get("hands") {
            Some(_) => self.fault("hands", fault),
            None => self.sheet.fault(span, "hands", fault),
        }
        None
    }

    /// Text from above, or else from the file. The file's value is checked even where it is not used.
    fn text(&mut self, key: &'static str) -> Option<String> {
        let in_file = self.top.text(self.sheet, key);
        self.given(key).map(|given| given.text).or(in_file)
    }

    fn number(&mut self, key: &'static str, bounds: Bounds) -> Option<f64> {
        let in_file = self.top.number(self.sheet, key, bounds);
        let Some(given) = self.given(key) else {
            return in_file;
        };
        let fault = match given.text.trim().parse::<f64>() {
            Ok(number) => match bounds.fault(number) {
                None => return Some(number),
                Some(fault) => fault,
            },
            Err(_) => format!("is {:?}; it must be a number", given.text),
        };
        self.fault(key, fault);
        None
    }

    fn flag(&mut self, key: &'static str) -> Option<bool> {
        let in_file = self.top.flag(self.sheet, key);
        let Some(given) = self.given(key) else {
            return in_file;
        };
        let flag = given.text.trim().parse().ok();
        if flag.is_none() {
            self.fault(
                key,
                format!("is {:?}; it must be true or false", given.text),
            );
        }
        flag
    }

    fn choice(&mut self, key: &'static str, words: &[&'static str]) -> Option<&'static str> {
        let in_file = self.top.choice(self.sheet, key, words);
        let Some(given) = self.given(key) else {
            return in_file;
        };
        let found = words.iter().copied().find(|word| *word == given.text);
        if found.is_none() {
            self.fault(
                key,
                format!(
                    "is {:?}; it must be one of {}",
                    given.text,
                    words.join(", ")
                ),
            );
        }
        found
    }

    fn given(&self, key: &str) -> Option<Given> {
        self.overrides.get(key).cloned()
    }

    /// Notes a mistake where the value in force was given.
    fn fault(&mut self, key: &str, message: String) {
        match self.given(key) {
            None => self.top.fault(self.sheet, key, message),
            Some(Given { origin, .. }) => {
                self.sheet.fault_elsewhere(Mistake {
                    origin,
                    place: None,
                    key: key.to_owned(),
                    message,
                });
            }
        }
    }
}
