//! Settings texts and flags in, settings or mistakes out.

use std::path::Path;

use super::device;
use super::overrides::{KEYS, Overrides};
use super::{Mode, Settings, parse};
use crate::document::mistake::Mistakes;
use crate::input::fusion::Between;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::tracker::space::TrackerSpace;

fn read(text: &str, flags: &[(&str, &str)]) -> Result<Settings, Mistakes> {
    let mut overrides = Overrides::default();
    flags.iter().for_each(|(key, value)| {
        overrides.add(key, format!("--{}", key.replace('_', "-")), *value)
    });
    parse("t.toml", text, Path::new(""), &overrides)
}

/// Asserts exactly these mistakes, one line each.
fn check(text: &str, flags: &[(&str, &str)], expected: &[&str]) {
    let found = read(text, flags)
        .err()
        .map(|mistakes| mistakes.to_string())
        .unwrap_or_default();
    assert_eq!(found.lines().collect::<Vec<_>>(), expected, "in\n{text}");
}

const DEVICES: &str = "[[device]]\nname = 'g'\nkind = 'cyberglove'\nport = '/dev/a'\n\
    [[device]]\nname = 't'\nkind = 'fastrak'\nport = '/dev/b'\nstations = [2]\nencoding = 'ascii'\n";

#[test]
fn nothing_given_is_the_demo_on_loopback() {
    let settings = read("", &[]).unwrap();
    assert!(settings.listen.ip().is_loopback());
    assert_eq!(
        (settings.world.scene.as_str(), settings.world.mode),
        ("demo", Mode::Realtime)
    );
    assert_eq!(
        (settings.sources, settings.recording.from_start),
        (None, false)
    );
}

#[test]
fn flags_stand_above_the_file() {
    let text = "scene = 'target-game'\nrate_hz = 500\nmode = 'realtime'\nlisten = '0.0.0.0:1'\nrecord = false";
    let flags = [
        ("rate_hz", "1000"),
        ("mode", "lockstep"),
        ("hands", "synthetic:free;synthetic:stack"),
        ("record", "true"),
    ];
    let settings = read(text, &flags).unwrap();
    assert_eq!(
        (settings.world.scene.as_str(), settings.world.rate_hz),
        ("target-game", Some(1000.0))
    );
    assert_eq!(
        (settings.world.mode, settings.recording.from_start),
        (Mode::Lockstep, true)
    );
    assert_eq!(settings.sources.map(|sources| sources.len()), Some(2));
    assert_eq!(settings.listen.port(), 1);
}

#[test]
fn devices_and_hands_find_each_other() {
    let text = format!(
        "{DEVICES}[[hand]]\nname = 'h'\nside = 'left'\nglove = 'g'\ntracker = 't'\nstation = 2\nscale = 0.9\nmin_cutoff_hz = 1\nbetween = 'hold'\n"
    );
    let settings = read(&text, &[]).unwrap();
    let hand = &settings.hands[0];
    assert_eq!(
        (
            hand.glove,
            hand.tracker,
            hand.station,
            hand.model.side.name()
        ),
        (0, 1, 2, "left")
    );
    assert_eq!(hand.fusion.between, Between::Hold);
    assert_eq!(
        hand.fusion.wrist.filter.map(|filter| filter.beta),
        Some(0.0)
    );
    assert_eq!(hand.fusion.wrist, hand.fusion.fingers);
    let Driver::Fastrak(tracker) = &settings.devices[1].driver else {
        panic!("a tracker")
    };
    assert_eq!(tracker.stations, [false, true, false, false]);
    assert_eq!(settings.devices[0].bauds, [115_200]);
}

#[test]
fn each_stream_of_a_hand_has_keys_of_its_own() {
    let hand = "[[hand]]\nname = 'h'\nside = 'left'\nglove = 'g'\ntracker = 't'\nstation = 2\n";
    let read = |more: &str| read(&format!("{DEVICES}{hand}{more}"), &[]);
    let fusion = |more: &str| read(more).unwrap().hands[0].fusion;
    let filters = |more: &str| {
        let fusion = fusion(more);
        [fusion.fingers.filter, fusion.wrist.filter]
            .map(|filter| filter.map(|filter| (filter.min_cutoff_hz, filter.beta)))
    };
    assert_eq!(filters(""), [None, None]);
    assert_eq!(
        filters("min_cutoff_hz = 2\nbeta = 3\n"),
        [Some((2.0, 3.0)); 2]
    );
    assert_eq!(
        filters("glove_min_cutoff_hz = 2\n"),
        [Some((2.0, 0.0)), None]
    );
    assert_eq!(
        filters("min_cutoff_hz = 2\nbeta = 3\ntracker_min_cutoff_hz = 5\nglove_beta = 7\n"),
        [Some((2.0, 7.0)), Some((5.0, 3.0))]
    );
    let fusion = fusion("glove_delay_s = 0.02\ntracker_delay_s = 0.01\nglove_predict_s = 0.1\n");
    assert_eq!((fusion.fingers.delay_s, fusion.wrist.delay_s), (0.02, 0.01));
    assert_eq!(
        (fusion.fingers.predict_s, fusion.wrist.predict_s),
        (0.1, 0.0)
    );
    for (more, words) in [
        ("glove_predict_s = 0.2\n", "glove_predict_s: is 0.2"),
        ("tracker_delay_s = -1\n", "tracker_delay_s: is -1"),
        (
            "tracker_beta = 1\n",
            "tracker_beta: does nothing without tracker_min_cutoff_hz",
        ),
    ] {
        let mistakes = read(more).unwrap_err().to_string();
        assert!(mistakes.contains(words), "{mistakes}");
    }
}

