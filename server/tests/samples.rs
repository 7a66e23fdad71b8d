//! What an operator installs: every sample settings file is without mistakes.

use std::path::{Path, PathBuf};

use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{Settings, calibration, load};

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy")
}

fn settings(name: &str) -> Settings {
    load(Some(&deploy().join(name)), &Overrides::default())
        .unwrap_or_else(|mistakes| panic!("{mistakes}"))
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
            settings(&name);
        } else {
            continue;
        }
        n_samples += 1;
    }
    assert!(n_samples >= 3, "{n_samples}");
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
