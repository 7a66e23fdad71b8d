//! Hand samples over time.

use libm::{acos, sin};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use thiserror::Error;
use tsukamu_world::hand::joint::{N_JOINTS, Side};
use tsukamu_world::hand::kinematics::forward;
use tsukamu_world::hand::sample::{FingerAngles, FingerPose, HandSample, JointAngles, ThumbAngles};
use tsukamu_world::hand::skeleton::Skeleton;

/// The motion of one hand or of both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandTrack {
    /// At most one per side.
    pub hands: Vec<TrackHand>,
}

/// The motion of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackHand {
    /// Which hand.
    pub side: Side,
    /// Time of each sample, seconds, strictly rising.
    pub times_s: Vec<f64>,
    /// One sample per time.
    pub samples: Vec<HandSample>,
}

/// What a track answers before its first sample and after its last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outside {
    /// The hand is not tracked there.
    NoSample,
    /// The first or last sample is held.
    Hold,
}

/// Why a track is no track.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum TrackFault {
    /// Two hands of one side.
    #[error("two {} hands in one track", .0.name())]
    TwoOfOneSide(Side),
    /// A hand without samples.
    #[error("the {} hand has no samples", .0.name())]
    NoSamples(Side),
    /// Times and samples differ in number.
    #[error("the {} hand has {n_times} times and {n_samples} samples", .side.name())]
    Counts {
        /// The hand.
        side: Side,
        /// Number of times.
        n_times: usize,
        /// Number of samples.
        n_samples: usize,
    },
    /// A time that is not finite or not after the one before.
    #[error("time {index} of the {} hand does not rise", .side.name())]
    Time {
        /// The hand.
        side: Side,
        /// Index of the time.
        index: usize,
    },
    /// A sample with a number that is not finite.
    #[error("sample {index} of the {} hand is not finite", .side.name())]
    NotFinite {
        /// The hand.
        side: Side,
        /// Index of the sample.
        index: usize,
    },
}

/// Longest time between two samples that is bridged, seconds. In a longer gap the hand is not tracked.
pub const GAP_MAX_S: f64 = 0.1;
/// Rounding of times that may still be bridged, seconds.
const GAP_ROUNDING_S: f64 = 1e-9;
/// Above this cosine of half the angle two rotations are interpolated linearly.
const NEARLY_EQUAL: f64 = 0.999_999;

impl HandTrack {
    /// The hand of a side, if the track has one.
    pub fn hand(&self, side: Side) -> Option<&TrackHand> {
        self.hands.iter().find(|hand| hand.side == side)
    }

    /// Time of the earliest sample, seconds; 0 without samples.
    pub fn start_s(&self) -> f64 {
        self.hands
            .iter()
            .filter_map(|hand| hand.times_s.first().copied())
            .reduce(f64::min)
            .unwrap_or(0.0)
    }

    /// Time of the latest sample, seconds; 0 without samples.
    pub fn end_s(&self) -> f64 {
        self.hands
            .iter()
            .filter_map(|hand| hand.times_s.last().copied())
            .reduce(f64::max)
            .unwrap_or(0.0)
    }

    /// Seconds from the earliest sample to the latest.
    pub fn duration_s(&self) -> f64 {
        self.end_s() - self.start_s()
    }

    /// The same motion with joint places in place of joint angles.
    #[must_use]
    pub fn with_points(&self, skeleton: impl Fn(Side) -> Skeleton) -> Self {
        let hands = self.hands.iter().map(|hand| {
            let skeleton = skeleton(hand.side);
            let samples = hand.samples.iter().map(|sample| HandSample {
                wrist: sample.wrist,
                fingers: FingerPose::Points(world_points(sample, &skeleton, hand.side)),
            });
            TrackHand {
                side: hand.side,
                times_s: hand.times_s.clone(),
                samples: samples.collect(),
            }
        });
        Self {
            hands: hands.collect(),
        }
    }

    /// Checks what the types do not.
    ///
    /// # Errors
    /// The first fault.
    pub fn validate(&self) -> Result<(), TrackFault> {
        for (index, hand) in self.hands.iter().enumerate() {
            if self.hands[..index]
                .iter()
                .any(|other| other.side == hand.side)
            {
                return Err(TrackFault::TwoOfOneSide(hand.side));
            }
            hand.validate()?;
        }
        Ok(())
    }
}

