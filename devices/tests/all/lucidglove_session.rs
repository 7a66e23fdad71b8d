//! The LucidGlove's start-up and recovery, and what goes back to it, by hand-advanced time.

use tsukamu_devices::emulate::line_fault::Noise;
use tsukamu_devices::emulate::lucidglove::{LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::lucidglove::defaults::default_of;
use tsukamu_devices::glove::lucidglove::protocol::Encoding;
use tsukamu_devices::glove::lucidglove::session::LucidGloveSession;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState};

use crate::support::{Bench, Loss, MS, S};

type GloveBench = Bench<LucidGloveSession, LucidGloveEmulator>;

pub(crate) fn bench(settings: LucidGloveSettings, build: LucidGloveBuild) -> GloveBench {
    Bench::new(
        LucidGloveSession::new(settings, GloveCalibration::default()),
        LucidGloveEmulator::new(build),
    )
}

fn usual() -> GloveBench {
    bench(LucidGloveSettings::default(), LucidGloveBuild::default())
}

pub(crate) fn running(bench: &GloveBench) -> bool {
    bench.session.state() == SessionState::Running
}

fn infos(bench: &GloveBench) -> Vec<DeviceInfo> {
    let info = |event: &DeviceEvent| match event {
        DeviceEvent::Identified(info) => Some(info.clone()),
        _ => None,
    };
    bench.events.iter().filter_map(info).collect()
}

#[test]
fn a_running_glove_is_read_at_once_and_at_its_full_rate() {
    let mut bench = usual();
    bench.open();
    assert!(bench.run_until(S, running) < 100 * MS);
    use SessionState::{Opening, Resetting, Running};
    assert_eq!(bench.states(), [Opening, Resetting, Running]);
    bench.events.clear();
    bench.run_for(10 * S);
    // 23 bytes at 115200 bit/s take 2 ms, and the firmware pauses for 1 ms.
    let n_readings = bench.gloves().len();
    assert!((3000..=3400).contains(&n_readings), "{n_readings}");
    let stats = bench.session.stats();
    assert_eq!(
        (stats.dropped_records, stats.resyncs, stats.restarts),
        (0, 0, 0)
    );
    // No more lines wait at the glove than at the start.
    assert!(
        bench.emulator.n_unread() <= 1,
        "{}",
        bench.emulator.n_unread()
    );
    let gloves = bench.gloves();
    assert!(gloves.windows(2).all(|pair| {
        pair[0].sequence + 1 == pair[1].sequence && pair[0].stamp_ns < pair[1].stamp_ns
    }));
}

#[test]
fn a_glove_that_hears_nothing_slows_down_and_one_that_needs_no_answer_does_not() {
    let mut mute = usual();
    mute.open();
    mute.run_until(S, running);
    // Nothing of ours reaches it.
    let mut n_lines = 0;
    let start_ns = mute.now_ns;
    while mute.now_ns < start_ns + 10 * S {
        mute.now_ns += MS;
        n_lines += tsukamu_devices::emulate::Emulator::poll(&mut mute.emulator, mute.now_ns)
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
    }
    assert!((9..=12).contains(&n_lines), "{n_lines}");
    let build = LucidGloveBuild {
        force_feedback: false,
        ..LucidGloveBuild::default()
    };
    let mut free = bench(LucidGloveSettings::default(), build);
    free.open();
    free.run_until(S, running);
    free.run_for(S);
    assert!(free.session.stats().records > 150);
}

#[test]
fn boot_text_is_waited_for_and_is_no_error() {
    let mut bench = usual();
    bench.emulator.reset(0);
    bench.open();
    let took_ns = bench.run_until(3 * S, running);
    assert!((2 * S..2 * S + 200 * MS).contains(&took_ns), "{took_ns}");
    // The first line of a board of 12 bits is beyond 10 bits, and waits for the next.
    assert_eq!(bench.session.stats().dropped_records, 0);
    assert_eq!(bench.session.fault(), None);
    assert!(bench.requests.is_empty());
}

