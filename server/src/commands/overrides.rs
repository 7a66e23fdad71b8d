//! Flags and variables that stand above the settings file.

use clap::Args;
use tsukamu_server::settings::overrides::{KEYS, Overrides};
use tsukamu_server::settings::vrpn::ADDRESS_DEFAULT;

/// Flags that override keys of the settings file. Each is also a variable: `--rate-hz` is `TSUKAMU_RATE_HZ`.
#[derive(Debug, Args)]
pub(super) struct OverrideArgs {
    /// Address and port of gRPC, status page and metrics [default: 127.0.0.1:7447].
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<String>,
    /// A built-in scene or a scene file [default: demo].
    #[arg(long)]
    scene: Option<String>,
    /// A hand CSV or synthetic:NAME, in place of the scene's own hands; may be given several times.
    #[arg(long = "hand", value_name = "FILE|synthetic:NAME")]
    hands: Vec<String>,
    /// Steps per second, 1 to 4000 [default: the scene's].
    #[arg(long, alias = "rate", value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: Option<String>,
    /// realtime, or lockstep: only a client's Step advances the world [default: realtime].
    #[arg(long)]
    mode: Option<String>,
    /// How long a hand that is not seen keeps hold, seconds, 0 to 60 [default: the scene's].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    tracking_grace_s: Option<String>,
    /// How often a frame holds all objects, seconds, 0.05 to 60 [default: 1].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    keyframe_interval_s: Option<String>,
    /// Events kept for clients that resume [default: 65536].
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    event_log: Option<String>,
    /// Folder of recordings [default: recordings].
    #[arg(long, value_name = "DIR")]
    recording_dir: Option<String>,
    /// Record from the start.
    #[arg(long)]
    record: bool,
    /// Such a recording holds every frame too.
    #[arg(long)]
    record_frames: bool,
    /// Such a recording holds the raw bytes and samples of the sources too.
    #[arg(long)]
    record_raw: bool,
    /// VRPN server for existing virtual-reality software, TCP and UDP [default: off; alone: 127.0.0.1:3883].
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = ADDRESS_DEFAULT)]
    vrpn: Option<String>,
    /// Poses per second over VRPN, 1 to 1000 [default: 60].
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    vrpn_rate_hz: Option<String>,
    /// Axes of VRPN poses: y_up or z_up [default: y_up].
    #[arg(long, value_name = "AXES")]
    vrpn_axes: Option<String>,
    /// Log filter, e.g. info or tsukamu_server=debug [default: info].
    #[arg(long, value_name = "FILTER")]
    log: Option<String>,
}

impl OverrideArgs {
    /// What the user gave, flags before variables.
    pub(super) fn collect(&self, variable: impl Fn(&str) -> Option<String>) -> Overrides {
        let mut overrides = Overrides::default();
        for key in KEYS {
            let flag = if key == "hands" {
                "--hand".to_owned()
            } else {
                format!("--{}", key.replace('_', "-"))
            };
            if let Some(text) = self.flag(key) {
                overrides.add(key, flag, text);
            }
            let name = format!("TSUKAMU_{}", key.to_uppercase());
            if let Some(text) = variable(&name) {
                overrides.add(key, name, text);
            }
        }
        overrides
    }

    fn flag(&self, key: &str) -> Option<String> {
        let on = |given: bool| given.then(|| "true".to_owned());
        match key {
            "listen" => self.listen.clone(),
            "scene" => self.scene.clone(),
            "hands" => (!self.hands.is_empty()).then(|| self.hands.join(";")),
            "rate_hz" => self.rate_hz.clone(),
            "mode" => self.mode.clone(),
            "tracking_grace_s" => self.tracking_grace_s.clone(),
            "keyframe_interval_s" => self.keyframe_interval_s.clone(),
            "event_log" => self.event_log.clone(),
            "recording_dir" => self.recording_dir.clone(),
            "record" => on(self.record),
            "record_frames" => on(self.record_frames),
            "record_raw" => on(self.record_raw),
            "vrpn" => self.vrpn.clone(),
            "vrpn_rate_hz" => self.vrpn_rate_hz.clone(),
            "vrpn_axes" => self.vrpn_axes.clone(),
            "log" => self.log.clone(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Words {
        #[command(flatten)]
        args: OverrideArgs,
    }

    #[test]
    fn flags_stand_above_variables() {
        let words = [
            "x",
            "--rate-hz",
            "500",
            "--record",
            "--hand",
            "a.csv",
            "--hand",
            "synthetic:b",
        ];
        let overrides = Words::parse_from(words).args.collect(|name| match name {
            "TSUKAMU_RATE_HZ" => Some("100".to_owned()),
            "TSUKAMU_MODE" => Some("lockstep".to_owned()),
            _ => None,
        });
        let texts: Vec<_> = ["rate_hz", "mode", "record", "hands", "log"]
            .map(|key| {
                overrides
                    .get(key)
                    .map(|given| (given.origin.as_str(), given.text.as_str()))
            })
            .into();
        assert_eq!(
            texts,
            [
                Some(("--rate-hz", "500")),
                Some(("TSUKAMU_MODE", "lockstep")),
                Some(("--record", "true")),
                Some(("--hand", "a.csv;synthetic:b")),
                None
            ]
        );
    }

    #[test]
    fn every_key_has_a_flag() {
        for key in KEYS {
            let flag = if key == "hands" {
                "--hand".to_owned()
            } else {
                format!("--{}", key.replace('_', "-"))
            };
            let words = if key.starts_with("record") && key != "recording_dir" {
                vec!["x".to_owned(), flag.clone()]
            } else {
                vec!["x".to_owned(), flag.clone(), "1".to_owned()]
            };
            let overrides = Words::parse_from(words).args.collect(|_| None);
            assert_eq!(
                overrides.get(key).map(|given| given.origin.clone()),
                Some(flag)
            );
        }
    }
}
