use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, sleep_until};
use tsukamu_devices::calibration::hold::{HoldProgress, PoseHold};
use tsukamu_devices::calibration::scale::Scales;
use tsukamu_devices::calibration::tracker_hold::{HeldSensor, TrackerHold, TrackerProgress};
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_devices::glove::quick_range::QuickRange;
use tsukamu_devices::reading::{GloveReading, TrackerReading};

use super::desk::CalibrationDesk;
use super::fault::CalibrationFault;
use super::taps::Stations;

/// Between two answers about the progress.
const TELL_EVERY: Duration = Duration::from_millis(100);
/// A device that has sent nothing for so long counts as blind.
const SILENCE: Duration = Duration::from_millis(500);
/// Names of restless sensors in a refusal, at most.
const NAMES_MAX: usize = 4;

/// The readings of one glove, of one hand where it has both.
#[derive(Debug)]
struct GloveEar {
    device: String,
    hand: Option<Handedness>,
    readings: watch::Receiver<Option<GloveReading>>,
    newest: Option<GloveReading>,
    heard: Instant,
    _attendance: Arc<()>,
}

impl GloveEar {
    /// The next reading; pends while there is none.
    async fn next(&mut self) -> GloveReading {
        loop {
            if self.readings.changed().await.is_err() {
                // The device is gone with the daemon: whoever waits has a deadline.
                std::future::pending::<()>().await;
            }
            let reading = *self.readings.borrow_and_update();
            let is_other = |reading: &GloveReading| {
                self.hand.is_some() && reading.hand.is_some() && reading.hand != self.hand
            };
            if let Some(reading) = reading.filter(|reading| !is_other(reading)) {
                self.newest = Some(reading);
                self.heard = Instant::now();
                return reading;
            }
        }
    }

    fn is_silent(&self) -> bool {
        self.heard.elapsed() > SILENCE
    }
}

/// Waits until a pose is held.
#[derive(Debug)]
pub struct PoseCapturing {
    desk: Arc<CalibrationDesk>,
    run: u64,
    ear: GloveEar,
    hold: PoseHold,
    scales: Scales,
    progress: HoldProgress,
    tell: Interval,
    deadline: Instant,
    is_over: bool,
}

/// What a capture hears, and until when.
#[derive(Debug)]
pub(super) struct Listening {
    pub(super) device: String,
    pub(super) hand: Option<Handedness>,
    pub(super) readings: watch::Receiver<Option<GloveReading>>,
    pub(super) patience: Duration,
    /// Says, while it lives, that somebody is there.
    pub(super) attendance: Arc<()>,
}

impl Listening {
    fn ear(self) -> (GloveEar, Instant) {
        let now = Instant::now();
        let ear = GloveEar {
            device: self.device,
            hand: self.hand,
            readings: self.readings,
            newest: None,
            heard: now,
            _attendance: self.attendance,
        };
        (ear, now + self.patience)
    }
}

impl PoseCapturing {
    pub(super) fn new(
        desk: Arc<CalibrationDesk>,
        run: u64,
        listening: Listening,
        hold: PoseHold,
        scales: Scales,
    ) -> Self {
        let (ear, deadline) = listening.ear();
        Self {
            desk,
            run,
            ear,
            hold,
            scales,
            progress: HoldProgress::Moving(Vec::new()),
            tell: telling(),
            deadline,
            is_over: false,
        }
    }

    /// The next news, with the newest reading; `None` after the end.
    pub async fn next(
        &mut self,
    ) -> Option<Result<(HoldProgress, Option<GloveReading>), CalibrationFault>> {
        if self.is_over {
            return None;
        }
        loop {
            tokio::select! {
                biased;
                () = sleep_until(self.deadline) => {
                    self.is_over = true;
                    return Some(Err(CalibrationFault::NotHeld(self.excuse())));
                }
                _ = self.tell.tick() => {
                    if self.ear.is_silent() {
                        self.progress = HoldProgress::Blind;
                    }
                    return Some(Ok((self.progress.clone(), self.ear.newest)));
                }
                reading = self.ear.next() => {
                    self.scales.add(&reading);
                    self.progress = self.hold.push(&reading, &self.scales).clone();
                    if let HoldProgress::Done(capture) = &self.progress {
                        self.is_over = true;
                        let kept = self.desk.keep_pose(self.run, (**capture).clone(), self.scales.clone());
                        return Some(kept.map(|()| (self.progress.clone(), self.ear.newest)));
                    }
                }
            }
        }
    }

