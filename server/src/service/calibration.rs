//! Calibration of gloves and trackers.

use std::time::Duration;

use nalgebra::Point3;
use tokio::time::{MissedTickBehavior, interval};
use tonic::{Request, Response, Status};
use tsukamu_devices::calibration::pose::CalibrationPose;
use tsukamu_devices::reading::GloveReading;
use tsukamu_proto::v1;
use tsukamu_proto::v1::calibration_server::Calibration;
use tsukamu_proto::v1::set_calibration_request::Source;

use super::{Answers, Backend, off_thread};
use crate::calibration::desk::{CalibrationDesk, Replace, Use};
use crate::calibration::fault::CalibrationFault;
use crate::convert::basic::{checked_name, point, point_from};
use crate::convert::calibration as wire;
use crate::convert::calibration::Extremes;
use crate::convert::fault::Fault;
use crate::settings;

/// Readings a second unless told otherwise, and at most.
const RATE_HZ: (f64, f64) = (30.0, 1000.0);
/// Fewest readings a second: below it a stream looks dead.
const RATE_MIN_HZ: f64 = 0.1;
/// Seconds that a pose is waited for unless told otherwise, and at most: less than a run is left alone.
const PATIENCE_S: (f64, f64) = (30.0, 100.0);
/// Seconds of the quick routine unless told otherwise, and at most.
const RANGE_S: (f64, f64) = (20.0, 100.0);

/// The service.
#[derive(Clone, Debug)]
pub struct CalibrationService(pub Backend);

type Answer<T> = Result<Response<T>, Status>;

/// A number of seconds or hertz; 0 is the default.
fn given(value: f64, (default, most): (f64, f64), field: &'static str) -> Result<f64, Fault> {
    match value {
        _ if !value.is_finite() => Err(Fault::NotFinite(field)),
        _ if value > 0.0 => Ok(value.min(most)),
        _ => Ok(default),
    }
}

fn seconds(value: f64, bounds: (f64, f64), field: &'static str) -> Result<Duration, Fault> {
    given(value, bounds, field).map(Duration::from_secs_f64)
}

const fn over(replace_wearer: bool) -> Replace {
    if replace_wearer {
        Replace::Anyone
    } else {
        Replace::SameWearer
    }
}

fn station(number: u32) -> Result<u16, Status> {
    u16::try_from(number.max(1))
        .map_err(|_too_large| Status::invalid_argument("station is above 65535"))
}

fn path_text(file: Option<std::path::PathBuf>) -> String {
    file.map_or_else(String::new, |file| file.display().to_string())
}

impl CalibrationService {
    fn stamp(&self) -> v1::Stamp {
        self.0.status.stamp()
    }

    /// Runs work of the desk that writes files.
    async fn at_the_desk<T: Send + 'static>(
        &self,
        work: impl FnOnce(&CalibrationDesk) -> Result<T, CalibrationFault> + Send + 'static,
    ) -> Result<T, Status> {
        let desk = std::sync::Arc::clone(&self.0.calibration);
        Ok(off_thread(move || work(&desk)).await??)
    }
}

#[tonic::async_trait]
impl Calibration for CalibrationService {
    type WatchReadingsStream = Answers<v1::WatchReadingsResponse>;
    type CapturePoseStream = Answers<v1::CapturePoseResponse>;
    type CaptureRangeStream = Answers<v1::CaptureRangeResponse>;
    type HoldTrackerStream = Answers<v1::HoldTrackerResponse>;

    async fn watch_readings(
        &self,
        request: Request<v1::WatchReadingsRequest>,
    ) -> Answer<Self::WatchReadingsStream> {
        let request = request.into_inner();
        let rate_hz = given(request.max_rate_hz, RATE_HZ, "max_rate_hz")?;
        if rate_hz < RATE_MIN_HZ {
            return Err(Status::invalid_argument(format!(
                "max_rate_hz is {rate_hz}: it must be 0 (30 readings per second) or at least {RATE_MIN_HZ}"
            )));
        }
        let readings = self
            .0
            .calibration
            .taps()
            .glove(&request.device)?
            .glove_readings();
        let mut period = interval(Duration::from_secs_f64(1.0 / rate_hz));
        period.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let start = (self.0.clone(), readings, period, Extremes::new());
        let answers = futures_util::stream::unfold(
            start,
            |(mut backend, mut readings, mut period, mut extremes)| async move {
                let next = async {
                    period.tick().await;
                    loop {
                        readings.changed().await.ok()?;
                        if let Some(reading) = *readings.borrow_and_update() {
                            return Some(reading);
                        }
                    }
                };
                let reading = tokio::select! {
                    reading = next => reading?,
                    _ = backend.stopping.wait_for(|stops| *stops) => return None,
                };
                let answer = wire::readings(backend.status.stamp(), &reading, &mut extremes);
                Some((Ok(answer), (backend, readings, period, extremes)))
            },
        );
        Ok(Response::new(Box::pin(answers)))
    }

