use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use nalgebra::Point3;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until};
use tracing::info;
use tsukamu_devices::calibration::fit::{Fit, fit, with_all_sensors};
use tsukamu_devices::calibration::hold::{PoseCapture, PoseHold};
use tsukamu_devices::calibration::place::{Room, TablePoints, mount, room};
use tsukamu_devices::calibration::pose::CalibrationPose;
use tsukamu_devices::calibration::scale::Scales;
use tsukamu_devices::calibration::tracker_hold::HeldSensor;
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness, MountOffset};
use tsukamu_devices::glove::quick_range::QuickRange;

use super::capture::{Listening, PoseCapturing, RangeCapturing, SensorHolding};
use super::fault::CalibrationFault;
use super::file::{save, save_calibration};
use super::taps::{Tap, Taps};
use crate::settings;

pub use super::file::Replace;

/// A run that nobody asks about is given up after so long.
const LEFT_ALONE: Duration = Duration::from_secs(120);
/// A run in which nothing is captured gives way to a new one after so long: whoever began it may have gone.
const GIVES_WAY: Duration = Duration::from_secs(3);

/// What is to be done with a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// In force from now on.
    pub apply: bool,
    /// Into the device's file, and over whose.
    pub save: Option<Replace>,
}

/// A guided run as it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Begun {
    /// Its number.
    pub run: u64,
    /// Wearer of the calibration in force.
    pub wearer_before: String,
    /// Where it may be saved.
    pub file: Option<PathBuf>,
}

/// A calibration that was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// With the quality of each sensor.
    pub fit: Fit,
    /// As the text of a file.
    pub text: String,
    /// Where it was saved.
    pub file: Option<PathBuf>,
}

/// Guided runs, and everything that is asked about calibration.
#[derive(Debug)]
pub struct CalibrationDesk {
    taps: Taps,
    runs: Mutex<Runs>,
}

#[derive(Debug, Default)]
struct Runs {
    n_begun: u64,
    open: BTreeMap<u64, Run>,
}

#[derive(Debug)]
struct Run {
    tap: Arc<Tap>,
    /// What is fitted over: that in force, of the new wearer.
    base: GloveCalibration,
    scales: Scales,
    captures: Vec<PoseCapture>,
    range: Option<QuickRange>,
    last_used: Instant,
    /// Alive while something is captured.
    capturing: Weak<()>,
    /// Gives it up when it is left alone, and ends with it.
    _watch: JoinSet<()>,
}

impl CalibrationDesk {
    /// A desk for these devices.
    pub fn new(taps: Taps) -> Self {
        Self {
            taps,
            runs: Mutex::default(),
        }
    }

    /// The devices.
    pub const fn taps(&self) -> &Taps {
        &self.taps
    }

    /// Whether a guided run is under way for a device.
    pub fn is_running(&self, device: &str) -> bool {
        self.runs()
            .open
            .values()
            .any(|run| run.tap.name() == device)
    }

    /// Begins a guided run. It is given up by itself when it is left alone.
    ///
    /// # Errors
    /// When there is no such glove, or one is under way for it.
    pub fn begin(
        self: &Arc<Self>,
        device: &str,
        wearer: &str,
        hand: Option<Handedness>,
    ) -> Result<Begun, CalibrationFault> {
        let tap = self.taps.glove(device)?;
        let before = tap.calibration();
        let begun = {
            let mut runs = self.runs();
            runs.open
                .retain(|_, run| run.tap.name() != device || run.is_attended());
            if runs.open.values().any(|run| run.tap.name() == device) {
                return Err(CalibrationFault::Busy(device.to_owned()));
            }
            runs.n_begun += 1;
            let run = runs.n_begun;
            let mut watch = JoinSet::new();
            watch.spawn(give_up_when_left_alone(Arc::clone(self), run));
            let base = GloveCalibration {
                wearer: wearer.to_owned(),
                hand: hand.or(before.hand),
                ..before.clone()
            };
            let new = Run {
                tap: Arc::clone(&tap),
                base,
                scales: Scales::default(),
                captures: Vec::new(),
                range: None,
                last_used: Instant::now(),
                capturing: Weak::new(),
                _watch: watch,
            };
            runs.open.insert(run, new);
            run
        };
        tap.show_with(with_all_sensors(&before));
        Ok(Begun {
            run: begun,
            wearer_before: before.wearer,
            file: tap.calibration_file(),
        })
    }

