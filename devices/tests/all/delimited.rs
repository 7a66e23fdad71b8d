//! A glove that prints lines of numbers: lines, settings, start-up, recovery, arbitrary bytes.

use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::delimited::DelimitedEmulator;
use tsukamu_devices::emulate::line_fault::Noise;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::delimited::column::Column;
use tsukamu_devices::glove::delimited::format::DelimitedSession;
use tsukamu_devices::glove::delimited::line::{LineFault, read_line};
use tsukamu_devices::glove::delimited::settings::{DelimitedSettings, Scale, TimeUnit};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::{PortRequest, Session, SessionState};

use crate::garbage::{recovers, survive};
use crate::support::{Bench, MS, S};

fn settings(columns: &[&str]) -> DelimitedSettings {
    let columns = columns.iter().map(|name| Column::parse(name).unwrap());
    DelimitedSettings::new(columns.collect())
}

fn fingers() -> DelimitedSettings {
    settings(&["thumb", "index", "middle", "ring", "little"])
}

fn bench(settings: DelimitedSettings) -> Bench<DelimitedSession, DelimitedEmulator> {
    let session = DelimitedSession::new(settings.clone(), GloveCalibration::default());
    Bench::new(session, DelimitedEmulator::new(settings))
}

fn running(bench: &Bench<DelimitedSession, DelimitedEmulator>) -> bool {
    bench.session.state() == SessionState::Running
}

/// The values of the line that drive something, from the thumb on; each flexure drives two joints.
fn values(line: &str, settings: &DelimitedSettings) -> Result<Vec<f64>, LineFault> {
    let row = read_line(line, settings)?;
    Ok(row.raw.iter().flatten().copied().collect())
}

#[test]
fn lines_of_many_makes_are_read() {
    let five = Ok(vec![
        10.0, 10.0, 20.0, 20.0, 30.0, 30.0, 40.0, 40.0, 50.0, 50.0,
    ]);
    let usual = [
        "10,20,30,40,50",
        "10, 20, 30, 40, 50",
        "10 20 30 40 50",
        "10\t20\t30\t40\t50",
        "  10;20;30 ; 40;50;",
        "10.0,+20,3e1,40.,5.0e1",
        "10,20,30,40,50,",
    ];
    for line in usual {
        assert_eq!(values(line, &fingers()), five, "{line}");
    }
    let columns = |found| {
        let expected = 5;
        Err(LineFault::Columns { found, expected })
    };
    for (line, expected) in [
        ("", Err(LineFault::Other)),
        ("# 10,20,30,40,50", Err(LineFault::Other)),
        ("// five numbers", Err(LineFault::Other)),
        ("ready", columns(1)),
        ("10,20,30,40", columns(4)),
        ("10,20,30,40,50,60", columns(6)),
        ("10,20,,40,50", Err(LineFault::Number { column: 3 })),
        ("10,20,x30,40,50", Err(LineFault::Number { column: 3 })),
        ("10,20,nan,40,50", Err(LineFault::Number { column: 3 })),
        ("inf,20,30,40,50", Err(LineFault::Number { column: 1 })),
        ("10,20,30,40,1e999", Err(LineFault::Number { column: 5 })),
    ] {
        assert_eq!(values(line, &fingers()), expected, "{line}");
    }
    // A prefix tells lines of numbers from others, and may be a comment's sign.
    let with_prefix = DelimitedSettings {
        prefix: "#H:".to_owned(),
        ..fingers()
    };
    assert_eq!(values("#H: 10,20,30,40,50", &with_prefix), five);
    assert_eq!(
        values("10,20,30,40,50", &with_prefix),
        Err(LineFault::Other)
    );
    // What is skipped need not be a number: the form that a plotter reads.
    let plotted = DelimitedSettings {
        separators: ":,".to_owned(),
        ..settings(&["skip", "index_mcp", "skip", "middle_mcp"])
    };
    assert_eq!(
        values("index:512,middle:300", &plotted),
        Ok(vec![512.0, 300.0])
    );
    // Without a blank among the separators a blank is part of a column.
    let commas = DelimitedSettings {
        separators: ",".to_owned(),
        ..settings(&["index_mcp", "middle_mcp"])
    };
    assert_eq!(values(" 1 , 2 ", &commas), Ok(vec![1.0, 2.0]));
    assert_eq!(
        values("1 2, 3", &commas),
        Err(LineFault::Number { column: 1 })
    );
}

