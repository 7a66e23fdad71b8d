//! The One-Euro filter (Casiez, Roussel and Vogel 2012, "1€ Filter", CHI '12) on a whole hand.
//!
//! A first-order low-pass whose cut-off rises with speed: `f_c = f_min + β |ẋ|`, `α = 1 / (1 + τ/Tₑ)`,
//! `τ = 1 / (2π f_c)`. Each quantity is filtered as a vector, so that its direction is kept: the wrist's position, its
//! rotation, and each joint in the wrist's space (or the joint angles together).
//!
//! Wrist and joint angles that come by turns, from a tracker and a glove, are each filtered on their own news only: a
//! repeated value would read as a hand that stands.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, SVector, Translation3, UnitQuaternion, Vector3};
use tsukamu_world::hand::joint::N_JOINTS;
use tsukamu_world::hand::sample::{FingerAngles, FingerPose, HandSample, JointAngles, ThumbAngles};

use super::sources::News;

/// A filter's settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneEuro {
    /// Cut-off at rest, Hz, above 0.
    pub min_cutoff_hz: f64,
    /// How fast the cut-off rises with speed, per metre or per radian; 0 or more.
    pub beta: f64,
    /// Cut-off of the speed estimate, Hz, above 0.
    pub derivative_cutoff_hz: f64,
}

/// Cut-off of the speed estimate where none is given, Hz: the paper's.
pub const DERIVATIVE_CUTOFF_HZ: f64 = 1.0;
/// Time between samples after which the filter begins anew, in seconds: what was before says nothing.
const FORGET_S: f64 = 0.5;

/// A filter's memory of one vector.
#[derive(Clone, Copy, Debug)]
struct Channel<const N: usize> {
    value: SVector<f64, N>,
    speed: SVector<f64, N>,
    /// Time constant used last, seconds.
    tau_s: f64,
}

impl OneEuro {
    /// Whether every number is in its bounds.
    pub fn is_valid(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        positive(self.min_cutoff_hz)
            && positive(self.derivative_cutoff_hz)
            && self.beta >= 0.0
            && self.beta.is_finite()
    }

    /// The new filtered value of a channel, `elapsed_s` after the last one.
    fn advance<const N: usize>(
        &self,
        memory: &mut Option<Channel<N>>,
        now: SVector<f64, N>,
        elapsed_s: f64,
    ) -> SVector<f64, N> {
        let Some(before) = memory else {
            *memory = Some(Channel {
                value: now,
                speed: SVector::zeros(),
                tau_s: 0.0,
            });
            return now;
        };
        // The paper takes the speed from the filtered value.
        let speed = (now - before.value) / elapsed_s;
        before.speed = before
            .speed
            .lerp(&speed, alpha(self.derivative_cutoff_hz, elapsed_s));
        let cutoff = self.min_cutoff_hz + self.beta * before.speed.norm();
        before.tau_s = 1.0 / (TAU * cutoff);
        before.value = before.value.lerp(&now, alpha(cutoff, elapsed_s));
        before.value
    }
}

fn alpha(cutoff_hz: f64, elapsed_s: f64) -> f64 {
    1.0 / (1.0 + 1.0 / (TAU * cutoff_hz * elapsed_s))
}

/// A filter of one hand.
#[derive(Clone, Debug)]
pub struct HandFilter {
    settings: OneEuro,
    /// Newest news of each half, monotonic nanoseconds.
    wrist_ns: Option<u64>,
    fingers_ns: Option<u64>,
    position: Option<Channel<3>>,
    rotation: Option<(UnitQuaternion<f64>, Option<Channel<3>>)>,
    joints: [Option<Channel<3>>; N_JOINTS],
    angles: Option<Channel<N_ANGLES>>,
}

/// Joint angles of a hand.
const N_ANGLES: usize = 21;

impl HandFilter {
    /// A filter that has seen nothing.
    pub const fn new(settings: OneEuro) -> Self {
        Self {
            settings,
            wrist_ns: None,
            fingers_ns: None,
            position: None,
            rotation: None,
            joints: [None; N_JOINTS],
            angles: None,
        }
    }

    /// The filtered sample of a finite one that arrived at a monotonic time in nanoseconds. Stamps that do not rise
    /// give the newer sample the filter's place without moving it in time. A half that is no news stays where it is.
    pub fn filtered(&mut self, sample: &HandSample, arrival_ns: u64, news: News) -> HandSample {
        let known_wrist = self.wrist().filter(|_| news == News::Fingers);
        let wrist = known_wrist.unwrap_or_else(|| self.next_wrist(&sample.wrist, arrival_ns));
        let known_angles = self.angles.filter(|_| news == News::Wrist);
        let fingers = match (&sample.fingers, known_angles) {
            (FingerPose::Angles(_), Some(known)) => FingerPose::Angles(unpacked(&known.value)),
            _ => self.next_fingers(sample, &wrist, arrival_ns),
        };
        HandSample { wrist, fingers }
    }