    /// Begins to wait for a pose.
    ///
    /// # Errors
    /// When there is no such run.
    pub fn capture_pose(
        self: &Arc<Self>,
        run: u64,
        pose: CalibrationPose,
        patience: Duration,
    ) -> Result<PoseCapturing, CalibrationFault> {
        let (hold, scales, listening) = self.with_run(run, |found| {
            let before = found
                .captures
                .iter()
                .rev()
                .find(|capture| capture.pose != pose);
            let hold = PoseHold::new(pose, before.cloned());
            (hold, found.scales.clone(), found.listening(patience))
        })?;
        let desk = Arc::clone(self);
        Ok(PoseCapturing::new(desk, run, listening, hold, scales))
    }

    /// Begins to note how far everything goes.
    ///
    /// # Errors
    /// When there is no such run.
    pub fn capture_range(
        self: &Arc<Self>,
        run: u64,
        duration: Duration,
    ) -> Result<RangeCapturing, CalibrationFault> {
        let listening = self.with_run(run, |found| found.listening(duration))?;
        Ok(RangeCapturing::new(Arc::clone(self), run, listening))
    }

    pub(super) fn keep_pose(
        &self,
        run: u64,
        capture: PoseCapture,
        scales: Scales,
    ) -> Result<(), CalibrationFault> {
        self.with_run(run, |found| {
            found.captures.retain(|other| other.pose != capture.pose);
            found.captures.push(capture);
            found.scales = scales;
        })
    }

    pub(super) fn keep_range(&self, run: u64, range: QuickRange) -> Result<(), CalibrationFault> {
        self.with_run(run, |found| found.range = Some(range))
    }

    /// Fits what was captured: the poses, or without any the range. Writes files: not for async code.
    ///
    /// # Errors
    /// When there is no such run, nothing can be fitted, or the file must not or cannot be written; then nothing is
    /// applied, and the run goes on.
    pub fn fit(&self, run: u64, wanted: Use) -> Result<Fitted, CalibrationFault> {
        let (tap, fitted) = self.with_run(run, |found| {
            let base = with_all_sensors(&found.base);
            let fitted = match &found.range {
                Some(range) if found.captures.is_empty() => range.fit(&base),
                _ => fit(&found.captures, &found.scales, &base),
            };
            (Arc::clone(&found.tap), fitted)
        })?;
        let fit = fitted?;
        let file = self.use_calibration(&tap, &fit.calibration, wanted)?;
        if wanted.apply {
            self.runs().open.remove(&run);
        }
        let text = super::file::text(&fit.calibration)?;
        Ok(Fitted { fit, text, file })
    }

    /// Gives a run up: what was in force is shown again.
    ///
    /// # Errors
    /// When there is no such run.
    pub fn cancel(&self, run: u64) -> Result<(), CalibrationFault> {
        let ended = self
            .runs()
            .open
            .remove(&run)
            .ok_or(CalibrationFault::NoRun(run))?;
        ended.tap.show_with(ended.tap.calibration());
        Ok(())
    }

    /// Saves and applies a calibration that came from outside. Writes files: not for async code.
    ///
    /// # Errors
    /// When there is no such glove, a number makes no sense, or the file must not or cannot be written; then nothing is
    /// applied.
    pub fn set(
        &self,
        device: &str,
        calibration: &GloveCalibration,
        saved: Option<Replace>,
    ) -> Result<Option<PathBuf>, CalibrationFault> {
        let tap = self.taps.glove(device)?;
        let problems = calibration.problems();
        if !problems.is_empty() {
            return Err(CalibrationFault::Problems(problems));
        }
        let wanted = Use {
            apply: true,
            save: saved,
        };
        self.use_calibration(&tap, calibration, wanted)
    }

    /// The text of a calibration file.
    ///
    /// # Errors
    /// When TOML cannot say it.
    pub fn text(calibration: &GloveCalibration) -> Result<String, CalibrationFault> {
        super::file::text(calibration)
    }

    fn use_calibration(
        &self,
        tap: &Tap,
        calibration: &GloveCalibration,
        wanted: Use,
    ) -> Result<Option<PathBuf>, CalibrationFault> {
        let file = wanted
            .save
            .map(|replace| {
                let file = tap
                    .calibration_file()
                    .ok_or_else(|| no_file(tap, "calibration"))?;
                save_calibration(&file, calibration, replace)?;
                Ok::<_, CalibrationFault>(file)
            })
            .transpose()?;
        if wanted.apply {
            self.taps.apply_calibration(tap, calibration.clone());
            let saved = file
                .as_ref()
                .map_or_else(|| "nowhere".into(), |file| file.display().to_string());
            info!(
                device = tap.name(),
                wearer = calibration.wearer,
                saved,
                "calibrated"
            );
        }
        Ok(file)
    }

