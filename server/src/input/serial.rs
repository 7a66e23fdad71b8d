//! Gloves and trackers on serial ports: one thread per port, which hands what it reads to the hands it belongs to.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::task::JoinSet;
use tracing::{debug, info, warn};
use tsukamu_devices::clock::Clock as PortClock;
use tsukamu_devices::network::{self, LinkSettings};
use tsukamu_devices::port::{Direction, PortEvent};
use tsukamu_devices::port_thread::PortThread;
use tsukamu_devices::session::{DeviceEvent, DeviceInfo, SessionState, SessionStats, StateChange};
use tsukamu_devices::timing::source::{SourceClock, Stream};
use tsukamu_proto::v1;

use crate::broadcast::inbox::{DeviceNews, EventEntry, Inbox, What};
use crate::calibration::taps::Taps;
use crate::clock::Clock;
use crate::recorder_handle::{RecordItem, RecorderHandle};
use crate::settings::device::DeviceSettings;
use crate::settings::hand::HandSettings;
use crate::status::StatusBoard;
use crate::ticker::request::{NewDriver, NewHand, Refusal, Request, TickerHandle};

use super::assemble::{Assembly, Mount};
use super::feedback::Feel;
use super::presence::{News, Presence};
use super::sources::{Arrived, HAND, Source, Sources};
use super::supervise::supervise;

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
    /// Whether its fingers come from there.
    has_fingers: bool,
    /// Station of the tracker that its wrist comes from; `None` when it does not come from there.
    station: Option<u16>,
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
    /// Ends with it.
    _supervision: JoinSet<()>,
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
    /// Where events go.
    pub inbox: Arc<Inbox>,
    /// The last step's stamp, which events carry.
    pub status: Arc<StatusBoard>,
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
    /// is waited for. Called on a tokio runtime, on which the devices are looked after.
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
            // One device may be both, or be able to be both and be used for one.
            let is_one = hand.glove == hand.tracker;
            let part = HandOfPort {
                has_fingers: true,
                station: is_one.then_some(hand.station),
                assembly,
                source,
            };
            if !is_one {
                of_port[hand.tracker].push(HandOfPort {
                    has_fingers: false,
                    station: Some(hand.station),
                    ..part.clone()
                });
            }
            of_port[hand.glove].push(part);
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
        let mut supervision = JoinSet::new();
        supervision.spawn(supervise(context.sources.clone(), context.clock));
        Ok(Self {
            threads,
            _supervision: supervision,
        })
    }

    /// Makes the devices quiet and closes their ports, all at once; within about 0.3 s each.
    pub fn close(self) {
        PortThread::stop_all(self.threads);
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
    let source = context.sources.add(&hand.name, HAND, place, "running");
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
    let reads = context.taps.add(device);
    let shown = Arc::clone(&reads);
    let tap = context.raw_tap.clone();
    row.supervise(
        device
            .expected_rate_hz
            .or_else(|| device.driver.nominal_rate_hz()),
    );
    let mut port = DeviceOfPort {
        row,
        hands,
        times: SourceClock::new(),
        presence: Presence::default(),
        identity: String::new(),
        noted_glove_ns: None,
        context: context.clone(),
    };
    let deliver = move |event: PortEvent<'_>| match event {
        PortEvent::Device(event) => {
            shown.offer(&event);
            port.take(event);
        }
        PortEvent::Stats(stats) => port.note_stats(&stats),
        PortEvent::Raw {
            stamp_ns,
            direction: Direction::Received,
            bytes,
        } => {
            tap.offer(&port.context.clock, &port.row.name, stamp_ns, bytes);
        }
        PortEvent::Raw { .. } => {}
    };
    let session = device.driver.session((*device.calibration).clone());
    let thread = network::spawn(settings, session, port_clock, deliver)?;
    reads.set_session(thread.session());
    Ok(thread)
}

/// What a port's thread knows of its device.
#[derive(Debug)]
struct DeviceOfPort {
    row: Arc<Source>,
    hands: Vec<HandOfPort>,
    /// When its samples were taken.
    times: SourceClock,
    presence: Presence,
    /// What it last said of itself.
    identity: String,
    /// Stamp of its last sample of fingers, ns.
    noted_glove_ns: Option<u64>,
    context: PortContext,
}

