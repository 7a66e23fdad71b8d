//! From held poses to a wearer's calibration.
//!
//! Each sensor gets the line through the flat pose (0°) and the pose in which it is as far as it goes. The
//! thumb's rotation sensor also bends when the thumb is only spread: with the thumb across the palm and spread, both
//! sensors known, its angle becomes a·rotation + b·abduction, with b as a `Coupling`.

use std::collections::BTreeSet;

use thiserror::Error;

use crate::calibration::hold::{Held, PoseCapture};
use crate::calibration::pose::{CalibrationPose, full_deg, full_pose};
use crate::calibration::quality::{SensorQuality, Verdict};
use crate::calibration::scale::{Scales, with_room};
use crate::glove::calibrate::{Coupling, GloveCalibration, SensorCalibration};
use crate::glove::sensor::GloveSensor;

/// A sensor that moves less than this share of what the others move per degree is dead.
pub(crate) const DEAD_SHARE: f64 = 0.05;
/// The same, in standard deviations of its noise.
const DEAD_NOISES: f64 = 4.0;
/// The same, in steps of its raw value.
pub(crate) const DEAD_STEPS: f64 = 2.0;
/// Share of a hold's readings at one value from which a sensor at its end is stuck there, not passing by.
const RAIL_SHARE: f64 = 0.8;
/// Least sine of the angle between the thumb's two movements, in units of their sensors' travel, that tells the sensors
/// apart.
const COUPLING_SINE_MIN: f64 = 0.35;
/// Least change of the rotation sensor when the thumb is only spread, as a share of its change across the palm: below
/// it a coupling is not worth having.
const COUPLING_SHARE_MIN: f64 = 0.05;

/// What came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The calibration: that given, with every sensor that could be fitted.
    pub calibration: GloveCalibration,
    /// Every sensor of the glove, in the order of the record.
    pub qualities: Vec<SensorQuality>,
}

/// Why nothing came out.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FitFault {
    /// The pose that all others are measured from is missing.
    #[error("the pose `flat` was not held: every angle is measured from it")]
    NoFlat,
    /// Only the flat pose.
    #[error("no pose but `flat` was held: hold `fist` at least")]
    FlatOnly,
    /// The poses were not those that were asked for.
    #[error(
        "in the pose `{0}` the fingers were as in the pose `fist`, not as in `flat`: hold the poses in their order"
    )]
    MixedUp(&'static str),
    /// No sensor moved from pose to pose.
    #[error("no sensor moved from one pose to another: is the glove worn and plugged in?")]
    NothingMoved,
}

/// The two ends of a sensor's line.
#[derive(Debug, Clone, Copy)]
struct Ends {
    flat: Held,
    full: Held,
    full_deg: f64,
}

impl Ends {
    fn separation(&self) -> f64 {
        (self.full.median - self.flat.median).abs()
    }

    fn noise(&self) -> f64 {
        self.flat.noise.max(self.full.noise)
    }
}