    /// Why the pose was not held.
    fn excuse(&self) -> String {
        let device = &self.ear.device;
        match &self.progress {
            HoldProgress::Blind => silent(device),
            HoldProgress::Moving(sensors) if !sensors.is_empty() => {
                let names: Vec<&str> = sensors.iter().take(NAMES_MAX).map(|s| s.name()).collect();
                let more = if sensors.len() > NAMES_MAX {
                    " and others"
                } else {
                    ""
                };
                format!(
                    "the hand was not still in time: {}{more} moved",
                    names.join(", ")
                )
            }
            _ => "the pose was not held long enough in time".to_owned(),
        }
    }
}

/// Notes how far everything goes.
#[derive(Debug)]
pub struct RangeCapturing {
    desk: Arc<CalibrationDesk>,
    run: u64,
    ear: GloveEar,
    range: QuickRange,
    tell: Interval,
    deadline: Instant,
    is_over: bool,
}

impl RangeCapturing {
    pub(super) fn new(desk: Arc<CalibrationDesk>, run: u64, listening: Listening) -> Self {
        let (ear, deadline) = listening.ear();
        Self {
            desk,
            run,
            ear,
            range: QuickRange::default(),
            tell: telling(),
            deadline,
            is_over: false,
        }
    }

    /// The seconds left, with the newest reading; `None` after the end.
    pub async fn next(&mut self) -> Option<Result<(f64, Option<GloveReading>), CalibrationFault>> {
        if self.is_over {
            return None;
        }
        loop {
            tokio::select! {
                biased;
                () = sleep_until(self.deadline) => {
                    self.is_over = true;
                    if self.ear.newest.is_none() {
                        return Some(Err(CalibrationFault::NotHeld(silent(&self.ear.device))));
                    }
                    let kept = self.desk.keep_range(self.run, self.range.clone());
                    return Some(kept.map(|()| (0.0, self.ear.newest)));
                }
                _ = self.tell.tick() => {
                    let left = self.deadline.saturating_duration_since(Instant::now());
                    return Some(Ok((left.as_secs_f64(), self.ear.newest)));
                }
                reading = self.ear.next() => self.range.add(&reading),
            }
        }
    }
}

/// Waits until a tracker's sensor is still.
#[derive(Debug)]
pub struct SensorHolding {
    device: String,
    station: u16,
    readings: watch::Receiver<Stations>,
    hold: TrackerHold,
    newest: Option<TrackerReading>,
    progress: TrackerProgress,
    heard: Instant,
    tell: Interval,
    deadline: Instant,
    is_over: bool,
}

impl SensorHolding {
    pub(super) fn new(
        device: String,
        station: u16,
        readings: watch::Receiver<Stations>,
        patience: Duration,
    ) -> Self {
        let now = Instant::now();
        Self {
            device,
            station,
            readings,
            hold: TrackerHold::default(),
            newest: None,
            progress: TrackerProgress::Moving,
            heard: now,
            tell: telling(),
            deadline: now + patience,
            is_over: false,
        }
    }

    /// The next news, with the newest reading; `None` after the end.
    pub async fn next(
        &mut self,
    ) -> Option<Result<(TrackerProgress, Option<TrackerReading>), CalibrationFault>> {
        if self.is_over {
            return None;
        }
        loop {
            tokio::select! {
                biased;
                () = sleep_until(self.deadline) => {
                    self.is_over = true;
                    return Some(Err(CalibrationFault::NotHeld(match self.progress {
                        TrackerProgress::Blind => silent(&format!("station {} of {}", self.station, self.device)),
                        _ => "the sensor was not still for a second in time".to_owned(),
                    })));
                }
                _ = self.tell.tick() => {
                    if self.heard.elapsed() > SILENCE {
                        self.progress = TrackerProgress::Blind;
                    }
                    return Some(Ok((self.progress, self.newest)));
                }
                Ok(()) = self.readings.changed() => {
                    let newest = self.readings.borrow_and_update().get(&self.station).copied();
                    let Some(reading) = newest.filter(|reading| self.newest.as_ref() != Some(reading)) else {
                        continue;
                    };
                    (self.newest, self.heard) = (Some(reading), Instant::now());
                    self.progress = self.hold.push(&reading);
                    if let TrackerProgress::Done(HeldSensor { .. }) = self.progress {
                        self.is_over = true;
                        return Some(Ok((self.progress, self.newest)));
                    }
                }
            }
        }
    }
}

fn telling() -> Interval {
    let mut tell = interval(TELL_EVERY);
    tell.set_missed_tick_behavior(MissedTickBehavior::Delay);
    tell
}

fn silent(device: &str) -> String {
    format!("{device} sends nothing that can be used: `tsukamu devices` says how it does")
}
