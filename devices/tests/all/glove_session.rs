//! The CyberGlove's start-up and recovery, by hand-advanced time.

use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::session::CyberGloveSession;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, Sampling, SensorCount};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::{DeviceEvent, PortRequest, Session, SessionState};

use crate::support::{Bench, Loss, MS, S};

type GloveBench = Bench<CyberGloveSession, CyberGloveEmulator>;

fn bench(settings: CyberGloveSettings, sensors: SensorCount) -> GloveBench {
    Bench::new(
        CyberGloveSession::new(settings, GloveCalibration::default()),
        CyberGloveEmulator::new(sensors, Handedness::Left),
    )
}

fn running(bench: &GloveBench) -> bool {
    bench.session.state() == SessionState::Running
}

#[test]
fn starts_within_half_a_second_and_says_what_it_is() {
    for (sensors, n_sensors) in [(SensorCount::Eighteen, 18), (SensorCount::TwentyTwo, 22)] {
        let mut bench = bench(CyberGloveSettings::default(), sensors);
        let bent: Vec<u8> = (50..50 + n_sensors as u8).collect();
        bench.emulator.set_sensors(&bent);
        bench.open();
        let took_ns = bench.run_until(S, running);
        assert!(took_ns < 500 * MS, "{took_ns}");
        use SessionState::{Opening, Querying, Resetting, Running};
        assert_eq!(bench.states(), [Opening, Resetting, Querying, Running]);
        let info = bench.events.iter().find_map(|event| match event {
            DeviceEvent::Identified(info) => Some(info.clone()),
            _ => None,
        });
        let info = info.unwrap();
        assert_eq!(
            (info.n_sensors, info.hand),
            (n_sensors, Some(Handedness::Left))
        );
        assert_eq!(info.firmware, "box 1.0, glove 2.0");
        bench.run_for(S);
        let gloves = bench.gloves();
        assert!((99..=102).contains(&gloves.len()), "{}", gloves.len());
        let reading = gloves[50];
        assert!(reading.angles_valid);
        assert_eq!(reading.plugged_in, Some(true));
        let raw: Vec<u8> = reading
            .sensors
            .iter()
            .flatten()
            .map(|sensor| sensor.raw as u8)
            .collect();
        assert_eq!(raw, bent);
        let dip = reading.angle_rad(GloveSensor::IndexDip);
        assert_eq!(dip.is_some(), n_sensors == 22);
        assert!(gloves.windows(2).all(|pair| {
            pair[0].sequence + 1 == pair[1].sequence && pair[0].stamp_ns < pair[1].stamp_ns
        }));
        let stats = bench.session.stats();
        assert_eq!(
            (stats.resyncs, stats.dropped_records, stats.restarts),
            (0, 0, 0)
        );
    }
}

#[test]
fn a_stream_left_running_is_stopped_first() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.emulator.push(0, b"S");
    bench.open();
    assert!(bench.run_until(S, running) < 500 * MS);
    assert_eq!(bench.sent[0], [3]);
    assert_eq!(bench.session.stats().resyncs, 0);
}

#[test]
fn polling_and_odd_settings_work() {
    let cases = [
        CyberGloveSettings {
            sampling: Sampling::Poll { period_ns: 10 * MS },
            ..CyberGloveSettings::default()
        },
        CyberGloveSettings {
            status: false,
            filter: false,
            rate_hz: None,
            ..CyberGloveSettings::default()
        },
        CyberGloveSettings {
            forced_sensors: Some(SensorCount::TwentyTwo),
            rate_hz: Some(45.0),
            ..CyberGloveSettings::default()
        },
    ];
    for settings in cases {
        let mut bench = bench(settings.clone(), SensorCount::TwentyTwo);
        bench.open();
        bench.run_until(S, running);
        bench.run_for(S);
        let n_readings = bench.gloves().len();
        assert!(n_readings >= 44, "{settings:?}: {n_readings}");
        assert!(bench.gloves().iter().all(|reading| reading.angles_valid));
        assert_eq!(bench.session.stats().dropped_records, 0, "{settings:?}");
    }
}

#[test]
fn survives_loss_and_counts_it() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.emulator.set_sensors(&[77; 22]);
    bench.loss = Loss::one_in(200);
    bench.open();
    bench.run_until(20 * S, running);
    bench.run_for(20 * S);
    let stats = bench.session.stats();
    assert!(stats.records > 1000, "{stats:?}");
    assert!(
        stats.resyncs > 20 && stats.dropped_records >= stats.resyncs,
        "{stats:?}"
    );
    // Nothing that was damaged got through.
    for reading in bench.gloves() {
        for sensor in reading.sensors.iter().flatten() {
            assert_eq!(sensor.raw, 77.0);
        }
    }
}

#[test]
fn one_lost_byte_costs_one_record() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::Eighteen);
    bench.open();
    bench.run_until(S, running);
    bench.emulator.faults.drop_bytes(1);
    bench.run_for(500 * MS);
    let stats = bench.session.stats();
    assert_eq!(
        (stats.resyncs, stats.dropped_records, stats.restarts),
        (1, 1, 0)
    );
    assert_eq!(bench.session.state(), SessionState::Running);
}

#[test]
fn a_frozen_glove_is_noticed_and_revived() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.open();
    bench.run_until(S, running);
    bench.emulator.faults.stop_mid_record();
    let took_ns = bench.run_until(2 * S, |bench| {
        bench.session.state() == SessionState::Stalled
    });
    assert!(took_ns < 1_100 * MS, "{took_ns}");
    assert_eq!(
        bench.session.fault(),
        Some(&Fault::Silent {
            device: "CyberGlove"
        })
    );
    bench.run_for(300 * MS);
    assert_eq!(bench.requests, [PortRequest::ReapplySettings]);
    bench.emulator.faults.thaw();
    bench.run_until(5 * S, running);
    assert_eq!(bench.session.fault(), None);
}

