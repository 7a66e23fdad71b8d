//! The guided calibration: a computed wearer holds the poses in gloves of several units.

use tsukamu_devices::calibration::fit::{Fit, FitFault, fit};
use tsukamu_devices::calibration::hold::{HoldProgress, PoseCapture, PoseHold};
use tsukamu_devices::calibration::pose::{CalibrationPose, full_deg, full_pose};
use tsukamu_devices::calibration::quality::Verdict;
use tsukamu_devices::calibration::scale::Scales;
use tsukamu_devices::glove::calibrate::{GloveCalibration, SensorCalibration};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;

const PERIOD_NS: u64 = 10_000_000;

/// A wearer in a glove: what each sensor sends at an angle, and what the daemon believes at first.
struct Wearer {
    /// Raw value at 0°, and raw units per degree.
    zero: f64,
    per_deg: f64,
    /// Whether raw values are whole.
    is_whole: bool,
    /// Greatest noise, raw units.
    noise: f64,
    /// Ends of the range, raw units.
    rails: (f64, f64),
    believed: GloveCalibration,
    now_ns: u64,
    seed: u64,
    dead: Vec<GloveSensor>,
    /// Raw units of the thumb's rotation sensor per degree of its abduction.
    thumb_cross: f64,
}

impl Wearer {
    fn new(zero: f64, per_deg: f64) -> Self {
        let believe = |sensor| SensorCalibration {
            raw_at_zero: zero * 1.2,
            gain_deg_per_count: 0.8 / per_deg,
            ..SensorCalibration::default_of(sensor)
        };
        Self {
            zero,
            per_deg,
            is_whole: true,
            noise: 0.0,
            rails: (f64::NEG_INFINITY, f64::INFINITY),
            believed: GloveCalibration::default().filled(believe),
            now_ns: 0,
            seed: 1,
            dead: Vec::new(),
            thumb_cross: 0.0,
        }
    }

