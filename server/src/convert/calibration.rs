//! Readings, calibrations, rooms and mounts.

use std::collections::{BTreeMap, BTreeSet};

use tonic::Status;
use tsukamu_devices::calibration::hold::HoldProgress;
use tsukamu_devices::calibration::place::TablePoints;
use tsukamu_devices::calibration::quality::SensorQuality;
use tsukamu_devices::calibration::tracker_hold::{HeldSensor, TrackerProgress};
use tsukamu_devices::glove::calibrate::{
    Coupling, GloveCalibration, Handedness, MountOffset, SensorCalibration,
};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::{GloveReading, TrackerReading};
use tsukamu_proto::v1;

use super::basic::{checked_name, point_from, pose, pose_from};
use super::fault::{Fault, status_text};
use crate::calibration::fault::CalibrationFault;

/// Points of a table that are taken, at most.
const POINTS_MAX: usize = 100;

/// Least and greatest raw value of each sensor of one stream.
pub type Extremes = BTreeMap<GloveSensor, (f64, f64)>;

/// A glove's reading, with the extremes of the stream that it is in.
pub fn readings(
    stamp: v1::Stamp,
    reading: &GloveReading,
    extremes: &mut Extremes,
) -> v1::WatchReadingsResponse {
    let sensors = GloveSensor::ALL.into_iter().filter_map(|sensor| {
        let read = reading.sensor(sensor)?;
        let (low, high) = extremes.entry(sensor).or_insert((read.raw, read.raw));
        (*low, *high) = (low.min(read.raw), high.max(read.raw));
        Some(v1::SensorReading {
            sensor: sensor.name().to_owned(),
            raw: read.raw,
            angle_deg: read.angle_rad.to_degrees(),
            clamped: read.clamped,
            raw_min: *low,
            raw_max: *high,
        })
    });
    v1::WatchReadingsResponse {
        stamp: Some(stamp),
        arrival_ns: reading.stamp_ns,
        sequence: reading.sequence,
        valid: reading.angles_valid,
        side: side(reading.hand).into(),
        sensors: sensors.collect(),
    }
}

const fn side(hand: Option<Handedness>) -> v1::Side {
    match hand {
        None => v1::Side::Unspecified,
        Some(Handedness::Left) => v1::Side::Left,
        Some(Handedness::Right) => v1::Side::Right,
    }
}

/// A side that may be left open.
///
/// # Errors
/// When it is neither.
pub fn hand_from(side: i32) -> Result<Option<Handedness>, Fault> {
    match v1::Side::try_from(side) {
        Ok(v1::Side::Unspecified) => Ok(None),
        Ok(v1::Side::Left) => Ok(Some(Handedness::Left)),
        Ok(v1::Side::Right) => Ok(Some(Handedness::Right)),
        Err(_) => Err(Fault::Unknown {
            field: "hand",
            value: side.to_string(),
            allowed: "left, right, unspecified",
        }),
    }
}

/// A wearer's calibration as a message.
pub fn calibration(calibration: &GloveCalibration) -> v1::GloveCalibration {
    let line = |(sensor, line): (&GloveSensor, &SensorCalibration)| v1::SensorLine {
        sensor: sensor.name().to_owned(),
        raw_at_zero: line.raw_at_zero,
        gain_deg_per_count: line.gain_deg_per_count,
        min_deg: line.min_deg,
        max_deg: line.max_deg,
        coupled_to: line
            .coupling
            .map_or_else(String::new, |other| other.sensor.name().to_owned()),
        coupled_gain_deg_per_count: line.coupling.map_or(0.0, |other| other.gain_deg_per_count),
    };
    let name = |sensor: &GloveSensor| sensor.name().to_owned();
    v1::GloveCalibration {
        wearer: calibration.wearer.clone(),
        hand: side(calibration.hand).into(),
        mount: Some(mount(&calibration.mount)),
        sensors: calibration.sensors.iter().map(line).collect(),
        absent: calibration.absent.iter().map(name).collect(),
    }
}