    async fn get_calibration(
        &self,
        request: Request<v1::GetCalibrationRequest>,
    ) -> Answer<v1::GetCalibrationResponse> {
        let device = request.into_inner().device;
        let tap = self.0.calibration.taps().glove(&device)?;
        let calibration = tap.calibration();
        Ok(Response::new(v1::GetCalibrationResponse {
            stamp: Some(self.stamp()),
            toml: CalibrationDesk::text(&calibration)?,
            calibration: Some(wire::calibration(&calibration)),
            file: path_text(tap.calibration_file()),
            running: self.0.calibration.is_running(&device),
        }))
    }

    async fn set_calibration(
        &self,
        request: Request<v1::SetCalibrationRequest>,
    ) -> Answer<v1::SetCalibrationResponse> {
        let request = request.into_inner();
        let calibration = match &request.source {
            Some(Source::Calibration(message)) => wire::calibration_from(message)?,
            Some(Source::Toml(text)) => settings::calibration::parse("calibration", text)?,
            None => return Err(Fault::Missing("calibration").into()),
        };
        let saved = request.save.then_some(over(request.replace_wearer));
        let device = request.device;
        let file = self
            .at_the_desk(move |desk| desk.set(&device, &calibration, saved))
            .await?;
        Ok(Response::new(v1::SetCalibrationResponse {
            stamp: Some(self.stamp()),
            file: path_text(file),
        }))
    }

    async fn begin_calibration(
        &self,
        request: Request<v1::BeginCalibrationRequest>,
    ) -> Answer<v1::BeginCalibrationResponse> {
        let request = request.into_inner();
        let hand = wire::hand_from(request.hand)?;
        let wearer = checked_name(&request.wearer)?;
        let begun = self.0.calibration.begin(&request.device, wearer, hand)?;
        let pose = |pose: CalibrationPose| v1::PoseToHold {
            pose: pose.name().to_owned(),
            words: pose.words().to_owned(),
        };
        Ok(Response::new(v1::BeginCalibrationResponse {
            stamp: Some(self.stamp()),
            run: begun.run,
            poses: CalibrationPose::ALL.map(pose).to_vec(),
            wearer_before: begun.wearer_before,
            file: path_text(begun.file),
        }))
    }

    async fn capture_pose(
        &self,
        request: Request<v1::CapturePoseRequest>,
    ) -> Answer<Self::CapturePoseStream> {
        let request = request.into_inner();
        let patience = seconds(request.timeout_s, PATIENCE_S, "timeout_s")?;
        let pose = CalibrationPose::ALL
            .into_iter()
            .find(|pose| pose.name() == request.pose)
            .ok_or(CalibrationFault::NoPose(request.pose))?;
        let capturing = self
            .0
            .calibration
            .capture_pose(request.run, pose, patience)?;
        let start = (self.0.clone(), capturing, Extremes::new());
        let answers = futures_util::stream::unfold(
            start,
            |(mut backend, mut capturing, mut extremes)| async move {
                let news = tokio::select! {
                    news = capturing.next() => news?,
                    _ = backend.stopping.wait_for(|stops| *stops) => return None,
                };
                let answer = news.map_err(Status::from).map(|(progress, reading)| {
                    let stamp = backend.status.stamp();
                    let shown = shown(stamp, reading.as_ref(), &mut extremes);
                    v1::CapturePoseResponse {
                        stamp: Some(stamp),
                        kind: Some(wire::capture_progress(&progress, shown)),
                    }
                });
                Some((answer, (backend, capturing, extremes)))
            },
        );
        Ok(Response::new(Box::pin(answers)))
    }

    async fn capture_range(
        &self,
        request: Request<v1::CaptureRangeRequest>,
    ) -> Answer<Self::CaptureRangeStream> {
        let request = request.into_inner();
        let duration = seconds(request.duration_s, RANGE_S, "duration_s")?;
        let capturing = self.0.calibration.capture_range(request.run, duration)?;
        let start = (self.0.clone(), capturing, Extremes::new());
        let answers = futures_util::stream::unfold(
            start,
            |(mut backend, mut capturing, mut extremes)| async move {
                let news = tokio::select! {
                    news = capturing.next() => news?,
                    _ = backend.stopping.wait_for(|stops| *stops) => return None,
                };
                let answer = news.map_err(Status::from).map(|(left_s, reading)| {
                    let stamp = backend.status.stamp();
                    v1::CaptureRangeResponse {
                        stamp: Some(stamp),
                        left_s,
                        readings: shown(stamp, reading.as_ref(), &mut extremes),
                    }
                });
                Some((answer, (backend, capturing, extremes)))
            },
        );
        Ok(Response::new(Box::pin(answers)))
    }

