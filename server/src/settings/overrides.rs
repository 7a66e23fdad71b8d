//! Values from flags and environment variables, which stand above those of the file.

/// One value that overrides a key of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Given {
    /// The flag or variable, as the user wrote it: `--rate-hz`, `TSUKAMU_RATE_HZ`.
    pub origin: String,
    /// Its text.
    pub text: String,
}

/// Values by key. The reader of the settings asks it before it asks the file; tests fill it with pairs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Overrides(Vec<(String, Given)>);

/// The keys that flags and variables may override.
pub const KEYS: [&str; 16] = [
    "listen",
    "scene",
    "hands",
    "rate_hz",
    "mode",
    "tracking_grace_s",
    "keyframe_interval_s",
    "event_log",
    "recording_dir",
    "record",
    "record_frames",
    "record_raw",
    "vrpn",
    "vrpn_rate_hz",
    "vrpn_axes",
    "log",
];

impl Overrides {
    /// Adds a value; one that is there for the same key already stays in force.
    pub fn add(&mut self, key: &str, origin: impl Into<String>, text: impl Into<String>) {
        self.0.push((
            key.to_owned(),
            Given {
                origin: origin.into(),
                text: text.into(),
            },
        ));
    }

    /// The value of a key, if one was given.
    pub fn get(&self, key: &str) -> Option<&Given> {
        self.0
            .iter()
            .find(|(known, _)| known == key)
            .map(|(_, given)| given)
    }
}