/// A wearer's calibration from a message. Whether its numbers make sense is asked elsewhere.
///
/// # Errors
/// When a sensor has no name that is known, or the mount is none.
pub fn calibration_from(message: &v1::GloveCalibration) -> Result<GloveCalibration, Fault> {
    let mut sensors = BTreeMap::new();
    for line in &message.sensors {
        let coupling = match line.coupled_to.as_str() {
            "" => None,
            other => Some(Coupling {
                sensor: sensor_from("coupled_to", other)?,
                gain_deg_per_count: line.coupled_gain_deg_per_count,
            }),
        };
        let calibration = SensorCalibration {
            raw_at_zero: line.raw_at_zero,
            gain_deg_per_count: line.gain_deg_per_count,
            min_deg: line.min_deg,
            max_deg: line.max_deg,
            coupling,
        };
        sensors.insert(sensor_from("sensor", &line.sensor)?, calibration);
    }
    let absent: Result<BTreeSet<GloveSensor>, Fault> = message
        .absent
        .iter()
        .map(|name| sensor_from("absent", name))
        .collect();
    Ok(GloveCalibration {
        wearer: checked_name(&message.wearer)?.to_owned(),
        hand: hand_from(message.hand)?,
        absent: absent?,
        mount: message
            .mount
            .as_ref()
            .map(mount_from)
            .transpose()?
            .unwrap_or_default(),
        sensors,
    })
}

fn sensor_from(field: &'static str, name: &str) -> Result<GloveSensor, Fault> {
    GloveSensor::from_name(name).ok_or_else(|| Fault::Unknown {
        field,
        value: format!("{name:?}"),
        allowed: "the names of a calibration file, such as index_mcp",
    })
}

/// A mount as a pose.
pub fn mount(mount: &MountOffset) -> v1::Pose {
    pose(&mount.wrist_from_sensor())
}

fn mount_from(message: &v1::Pose) -> Result<MountOffset, Fault> {
    let wrist_from_sensor = pose_from(Some(message), "mount")?;
    let q = wrist_from_sensor.rotation.coords;
    Ok(MountOffset {
        position_m: wrist_from_sensor.translation.vector.into(),
        rotation_xyzw: [q.x, q.y, q.z, q.w],
    })
}

/// How good a sensor is.
pub fn quality(quality: &SensorQuality) -> v1::SensorQuality {
    v1::SensorQuality {
        sensor: quality.sensor.name().to_owned(),
        travel: quality.travel,
        noise: quality.noise,
        separation: quality.separation,
        error_deg: Some(quality.error_deg).filter(|error| error.is_finite()),
        score: quality.score,
        verdict: quality.verdict.name().to_owned(),
    }
}

/// How far a hold is.
pub fn capture_progress(
    progress: &HoldProgress,
    readings: Option<v1::WatchReadingsResponse>,
) -> v1::capture_pose_response::Kind {
    use v1::capture_pose_response::Kind;
    let (state, share, moving) = match progress {
        HoldProgress::Blind => ("blind", 0.0, &[][..]),
        HoldProgress::Unmoved => ("unmoved", 0.0, &[][..]),
        HoldProgress::Moving(sensors) => ("moving", 0.0, sensors.as_slice()),
        HoldProgress::Holding(share) => ("holding", *share, &[][..]),
        HoldProgress::Doubtful(share) => ("doubtful", *share, &[][..]),
        HoldProgress::Done(capture) => {
            return Kind::Captured(v1::PoseCaptured {
                pose: capture.pose.name().to_owned(),
                readings: u32::try_from(capture.n_readings).unwrap_or(u32::MAX),
                unmoved: capture.unmoved,
            });
        }
    };
    Kind::Progress(v1::CaptureProgress {
        state: state.to_owned(),
        share,
        moving: moving
            .iter()
            .map(|sensor| sensor.name().to_owned())
            .collect(),
        readings,
    })
}

