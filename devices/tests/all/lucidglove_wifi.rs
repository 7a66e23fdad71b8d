//! A LucidGlove over Wi-Fi: it connects to us, and what goes back to it goes through the same connection.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use tsukamu_devices::clock::Clock;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::lucidglove::{LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::feedback::Feedback;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::network::{self, LinkSettings};
use tsukamu_devices::port::PortEvent;
use tsukamu_devices::session::DeviceEvent;

const PATIENCE: Duration = Duration::from_secs(20);

/// The glove's end of a connection.
struct Glove {
    stream: TcpStream,
    emulator: LucidGloveEmulator,
    clock: Clock,
}

impl Glove {
    fn connect(port: u16, curl: u16) -> Self {
        let end = Instant::now() + PATIENCE;
        let stream = loop {
            match TcpStream::connect(("127.0.0.1", port)) {
                Ok(stream) => break stream,
                Err(error) => assert!(Instant::now() < end, "{error}"),
            }
        };
        stream
            .set_read_timeout(Some(Duration::from_millis(2)))
            .unwrap();
        let build = LucidGloveBuild {
            line_end: "\n\r\n",
            ..LucidGloveBuild::default()
        };
        let mut emulator = LucidGloveEmulator::new(build);
        emulator.set_curls([curl; 5]);
        Self {
            stream,
            emulator,
            clock: Clock::new(Instant::now()),
        }
    }

    /// Runs until the question has an answer; false when the daemon's side ends before.
    fn run_until(&mut self, mut done: impl FnMut(&LucidGloveEmulator) -> bool) -> bool {
        let end = Instant::now() + PATIENCE;
        let mut bytes = [0; 1024];
        while !done(&self.emulator) {
            assert!(Instant::now() < end, "{:?}", self.emulator.heard());
            let said = self.emulator.poll(self.clock.now_ns());
            let _ = self.stream.write_all(&said);
            match self.stream.read(&mut bytes) {
                Ok(0) => return false,
                Ok(n_bytes) => self.emulator.push(self.clock.now_ns(), &bytes[..n_bytes]),
                Err(error) => assert!(
                    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
                    "{error}"
                ),
            }
        }
        true
    }
}

/// The newest counts of the index finger.
fn newest(events: &Receiver<DeviceEvent>) -> Option<f64> {
    let readings = events.try_iter().filter_map(|event| match event {
        DeviceEvent::Glove(reading) => reading.sensor(GloveSensor::IndexMcp),
        _ => None,
    });
    readings.last().map(|sensor| sensor.raw)
}

#[test]
fn a_glove_connects_is_read_and_stopped_and_may_come_back() {
    // A port that is free, or was just now.
    let port = TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .unwrap()
        .port();
    let settings = LinkSettings {
        place: format!("tcp-listen:127.0.0.1:{port}").parse().unwrap(),
        bauds: Vec::new(),
        raw: false,
    };
    let driver = Driver::LucidGlove(LucidGloveSettings::default());
    let (tell, events) = sync_channel(10_000);
    let thread = network::spawn(
        settings,
        driver.session(GloveCalibration::default()),
        Clock::new(Instant::now()),
        move |event| {
            if let PortEvent::Device(event) = event {
                // The test may have ended.
                let _ = tell.send(event);
            }
        },
    )
    .unwrap();

    let mut first = Glove::connect(port, 1234);
    assert!(first.run_until(|_| newest(&events) == Some(1234.0)));
    let block = Feedback {
        resistance: [0.0, 0.5, 1.0, 0.0, 0.0],
        vibration: None,
    };
    let is_blocked = |glove: &LucidGloveEmulator| {
        thread.session().set_feedback(block);
        glove.limits() == [0, 500, 1000, 0, 0]
    };
    assert!(first.run_until(is_blocked));
    drop(first);

    // It connects anew, free, and is stopped again.
    let mut second = Glove::connect(port, 2345);
    assert!(second.run_until(|_| newest(&events) == Some(2345.0)));
    assert!(second.run_until(is_blocked));
    let line = |heard: &tsukamu_devices::emulate::lucidglove::Heard| heard.line.clone();
    let lines: Vec<Vec<u8>> = second.emulator.heard().iter().map(line).collect();
    assert_eq!(lines.last().unwrap(), b"A0B500C1000D0E0");

    // The end frees it.
    thread.stop();
    second.run_until(|glove| glove.limits() == [0; 5]);
    assert_eq!(second.emulator.limits(), [0; 5]);
}