    /// Where the filter has the wrist.
    fn wrist(&self) -> Option<Isometry3<f64>> {
        let (position, (rotation, _)) = (self.position?, self.rotation?);
        Some(Isometry3::from_parts(
            Translation3::from(position.value),
            rotation,
        ))
    }

    fn next_wrist(&mut self, wrist: &Isometry3<f64>, arrival_ns: u64) -> Isometry3<f64> {
        let elapsed_s = elapsed_s(&mut self.wrist_ns, arrival_ns).unwrap_or_else(|| {
            (self.position, self.rotation) = (None, None);
            FORGET_S
        });
        let place = self
            .settings
            .advance(&mut self.position, wrist.translation.vector, elapsed_s);
        let rotation = self.rotated(&wrist.rotation, elapsed_s);
        Isometry3::from_parts(Translation3::from(place), rotation)
    }

    /// The filtered fingers of a sample, on its filtered wrist.
    fn next_fingers(
        &mut self,
        sample: &HandSample,
        wrist: &Isometry3<f64>,
        arrival_ns: u64,
    ) -> FingerPose {
        let elapsed_s = elapsed_s(&mut self.fingers_ns, arrival_ns).unwrap_or_else(|| {
            (self.joints, self.angles) = ([None; N_JOINTS], None);
            FORGET_S
        });
        let settings = self.settings;
        match &sample.fingers {
            FingerPose::Angles(angles) => FingerPose::Angles(unpacked(&settings.advance(
                &mut self.angles,
                packed(angles),
                elapsed_s,
            ))),
            FingerPose::Points(points) => FingerPose::Points(std::array::from_fn(|joint| {
                let Some(point) = &points[joint] else {
                    self.joints[joint] = None;
                    return None;
                };
                let local = sample.wrist.inverse_transform_point(point).coords;
                Some(
                    wrist
                        * Point3::from(settings.advance(&mut self.joints[joint], local, elapsed_s)),
                )
            })),
        }
    }

    /// The filtered rotation: the remaining turn, as a vector, is what is filtered.
    fn rotated(&mut self, now: &UnitQuaternion<f64>, elapsed_s: f64) -> UnitQuaternion<f64> {
        let Some((before, channel)) = &mut self.rotation else {
            self.rotation = Some((*now, None));
            return *now;
        };
        let turn = (before.inverse() * now).scaled_axis();
        let memory = channel.get_or_insert(Channel {
            value: Vector3::zeros(),
            speed: Vector3::zeros(),
            tau_s: 0.0,
        });
        // Every turn is told from where the filter stands.
        memory.value = Vector3::zeros();
        let part = self.settings.advance(channel, turn, elapsed_s);
        *before *= UnitQuaternion::from_scaled_axis(part);
        before.renormalize();
        *before
    }

    /// How far the filter runs behind a steady motion at present, in seconds: the largest of its time constants.
    pub fn lag_s(&self) -> f64 {
        let position = self.position.map_or(0.0, |channel| channel.tau_s);
        let rotation = self
            .rotation
            .and_then(|(_, channel)| channel)
            .map_or(0.0, |channel| channel.tau_s);
        let angles = self.angles.map_or(0.0, |channel| channel.tau_s);
        let joints = self.joints.iter().flatten().map(|channel| channel.tau_s);
        joints
            .chain([position, rotation, angles])
            .fold(0.0, f64::max)
    }
}

/// Time since the last news, in seconds; `None` where there was none, or so long ago that it says nothing.
fn elapsed_s(last_ns: &mut Option<u64>, now_ns: u64) -> Option<f64> {
    let before_ns = last_ns.replace(now_ns)?;
    let elapsed_s = now_ns.saturating_sub(before_ns) as f64 * 1.0e-9;
    // Several samples at one time: the shortest time that a clock can tell.
    (elapsed_s <= FORGET_S).then_some(elapsed_s.max(1.0e-9))
}

fn packed(angles: &JointAngles) -> SVector<f64, N_ANGLES> {
    let thumb = &angles.thumb;
    let mut all: SVector<f64, N_ANGLES> = SVector::zeros();
    let thumb = [
        thumb.opposition,
        thumb.abduction,
        thumb.mcp_flexion,
        thumb.ip_flexion,
    ];
    let fingers = angles
        .fingers
        .iter()
        .flat_map(|f| [f.mcp_flexion, f.pip_flexion, f.dip_flexion, f.abduction]);
    let list = thumb.into_iter().chain(fingers).chain([angles.palm_arch]);
    all.iter_mut()
        .zip(list)
        .for_each(|(place, angle)| *place = angle);
    all
}

