//! One case: a conversation that goes wrong in any way, and whether the session is well after it.

use nalgebra::Isometry3;
use tsukamu_devices::driver::Driver;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::feedback::{Feedback, Vibration};
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::session::{DeviceEvent, PortRequest, Session, SessionState};

use crate::garble::{Chance, Transcripts, piece};
use crate::subjects::{Line, Subject};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;
/// Longest step of a line that works.
const STEP_NS: u64 = 5 * MS;
/// Longest time that a session may take until it runs again, whatever came before.
const PATIENCE_NS: u64 = 120 * S;
/// What may wait for a caller that takes nothing.
const EVENTS_MAX: usize = 1024;
const TRANSMITS_MAX: usize = 64;
const REQUESTS_MAX: usize = 8;
/// Records that garbage may cost behind it.
const RECORDS_LOST: f64 = 2.0;
/// Records that are looked at for that.
const RECORDS_SEEN: f64 = 6.0;
/// Deadlines that may pass at one time.
const DEADLINES_MAX: usize = 64;

/// What a good conversation showed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// What the device said, piece by piece.
    pub(crate) said: Vec<Vec<u8>>,
    /// Pieces to one record while it streams.
    pub(crate) pieces_per_record: f64,
    /// The last readings.
    values: Values,
}

/// What the newest readings say, without their times.
#[derive(Clone, Debug, Default, PartialEq)]
struct Values {
    angles: Option<Vec<Option<f64>>>,
    pose: Option<Isometry3<f64>>,
}

impl Values {
    fn take(&mut self, event: &DeviceEvent) {
        match event {
            DeviceEvent::Glove(reading) => self.angles = Some(angles(reading)),
            DeviceEvent::Tracker(reading) if reading.station != 2 || self.pose.is_none() => {
                self.pose = reading.transmitter_from_sensor().or(self.pose);
            }
            _ => {}
        }
    }
}

fn angles(reading: &GloveReading) -> Vec<Option<f64>> {
    let sensors = reading.sensors.iter();
    sensors
        .map(|sensor| sensor.map(|sensor| sensor.angle_rad))
        .collect()
}

/// How a case went.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// The session still ran at the end of the garbage, and was back in step within two records.
    pub(crate) in_step: bool,
    /// Virtual time until it ran again, ns.
    pub(crate) recovery_ns: u64,
}

/// Both ends of a line.
struct Pair {
    session: Box<dyn Session + Send>,
    line: Box<dyn Line>,
    now_ns: u64,
    is_open: bool,
    /// Times that the session chose to start again, and the records until then.
    restarts: (u64, u64),
    /// The state that it last told.
    told: SessionState,
    /// Whether the device has not heard something that it was told: it may be set up otherwise than the session thinks.
    has_missed: bool,
    n_pieces: u64,
    values: Values,
    recording: Option<Vec<Vec<u8>>>,
    /// Whether everything is printed.
    tells: bool,
}

impl Pair {
    fn new(subject: &Subject, tells: bool) -> Self {
        Self {
            tells,
            session: subject.session(),
            line: (subject.line)(),
            now_ns: S,
            is_open: false,
            restarts: (0, 0),
            told: SessionState::Absent,
            has_missed: false,
            n_pieces: 0,
            values: Values::default(),
            recording: None,
        }
    }

    fn tell(&self, what: &str, bytes: &[u8]) {
        if self.tells {
            println!(
                "{:.4} s {what} \"{}\" {:?} {:?}",
                self.now_ns as f64 * 1.0e-9,
                bytes.escape_ascii(),
                self.session.state(),
                self.session.stats()
            );
        }
    }

    fn open(&mut self) {
        self.session.port_opened(self.now_ns);
        self.line.reopen(self.now_ns);
        self.is_open = true;
    }

    fn lose(&mut self) {
        let path = "/dev/fuzz".to_owned();
        self.session
            .port_lost(self.now_ns, Fault::Unplugged { path });
        self.is_open = false;
    }

    /// Passes every deadline that is due.
    fn pass_deadlines(&mut self) -> Result<(), String> {
        for _ in 0..DEADLINES_MAX {
            match self.session.deadline() {
                Some(deadline_ns) if deadline_ns <= self.now_ns => {
                    self.session.handle_timeout(self.now_ns);
                }
                _ => return Ok(()),
            }
        }
        Err("its deadline does not move on".to_owned())
    }