#[test]
fn the_homunculus_is_a_line_of_sixteen_numbers() {
    let settings = DelimitedSettings::homunculus();
    assert_eq!(settings.columns.len(), 16);
    let line: Vec<String> = (1..=16).map(|number| (100 * number).to_string()).collect();
    let row = read_line(&line.join(" "), &settings).unwrap();
    for (sensor, raw) in [
        (GloveSensor::ThumbRotation, 100.0),
        (GloveSensor::IndexMcp, 600.0),
        (GloveSensor::IndexPip, 700.0),
        (GloveSensor::MiddleMcp, 900.0),
        (GloveSensor::LittlePip, 1600.0),
    ] {
        assert_eq!(row.raw[sensor.slot()], Some(raw), "{sensor:?}");
    }
    let mut bench = bench(settings);
    bench.emulator.set_slots(&[2048.0; GloveSensor::N_SLOTS]);
    bench.open();
    bench.run_until(S, running);
    let reading = *bench.gloves().last().unwrap();
    assert_eq!(reading.sensors.iter().flatten().count(), 15);
    assert_eq!(reading.sensor(GloveSensor::IndexPip).unwrap().raw, 2048.0);
}

#[test]
fn numbers_become_angles_by_range_or_as_they_are() {
    let cases = [
        (Scale::Range(0.0, 1023.0), 511.5, 45.0),
        (Scale::Range(900.0, 100.0), 500.0, 45.0),
        (Scale::Range(900.0, 100.0), 900.0, 0.0),
        (Scale::Degrees, 30.0, 30.0),
        (Scale::Degrees, -7.5, -7.5),
        (Scale::Radians, 0.5, 0.5_f64.to_degrees()),
    ];
    for (scale, raw, expected_deg) in cases {
        let settings = DelimitedSettings {
            scale,
            ..settings(&["index_mcp"])
        };
        let mut session = DelimitedSession::new(settings, GloveCalibration::default());
        session.port_opened(0);
        session.push(MS, format!("\n{raw}\n").as_bytes());
        let readings: Vec<_> = std::iter::from_fn(|| session.next_event())
            .filter_map(|event| match event {
                tsukamu_devices::session::DeviceEvent::Glove(reading) => Some(reading),
                _ => None,
            })
            .collect();
        let angle_deg = readings[0]
            .angle_rad(GloveSensor::IndexMcp)
            .unwrap()
            .to_degrees();
        assert!(
            (angle_deg - expected_deg).abs() < 1e-9,
            "{scale:?} {angle_deg}"
        );
    }
}

#[test]
fn a_time_column_is_the_devices_clock() {
    let cases = [
        (
            TimeUnit::Milliseconds,
            ["7", "12.5", "4294967295", "3"],
            [7_000, 12_500, 4_294_967_295_000, 4_294_967_299_000],
        ),
        (
            TimeUnit::Microseconds,
            ["7", "12", "4294967295", "3"],
            [7, 12, 4_294_967_295, 4_294_967_299],
        ),
        (
            TimeUnit::Seconds,
            ["0.000007", "1.5", "86400.25", "86400.5"],
            [7, 1_500_000, 86_400_250_000, 86_400_500_000],
        ),
        (TimeUnit::Ticks, ["7", "12", "13", "14"], [7, 12, 13, 14]),
    ];
    for (time_unit, texts, expected) in cases {
        let settings = DelimitedSettings {
            time_unit,
            ..settings(&["time", "index"])
        };
        let mut bench = bench(settings);
        bench.session.port_opened(0);
        bench.session.push(MS, b"\n");
        for text in texts {
            bench.session.push(MS, format!("{text},1\n").as_bytes());
        }
        while let Some(event) = bench.session.next_event() {
            bench.events.push(event);
        }
        let ticks: Vec<u64> = bench
            .gloves()
            .iter()
            .filter_map(|reading| reading.device_ticks)
            .collect();
        assert_eq!(ticks, expected, "{time_unit:?}");
    }
}

#[test]
fn a_board_comes_up_after_its_boot_text() {
    let mut bench = bench(fingers());
    bench.emulator.boot_text = "rst:0x1 (POWERON_RESET)\r\nets Jul 29 2019 12:21:46\r\n".repeat(8);
    bench.emulator.set_slots(&[300.0; GloveSensor::N_SLOTS]);
    bench.open();
    assert!(bench.run_until(S, running) < 100 * MS);
    bench.run_for(S);
    let gloves = bench.gloves();
    assert!((98..=106).contains(&gloves.len()), "{}", gloves.len());
    let raw: Vec<f64> = gloves[9]
        .sensors
        .iter()
        .flatten()
        .map(|sensor| sensor.raw)
        .collect();
    assert_eq!(raw, [300.0; 10]);
    let stats = bench.session.stats();
    assert_eq!(
        (stats.resyncs, stats.dropped_records, stats.restarts),
        (0, 0, 0)
    );
    // A reset of the board is a loss of step, and nothing more.
    bench.emulator.faults.stop_mid_record();
    bench.run_for(20 * MS);
    bench.emulator.faults.thaw();
    bench.emulator.reset(bench.now_ns);
    bench.run_for(500 * MS);
    let stats = bench.session.stats();
    assert!(running(&bench));
    assert_eq!((stats.resyncs, stats.restarts), (1, 0), "{stats:?}");
}