    /// -1 to 1.
    fn random(&mut self) -> f64 {
        self.seed = self
            .seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    fn reading(&mut self, angle_deg: impl Fn(GloveSensor) -> f64) -> GloveReading {
        let mut raw = [None; GloveSensor::N_SLOTS];
        for sensor in GloveSensor::ALL {
            let mut value = self.zero + self.per_deg * angle_deg(sensor);
            if sensor == GloveSensor::ThumbRotation {
                value += self.thumb_cross * angle_deg(GloveSensor::ThumbAbduction);
            }
            if self.dead.contains(&sensor) {
                value = self.zero;
            }
            value += self.noise * self.random();
            let value = if self.is_whole { value.round() } else { value };
            raw[sensor.slot()] = Some(value.max(self.rails.0).min(self.rails.1));
        }
        self.now_ns += PERIOD_NS;
        GloveReading {
            sensors: self.believed.angles(&raw),
            angles_valid: true,
            ..GloveReading::empty(self.now_ns, 0)
        }
    }

    /// Goes from one pose to the next and holds it. The time that it took is in seconds.
    fn pose(
        &mut self,
        scales: &mut Scales,
        from: CalibrationPose,
        to: CalibrationPose,
        before: Option<PoseCapture>,
    ) -> (PoseCapture, f64) {
        let start_ns = self.now_ns;
        let mut hold = PoseHold::new(to, before);
        for step in 0..2000_u32 {
            let share = (f64::from(step) / 60.0).min(1.0);
            let angle = |sensor| angle(from, sensor) * (1.0 - share) + angle(to, sensor) * share;
            let reading = self.reading(angle);
            scales.add(&reading);
            if let HoldProgress::Done(capture) = hold.push(&reading, scales) {
                assert!(share >= 1.0, "{to:?} was taken while the hand moved");
                return ((**capture).clone(), (self.now_ns - start_ns) as f64 * 1e-9);
            }
        }
        panic!("{to:?} was never held");
    }

    fn routine(&mut self) -> (Result<Fit, FitFault>, f64) {
        let (mut scales, mut captures, mut total_s) = (Scales::default(), Vec::new(), 0.0);
        let mut from = CalibrationPose::Fist;
        for to in CalibrationPose::ALL {
            let (capture, took_s) = self.pose(&mut scales, from, to, captures.last().cloned());
            captures.push(capture);
            total_s += took_s;
            from = to;
        }
        (fit(&captures, &scales, &self.believed), total_s)
    }
}

/// What the joints really do in a pose; where the routine asks nothing, something all the same.
fn angle(pose: CalibrationPose, sensor: GloveSensor) -> f64 {
    let relaxed = match (pose, sensor) {
        (CalibrationPose::Fist, GloveSensor::ThumbRotation) => 35.0,
        (CalibrationPose::ThumbAcross, GloveSensor::ThumbMcp | GloveSensor::ThumbIp) => 30.0,
        (CalibrationPose::ThumbAcross, GloveSensor::ThumbAbduction) => 10.0,
        _ => 0.0,
    };
    pose.target_deg(sensor).unwrap_or(relaxed)
}

/// The calibration finds the angles at which the joints really are, everywhere in the range.
fn check_angles(wearer: &mut Wearer, fit: &Fit, tolerance_deg: f64) {
    wearer.believed = fit.calibration.clone();
    for share in [0.0, 0.3, 0.7, 1.0] {
        let wanted = |sensor: GloveSensor| match full_pose(sensor) {
            Some(_) => share * full_deg(sensor),
            None => 0.0,
        };
        let reading = wearer.reading(wanted);
        for sensor in GloveSensor::ALL
            .into_iter()
            .filter(|sensor| full_pose(*sensor).is_some())
        {
            if wearer.dead.contains(&sensor) {
                assert_eq!(reading.sensor(sensor), None, "{sensor:?} is absent");
                continue;
            }
            let found = reading.sensor(sensor).unwrap();
            let error = found.angle_rad.to_degrees() - wanted(sensor);
            assert!(
                error.abs() < tolerance_deg,
                "{sensor:?} at {share}: {error}"
            );
            assert!(!found.clamped, "{sensor:?} has room");
        }
    }
}

#[test]
fn any_glove_is_calibrated_in_well_under_half_a_minute() {
    let counts_8 = Wearer::new(45.0, 1.8);
    let counts_12 = Wearer {
        noise: 6.0,
        ..Wearer::new(700.0, 28.0)
    };
    let falling = Wearer {
        noise: 3.0,
        ..Wearer::new(3900.0, -25.0)
    };
    let degrees = Wearer {
        is_whole: false,
        noise: 0.2,
        ..Wearer::new(-4.0, 0.9)
    };
    let shares = Wearer {
        is_whole: false,
        noise: 0.001,
        ..Wearer::new(0.2, 0.006)
    };
    for (mut wearer, tolerance_deg) in [
        (counts_8, 1.0),
        (counts_12, 1.0),
        (falling, 1.0),
        (degrees, 1.0),
        (shares, 1.0),
    ] {
        let (fitted, took_s) = wearer.routine();
        let fitted = fitted.unwrap();
        assert!(took_s < 15.0, "{took_s} s");
        assert_eq!(fitted.calibration.problems(), []);
        for quality in &fitted.qualities {
            let expected = match full_pose(quality.sensor) {
                Some(_) => Verdict::Good,
                None => Verdict::NotAsked,
            };
            assert_eq!(quality.verdict, expected, "{quality:?}");
        }
        check_angles(&mut wearer, &fitted, tolerance_deg);
    }
}

#[test]
fn a_sensor_that_never_moves_is_absent_and_one_at_its_end_is_said_to_be() {
    let dead = vec![GloveSensor::RingDip, GloveSensor::PalmArch];
    let mut wearer = Wearer {
        dead: dead.clone(),
        rails: (1.0, 254.0),
        ..Wearer::new(60.0, 2.05)
    };
    // PIP joints reach 100°: 265 counts, which do not exist; MCP joints 90°: 244.5.
    let (fitted, _) = wearer.routine();
    let fitted = fitted.unwrap();
    let verdict = |sensor| {
        let found = fitted
            .qualities
            .iter()
            .find(|quality| quality.sensor == sensor);
        found.map(|quality| quality.verdict)
    };
    for sensor in &dead {
        assert_eq!(verdict(*sensor), Some(Verdict::Dead));
        assert!(fitted.calibration.absent.contains(sensor));
    }
    assert_eq!(verdict(GloveSensor::IndexPip), Some(Verdict::Saturated));
    assert_eq!(verdict(GloveSensor::IndexMcp), Some(Verdict::Good));
    assert_eq!(verdict(GloveSensor::WristFlexion), Some(Verdict::NotAsked));
}

#[test]
fn a_noisy_sensor_is_weak_and_keeps_nobody_waiting() {
    let mut wearer = Wearer {
        noise: 22.0,
        ..Wearer::new(100.0, 1.5)
    };
    let (fitted, took_s) = wearer.routine();
    assert!(took_s < 25.0, "{took_s} s");
    let fitted = fitted.unwrap();
    let index = fitted
        .qualities
        .iter()
        .find(|q| q.sensor == GloveSensor::IndexPip)
        .unwrap();
    assert_eq!(index.verdict, Verdict::Weak);
    assert!((0.05..0.6).contains(&index.score), "{index:?}");
}

#[test]
fn the_thumbs_two_sensors_are_told_apart() {
    let mut wearer = Wearer {
        noise: 2.0,
        thumb_cross: 9.0,
        ..Wearer::new(700.0, 28.0)
    };
    let (fitted, _) = wearer.routine();
    let fitted = fitted.unwrap();
    let rotation = fitted.calibration.sensor(GloveSensor::ThumbRotation);
    let coupling = rotation
        .coupling
        .expect("the rotation sensor bends when the thumb is spread");
    assert_eq!(coupling.sensor, GloveSensor::ThumbAbduction);
    check_angles(&mut wearer, &fitted, 1.5);
    // Without a cross-talk there is no coupling to be had.
    let mut plain = Wearer::new(700.0, 28.0);
    let (fitted, _) = plain.routine();
    let rotation = fitted
        .unwrap()
        .calibration
        .sensor(GloveSensor::ThumbRotation);
    assert_eq!(rotation.coupling, None);
}

#[test]
fn poses_that_say_nothing_are_refused() {
    let mut wearer = Wearer::new(45.0, 1.8);
    let mut scales = Scales::default();
    let (flat, fist) = (CalibrationPose::Flat, CalibrationPose::Fist);
    let (at_flat, _) = wearer.pose(&mut scales, fist, flat, None);
    let (at_fist, _) = wearer.pose(&mut scales, flat, fist, Some(at_flat.clone()));
    let base = GloveCalibration::default();
    let refused = |captures: &[PoseCapture]| fit(captures, &scales, &base).unwrap_err();
    assert_eq!(refused(&[]), FitFault::NoFlat);
    assert_eq!(refused(std::slice::from_ref(&at_fist)), FitFault::NoFlat);
    assert_eq!(refused(std::slice::from_ref(&at_flat)), FitFault::FlatOnly);
    let still = PoseCapture {
        pose: fist,
        ..at_flat.clone()
    };
    assert_eq!(refused(&[at_flat.clone(), still]), FitFault::NothingMoved);
    // Two poses fit what they can, and leave the rest as it was.
    let half = fit(&[at_flat, at_fist], &scales, &base).unwrap();
    assert!(
        half.calibration
            .sensors
            .contains_key(&GloveSensor::IndexMcp)
    );
    assert!(
        !half
            .calibration
            .sensors
            .contains_key(&GloveSensor::PalmArch)
    );
}

#[test]
fn poses_in_another_order_are_seen() {
    // A wearer who goes round on his own, and begins with another pose than the routine.
    for shift in 1..4 {
        let mut wearer = Wearer::new(45.0, 1.8);
        let (mut scales, mut captures) = (Scales::default(), Vec::<PoseCapture>::new());
        let mut from = CalibrationPose::ALL[shift - 1];
        for (index, asked) in CalibrationPose::ALL.into_iter().enumerate() {
            let to = CalibrationPose::ALL[(index + shift) % 4];
            let (capture, _) = wearer.pose(&mut scales, from, to, captures.last().cloned());
            captures.push(PoseCapture {
                pose: asked,
                ..capture
            });
            from = to;
        }
        let refused = fit(&captures, &scales, &wearer.believed).unwrap_err();
        assert!(matches!(refused, FitFault::MixedUp(_)), "{refused}");
    }
}

#[test]
fn a_glove_that_cannot_see_the_fingers_spread_is_believed_after_a_while() {
    let mut wearer = Wearer::new(45.0, 1.8);
    let mut scales = Scales::default();
    let flat = CalibrationPose::Flat;
    let (before, _) = wearer.pose(&mut scales, CalibrationPose::Fist, flat, None);
    let mut fist = PoseHold::new(CalibrationPose::Fist, Some(before.clone()));
    let mut spread = PoseHold::new(CalibrationPose::Spread, Some(before));
    let mut unmoved_s = 0.0;
    for _ in 0..1000 {
        let reading = wearer.reading(|sensor| angle(flat, sensor));
        scales.add(&reading);
        let of_fist = fist.push(&reading, &scales);
        assert!(
            !matches!(of_fist, HoldProgress::Done(_)),
            "no glove misses a fist"
        );
        match spread.push(&reading, &scales) {
            HoldProgress::Unmoved => unmoved_s += 0.01,
            HoldProgress::Done(capture) => {
                assert!(capture.unmoved && unmoved_s > 4.0, "{unmoved_s}");
                return;
            }
            _ => {}
        }
    }
    panic!("it waits for ever");
}

/// A wearer who goes round without listening, as the emulated one does, and whom the routine meets at some moment.
#[test]
fn a_routine_that_begins_at_any_moment_takes_each_pose_for_itself() {
    const ROUND_S: f64 = 16.0;
    for begin_s in 0..16 {
        let mut wearer = Wearer::new(45.0, 1.8);
        let (mut scales, mut captures) = (Scales::default(), Vec::<PoseCapture>::new());
        let mut hold = PoseHold::new(CalibrationPose::Flat, None);
        for step in 0..5000_u32 {
            let turn = (f64::from(begin_s) + f64::from(step) * 0.01) % ROUND_S / ROUND_S * 4.0;
            let pose = |index: usize| CalibrationPose::ALL[index % 4];
            // 0.6 s of each turn's four are the way to the next pose.
            let share = ((turn.fract() - 0.85) / 0.15).max(0.0);
            let (from, to) = (pose(turn as usize), pose(turn as usize + 1));
            let of = |sensor| angle(from, sensor) * (1.0 - share) + angle(to, sensor) * share;
            let reading = wearer.reading(of);
            scales.add(&reading);
            if let HoldProgress::Done(capture) = hold.push(&reading, &scales) {
                assert_eq!(capture.pose, from, "begun at {begin_s} s");
                captures.push((**capture).clone());
                if captures.len() == 4 {
                    break;
                }
                hold = PoseHold::new(pose(captures.len()), captures.last().cloned());
            }
        }
        assert_eq!(captures.len(), 4, "begun at {begin_s} s");
        let fit = fit(&captures, &scales, &wearer.believed).unwrap();
        check_angles(&mut wearer, &fit, 1.0);
    }
}

#[test]
fn a_calibration_that_is_far_off_makes_a_pose_longer_and_hinders_none() {
    let mut wearer = Wearer::new(45.0, 1.8);
    for line in wearer.believed.sensors.values_mut() {
        line.gain_deg_per_count *= -1.0;
    }
    let (fit, took_s) = wearer.routine();
    assert!(took_s > 12.0 && took_s < 30.0, "{took_s} s");
    check_angles(&mut wearer, &fit.unwrap(), 1.0);
}

#[test]
fn a_glove_that_is_not_plugged_in_holds_nothing() {
    let mut hold = PoseHold::new(CalibrationPose::Flat, None);
    let scales = Scales::default();
    for k in 0..1000 {
        let progress = hold.push(&GloveReading::empty(k * PERIOD_NS, k), &scales);
        assert_eq!(*progress, HoldProgress::Blind);
    }
}
