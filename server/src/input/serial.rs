//! Gloves and trackers on serial ports: one thread per port, which hands what it reads to the hands it belongs to.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tracing::info;
use tsukamu_devices::clock::Clock as PortClock;
use tsukamu_devices::network::{self, LinkSettings};
use tsukamu_devices::port::{Direction, PortEvent};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, SessionState, SessionStats, StateChange};
use tsukamu_devices::timing::Stamped;
use tsukamu_proto::v1;

use crate::calibration::taps::Taps;
use crate::clock::Clock;
use crate::recorder_handle::{RecordItem, RecorderHandle};
use crate::settings::device::DeviceSettings;
use crate::settings::hand::HandSettings;
use crate::ticker::request::{NewDriver, NewHand, Refusal, Request, TickerHandle};

use super::assemble::{Assembly, Mount};
use super::feedback::Feel;
use super::sources::{Arrived, Source, Sources};

/// Where the ports' threads find the recording that wants their bytes; cheap to clone.
#[derive(Clone, Debug, Default)]
pub struct RawTap(Arc<Mutex<Option<RecorderHandle>>>);

impl RawTap {
    /// From now on bytes go there, or nowhere.
    pub fn set(&self, recorder: Option<RecorderHandle>) {
        *lock(&self.0) = recorder;
    }

    fn offer(&self, clock: &Clock, device: &str, arrival_ns: u64, bytes: &[u8]) {
        let recorder = lock(&self.0);
        if let Some(recorder) = recorder.as_ref() {
            let raw = v1::RawBytes {
                device: device.to_owned(),
                arrival_ns,
                bytes: bytes.to_vec(),
            };
            recorder.offer(clock.wall_of(arrival_ns), RecordItem::Raw(raw));
        }
    }
}

/// A hand as a port's thread sees it.
#[derive(Clone, Debug)]
struct HandOfPort {
    /// Station of the tracker that belongs to it.
    station: u16,
    assembly: Arc<Mutex<Assembly>>,
    source: Arc<Source>,
}

impl HandOfPort {
    fn offer(&self, arrived: Option<Arrived>) {
        if let Some(arrived) = arrived {
            self.source.offer(arrived);
        }
    }
}

/// The ports that are open, or tried again and again. They close when this is dropped.
#[derive(Debug)]
pub struct SerialPorts {
    threads: Vec<PortThread>,
}

/// What ports need of the daemon.
#[derive(Clone, Debug)]
pub struct PortContext {
    /// The list of sources.
    pub sources: Sources,
    /// To let hands join.
    pub ticker: TickerHandle,
    /// Where raw bytes go.
    pub raw_tap: RawTap,
    /// The time that all stamps share.
    pub clock: Clock,
    /// Where calibration finds the devices.
    pub taps: Taps,
}