#[test]
fn line_ends_and_blank_lines_do_not_matter() {
    for line_end in ["\n", "\r\n", "\n\r\n"] {
        let build = LucidGloveBuild {
            line_end,
            ..LucidGloveBuild::default()
        };
        let mut bench = bench(LucidGloveSettings::default(), build);
        bench.open();
        bench.run_until(S, running);
        bench.run_for(5 * S);
        assert!(bench.session.stats().records > 500, "{line_end:?}");
        assert!(bench.emulator.n_unread() <= 1, "{line_end:?}");
        assert_eq!(bench.session.stats().resyncs, 0, "{line_end:?}");
    }
}

#[test]
fn the_range_is_found_out_or_set() {
    // 10 bits, 12 bits, and 12 bits with a stick that tells nothing: a fist of an AVR is a quarter of an ESP32's.
    let full = |bench: &GloveBench| {
        let reading = *bench.gloves().last().unwrap();
        let angle_rad = reading.angle_rad(GloveSensor::IndexMcp).unwrap();
        (angle_rad.to_degrees() / 90.0 * 1000.0).round()
    };
    for (max, fixed, expected) in [
        (1023, None, 1000.0),
        (4095, None, 1000.0),
        (1023, Some(4095), 250.0),
        (4095, Some(4095), 1000.0),
        (4095, Some(8190), 500.0),
    ] {
        let settings = LucidGloveSettings {
            max: fixed,
            ..LucidGloveSettings::default()
        };
        let build = LucidGloveBuild {
            max,
            ..LucidGloveBuild::default()
        };
        let mut bench = bench(settings, build);
        bench.emulator.set_curls([max; 5]);
        bench.open();
        bench.run_until(S, running);
        bench.run_for(100 * MS);
        assert_eq!(full(&bench), expected, "{max} {fixed:?}");
        assert_eq!(bench.session.fault(), None);
    }
    // A maximum that is set too small is said to be so.
    let settings = LucidGloveSettings {
        max: Some(1023),
        ..LucidGloveSettings::default()
    };
    let mut bench = bench(settings, LucidGloveBuild::default());
    bench.open();
    bench.run_for(S);
    let text = bench.session.fault().unwrap().to_string();
    assert!(
        running(&bench) && text.contains("1023") && text.contains("max"),
        "{text}"
    );
}

#[test]
fn single_lines_beyond_the_range_or_of_another_shape_are_not_believed() {
    let mut session =
        LucidGloveSession::new(LucidGloveSettings::default(), GloveCalibration::default());
    session.port_opened(0);
    let mut raw = |line: &str| {
        session.push(1, format!("{line}\n").as_bytes());
        let mut newest = None;
        while let Some(event) = session.next_event() {
            if let DeviceEvent::Glove(reading) = event {
                newest = reading
                    .sensor(GloveSensor::IndexPip)
                    .map(|sensor| sensor.raw);
            }
        }
        newest
    };
    assert_eq!(raw("E5"), None, "its beginning was missed");
    assert_eq!(raw("A1B2C3D4E5"), Some(2.0));
    assert_eq!(raw("A1B4000C3D4E5"), None, "a spoilt digit, perhaps");
    assert_eq!(raw("A1B3C3D4E5"), Some(3.0));
    assert_eq!(raw("A1B4000C3D4E5"), None);
    assert_eq!(raw("A1B4001C3D4E5"), Some(4001.0), "a board of 12 bits");
    assert_eq!(raw("A1B9C3"), None, "the rest was cut off");
    assert_eq!(raw("A1B8C3D4E5"), Some(8.0));
    assert_eq!(raw("A1B9C3"), None);
    assert_eq!(raw("A1B10C3"), Some(10.0), "three fingers from now on");
    assert_eq!(raw("1&2&3&4&5"), None);
    assert_eq!(raw("1&2&3&4&5"), Some(2.0), "another firmware");
    let two = "A1B2C3D4E5F6G7\nA1B3C3D4E5F6G7";
    assert_eq!(raw(two), Some(3.0), "the newest of several");
    assert_eq!(session.stats().dropped_records, 5 + 1);
    assert_eq!(session.stats().resyncs, 6);
}