impl DeviceOfPort {
    /// Hands a reading to the hands that it belongs to, and a change of state to those who watch.
    fn take(&mut self, event: DeviceEvent) {
        match event {
            DeviceEvent::Glove(reading) => {
                self.row.note_glove(&reading);
                self.noted_glove_ns = Some(reading.stamp_ns);
                let stream = Stream::Glove(reading.hand);
                let stamped = self
                    .times
                    .stamp(stream, reading.stamp_ns, reading.device_ticks);
                for hand in self.hands.iter().filter(|hand| hand.has_fingers) {
                    hand.offer(lock(&hand.assembly).of_glove(stamped, &reading));
                }
            }
            DeviceEvent::Tracker(reading) => {
                // A source that is both gives fingers and wrist of one record.
                if self.noted_glove_ns != Some(reading.stamp_ns) {
                    self.row.note(reading.stamp_ns);
                }
                let stream = Stream::Station(reading.station);
                let stamped = self
                    .times
                    .stamp(stream, reading.stamp_ns, reading.device_ticks);
                let of_station = |hand: &&HandOfPort| hand.station == Some(reading.station);
                for hand in self.hands.iter().filter(of_station) {
                    hand.offer(Some(lock(&hand.assembly).of_tracker(stamped, &reading)));
                }
            }
            DeviceEvent::State(change) => self.note_state(change),
            DeviceEvent::Identified(about) => self.identify(&about),
        }
    }

    /// A device that is back says the same of itself as before: that is no news.
    fn identify(&mut self, about: &DeviceInfo) {
        self.times.set_tick(about.tick_ns);
        let said = about
            .rate_hz
            .filter(|rate_hz| rate_hz.is_finite() && *rate_hz > 0.0);
        if let Some(rate_hz) = said {
            self.row.expect_rate(rate_hz);
        }
        let identity = format!(
            "{} {} {} {}",
            about.family, about.firmware, about.identity, about.n_sensors
        );
        if self.identity == identity {
            return;
        }
        self.identity = identity;
        info!(
            device = self.row.name,
            family = about.family,
            firmware = about.firmware,
            identity = about.identity,
            sensors = about.n_sensors,
            "device identified"
        );
    }

    fn note_state(&mut self, change: StateChange) {
        if change.state != SessionState::Running {
            self.times.restart();
        }
        let news = self.presence.change(&change);
        let error = change
            .fault
            .map_or_else(String::new, |fault| fault.to_string());
        debug!(
            device = self.row.name,
            state = state_name(change.state),
            error,
            "device state"
        );
        self.row.update(|health| {
            health.state = state_name(change.state);
            health.error = error;
        });
        self.row.note_clock(self.times.report());
        if let Some(news) = news {
            self.tell(change.stamp_ns, news);
        }
    }

    /// One line of the log, and of a loss and a return one event.
    fn tell(&self, stamp_ns: u64, news: News) {
        let name = || self.row.name.clone();
        match news {
            News::Runs => info!(device = self.row.name, "device runs"),
            News::Waited { reason } => {
                warn!(device = self.row.name, reason, "device is not there yet");
            }
            News::Lost { reason } => {
                warn!(device = self.row.name, reason, "device lost");
                self.row.note_loss();
                let device = name();
                self.post(stamp_ns, DeviceNews::Lost { device, reason });
            }
            News::Returned { absent_s } => {
                let rounded_s = (absent_s * 1.0e3).round() / 1.0e3;
                info!(
                    device = self.row.name,
                    absent_s = rounded_s,
                    "device is back"
                );
                let device = name();
                self.post(stamp_ns, DeviceNews::Returned { device, absent_s });
            }
        }
    }

    fn post(&self, stamp_ns: u64, news: DeviceNews) {
        let entry = EventEntry {
            stamp: v1::Stamp {
                wall_ns: self.context.clock.wall_of(stamp_ns),
                ..self.context.status.stamp()
            },
            what: What::Device(news),
            object: None,
            content: None,
        };
        self.context.inbox.post(|batch| batch.events.push(entry));
    }

    fn note_stats(&self, stats: &SessionStats) {
        self.row.update(|health| {
            health.n_bytes = stats.bytes;
            health.n_resyncs = stats.resyncs;
            health.n_bad_records = stats.dropped_records;
            health.n_reconnects = stats.restarts;
        });
        self.row.note_clock(self.times.report());
    }
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
