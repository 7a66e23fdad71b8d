//! What an operator installs: every sample settings file is without mistakes, and sets up what it says.

use std::path::{Path, PathBuf};

use tsukamu_devices::driver::Driver;
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::fivedt::settings::Model;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::tracker::flock::settings::Hemisphere;
use tsukamu_devices::tracker::space::TrackerSpace;
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{Settings, calibration, load};

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy")
}

fn settings(name: &str) -> Settings {
    load(Some(&deploy().join(name)), &Overrides::default())
        .unwrap_or_else(|mistakes| panic!("{mistakes}"))
}

/// Each hand: its name, the names of its glove and its tracker, and its station.
fn hands(settings: &Settings) -> Vec<(&str, &str, &str, u16)> {
    let name = |index: usize| settings.devices[index].name.as_str();
    settings
        .hands
        .iter()
        .map(|hand| {
            (
                hand.name.as_str(),
                name(hand.glove),
                name(hand.tracker),
                hand.station,
            )
        })
        .collect()
}

#[test]
fn every_sample_is_without_mistakes() {
    let entries = std::fs::read_dir(deploy()).expect("the folder of samples");
    let mut n_samples = 0;
    for entry in entries {
        let path = entry.expect("an entry").path();
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        if name.starts_with("calibration") {
            calibration::load(&path).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        } else if name.ends_with(".toml") {
            let settings = settings(&name);
            scene_file::load(&settings.world.scene).expect("its scene");
            assert!(
                settings.devices.is_empty() != settings.sources.is_none(),
                "{name}: hands of devices, or none of the scene's own"
            );
        } else {
            continue;
        }
        n_samples += 1;
    }
    assert!(n_samples >= 8, "{n_samples}");
}

#[test]
fn the_real_set_up_is_a_calibrated_glove_and_a_tracker_on_one_hand() {
    let settings = settings("cyberglove-fastrak.toml");
    let [glove, tracker] = settings.devices.as_slice() else {
        panic!("{:?}", settings.devices)
    };
    assert_eq!(glove.driver.name(), "cyberglove");
    assert_eq!(
        glove.calibration.sensor(GloveSensor::IndexMcp).raw_at_zero,
        47.0
    );
    for device in [glove, tracker] {
        let path = device.port.serial_path();
        assert!(path.is_some_and(|path| path.starts_with("/dev/serial/by-id/")));
    }
    assert_eq!((settings.hands.len(), settings.recording.raw), (1, true));
}

#[test]
fn the_emulated_set_up_finds_what_emulate_links() {
    let ports = settings("emulated.toml")
        .devices
        .into_iter()
        .map(|device| device.port.to_string());
    assert_eq!(
        ports.collect::<Vec<_>>(),
        ["/tmp/tsukamu-glove", "/tmp/tsukamu-tracker"]
    );
}

#[test]
fn two_lucidgloves_share_a_vrpn_tracker() {
    let settings = settings("lucidgloves-vrpn.toml");
    assert_eq!(
        hands(&settings),
        [
            ("left", "glove-left", "tracker", 1),
            ("right", "glove-right", "tracker", 2)
        ]
    );
    let [left, right, tracker] = settings.devices.as_slice() else {
        panic!("{:?}", settings.devices)
    };
    for (glove, hand) in [(left, Handedness::Left), (right, Handedness::Right)] {
        let Driver::LucidGlove(lucid) = &glove.driver else {
            panic!("{:?}", glove.driver)
        };
        assert_eq!(
            (lucid.hand, lucid.max, lucid.feedback),
            (Some(hand), Some(4095), true)
        );
    }
    let Driver::Vrpn(vrpn) = &tracker.driver else {
        panic!("{:?}", tracker.driver)
    };
    assert_eq!((vrpn.space, vrpn.scale), (TrackerSpace::ZUp, 1.0));
    assert_eq!(tracker.port.to_string(), "Wrists@tcp://tracking-pc:3883");
    assert!(
        settings
            .hands
            .iter()
            .all(|hand| hand.feedback_strength == 0.8)
    );
    let served = settings.vrpn.expect("it is a VRPN server too");
    assert_eq!(served.listen.port(), 3883);
}

#[test]
fn two_5dt_gloves_share_a_flock_on_a_bus() {
    let settings = settings("5dt-flock.toml");
    assert_eq!(
        hands(&settings),
        [
            ("left", "glove-left", "flock", 1),
            ("right", "glove-right", "flock", 2)
        ]
    );
    for glove in &settings.devices[..2] {
        let Driver::FiveDt(fivedt) = &glove.driver else {
            panic!("{:?}", glove.driver)
        };
        assert_eq!(
            (fivedt.model, glove.bauds.as_slice()),
            (Model::Fourteen, [19_200].as_slice())
        );
    }
    let Driver::Flock(flock) = &settings.devices[2].driver else {
        panic!("{:?}", settings.devices[2].driver)
    };
    assert_eq!(
        (flock.birds.as_slice(), flock.group),
        ([1, 2].as_slice(), true)
    );
    assert_eq!(flock.hemisphere, Some(Hemisphere::Forward));
    let transmitter = settings.devices[2]
        .world_from_transmitter
        .translation
        .vector;
    assert_eq!(
        [transmitter.x, transmitter.y, transmitter.z],
        [0.0, 0.2, -0.6]
    );
}

#[test]
fn hands_of_webxr_come_over_the_network_alone() {
    let settings = settings("webxr.toml");
    assert!(settings.devices.is_empty() && settings.hands.is_empty());
    assert!(settings.listen.ip().is_unspecified());
    assert_eq!(settings.world.tracking_grace_s, Some(0.5));
    let loaded = scene_file::load(&settings.world.scene).expect("the scene");
    let sources = settings.sources.expect("hands are named: none");
    let plan = plan(&loaded, Cast::Named(&sources)).expect("a plan");
    assert!(plan.hands.is_empty(), "nobody plays before a client comes");
}

#[test]
fn the_installed_settings_open_nothing_and_listen_to_this_machine() {
    let settings = settings("tsukamu.toml");
    assert!(settings.listen.ip().is_loopback());
    assert!(settings.devices.is_empty() && settings.vrpn.is_none());
    assert!(!settings.recording.from_start && settings.recording.dir.is_relative());
}