#[test]
fn joints_and_splay_make_the_angles_that_the_glove_was_bent_to() {
    let build = LucidGloveBuild {
        joints: true,
        splay: true,
        info: Some(Handedness::Left),
        ..LucidGloveBuild::default()
    };
    let mut bench = bench(LucidGloveSettings::default(), build);
    let mut angles = [None; GloveSensor::N_SLOTS];
    for (index, sensor) in GloveSensor::ALL.into_iter().enumerate() {
        angles[sensor.slot()] = Some(0.02 * index as f64);
    }
    // The little finger swings by both of these, and by 20° at most.
    angles[GloveSensor::RingMiddleAbduction.slot()] = Some(-0.05);
    angles[GloveSensor::LittleRingAbduction.slot()] = Some(0.3);
    let worn = GloveCalibration::default().filled(|sensor| default_of(sensor, 4095));
    bench.emulator.set_slots(&worn.counts(&angles, 0, 4095));
    bench.open();
    bench.run_until(S, running);
    bench.run_for(S);
    let reading = *bench.gloves().last().unwrap();
    assert_eq!(reading.hand, Some(Handedness::Left));
    for sensor in GloveSensor::ALL {
        let wanted = angles[sensor.slot()].unwrap();
        match sensor {
            GloveSensor::PalmArch | GloveSensor::WristFlexion | GloveSensor::WristAbduction => {
                assert_eq!(reading.sensor(sensor), None);
            }
            // A step of 80° / 4095, twice rounded.
            _ => {
                let angle = reading.angle_rad(sensor).unwrap();
                assert!(
                    (angle - wanted).abs() < 1.1e-3,
                    "{sensor:?}: {angle}, not {wanted}"
                );
            }
        }
    }
    let info = infos(&bench).pop().unwrap();
    assert_eq!(
        (info.firmware.as_str(), info.identity.as_str()),
        ("5", "lucidgloves")
    );
    assert_eq!((info.n_sensors, info.hand), (30, Some(Handedness::Left)));
    assert!(infos(&bench).len() <= 2);
}

#[test]
fn the_hand_of_the_settings_is_believed_first() {
    let settings = LucidGloveSettings {
        hand: Some(Handedness::Left),
        ..LucidGloveSettings::default()
    };
    let build = LucidGloveBuild {
        info: Some(Handedness::Right),
        ..LucidGloveBuild::default()
    };
    let mut bench = bench(settings, build);
    bench.open();
    bench.run_until(S, running);
    bench.run_for(100 * MS);
    assert_eq!(bench.gloves()[0].hand, Some(Handedness::Left));
}

#[test]
fn one_percent_of_noise_costs_lines_and_nothing_else() {
    for encoding in [Encoding::Alpha, Encoding::Legacy] {
        let build = LucidGloveBuild {
            encoding,
            ..LucidGloveBuild::default()
        };
        let mut bench = bench(LucidGloveSettings::default(), build);
        bench.emulator.set_curls([1000, 2000, 3000, 2500, 1500]);
        bench.noise = Noise::new(0.01);
        bench.open();
        bench.run_until(3 * S, running);
        bench.events.clear();
        bench.run_for(20 * S);
        let stats = bench.session.stats();
        let gloves = bench.gloves();
        assert!(gloves.len() > 1000, "{encoding:?}: {stats:?}");
        assert!(stats.dropped_records > 100, "{encoding:?}: {stats:?}");
        assert_eq!(stats.restarts, 0, "{encoding:?}");
        // A digit that turns into another digit goes unnoticed; that is rare.
        let right = gloves.iter().filter(|reading| {
            let raw = |sensor| reading.sensor(sensor).unwrap().raw;
            raw(GloveSensor::ThumbMcp) == 1000.0 && raw(GloveSensor::LittlePip) == 1500.0
        });
        let n_wrong = gloves.len() - right.count();
        assert!(n_wrong * 100 < gloves.len(), "{encoding:?}: {n_wrong}");
        // The longest silence is that of a lost line end.
        let gaps = gloves
            .windows(2)
            .map(|pair| pair[1].stamp_ns - pair[0].stamp_ns);
        assert!(gaps.max().unwrap() < 250 * MS, "{encoding:?}");
    }
}