#[test]
fn a_dead_glove_is_restarted_then_reopened() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.emulator.faults.freeze();
    bench.open();
    bench.run_until(5 * S, |bench| !bench.requests.is_empty());
    assert_eq!(bench.requests, [PortRequest::Reopen]);
    assert!(bench.sent.contains(&vec![0x12]));
    assert_eq!(
        bench.session.fault(),
        Some(&Fault::Silent {
            device: "CyberGlove"
        })
    );
    bench.run_for(30 * S);
    assert!(bench.requests.len() >= 3);
    // A late answer to the restart is no hindrance.
    bench.emulator.restart_takes_ns = 4 * S;
    bench.emulator.faults.thaw();
    bench.run_until(60 * S, running);
}

#[test]
fn a_glove_pulled_out_is_reported_and_comes_back() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.open();
    bench.run_until(S, running);
    bench.emulator.set_plugged_in(false);
    bench.run_for(100 * MS);
    let last = *bench.gloves().last().unwrap();
    assert_eq!(
        (last.plugged_in, last.angles_valid, last.error),
        (Some(false), false, Some('g'))
    );
    assert_eq!(last.angle_rad(GloveSensor::IndexMcp), None);
    assert_eq!(bench.session.fault(), Some(&Fault::GloveUnplugged));
    bench.emulator.set_plugged_in(true);
    bench.run_for(100 * MS);
    assert!(bench.gloves().last().unwrap().angles_valid);
    assert_eq!(bench.session.fault(), None);
}

#[test]
fn a_box_without_a_glove_is_asked_again() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.emulator.set_plugged_in(false);
    bench.open();
    bench.run_for(5 * S);
    assert_eq!(bench.session.state(), SessionState::Stalled);
    assert_eq!(bench.session.fault(), Some(&Fault::GloveUnplugged));
    assert!(bench.events.len() < 20, "{:?}", bench.events);
    bench.emulator.set_plugged_in(true);
    assert!(bench.run_until(2 * S, running) < 1_500 * MS);
}

#[test]
fn another_device_is_not_taken_for_a_glove() {
    let mut session =
        CyberGloveSession::new(CyberGloveSettings::default(), GloveCalibration::default());
    session.port_opened(0);
    let mut now_ns = 0;
    while session.poll_port_request() != Some(PortRequest::Reopen) {
        now_ns += 50 * MS;
        assert!(now_ns < 20 * S);
        session.handle_timeout(now_ns);
        session.push(now_ns, b"$GPGGA,123519,4807.038,N\r\n");
    }
    let text = session.fault().unwrap().to_string();
    assert!(
        text.contains("not a CyberGlove") && text.contains("24 47 50"),
        "{text}"
    );
}

#[test]
fn a_record_length_that_was_not_negotiated_is_learned() {
    // A glove whose every answer but `?G` is lost, and which sends 18 sensors without status.
    let mut session =
        CyberGloveSession::new(CyberGloveSettings::default(), GloveCalibration::default());
    session.port_opened(0);
    let mut now_ns = 0;
    let record = [&b"S"[..], &[90; 18], &[0]].concat();
    let mut streaming = false;
    while session.stats().records < 5 {
        now_ns += 10 * MS;
        assert!(now_ns < 20 * S);
        session.handle_timeout(now_ns);
        while let Some(command) = session.poll_transmit() {
            match command.as_slice() {
                b"?G" => session.push(now_ns, b"?G\x03\0"),
                b"S" => streaming = true,
                _ => {}
            }
        }
        if streaming {
            session.push(now_ns, &record);
        }
    }
    assert_eq!(session.stats().dropped_records, 3);
}

#[test]
fn a_glove_that_changes_its_records_is_followed_or_set_right() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::TwentyTwo);
    bench.open();
    bench.run_until(S, running);
    // Somebody else's host switches the time stamp on: learned after three records.
    bench.emulator.push(bench.now_ns, b"D\x01");
    bench.run_for(200 * MS);
    assert!(bench.gloves().last().unwrap().device_ticks.is_some());
    // The foreign answer and the three.
    assert_eq!(bench.session.stats().dropped_records, 4);
    // And takes sensors away: no glove has such records, so the settings are sent again.
    bench.emulator.push(bench.now_ns, b"M\x0F\0\0");
    bench.run_until(5 * S, |bench| bench.session.stats().restarts > 0);
    bench.run_until(10 * S, |bench| {
        running(bench) && bench.gloves().last().unwrap().device_ticks.is_none()
    });
    let mut states = bench.states();
    states.reverse();
    assert!(states.starts_with(&[
        SessionState::Running,
        SessionState::Querying,
        SessionState::Stalled
    ]));
}

#[test]
fn a_power_cut_of_the_box_is_recovered_from() {
    let mut bench = bench(CyberGloveSettings::default(), SensorCount::Eighteen);
    bench.open();
    bench.run_until(S, running);
    bench.emulator.push(bench.now_ns, b"\x12");
    bench.run_until(3 * S, |bench| bench.session.stats().restarts == 1);
    bench.run_until(10 * S, running);
    bench.run_for(100 * MS);
    assert_eq!(bench.gloves().last().unwrap().plugged_in, Some(true));
    assert_eq!(bench.session.fault(), None);
}