impl TrackHand {
    /// The hand at a time in seconds, interpolated between its neighbours; `None` where it is not tracked: in gaps
    /// longer than [`GAP_MAX_S`] and, as `outside` says, beyond the ends. A joint is tracked between two
    /// samples if it is in both. A recorded time gives its sample as it is.
    ///
    /// Joint places are interpolated in the wrist's space, so that a turning hand keeps its shape.
    pub fn sample_at(&self, t_s: f64, outside: Outside) -> Option<HandSample> {
        let (first, last) = (self.times_s.first()?, self.times_s.last()?);
        if t_s < *first || t_s > *last {
            let end = if t_s < *first {
                self.samples.first()
            } else {
                self.samples.last()
            };
            return (outside == Outside::Hold).then(|| end.cloned()).flatten();
        }
        let after = self.times_s.partition_point(|time| *time <= t_s);
        let before = after.checked_sub(1)?;
        let (earlier, start) = (self.samples.get(before)?, self.times_s[before]);
        if t_s == start {
            return Some(earlier.clone());
        }
        let (later, end) = (self.samples.get(after)?, *self.times_s.get(after)?);
        let gap = end - start;
        (gap <= GAP_MAX_S + GAP_ROUNDING_S).then(|| between(earlier, later, (t_s - start) / gap))
    }

    fn validate(&self) -> Result<(), TrackFault> {
        let side = self.side;
        let (n_times, n_samples) = (self.times_s.len(), self.samples.len());
        if n_times != n_samples {
            return Err(TrackFault::Counts {
                side,
                n_times,
                n_samples,
            });
        }
        if n_times == 0 {
            return Err(TrackFault::NoSamples(side));
        }
        let mut previous = f64::NEG_INFINITY;
        for (index, (time, sample)) in self.times_s.iter().zip(&self.samples).enumerate() {
            if !time.is_finite() || *time <= previous {
                return Err(TrackFault::Time { side, index });
            }
            if !sample.is_finite() {
                return Err(TrackFault::NotFinite { side, index });
            }
            previous = *time;
        }
        Ok(())
    }
}

/// The joints of a sample in world space, metres: its own, or those of its angles.
pub fn world_points(
    sample: &HandSample,
    skeleton: &Skeleton,
    side: Side,
) -> [Option<Point3<f64>>; N_JOINTS] {
    match &sample.fingers {
        FingerPose::Points(points) => *points,
        FingerPose::Angles(angles) => {
            forward(skeleton, side, angles).map(|place| Some(sample.wrist * place))
        }
    }
}

/// The sample a share of the way from one to another. Between angles and places the earlier one's fingers stay.
pub fn between(earlier: &HandSample, later: &HandSample, share: f64) -> HandSample {
    let place = earlier
        .wrist
        .translation
        .vector
        .lerp(&later.wrist.translation.vector, share);
    let rotation = slerp(&earlier.wrist.rotation, &later.wrist.rotation, share);
    let wrist = Isometry3::from_parts(Translation3::from(place), rotation);
    let fingers = match (&earlier.fingers, &later.fingers) {
        (FingerPose::Points(a), FingerPose::Points(b)) => {
            FingerPose::Points(std::array::from_fn(|joint| {
                let from = earlier.wrist.inverse_transform_point(&a[joint]?);
                let to = later.wrist.inverse_transform_point(&b[joint]?);
                Some(wrist * Point3::from(from.coords.lerp(&to.coords, share)))
            }))
        }
        (FingerPose::Angles(a), FingerPose::Angles(b)) => {
            FingerPose::Angles(angles_between(a, b, share))
        }
        // The earlier hand's shape, carried by the wrist.
        (FingerPose::Points(a), FingerPose::Angles(_)) => FingerPose::Points(
            a.map(|point| point.map(|p| wrist * earlier.wrist.inverse_transform_point(&p))),
        ),
        (FingerPose::Angles(a), FingerPose::Points(_)) => FingerPose::Angles(*a),
    };
    HandSample { wrist, fingers }
}

/// The rotation a share of the way from one to another, the short way round.
pub fn slerp(
    from: &UnitQuaternion<f64>,
    to: &UnitQuaternion<f64>,
    share: f64,
) -> UnitQuaternion<f64> {
    let (a, mut b) = (from.coords, to.coords);
    let mut cosine = a.dot(&b);
    if cosine < 0.0 {
        (b, cosine) = (-b, -cosine);
    }
    let (near, far) = if cosine > NEARLY_EQUAL {
        (1.0 - share, share)
    } else {
        let angle = acos(cosine);
        let whole = sin(angle);
        (
            sin((1.0 - share) * angle) / whole,
            sin(share * angle) / whole,
        )
    };
    UnitQuaternion::new_normalize(Quaternion::from(a * near + b * far))
}