/// Fits what the poses allow. A pose that is given twice counts as the later one. What no pose asks of, or was not held,
/// keeps its calibration; a sensor that does not move becomes absent.
///
/// # Errors
/// When the flat pose or every other one is missing, or nothing moved.
pub fn fit(
    captures: &[PoseCapture],
    scales: &Scales,
    base: &GloveCalibration,
) -> Result<Fit, FitFault> {
    let held = |pose| captures.iter().rev().find(|capture| capture.pose == pose);
    let flat = held(CalibrationPose::Flat).ok_or(FitFault::NoFlat)?;
    if captures
        .iter()
        .all(|capture| capture.pose == CalibrationPose::Flat)
    {
        return Err(FitFault::FlatOnly);
    }
    let ends = |sensor: GloveSensor| {
        let full = held(full_pose(sensor)?)?;
        Some(Ends {
            flat: flat.sensor(sensor)?,
            full: full.sensor(sensor)?,
            full_deg: full_deg(sensor),
        })
    };
    let usual_gain = usual_gain(GloveSensor::ALL.into_iter().filter_map(ends));
    if usual_gain <= 0.0 {
        return Err(FitFault::NothingMoved);
    }
    let (across, spread) = (
        held(CalibrationPose::ThumbAcross),
        held(CalibrationPose::Spread),
    );
    if let Some(fist) = held(CalibrationPose::Fist) {
        check_order(flat, fist, &[across, spread])?;
    }
    let mut calibration = base.clone();
    let mut qualities = Vec::new();
    for sensor in GloveSensor::ALL {
        let Some(at_flat) = flat.sensor(sensor) else {
            continue;
        };
        let quality = unasked(sensor, travel(captures, sensor), at_flat.noise);
        qualities.push(match ends(sensor) {
            Some(ends) => judge(&mut calibration, quality, &ends, scales, usual_gain),
            None => {
                shift_zero(&mut calibration, sensor, at_flat);
                quality
            }
        });
    }
    if qualities
        .iter()
        .all(|quality| matches!(quality.verdict, Verdict::Dead | Verdict::NotAsked))
    {
        return Err(FitFault::NothingMoved);
    }
    if let (Some(across), Some(spread)) = (across, spread) {
        couple_thumb(&mut calibration, flat, across, spread);
    }
    Ok(Fit {
        calibration,
        qualities,
    })
}

/// In these poses the fingers are straight, as in the flat one.
fn check_order(
    flat: &PoseCapture,
    fist: &PoseCapture,
    straight: &[Option<&PoseCapture>],
) -> Result<(), FitFault> {
    let mut held = straight.iter().flatten();
    held.find(|open| is_bent(flat, fist, open))
        .map_or(Ok(()), |open| Err(FitFault::MixedUp(open.pose.name())))
}

/// Whether most of the fingers are nearer to the fist, or bent farther than it, in a pose that has them straight.
fn is_bent(flat: &PoseCapture, fist: &PoseCapture, open: &PoseCapture) -> bool {
    let is_finger = |sensor: &GloveSensor| {
        full_pose(*sensor) == Some(CalibrationPose::Fist)
            && !matches!(sensor, GloveSensor::ThumbMcp | GloveSensor::ThumbIp)
    };
    let nearer = GloveSensor::ALL
        .into_iter()
        .filter(is_finger)
        .filter_map(|sensor| {
            let (flat, fist, open) = (
                flat.sensor(sensor)?,
                fist.sensor(sensor)?,
                open.sensor(sensor)?,
            );
            let noise = flat.noise.max(fist.noise).max(open.noise);
            let apart = |a: Held, b: Held| (a.median - b.median).abs();
            let (bend, open_bend) = (apart(fist, flat), apart(open, flat));
            (bend.max(open_bend) > DEAD_NOISES * noise)
                .then(|| open_bend > bend || apart(open, fist) < open_bend)
        });
    let nearer: Vec<bool> = nearer.collect();
    let n_bent = nearer.iter().filter(|is_nearer| **is_nearer).count();
    2 * n_bent > nearer.len()
}

const fn unasked(sensor: GloveSensor, travel: f64, noise: f64) -> SensorQuality {
    SensorQuality {
        sensor,
        travel,
        noise,
        separation: 0.0,
        error_deg: f64::INFINITY,
        score: 0.0,
        verdict: Verdict::NotAsked,
    }
}

/// Raw units per degree of the sensor in the middle: what one that works has, more or less.
fn usual_gain(all: impl Iterator<Item = Ends>) -> f64 {
    let moved = all.filter(|ends| ends.separation() > DEAD_NOISES * ends.noise());
    middle(moved.map(|ends| ends.separation() / ends.full_deg))
}

/// The median of the values above 0; 0 where there is none.
pub(crate) fn middle(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| *value > 0.0).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn travel(captures: &[PoseCapture], sensor: GloveSensor) -> f64 {
    let held = || captures.iter().filter_map(|capture| capture.sensor(sensor));
    let low = held().fold(f64::INFINITY, |low, held| low.min(held.median));
    let high = held().fold(f64::NEG_INFINITY, |high, held| high.max(held.median));
    high - low
}