/// Why ports cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum SerialFault {
    /// The system refuses a thread.
    #[error("no thread for a serial port")]
    Thread(#[from] io::Error),
    /// The tick thread does not take the hand.
    #[error(transparent)]
    Hand(#[from] Refusal),
}

impl SerialPorts {
    /// Opens every device's port on a thread of its own, and lets the hands join the world. A port that is not there
    /// is waited for.
    ///
    /// # Errors
    /// When the system refuses a thread, or the tick thread a hand.
    pub fn open(
        devices: &[DeviceSettings],
        hands: &[HandSettings],
        context: &PortContext,
    ) -> Result<Self, SerialFault> {
        let add = |device: &DeviceSettings| {
            context.sources.add(
                &device.name,
                device.driver.name(),
                device.port.to_string(),
                "absent",
            )
        };
        let rows: Vec<Arc<Source>> = devices.iter().map(add).collect();
        let mut of_port: Vec<Vec<HandOfPort>> = vec![Vec::new(); devices.len()];
        let mut sources = Vec::with_capacity(hands.len());
        for hand in hands {
            let (source, assembly) = join(hand, devices, context)?;
            sources.push(Arc::clone(&source));
            let part = HandOfPort {
                station: hand.station,
                assembly,
                source,
            };
            of_port[hand.glove].push(part.clone());
            // One device may be both.
            if hand.tracker != hand.glove {
                of_port[hand.tracker].push(part);
            }
        }
        let threads = devices
            .iter()
            .zip(rows)
            .zip(of_port)
            .map(|((device, row), hands)| spawn(device, row, hands, context));
        let threads: Vec<PortThread> = threads.collect::<io::Result<_>>()?;
        for (hand, source) in hands.iter().zip(sources) {
            let glove = threads[hand.glove].session();
            source.set_feel(Feel::new(hand.feedback_strength, glove));
        }
        Ok(Self { threads })
    }

    /// Makes the devices quiet and closes their ports, all at once; within about 0.3 s each.
    pub fn close(self) {
        self.threads.into_iter().for_each(PortThread::stop);
    }
}

/// Lets a hand of devices join the world.
fn join(
    hand: &HandSettings,
    devices: &[DeviceSettings],
    context: &PortContext,
) -> Result<(Arc<Source>, Arc<Mutex<Assembly>>), Refusal> {
    let (glove, tracker) = (&devices[hand.glove], &devices[hand.tracker]);
    let place = format!("{} + {} station {}", glove.name, tracker.name, hand.station);
    let source = context.sources.add(&hand.name, "hand", place, "running");
    let mount = Mount {
        wrist_from_sensor: glove.calibration.mount.wrist_from_sensor(),
        world_from_transmitter: tracker.world_from_transmitter,
    };
    let driver = NewDriver::Device(hand.fusion);
    let new = NewHand {
        model: hand.model.clone(),
        source: Arc::clone(&source),
        filter: None,
        driver,
    };
    // The answer is the hand's id, which the source is told by the tick thread.
    let (reply, _) = tokio::sync::oneshot::channel();
    context.ticker.send(Request::OpenHand {
        hand: Box::new(new),
        reply,
    })?;
    let assembly = Arc::new(Mutex::new(Assembly::new(hand.model.side, mount)));
    let devices = (glove.name.as_str(), tracker.name.as_str());
    context
        .taps
        .add_hand(devices, hand.station, mount, Arc::clone(&assembly));
    Ok((source, assembly))
}

fn spawn(
    device: &DeviceSettings,
    row: Arc<Source>,
    hands: Vec<HandOfPort>,
    context: &PortContext,
) -> io::Result<PortThread> {
    let settings = LinkSettings {
        place: device.port.clone(),
        bauds: device.bauds.clone(),
        raw: true,
    };
    let port_clock = PortClock::new(context.clock.origin());
    let (tap, clock) = (context.raw_tap.clone(), context.clock);
    let reads = context.taps.add(device);
    let shown = Arc::clone(&reads);
    let deliver = move |event: PortEvent<'_>| match event {
        PortEvent::Device(event) => {
            shown.offer(&event);
            take(&row, &hands, event);
        }
        PortEvent::Stats(stats) => note_stats(&row, &stats),
        PortEvent::Raw {
            stamp_ns,
            direction: Direction::Received,
            bytes,
        } => {
            tap.offer(&clock, &row.name, stamp_ns, bytes);
        }
        PortEvent::Raw { .. } => {}
    };
    let session = device.driver.session((*device.calibration).clone());
    let thread = network::spawn(settings, session, port_clock, deliver)?;
    reads.set_session(thread.session());
    Ok(thread)
}

/// Hands a reading to the hands that it belongs to.
fn take(row: &Source, hands: &[HandOfPort], event: DeviceEvent) {
    match event {
        DeviceEvent::Glove(reading) => {
            row.note(reading.stamp_ns);
            let stamped = Stamped {
                ticks: reading.device_ticks,
                ..Stamped::on_arrival(reading.stamp_ns)
            };
            for hand in hands {
                hand.offer(lock(&hand.assembly).of_glove(stamped, &reading));
            }
        }
        DeviceEvent::Tracker(reading) => {
            row.note(reading.stamp_ns);
            let stamped = Stamped {
                ticks: reading.device_ticks,
                ..Stamped::on_arrival(reading.stamp_ns)
            };
            for hand in hands.iter().filter(|hand| hand.station == reading.station) {
                hand.offer(Some(lock(&hand.assembly).of_tracker(stamped, &reading)));
            }
        }
        DeviceEvent::State(change) => note_state(row, change),
        DeviceEvent::Identified(about) => {
            info!(
                device = row.name,
                family = about.family,
                firmware = about.firmware,
                identity = about.identity,
                sensors = about.n_sensors,
                "device identified"
            );
        }
    }
}

fn note_state(row: &Source, change: StateChange) {
    let error = change
        .fault
        .map_or_else(String::new, |fault| fault.to_string());
    info!(
        device = row.name,
        state = state_name(change.state),
        error,
        "device"
    );
    row.update(|health| {
        health.state = state_name(change.state);
        health.error = error;
    });
}

fn note_stats(row: &Source, stats: &SessionStats) {
    row.update(|health| {
        health.n_bytes = stats.bytes;
        health.n_resyncs = stats.resyncs;
        health.n_bad_records = stats.dropped_records;
        health.n_reconnects = stats.restarts;
    });
}

/// The name on the wire.
const fn state_name(state: SessionState) -> &'static str {
    match state {
        SessionState::Absent => "absent",
        SessionState::Opening => "opening",
        SessionState::Resetting => "resetting",
        SessionState::Querying => "querying",
        SessionState::Running => "running",
        SessionState::Stalled => "stalled",
    }
}

/// A panic elsewhere leaves whole values.
fn lock<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}