/// The angles a share of the way from one posture to another.
pub(crate) fn angles_between(a: &JointAngles, b: &JointAngles, share: f64) -> JointAngles {
    let mix = |x: f64, y: f64| x + (y - x) * share;
    let (s, t) = (&a.thumb, &b.thumb);
    JointAngles {
        thumb: ThumbAngles {
            opposition: mix(s.opposition, t.opposition),
            abduction: mix(s.abduction, t.abduction),
            mcp_flexion: mix(s.mcp_flexion, t.mcp_flexion),
            ip_flexion: mix(s.ip_flexion, t.ip_flexion),
        },
        fingers: std::array::from_fn(|finger| {
            let (f, g) = (&a.fingers[finger], &b.fingers[finger]);
            FingerAngles {
                mcp_flexion: mix(f.mcp_flexion, g.mcp_flexion),
                pip_flexion: mix(f.pip_flexion, g.pip_flexion),
                dip_flexion: mix(f.dip_flexion, g.dip_flexion),
                abduction: mix(f.abduction, g.abduction),
            }
        }),
        palm_arch: mix(a.palm_arch, b.palm_arch),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn sample(x: f64, turn: f64) -> HandSample {
        let wrist = Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::y() * turn);
        let mut points = [None; N_JOINTS];
        points[3] = Some(wrist * Point3::new(0.0, 0.0, -0.1));
        HandSample {
            wrist,
            fingers: FingerPose::Points(points),
        }
    }

    fn hand(times_s: &[f64]) -> TrackHand {
        let samples = times_s.iter().map(|t| sample(*t, *t)).collect();
        TrackHand {
            side: Side::Right,
            times_s: times_s.to_vec(),
            samples,
        }
    }

    #[test]
    fn between_samples_the_hand_moves_on_and_keeps_its_shape() {
        let hand = hand(&[0.0, 0.1, 0.2]);
        let middle = hand.sample_at(0.15, Outside::NoSample).unwrap();
        assert!((middle.wrist.translation.x - 0.15).abs() < 1e-12);
        assert!((middle.wrist.rotation.angle() - 0.15).abs() < 1e-9);
        let FingerPose::Points(points) = middle.fingers else {
            panic!("points stay points")
        };
        let reach = (points[3].unwrap() - Point3::from(middle.wrist.translation.vector)).norm();
        assert!((reach - 0.1).abs() < 1e-12 && points[4].is_none());
        assert_eq!(
            hand.sample_at(0.1, Outside::NoSample),
            Some(sample(0.1, 0.1))
        );
    }

    #[test]
    fn gaps_and_ends_are_as_told() {
        let hand = hand(&[0.0, 0.1, 0.3, 0.31]);
        let check = |t, outside, tracked| {
            assert_eq!(
                hand.sample_at(t, outside).is_some(),
                tracked,
                "{t} {outside:?}"
            );
        };
        check(-0.01, Outside::NoSample, false);
        check(-0.01, Outside::Hold, true);
        check(0.05, Outside::NoSample, true);
        check(0.1, Outside::NoSample, true);
        check(0.2, Outside::Hold, false);
        check(0.305, Outside::NoSample, true);
        check(0.31, Outside::NoSample, true);
        check(0.32, Outside::NoSample, false);
        check(0.32, Outside::Hold, true);
        check(f64::NAN, Outside::Hold, false);
        let empty = TrackHand {
            side: Side::Left,
            times_s: vec![],
            samples: vec![],
        };
        assert_eq!(empty.sample_at(0.0, Outside::Hold), None);
    }

    #[test]
    fn faults_are_found() {
        let track = |hands| HandTrack { hands };
        assert_eq!(track(vec![hand(&[0.0, 0.1])]).validate(), Ok(()));
        assert_eq!(
            track(vec![hand(&[0.0]), hand(&[0.0])]).validate(),
            Err(TrackFault::TwoOfOneSide(Side::Right))
        );
        assert_eq!(
            track(vec![hand(&[])]).validate(),
            Err(TrackFault::NoSamples(Side::Right))
        );
        let backwards = track(vec![hand(&[0.1, 0.1])]).validate();
        assert_eq!(
            backwards,
            Err(TrackFault::Time {
                side: Side::Right,
                index: 1
            })
        );
        let mut spoilt = hand(&[0.0, 0.1]);
        spoilt.samples[1].wrist.translation.x = f64::NAN;
        let fault = track(vec![spoilt]).validate();
        assert_eq!(
            fault,
            Err(TrackFault::NotFinite {
                side: Side::Right,
                index: 1
            })
        );
        assert!((track(vec![hand(&[0.5, 2.0])]).duration_s() - 1.5).abs() < 1e-12);
    }

    #[test]
    fn rotations_go_the_short_way() {
        let a = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.2);
        let b = UnitQuaternion::new_unchecked(
            -UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1.0).into_inner(),
        );
        let middle = slerp(&a, &b, 0.5);
        assert!((middle.angle() - 0.6).abs() < 1e-12, "{}", middle.angle());
        let opposite =
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.2 + std::f64::consts::PI);
        assert!(
            slerp(&a, &opposite, 0.5)
                .coords
                .iter()
                .all(|x| x.is_finite())
        );
    }
}