    /// Takes everything that waits; the commands go to the device, or nowhere. An error when more waits than may.
    fn take_all(&mut self, is_heard: bool) -> Result<(), String> {
        let mut n_events = 0;
        while let Some(event) = self.session.next_event() {
            n_events += 1;
            self.values.take(&event);
            if let DeviceEvent::State(change) = event {
                self.told = change.state;
            }
        }
        let state = self.session.state();
        if self.told != state {
            return Err(format!("it is {state:?}, and told {:?} last", self.told));
        }
        let stats = self.session.stats();
        if stats.restarts != self.restarts.0 {
            self.restarts = (stats.restarts, stats.records);
        }
        let (mut n_transmits, mut n_requests) = (0, 0);
        while let Some(command) = self.session.poll_transmit() {
            n_transmits += 1;
            self.tell("command", &command);
            if is_heard && self.is_open {
                self.line.hear(self.now_ns, &command);
            } else {
                self.has_missed |= self.is_open;
            }
        }
        while let Some(request) = self.session.poll_port_request() {
            n_requests += 1;
            if request == PortRequest::Reopen && self.is_open {
                self.lose();
                self.now_ns += 100 * MS;
                self.open();
            }
        }
        if n_events > EVENTS_MAX || n_transmits > TRANSMITS_MAX || n_requests > REQUESTS_MAX {
            return Err(format!(
                "{n_events} events, {n_transmits} commands and {n_requests} requests waited"
            ));
        }
        Ok(())
    }

    /// A step of a line that works.
    fn step(&mut self) -> Result<(), String> {
        let due_ns = [self.session.deadline(), self.line.due_ns()];
        let next_ns = due_ns.into_iter().flatten().min().unwrap_or(u64::MAX);
        self.now_ns = next_ns.clamp(self.now_ns + MS / 10, self.now_ns + STEP_NS);
        self.pass_deadlines()?;
        self.take_all(true)?;
        let said = self.line.say(self.now_ns);
        if !said.is_empty() {
            self.n_pieces += 1;
            self.session.push(self.now_ns, &said);
            self.tell("said", &said);
            if let Some(recording) = &mut self.recording {
                recording.push(said);
            }
        }
        self.take_all(true)
    }

    /// Whether records are taken, and it has not just chosen to start again.
    fn is_running(&self) -> bool {
        let (_, n_before) = self.restarts;
        let has_records = self.session.stats().records > n_before;
        self.is_open && has_records && self.session.state() == SessionState::Running
    }

    /// Runs until half a second has brought records and no bad one; the time that it took.
    fn run_well(&mut self) -> Result<u64, String> {
        let begun_ns = self.now_ns;
        while self.now_ns < begun_ns + PATIENCE_NS {
            let before = self.session.stats();
            let end_ns = self.now_ns + S / 2;
            while self.now_ns < end_ns {
                self.step()?;
            }
            let after = self.session.stats();
            let n_bad =
                after.resyncs + after.dropped_records - before.resyncs - before.dropped_records;
            if self.is_running() && after.records >= before.records + 3 && n_bad == 0 {
                return Ok(self.now_ns - begun_ns);
            }
        }
        Err(format!(
            "does not run again: {:?} {:?} {:?}",
            self.session.state(),
            self.session.fault(),
            self.session.stats()
        ))
    }
}

/// A good conversation of some seconds.
pub(crate) fn learn(subject: &Subject) -> Result<Known, String> {
    let mut pair = Pair::new(subject, false);
    pair.recording = Some(Vec::new());
    pair.session.port_opening(pair.now_ns);
    pair.open();
    pair.run_well()?;
    let (n_pieces, n_records) = (pair.n_pieces, pair.session.stats().records);
    pair.run_well()?;
    let n_records = pair.session.stats().records - n_records;
    Ok(Known {
        said: pair.recording.unwrap_or_default(),
        pieces_per_record: (pair.n_pieces - n_pieces) as f64 / n_records as f64,
        values: pair.values,
    })
}