    /// Begins to wait until a tracker's sensor is still.
    ///
    /// # Errors
    /// When there is no such tracker.
    pub fn hold_tracker(
        &self,
        device: &str,
        station: u16,
        patience: Duration,
    ) -> Result<SensorHolding, CalibrationFault> {
        let readings = self.taps.tracker(device)?.tracker_readings();
        Ok(SensorHolding::new(
            device.to_owned(),
            station,
            readings,
            patience,
        ))
    }

    /// Finds where a tracker's transmitter stands. Writes files: not for async code.
    ///
    /// # Errors
    /// When there is no such tracker, the points say nothing, or the file cannot be written; then nothing is applied.
    pub fn set_room(
        &self,
        device: &str,
        points: &TablePoints,
        corner: Point3<f64>,
        wanted: Use,
    ) -> Result<(Room, Option<PathBuf>), CalibrationFault> {
        let tap = self.taps.tracker(device)?;
        let found = room(points, corner)?;
        let file = wanted
            .save
            .map(|_| {
                let file = tap.room_file().ok_or_else(|| no_file(&tap, "room"))?;
                save(&file, &settings::room::text(&found.world_from_transmitter))?;
                Ok::<_, CalibrationFault>(file)
            })
            .transpose()?;
        if wanted.apply {
            self.taps.apply_room(&tap, found.world_from_transmitter);
            info!(device, residual_m = found.residual_m, "the room is set");
        }
        Ok((found, file))
    }

    /// Finds how a tracker's sensor sits on the wrist of the hand that wears it. Writes files: not for async code.
    ///
    /// # Errors
    /// When no hand wears it, or the file cannot be written; then nothing is applied.
    pub fn set_mount(
        &self,
        (device, station): (&str, u16),
        held: &HeldSensor,
        wrist: Option<Point3<f64>>,
        wanted: Use,
    ) -> Result<(MountOffset, String, Option<PathBuf>), CalibrationFault> {
        let tracker = self.taps.tracker(device)?;
        let glove = self.taps.glove_on(device, station)?;
        let before = glove.calibration();
        let found = mount(
            held,
            &tracker.world_from_transmitter(),
            wrist,
            &before.mount,
        );
        let calibration = GloveCalibration {
            mount: found,
            ..before
        };
        let file = self.use_calibration(&glove, &calibration, wanted)?;
        Ok((found, glove.name().to_owned(), file))
    }

    fn with_run<T>(
        &self,
        run: u64,
        work: impl FnOnce(&mut Run) -> T,
    ) -> Result<T, CalibrationFault> {
        let mut runs = self.runs();
        let found = runs
            .open
            .get_mut(&run)
            .ok_or(CalibrationFault::NoRun(run))?;
        found.last_used = Instant::now();
        Ok(work(found))
    }

    /// When a run will have been left alone for too long; `None` when it is over.
    fn alone_at(&self, run: u64) -> Option<Instant> {
        self.runs()
            .open
            .get(&run)
            .map(|run| run.last_used + LEFT_ALONE)
    }

    /// A panic elsewhere leaves whole runs.
    fn runs(&self) -> MutexGuard<'_, Runs> {
        self.runs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Run {
    fn is_attended(&self) -> bool {
        self.capturing.strong_count() > 0 || self.last_used.elapsed() < GIVES_WAY
    }

    fn listening(&mut self, patience: Duration) -> Listening {
        let attendance = Arc::new(());
        self.capturing = Arc::downgrade(&attendance);
        Listening {
            attendance,
            device: self.tap.name().to_owned(),
            hand: self.base.hand,
            readings: self.tap.glove_readings(),
            patience,
        }
    }
}

async fn give_up_when_left_alone(desk: Arc<CalibrationDesk>, run: u64) {
    while let Some(due) = desk.alone_at(run) {
        if due <= Instant::now() {
            info!(run, "a calibration was left alone and is given up");
            // It may have ended by itself this instant.
            let _ = desk.cancel(run);
            return;
        }
        sleep_until(due).await;
    }
}

fn no_file(tap: &Tap, key: &'static str) -> CalibrationFault {
    let device = tap.name().to_owned();
    CalibrationFault::NoFile { device, key }
}