#[test]
fn a_board_that_waits_for_a_word_is_told_it_again() {
    let settings = DelimitedSettings {
        start: "start\n".to_owned(),
        ..fingers()
    };
    let mut bench = bench(settings);
    bench.open();
    bench.run_until(S, running);
    assert_eq!(bench.sent, [b"start\n"]);
    let now_ns = bench.now_ns;
    bench.emulator.reset(now_ns);
    bench.run_until(3 * S, |bench| bench.sent.len() == 2);
    bench.run_until(S, running);
    assert_eq!(bench.session.stats().restarts, 1);
}

#[test]
fn noise_silence_and_a_lost_port_are_lived_through() {
    let mut bench = bench(settings(&[
        "time", "thumb", "index", "middle", "ring", "little",
    ]));
    bench.open();
    bench.run_until(S, running);
    bench.noise = Noise::new(0.01);
    bench.run_for(20 * S);
    let stats = bench.session.stats();
    assert!(stats.records > 1200 && stats.resyncs > 50, "{stats:?}");
    assert!(
        stats.dropped_records >= stats.resyncs && stats.restarts == 0,
        "{stats:?}"
    );
    bench.noise = Noise::new(0.0);
    bench.emulator.faults.freeze();
    bench.run_until(3 * S, |bench| {
        bench.session.state() == SessionState::Stalled
    });
    let device = "glove of delimited numbers";
    assert_eq!(bench.session.fault(), Some(&Fault::Silent { device }));
    // A board may need seconds to come up after its port was opened: that is not done soon.
    bench.run_for(7 * S);
    assert!(!bench.requests.contains(&PortRequest::Reopen));
    bench.run_for(3 * S);
    assert!(bench.requests.contains(&PortRequest::Reopen));
    bench.emulator.faults.thaw();
    assert!(bench.run_until(S, running) < 100 * MS);
    let path = "/dev/x".to_owned();
    bench
        .session
        .port_lost(bench.now_ns, Fault::Unplugged { path });
    bench.run_for(300 * MS);
    bench.session.port_opened(bench.now_ns);
    assert!(bench.run_until(S, running) < 100 * MS);
}

#[test]
fn another_device_is_not_taken_for_a_glove() {
    let mut session = DelimitedSession::new(fingers(), GloveCalibration::default());
    session.port_opened(0);
    let mut now_ns = 0;
    while session.poll_port_request() != Some(PortRequest::Reopen) {
        now_ns += 50 * MS;
        assert!(now_ns < 30 * S);
        session.handle_timeout(now_ns);
        session.push(now_ns, b"$GPGGA,123519,4807.038,N\r\n");
    }
    let text = session.fault().unwrap().to_string();
    assert!(text.contains("24 47 50"), "{text}");
    assert_eq!(session.stats().records, 0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_do_no_harm(
        parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60),
        texts in vec((any::<u32>(), "[-+0-9.,;: e\n\r#x]{0,200}"), 0..60),
    ) {
        let mut session = DelimitedSession::new(fingers(), GloveCalibration::default());
        prop_assert!(survive(&mut session, &parts) <= 1024);
        let texts: Vec<(u32, Vec<u8>)> =
            texts.into_iter().map(|(pause_ns, text)| (pause_ns, text.into_bytes())).collect();
        let timed = DelimitedSettings { start: "go".to_owned(), ..settings(&["time", "index"]) };
        let mut session = DelimitedSession::new(timed, GloveCalibration::default());
        prop_assert!(survive(&mut session, &texts) <= 1024);
    }

    #[test]
    fn arbitrary_commands_do_no_harm(parts in vec((any::<u32>(), vec(any::<u8>(), 0..200)), 0..60)) {
        let waiting = DelimitedSettings { start: "go".to_owned(), ..fingers() };
        let mut glove = DelimitedEmulator::new(waiting);
        let mut now_ns = 0;
        for (pause_ns, junk) in &parts {
            now_ns += u64::from(*pause_ns);
            glove.push(now_ns, junk);
            prop_assert!(glove.poll(now_ns).len() < 100_000);
        }
    }

    #[test]
    fn a_glove_is_in_step_within_two_records(junk in vec(any::<u8>(), 0..200)) {
        prop_assert!(recovers(&mut bench(fingers()), &junk) >= 1);
    }
}

#[test]
fn an_endless_line_does_not_grow_anything() {
    let mut session = DelimitedSession::new(fingers(), GloveCalibration::default());
    session.port_opened(0);
    for round in 1..40 {
        session.handle_timeout(round * 300 * MS);
        session.push(round * 300 * MS, &b"1,2,3,4,5,".repeat(10_000));
    }
    assert_eq!(session.stats().records, 0);
    assert!(std::iter::from_fn(|| session.next_event()).count() <= 1024);
    assert!(std::iter::from_fn(|| session.poll_transmit()).count() <= 64);
}
