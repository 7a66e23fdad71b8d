//! The wearer's file: as text, its mistakes, its angles.

use std::collections::BTreeMap;

use tsukamu_devices::calibration::fit::FitFault;
use tsukamu_devices::glove::calibrate::{
    CalibrationProblem, Coupling, GloveCalibration, Handedness, MountOffset, SensorCalibration,
};
use tsukamu_devices::glove::quick_range::QuickRange;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;

const FILE: &str = r#"
wearer = "someone"
hand = "right"

[mount]
position_m = [0.0, 0.02, 0.03]
rotation_xyzw = [0.0, 0.0, 0.0, 1.0]

[sensors.index_mcp]
raw_at_zero = 60
gain_deg_per_count = 0.5
min_deg = -10
max_deg = 90

[sensors.thumb_rotation]
raw_at_zero = 100
gain_deg_per_count = -0.4
min_deg = -40
max_deg = 60
coupling = { sensor = "thumb_abduction", gain_deg_per_count = 0.1 }
"#;

fn counts(values: &[(GloveSensor, u16)]) -> [Option<f64>; GloveSensor::N_SLOTS] {
    let mut raw = [None; GloveSensor::N_SLOTS];
    for (sensor, value) in values {
        raw[sensor.slot()] = Some(f64::from(*value));
    }
    raw
}

#[test]
fn a_file_is_read_and_written() {
    let calibration: GloveCalibration = toml::from_str(FILE).unwrap();
    assert_eq!(calibration.hand, Some(Handedness::Right));
    assert_eq!(calibration.sensors.len(), 2);
    assert_eq!(calibration.problems(), []);
    assert_eq!(calibration.mount.wrist_from_sensor().translation.y, 0.02);
    let again: GloveCalibration = toml::from_str(&toml::to_string(&calibration).unwrap()).unwrap();
    assert_eq!(again, calibration);
    let error = toml::from_str::<GloveCalibration>("[sensors.index_mpc]\n").unwrap_err();
    assert!(error.to_string().contains("index_mpc"), "{error}");
    assert_eq!(
        toml::from_str::<GloveCalibration>("").unwrap(),
        GloveCalibration::default()
    );
}

#[test]
fn angles_follow_the_line_the_coupling_and_the_range() {
    let calibration: GloveCalibration = toml::from_str(FILE).unwrap();
    use GloveSensor::{IndexMcp, IndexPip, MiddleMcp, ThumbAbduction, ThumbRotation};
    let readings = calibration.angles(&counts(&[
        (IndexMcp, 120),
        (IndexPip, 60),
        (ThumbRotation, 90),
        (ThumbAbduction, 150),
    ]));
    let cases = [
        (IndexMcp, Some((30.0, false))),
        // Not in the file: the paper's half degree, from the default zero.
        (IndexPip, Some((10.0, false))),
        (ThumbRotation, Some((-0.4 * -10.0 + 0.1 * 50.0, false))),
        (MiddleMcp, None),
    ];
    for (sensor, expected) in cases {
        let found = readings[sensor.slot()]
            .map(|reading| (reading.angle_rad.to_degrees(), reading.clamped));
        match (found, expected) {
            (Some((angle, clamped)), Some((expected_angle, expected_clamped))) => {
                assert!((angle - expected_angle).abs() < 1e-9, "{sensor:?}: {angle}");
                assert_eq!(clamped, expected_clamped);
            }
            (found, expected) => assert_eq!(found, expected, "{sensor:?}"),
        }
    }
    let bent = calibration.angles(&counts(&[(IndexMcp, 255)]))[IndexMcp.slot()].unwrap();
    assert!((bent.angle_rad.to_degrees() - 90.0).abs() < 1e-9 && bent.clamped);
}

#[test]
fn every_mistake_is_named() {
    let sensor = GloveSensor::ThumbIp;
    let calibration = GloveCalibration {
        mount: MountOffset {
            position_m: [0.0; 3],
            rotation_xyzw: [0.0; 4],
        },
        sensors: BTreeMap::from([(
            sensor,
            SensorCalibration {
                raw_at_zero: f64::NAN,
                gain_deg_per_count: 0.0,
                min_deg: 5.0,
                max_deg: 5.0,
                coupling: Some(Coupling {
                    sensor,
                    gain_deg_per_count: 1.0,
                }),
            },
        )]),
        ..GloveCalibration::default()
    };
    let problems = calibration.problems();
    assert_eq!(problems.len(), 5, "{problems:?}");
    assert!(problems.contains(&CalibrationProblem::SelfCoupling { sensor }));
    assert_eq!(GloveCalibration::default().problems(), []);
    // A file that nobody checked does not panic either.
    let _ = calibration.angles(&counts(&[(sensor, 7)]));
}

#[test]
fn the_quick_routine_maps_extremes_to_joint_ranges() {
    let mut range = QuickRange::default();
    let base = GloveCalibration::default();
    for raw in [80, 50, 150, 110] {
        let reading = GloveReading {
            sensors: base.angles(&counts(&[
                (GloveSensor::IndexMcp, raw),
                (GloveSensor::RingDip, 99),
            ])),
            angles_valid: true,
            ..GloveReading::empty(0, 0)
        };
        range.add(&reading);
    }
    assert_eq!(range.extremes(GloveSensor::IndexMcp), Some((50.0, 150.0)));
    let fitted = range.fit(&base).unwrap().calibration;
    let index = fitted.sensor(GloveSensor::IndexMcp);
    assert!((index.raw_at_zero - 50.0).abs() < 1e-9);
    assert!((index.gain_deg_per_count - 0.9).abs() < 1e-9);
    // One that never moved is not fitted.
    assert!(!fitted.sensors.contains_key(&GloveSensor::RingDip));
    assert!(fitted.absent.contains(&GloveSensor::RingDip));
    assert_eq!(
        fitted.angles(&counts(&[(GloveSensor::RingDip, 99)])),
        [None; 24]
    );
    assert_eq!(
        QuickRange::default().fit(&base),
        Err(FitFault::NothingMoved)
    );
}

#[test]
fn counts_are_the_inverse_of_angles() {
    let calibration: GloveCalibration = toml::from_str(FILE).unwrap();
    let mut wanted = [None; GloveSensor::N_SLOTS];
    for (sensor, angle_deg) in GloveSensor::ALL
        .into_iter()
        .zip((0..).map(|step| f64::from(step) * 1.5))
    {
        wanted[sensor.slot()] = Some(angle_deg.to_radians());
    }
    let counts = calibration.counts(&wanted, 1, 254);
    let readings = calibration.angles(&counts.map(|value| Some(f64::from(value))));
    for sensor in GloveSensor::ALL {
        let error = readings[sensor.slot()].unwrap().angle_rad - wanted[sensor.slot()].unwrap();
        // Half a count.
        assert!(
            error.to_degrees().abs() <= 0.25 + 1e-9,
            "{sensor:?}: {error}"
        );
    }
}

#[test]
fn a_sensors_name_is_its_key_in_the_file() {
    for sensor in GloveSensor::ALL {
        let file = format!("absent = [\"{}\"]", sensor.name());
        let calibration: GloveCalibration = toml::from_str(&file).unwrap();
        assert!(calibration.absent.contains(&sensor));
        assert_eq!(GloveSensor::from_name(sensor.name()), Some(sensor));
        let again: GloveCalibration =
            toml::from_str(&toml::to_string(&calibration).unwrap()).unwrap();
        assert_eq!(again, calibration);
    }
    assert_eq!(GloveSensor::from_name("nose"), None);
}