/// How far a tracker's hold is.
pub fn tracker_progress(
    progress: &TrackerProgress,
    newest: Option<&TrackerReading>,
) -> v1::hold_tracker_response::Kind {
    use v1::hold_tracker_response::Kind;
    let (state, share) = match progress {
        TrackerProgress::Blind => ("blind", 0.0),
        TrackerProgress::Moving => ("moving", 0.0),
        TrackerProgress::Holding(share) => ("holding", *share),
        TrackerProgress::Done(held) => {
            return Kind::Held(v1::TrackerHeld {
                pose: Some(pose(&held.pose)),
                noise_m: held.noise_m,
                noise_rad: held.noise_rad,
                readings: u32::try_from(held.n_readings).unwrap_or(u32::MAX),
            });
        }
    };
    Kind::Progress(v1::TrackerProgress {
        state: state.to_owned(),
        share,
        pose: newest
            .and_then(TrackerReading::world_from_sensor)
            .as_ref()
            .map(pose),
    })
}

/// Points of a table, in the order of the request.
///
/// # Errors
/// When there are too many, or one is not finite.
pub fn table_points_from(points: &[v1::Vec3]) -> Result<TablePoints, Fault> {
    if !(2..=POINTS_MAX).contains(&points.len()) {
        return Err(Fault::Length {
            field: "points",
            found: points.len(),
            expected: "3 to 100",
        });
    }
    let point = |at: usize| point_from(points.get(at), "points");
    let on_table: Result<Vec<_>, Fault> = (2..points.len()).map(point).collect();
    Ok(TablePoints {
        corner: point(0)?,
        along_edge: point(1)?,
        on_table: on_table?,
    })
}

/// A sensor that was held, as `HoldTracker` told it.
///
/// # Errors
/// When it is no pose.
pub fn held_from(message: Option<&v1::Pose>) -> Result<HeldSensor, Fault> {
    Ok(HeldSensor {
        pose: pose_from(message, "held")?,
        noise_m: 0.0,
        noise_rad: 0.0,
        n_readings: 1,
    })
}

impl From<CalibrationFault> for Status {
    fn from(fault: CalibrationFault) -> Self {
        let text = status_text(&fault);
        match fault {
            CalibrationFault::NoDevice { .. } | CalibrationFault::NoRun(_) => Self::not_found(text),
            CalibrationFault::NoGlove(_)
            | CalibrationFault::NoTracker(_)
            | CalibrationFault::NoPose(_)
            | CalibrationFault::Room(_)
            | CalibrationFault::Problems(_) => Self::invalid_argument(text),
            CalibrationFault::NotHeld(_) => Self::deadline_exceeded(text),
            CalibrationFault::Busy(_) => Self::resource_exhausted(text),
            CalibrationFault::Fit(_)
            | CalibrationFault::NoHand { .. }
            | CalibrationFault::NoFile { .. }
            | CalibrationFault::OtherWearer { .. }
            | CalibrationFault::File { .. } => Self::failed_precondition(text),
            CalibrationFault::Text(_) => Self::internal(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_goes_over_the_wire_and_back() {
        let text = "wearer = 'alice'\nhand = 'left'\nabsent = ['ring_dip']\n\
                    [mount]\nposition_m = [0.1, 0.2, 0.3]\nrotation_xyzw = [0.0, 0.6, 0.0, 0.8]\n\
                    [sensors.thumb_rotation]\nraw_at_zero = 100\ngain_deg_per_count = -0.4\nmin_deg = -40\nmax_deg = 60\n\
                    coupling = { sensor = 'thumb_abduction', gain_deg_per_count = 0.1 }\n";
        let before: GloveCalibration = toml::from_str(text).unwrap();
        let mut message = calibration(&before);
        let after = calibration_from(&message).unwrap();
        assert_eq!(after, before);
        message.sensors[0].coupled_to = "nose".to_owned();
        let fault = calibration_from(&message).unwrap_err().to_string();
        assert!(fault.contains("coupled_to is \"nose\""), "{fault}");
        message.mount = Some(v1::Pose::default());
        assert!(calibration_from(&message).is_err());
    }
}