/// One conversation that goes wrong.
///
/// # Errors
/// What the session did that it must not.
pub(crate) fn run(
    subject: &Subject,
    known: &Known,
    from: Transcripts<'_>,
    chance: &mut Chance,
    tells: bool,
) -> Result<Outcome, String> {
    let mut pair = Pair::new(subject, tells);
    pair.session.port_opening(pair.now_ns);
    pair.open();
    if chance.one_in(4) {
        // It begins in the middle of the start-up.
        for _ in 0..chance.below(200) {
            pair.step()?;
        }
    } else {
        pair.run_well()?;
    }
    if chance.one_in(64) {
        flood(&mut pair, from, chance)?;
    } else {
        for _ in 0..=chance.below(40) {
            mischief(&mut pair, from, chance)?;
        }
    }
    // What the device was saying is lost; from here on the line works, and a connection is a new one.
    let _ = pair.line.say(pair.now_ns);
    if is_connection(subject) && pair.is_open {
        pair.lose();
    }
    if !pair.is_open {
        pair.open();
    }
    pair.pass_deadlines()?;
    pair.take_all(true)?;
    let in_step = is_in_step_soon(&mut pair, known)?;
    let recovery_ns = pair.run_well()?;
    pair.values = Values::default();
    for _ in 0..400 {
        pair.step()?;
    }
    if pair.values != known.values {
        return Err(format!(
            "reads {:?} in place of {:?}",
            pair.values, known.values
        ));
    }
    Ok(Outcome {
        in_step,
        recovery_ns,
    })
}

/// Whether it is joined by a connection, of which a garbled stream has nothing to be found again by.
const fn is_connection(subject: &Subject) -> bool {
    matches!(subject.driver, Driver::Vrpn(_))
}

/// Something that happens to a line.
fn mischief(pair: &mut Pair, from: Transcripts<'_>, chance: &mut Chance) -> Result<(), String> {
    match chance.below(20) {
        0..=10 => {
            let bytes = piece(chance, from);
            if pair.is_open && chance.one_in(8) {
                pair.session.push_datagram(pair.now_ns, &bytes);
            } else if pair.is_open {
                pair.session.push(pair.now_ns, &bytes);
            }
            pair.tell("garbage", &bytes);
        }
        11..=13 => {
            let longest_ns = [MS, 50 * MS, 700 * MS, 4 * S][chance.below(4)];
            pair.now_ns += chance.next() % longest_ns;
            pair.pass_deadlines()?;
        }
        14..=16 => {
            // It goes on for a while as it should.
            for _ in 0..chance.below(60) {
                if pair.is_open {
                    pair.step()?;
                }
            }
        }
        17 if chance.one_in(4) => {
            if pair.is_open {
                pair.lose();
            } else {
                pair.open();
            }
        }
        18 => pair.session.set_calibration(GloveCalibration::default()),
        19 => pair.session.set_feedback(pair.now_ns, feedback(chance)),
        _ => {}
    }
    // Now and then nobody takes what waits, or the device does not hear it.
    if chance.one_in(8) {
        return Ok(());
    }
    pair.take_all(!chance.one_in(8))
}

fn feedback(chance: &mut Chance) -> Feedback {
    let numbers = [0.0, 0.5, 1.0, -1.0, 7.0, f64::NAN, f64::INFINITY];
    let mut number = || numbers[chance.below(numbers.len())];
    Feedback {
        resistance: std::array::from_fn(|_| number()),
        vibration: Some(Vibration {
            frequency_hz: number(),
            duration_s: number(),
            amplitude: number(),
        }),
    }
}

/// Some megabytes at once, of which nothing is taken.
fn flood(pair: &mut Pair, from: Transcripts<'_>, chance: &mut Chance) -> Result<(), String> {
    let mut n_bytes = 0;
    while n_bytes < 2_000_000 {
        let bytes = piece(chance, from).repeat(1 + chance.below(16));
        n_bytes += bytes.len() + 1;
        pair.session.push(pair.now_ns, &bytes);
        pair.now_ns += chance.next() % (20 * MS);
        pair.pass_deadlines()?;
    }
    pair.take_all(true)
}

/// Whether a session that still runs is back in step within two records; false when it chose to start again, or has to.
fn is_in_step_soon(pair: &mut Pair, known: &Known) -> Result<bool, String> {
    if !pair.is_running() || pair.has_missed {
        return Ok(false);
    }
    let (before, n_before) = (pair.session.stats(), pair.n_pieces);
    let n_pieces = (RECORDS_SEEN * known.pieces_per_record).ceil() as u64;
    while pair.n_pieces < n_before + n_pieces {
        pair.step()?;
        if !pair.is_running() {
            return Ok(false);
        }
    }
    let n_sent = n_pieces as f64 / known.pieces_per_record;
    let n_records = pair.session.stats().records - before.records;
    if (n_records as f64) < (n_sent - RECORDS_LOST).floor() {
        return Err(format!(
            "of {n_sent} records after the garbage only {n_records} were read"
        ));
    }
    Ok(true)
}