/// Puts the sensor's line into the calibration, or takes the sensor for absent, and says how good it is.
fn judge(
    calibration: &mut GloveCalibration,
    mut quality: SensorQuality,
    ends: &Ends,
    scales: &Scales,
    usual_gain: f64,
) -> SensorQuality {
    let sensor = quality.sensor;
    quality.noise = ends.noise();
    quality.separation = ends.separation();
    let quantum = scales.quantum(sensor);
    let least = (DEAD_NOISES * ends.noise())
        .max(DEAD_STEPS * quantum)
        .max(DEAD_SHARE * usual_gain * ends.full_deg);
    let line = SensorCalibration::from_two_points(
        (ends.flat.median, 0.0),
        (ends.full.median, ends.full_deg),
    );
    let Some(line) = line.filter(|_| ends.separation() > least) else {
        if quality.travel > least {
            // It does something, but not what was asked: what it had before stands.
            quality.verdict = Verdict::Weak;
        } else {
            quality.verdict = Verdict::Dead;
            calibration.sensors.remove(&sensor);
            calibration.absent.insert(sensor);
        }
        return quality;
    };
    calibration.absent.remove(&sensor);
    calibration.sensors.insert(sensor, with_room(line, sensor));
    // A step is a uniform error of its length.
    let error_deg = line.gain_deg_per_count.abs() * ends.noise().hypot(quantum / 12.0_f64.sqrt());
    let at_rail = |held: &Held| held.share_at_median >= RAIL_SHARE && scales.is_rail(held.median);
    quality.of_line(error_deg, at_rail(&ends.flat) || at_rail(&ends.full))
}

/// A sensor of which no pose asks more than its zero.
fn shift_zero(calibration: &mut GloveCalibration, sensor: GloveSensor, flat: Held) {
    if full_pose(sensor).is_none()
        && let Some(line) = calibration.sensors.get_mut(&sensor)
    {
        line.raw_at_zero = flat.median;
    }
}

/// Finds a and b of rotation = a·(rotation sensor) + b·(abduction sensor) from the thumb across the palm and the thumb
/// spread, both counted from the flat hand; leaves the line as it is where the two movements cannot be told apart.
fn couple_thumb(
    calibration: &mut GloveCalibration,
    flat: &PoseCapture,
    across: &PoseCapture,
    spread: &PoseCapture,
) {
    let (rotation, abduction) = (GloveSensor::ThumbRotation, GloveSensor::ThumbAbduction);
    let from_flat = |pose: &PoseCapture, sensor| {
        Some(pose.sensor(sensor)?.median - flat.sensor(sensor)?.median)
    };
    let moved = |pose| Some([from_flat(pose, rotation)?, from_flat(pose, abduction)?]);
    let (Some([u1, v1]), Some([u2, v2])) = (moved(across), moved(spread)) else {
        return;
    };
    let both =
        calibration.sensors.contains_key(&rotation) && calibration.sensors.contains_key(&abduction);
    if !both || u2.abs() < COUPLING_SHARE_MIN * u1.abs() {
        return;
    }
    let (u_scale, v_scale) = (u1.abs().max(u2.abs()), v1.abs().max(v2.abs()));
    let det = u1 * v2 - u2 * v1;
    let lengths = (u1 / u_scale).hypot(v1 / v_scale) * (u2 / u_scale).hypot(v2 / v_scale);
    let sine = det / (u_scale * v_scale * lengths);
    if sine.is_nan() || sine.abs() < COUPLING_SINE_MIN {
        return;
    }
    let full = full_deg(rotation);
    let (gain, coupled) = (full * v2 / det, -full * u2 / det);
    if let Some(line) = calibration.sensors.get_mut(&rotation)
        && gain * line.gain_deg_per_count > 0.0
    {
        line.gain_deg_per_count = gain;
        line.coupling = Some(Coupling {
            sensor: abduction,
            gain_deg_per_count: coupled,
        });
    }
}

/// The sensors that a calibration takes for absent are shown again while it is made anew.
#[must_use]
pub fn with_all_sensors(base: &GloveCalibration) -> GloveCalibration {
    GloveCalibration {
        absent: BTreeSet::new(),
        ..base.clone()
    }
}