fn unpacked(all: &SVector<f64, N_ANGLES>) -> JointAngles {
    let finger = |f: usize| FingerAngles {
        mcp_flexion: all[4 + 4 * f],
        pip_flexion: all[5 + 4 * f],
        dip_flexion: all[6 + 4 * f],
        abduction: all[7 + 4 * f],
    };
    JointAngles {
        thumb: ThumbAngles {
            opposition: all[0],
            abduction: all[1],
            mcp_flexion: all[2],
            ip_flexion: all[3],
        },
        fingers: std::array::from_fn(finger),
        palm_arch: all[20],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: OneEuro = OneEuro {
        min_cutoff_hz: 1.0,
        beta: 10.0,
        derivative_cutoff_hz: DERIVATIVE_CUTOFF_HZ,
    };
    const STEP_NS: u64 = 10_000_000;

    fn sample(x: f64, turn: f64, flexion: f64) -> HandSample {
        let mut angles = JointAngles::default();
        angles.fingers[0].mcp_flexion = flexion;
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, turn, 0.0));
        let wrist = Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), rotation);
        HandSample {
            wrist,
            fingers: FingerPose::Angles(angles),
        }
    }

    fn flexion(sample: &HandSample) -> f64 {
        match &sample.fingers {
            FingerPose::Angles(angles) => angles.fingers[0].mcp_flexion,
            FingerPose::Points(_) => f64::NAN,
        }
    }

    #[test]
    fn noise_shrinks_and_a_step_is_reached() {
        let mut filter = HandFilter::new(OneEuro {
            beta: 0.0,
            ..SETTINGS
        });
        let noise = |k: u64| if k.is_multiple_of(2) { 0.001 } else { -0.001 };
        let mut last = filter.filtered(&sample(0.0, 0.0, 0.0), 0, News::Whole);
        for k in 1..500 {
            last = filter.filtered(
                &sample(noise(k), noise(k), noise(k)),
                k * STEP_NS,
                News::Whole,
            );
        }
        let parts = [
            last.wrist.translation.x,
            last.wrist.rotation.angle(),
            flexion(&last),
        ];
        assert!(parts.iter().all(|part| part.abs() < 0.0001), "{parts:?}");
        for k in 500..1000 {
            last = filter.filtered(&sample(0.5, 1.0, 0.7), k * STEP_NS, News::Whole);
        }
        let parts = [
            last.wrist.translation.x - 0.5,
            last.wrist.rotation.angle() - 1.0,
            flexion(&last) - 0.7,
        ];
        assert!(parts.iter().all(|part| part.abs() < 1e-6), "{parts:?}");
    }

    #[test]
    fn the_reported_lag_is_the_lag_of_a_steady_motion() {
        // At a constant speed v a low-pass of time constant τ stands v τ behind.
        for beta in [0.0, 10.0] {
            let mut filter = HandFilter::new(OneEuro { beta, ..SETTINGS });
            let speed = 0.5;
            let mut behind = 0.0;
            for k in 0..1000 {
                let x = speed * k as f64 * 0.01;
                behind = x - filter
                    .filtered(&sample(x, 0.0, 0.0), k * STEP_NS, News::Whole)
                    .wrist
                    .translation
                    .x;
            }
            let position = filter.position.expect("seen").tau_s;
            assert!(
                (behind / speed - position).abs() < 0.003,
                "β {beta}: {} s, said {position} s",
                behind / speed
            );
            assert!(filter.lag_s() >= position);
        }
    }

    #[test]
    fn a_long_silence_is_forgotten_and_equal_stamps_do_no_harm() {
        let mut filter = HandFilter::new(SETTINGS);
        filter.filtered(&sample(0.0, 0.0, 0.0), 0, News::Whole);
        let same = filter.filtered(&sample(1.0, 1.0, 1.0), 0, News::Whole);
        assert!(same.is_finite());
        let after = filter.filtered(&sample(2.0, 1.0, 1.0), 10_000_000_000, News::Whole);
        assert_eq!(after.wrist.translation.x, 2.0);
    }

    /// A tracker at 120 Hz and a glove at 100 Hz: each half is as if it were alone, whatever the other does.
    #[test]
    fn halves_that_come_by_turns_are_filtered_each_by_itself() {
        let wrist = (0..120_u64).map(|k| (k * 8_333_333, News::Wrist, k as f64 / 120.0));
        let fingers = (0..100_u64).map(|k| (k * STEP_NS + 1, News::Fingers, k as f64 / 100.0));
        let mut all: Vec<_> = wrist.chain(fingers).collect();
        all.sort_by_key(|(arrival_ns, ..)| *arrival_ns);
        let new = || HandFilter::new(SETTINGS);
        let (mut both, mut wrist_alone, mut fingers_alone) = (new(), new(), new());
        let (mut x, mut bend) = (0.0, 0.0);
        for (arrival_ns, news, value) in all {
            let alone = if news == News::Wrist {
                x = value;
                &mut wrist_alone
            } else {
                bend = value;
                &mut fingers_alone
            };
            let sample = sample(x, x, bend);
            let found = both.filtered(&sample, arrival_ns, news);
            let expected = alone.filtered(&sample, arrival_ns, News::Whole);
            if news == News::Wrist {
                assert_eq!(found.wrist, expected.wrist, "{arrival_ns} ns");
            } else {
                assert_eq!(flexion(&found), flexion(&expected), "{arrival_ns} ns");
            }
        }
        assert!(x > 0.99 && bend > 0.98, "they moved: {x} m, {bend} rad");
    }
}