#[test]
fn all_mistakes_are_reported_at_once() {
    let kinds: Vec<String> = device::KINDS
        .iter()
        .map(|(name, _)| format!("{name:?}"))
        .collect();
    check(
        "listen = 'here'\nrate_hz = 0\nkeyframe_interval = 2\n[[device]]\nname = 'g'\nkind = 'cyberglobe'\nport = 3\n",
        &[
            ("mode", "lockstop"),
            ("event_log", "many"),
            ("hands", "no.csv"),
        ],
        &[
            "--mode: mode: is \"lockstop\"; it must be one of realtime, lockstep",
            "--event-log: event_log: is \"many\"; it must be a number",
            "--hands: hands: names \"no.csv\"; there is no such file, and no synthetic:NAME",
            "t.toml:1:10: listen: is \"here\"; it must be an address with a port, such as 127.0.0.1:7447",
            "t.toml:2:11: rate_hz: is 0; it must be from 1 to 4000 steps per second",
            "t.toml:3:1: keyframe_interval: is no known key; did you mean keyframe_interval_s?",
            &format!(
                "t.toml:6:8: device[0].kind: is \"cyberglobe\"; it must be one of {}; did you mean \"cyberglove\"?",
                kinds.join(", ")
            ),
            "t.toml:7:8: device[0].port: is a integer; it must be text in quotes",
        ],
    );
}

#[test]
fn a_device_has_the_rate_that_it_is_set_to_or_its_drivers() {
    let glove = "[[device]]\nname = 'g'\nkind = 'cyberglove'\nport = '/dev/a'\n";
    let device =
        |more: &str| read(&format!("{glove}{more}"), &[]).map(|all| all.devices[0].clone());
    let device_at = device("expected_rate_hz = 85\nsample_rate_hz = 90").unwrap();
    assert_eq!(device_at.expected_rate_hz, Some(85.0));
    assert_eq!(device_at.driver.nominal_rate_hz(), Some(90.0));
    assert_eq!(device("").unwrap().expected_rate_hz, None);
    let mistake = device("expected_rate_hz = 0").unwrap_err().to_string();
    assert!(mistake.contains("expected_rate_hz"), "{mistake}");
}

#[test]
fn mistakes_between_devices_and_hands() {
    let hand = "[[hand]]\nname = 'h'\nside = 'right'\nglove = 'g'\ntracker = 't'\n";
    for (text, expected) in [
        (
            format!("{DEVICES}{hand}"),
            "t.toml:11:1: hand[0].station: is 1, which the tracker's stations leave out",
        ),
        (
            format!("{DEVICES}{hand}station = 2\nbeta = 1"),
            "t.toml:17:8: hand[0].beta: does nothing without min_cutoff_hz",
        ),
        (
            hand.replace("'t'", "'g'").replace("'g'\n", "'x'\n"),
            "t.toml:4:9: hand[0].glove: is \"x\"; there is no glove of that name without mistakes",
        ),
        (
            format!("{DEVICES}[[device]]\nname = 'g'\nkind = 'fastrak'\nport = '/dev/c'"),
            "t.toml:12:8: device[2].name: is \"g\", which another device carries",
        ),
        (
            format!("{DEVICES}[[device]]\nname = 'u'\nkind = 'fastrak'\nport = '/dev/a'"),
            "t.toml:14:8: device[2].port: is \"/dev/a\", which another device is on",
        ),
    ] {
        let found = read(&text, &[]).unwrap_err().to_string();
        assert!(
            found.lines().any(|line| line == expected),
            "{found}\nlacks\n{expected}"
        );
    }
}

#[test]
fn every_key_can_be_overridden() {
    let good = |key: &str| match key {
        "listen" | "vrpn" => "[::1]:9",
        "vrpn_axes" => "z_up",
        "hands" => "synthetic:free",
        "mode" => "realtime",
        "rate_hz" | "vrpn_rate_hz" | "tracking_grace_s" | "keyframe_interval_s" | "event_log" => {
            "20"
        }
        "record" | "record_frames" | "record_raw" => "true",
        _ => "words",
    };
    let flags: Vec<(&str, &str)> = KEYS.into_iter().map(|key| (key, good(key))).collect();
    let settings = read("", &flags).unwrap();
    let default = read("", &[]).unwrap();
    assert_ne!(settings.listen, default.listen);
    assert_ne!(settings.world.scene, default.world.scene);
    assert_ne!(settings.publish, default.publish);
    assert_ne!(settings.recording, default.recording);
    let vrpn = settings.vrpn.expect("a VRPN server");
    assert_eq!((vrpn.listen, vrpn.rate_hz), (settings.listen, 20.0));
    assert_eq!((vrpn.axes, default.vrpn), (TrackerSpace::ZUp, None));
    assert_eq!(
        (settings.log.as_str(), settings.world.tracking_grace_s),
        ("words", Some(20.0))
    );
}

#[test]
fn calibration_mistakes_name_their_place() {
    let parse =
        |text| super::calibration::parse("c.toml", text).map_err(|mistakes| mistakes.to_string());
    assert!(parse("wearer = 'x'").is_ok());
    let unknown = parse("wearer = 'x'\nglove = 3").unwrap_err();
    assert!(
        unknown.starts_with("c.toml:2:1: unknown field"),
        "{unknown}"
    );
    let bad_mount =
        parse("[mount]\nposition_m = [0, 0, 0]\nrotation_xyzw = [0, 0, 0, 3]").unwrap_err();
    assert!(bad_mount.contains("unit quaternion"), "{bad_mount}");
}