#[test]
fn lost_bytes_in_both_directions_do_not_stop_it() {
    let mut bench = usual();
    bench.loss = Loss::one_in(200);
    bench.open();
    bench.run_until(3 * S, running);
    bench.run_for(20 * S);
    let stats = bench.session.stats();
    assert!(stats.records > 1500 && stats.restarts == 0, "{stats:?}");
    assert!(bench.emulator.n_unread() <= 2);
}

#[test]
fn a_stalled_glove_frees_the_fingers_and_comes_back_by_itself() {
    let mut bench = usual();
    bench.open();
    bench.run_until(S, running);
    bench.emulator.faults.freeze();
    bench.run_until(2 * S, |bench| {
        bench.session.state() == SessionState::Stalled
    });
    assert_eq!(
        bench.session.fault(),
        Some(&Fault::Silent {
            device: "LucidGlove"
        })
    );
    assert_eq!(bench.requests, [PortRequest::ReapplySettings]);
    assert!(bench.sent.iter().any(|sent| sent == b"A0B0C0D0E0\n"));
    bench.run_for(S);
    bench.emulator.faults.thaw();
    assert!(bench.run_until(S, running) < 600 * MS);
    assert_eq!(bench.session.fault(), None);
    // A long freeze opens the port anew, each time after as long as a board needs to boot.
    bench.emulator.faults.freeze();
    bench.run_for(30 * S);
    let n_reopened = bench.requests.iter().filter(|r| **r == PortRequest::Reopen);
    assert!(
        (4..=6).contains(&n_reopened.count()),
        "{:?}",
        bench.requests
    );
    bench.emulator.faults.thaw();
    bench.run_until(6 * S, running);
}

#[test]
fn a_board_that_is_reset_in_mid_line_is_waited_for() {
    let mut bench = usual();
    bench.open();
    bench.run_until(S, running);
    bench.run_for(S);
    bench.emulator.faults.stop_mid_record();
    bench.run_for(20 * MS);
    bench.emulator.faults.thaw();
    let now_ns = bench.now_ns;
    bench.emulator.reset(now_ns);
    bench.run_for(100 * MS);
    let took_ns = bench.run_until(4 * S, |bench| {
        running(bench) && bench.gloves().last().unwrap().stamp_ns > now_ns + S
    });
    assert!(took_ns < 2 * S + 500 * MS, "{took_ns}");
    assert!(!bench.requests.contains(&PortRequest::Reopen));
}

#[test]
fn the_cable_is_pulled_and_plugged_in_again() {
    let mut bench = usual();
    bench.open();
    bench.run_until(S, running);
    for _ in 0..3 {
        let unplugged = Fault::Unplugged {
            path: "/dev/x".to_owned(),
        };
        bench.session.port_lost(bench.now_ns, unplugged.clone());
        assert_eq!(bench.session.state(), SessionState::Absent);
        assert_eq!(bench.session.deadline(), None);
        bench.now_ns += 3 * S;
        // Half a line is what comes first.
        bench.session.port_opened(bench.now_ns);
        bench.session.push(bench.now_ns, b"47C4095D1023E3071F2047");
        assert!(bench.run_until(S, running) < 100 * MS);
        assert_eq!(bench.session.fault(), None);
    }
    assert_eq!(bench.session.stats().restarts, 0);
}

#[test]
fn another_device_is_not_taken_for_a_glove() {
    let mut session =
        LucidGloveSession::new(LucidGloveSettings::default(), GloveCalibration::default());
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
        text.contains("not a LucidGlove") && text.contains("24 47 50"),
        "{text}"
    );
    assert_eq!(session.farewell(), b"");
}
