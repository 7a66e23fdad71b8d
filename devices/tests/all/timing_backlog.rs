//! What waits is bounded, and what is old is not handed on while something newer is there.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use tsukamu_devices::clock::Clock;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::session::CyberGloveSession;
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, SensorCount};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::port::{PortEvent, PortSettings};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, Session};

use crate::support::{Bench, MS, S};

/// Longest wait for anything, on a machine that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long the daemon's thread is held up.
const HELD_UP: Duration = Duration::from_millis(1500);
/// The glove shows the time: it counts up once in so long, ns, and begins anew after [`N_COUNTS`].
const COUNT_NS: u64 = 20_000_000;
const N_COUNTS: u64 = 200;

/// How many counts ago a glove showed that.
fn counts_ago(now: u64, raw: f64) -> u64 {
    (now + N_COUNTS - (raw as u64 - 20)) % N_COUNTS
}

#[test]
fn after_a_standstill_the_newest_is_there_at_once() {
    let shown = Arc::new(AtomicU64::new(0));
    let shows = Arc::clone(&shown);
    let motion = move |now_ns: u64, glove: &mut CyberGloveEmulator| {
        let count = now_ns / COUNT_NS % N_COUNTS;
        shows.store(count, Ordering::Relaxed);
        glove.set_sensors(&[count as u8 + 20; 22]);
    };
    let emulator = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
    let emulated = PtyEmulator::spawn(emulator, PtySettings::default(), motion).unwrap();
    let (sender, received) = sync_channel(100_000);
    let (_gate, never) = sync_channel::<()>(1);
    let settings = PortSettings {
        path: emulated.path().to_str().unwrap().to_owned(),
        bauds: Vec::new(),
        raw: false,
    };
    let session =
        CyberGloveSession::new(CyberGloveSettings::default(), GloveCalibration::default());
    let mut n_readings = 0_u64;
    let deliver = move |event: PortEvent<'_>| {
        let PortEvent::Device(DeviceEvent::Glove(reading)) = event else {
            return;
        };
        n_readings += 1;
        if n_readings == 50 {
            // Whatever holds a machine up: nothing is read meanwhile.
            let held_up = never.recv_timeout(HELD_UP);
            assert_eq!(held_up, Err(RecvTimeoutError::Timeout));
        }
        let raw = reading
            .sensor(GloveSensor::IndexMcp)
            .map(|sensor| sensor.raw);
        let ago = raw.map(|raw| counts_ago(shown.load(Ordering::Relaxed), raw));
        let _ = sender.try_send((Instant::now(), n_readings, ago.unwrap_or(N_COUNTS)));
    };
    let clock = Clock::new(Instant::now());
    let _port = PortThread::spawn(settings, Box::new(session), clock, deliver).unwrap();
    let next = || received.recv_timeout(PATIENCE).unwrap();
    let (freed, ..) = std::iter::repeat_with(next)
        .find(|(_, n, _)| *n == 50)
        .unwrap();
    // The backlog goes by in a moment, and then all is of the present.
    let mut n_old = 0;
    let caught_up = loop {
        let (at, _, ago) = next();
        if ago <= 3 {
            break at;
        }
        n_old += 1;
    };
    let took = caught_up - freed;
    assert!(n_old <= 1024, "{n_old}");
    assert!(took < Duration::from_millis(500), "{n_old}: {took:?}");
    for _ in 0..20 {
        let (_, _, ago) = next();
        assert!(
            ago < 25,
            "{ago} counts ago: a machine may be busy, but nothing old is kept"
        );
    }
}

#[test]
fn nobody_takes_and_nothing_grows() {
    let mut bench = Bench::new(
        CyberGloveSession::new(CyberGloveSettings::default(), GloveCalibration::default()),
        CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right),
    );
    bench.open();
    bench.run_until(3 * S, |bench| bench.session.stats().records >= 1);
    // A whole second's bytes of a device that never stops, again and again, and nobody asks for the events.
    for second in 0..60 {
        let mut line = Vec::new();
        for k in 0..600_u64 {
            line.push(b'S');
            line.extend(std::iter::repeat_n((k % 200) as u8 + 20, 22));
            line.extend([0x81, 0x00]);
        }
        bench.session.push(bench.now_ns + second * 1000 * MS, &line);
    }
    let mut n_events = 0;
    let mut newest = None;
    while let Some(event) = bench.session.next_event() {
        n_events += 1;
        if let DeviceEvent::Glove(reading) = event {
            newest = reading
                .sensor(GloveSensor::IndexMcp)
                .map(|sensor| sensor.raw);
        }
    }
    assert!(n_events <= 1024, "{n_events}");
    assert!(bench.session.stats().dropped_events > 10_000);
    assert_eq!(
        newest,
        Some(f64::from(599_u32 % 200 + 20)),
        "the newest is kept"
    );
}