    async fn fit_calibration(
        &self,
        request: Request<v1::FitCalibrationRequest>,
    ) -> Answer<v1::FitCalibrationResponse> {
        let request = request.into_inner();
        let wanted = Use {
            apply: request.apply,
            save: request.save.then_some(over(request.replace_wearer)),
        };
        let fitted = self
            .at_the_desk(move |desk| desk.fit(request.run, wanted))
            .await?;
        Ok(Response::new(v1::FitCalibrationResponse {
            stamp: Some(self.stamp()),
            calibration: Some(wire::calibration(&fitted.fit.calibration)),
            toml: fitted.text,
            qualities: fitted.fit.qualities.iter().map(wire::quality).collect(),
            file: path_text(fitted.file),
        }))
    }

    async fn cancel_calibration(
        &self,
        request: Request<v1::CancelCalibrationRequest>,
    ) -> Answer<v1::CancelCalibrationResponse> {
        self.0.calibration.cancel(request.into_inner().run)?;
        Ok(Response::new(v1::CancelCalibrationResponse {
            stamp: Some(self.stamp()),
        }))
    }

    async fn hold_tracker(
        &self,
        request: Request<v1::HoldTrackerRequest>,
    ) -> Answer<Self::HoldTrackerStream> {
        let request = request.into_inner();
        let patience = seconds(request.timeout_s, PATIENCE_S, "timeout_s")?;
        let station = station(request.station)?;
        let holding = self
            .0
            .calibration
            .hold_tracker(&request.device, station, patience)?;
        let answers = futures_util::stream::unfold(
            (self.0.clone(), holding),
            |(mut backend, mut holding)| async move {
                let news = tokio::select! {
                    news = holding.next() => news?,
                    _ = backend.stopping.wait_for(|stops| *stops) => return None,
                };
                let answer =
                    news.map_err(Status::from)
                        .map(|(progress, reading)| v1::HoldTrackerResponse {
                            stamp: Some(backend.status.stamp()),
                            kind: Some(wire::tracker_progress(&progress, reading.as_ref())),
                        });
                Some((answer, (backend, holding)))
            },
        );
        Ok(Response::new(Box::pin(answers)))
    }

    async fn set_room(&self, request: Request<v1::SetRoomRequest>) -> Answer<v1::SetRoomResponse> {
        let request = request.into_inner();
        let points = wire::table_points_from(&request.points)?;
        let corner = match &request.corner {
            None => Point3::origin(),
            given => point_from(given.as_ref(), "corner")?,
        };
        let wanted = Use {
            apply: request.apply,
            save: request.save.then_some(Replace::Anyone),
        };
        let device = request.device;
        let (room, file) = self
            .at_the_desk(move |desk| desk.set_room(&device, &points, corner, wanted))
            .await?;
        let there = room.world_from_transmitter;
        Ok(Response::new(v1::SetRoomResponse {
            stamp: Some(self.stamp()),
            transmitter_position: Some(point(&Point3::from(there.translation.vector))),
            transmitter_rotation_deg: settings::room::yaw_pitch_roll(&there).to_vec(),
            residual_m: room.residual_m,
            edge_m: room.edge_m,
            toml: settings::room::text(&there),
            file: path_text(file),
        }))
    }

    async fn set_mount(
        &self,
        request: Request<v1::SetMountRequest>,
    ) -> Answer<v1::SetMountResponse> {
        let request = request.into_inner();
        let held = wire::held_from(request.held.as_ref())?;
        let wrist = match &request.wrist {
            None => None,
            given => Some(point_from(given.as_ref(), "wrist")?),
        };
        let wanted = Use {
            apply: request.apply,
            save: request.save.then_some(Replace::SameWearer),
        };
        let station = station(request.station)?;
        let device = request.device;
        let (mount, glove, file) = self
            .at_the_desk(move |desk| desk.set_mount((&device, station), &held, wrist, wanted))
            .await?;
        Ok(Response::new(v1::SetMountResponse {
            stamp: Some(self.stamp()),
            mount: Some(wire::mount(&mount)),
            glove,
            toml: settings::calibration::mount_text(&mount),
            file: path_text(file),
        }))
    }
}

/// A reading for a picture.
fn shown(
    stamp: v1::Stamp,
    reading: Option<&GloveReading>,
    extremes: &mut Extremes,
) -> Option<v1::WatchReadingsResponse> {
    reading.map(|reading| wire::readings(stamp, reading, extremes))
}
