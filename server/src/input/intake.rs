//! All sources of the world, and what they give to each step. The tick thread owns it.

use std::sync::Arc;

use tokio::sync::watch;
use tsukamu_motion::track::Outside;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::HandInput;
use tsukamu_world::state::HandId;
use tsukamu_world::step::HandTouch;

use super::filter::HandFilter;
use super::fusion::{Between, Fusion};
use super::sources::{Arrived, Seen, Source};
use super::stream::Times;
use crate::offline::hands::Motion;

/// A source that drives a hand: one closed set.
#[derive(Debug)]
pub enum Feed {
    /// Motion that is known beforehand: sampled at the world's own time.
    Track {
        /// The motion.
        track: Arc<Motion>,
        /// What it is before its start and after its end.
        outside: Outside,
    },
    /// A glove and a tracker.
    Device(Box<Fusion>),
    /// A client.
    Remote {
        /// Where the answers go; newest wins. Nobody listens: the client is gone.
        answers: watch::Sender<DriveNow>,
    },
}

/// How a client's hand stands after a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriveNow {
    /// After which step.
    pub stamp: tsukamu_proto::v1::Stamp,
    /// Own stamp of the newest sample that was applied.
    pub applied_source_ns: u64,
    /// The tick at which it was applied.
    pub applied_tick: u64,
    /// Samples that were refused.
    pub n_dropped: u64,
    /// Samples that newer ones replaced before a step took them.
    pub n_superseded: u64,
    /// What the hand touches.
    pub touches: Vec<HandTouch>,
    /// What it holds.
    pub holds: Option<tsukamu_world::state::ObjectId>,
}

/// One hand and where its samples come from.
#[derive(Debug)]
pub struct Driver {
    /// The hand in the world.
    pub hand: HandId,
    /// Its shape.
    pub model: HandModel,
    /// Name, lane, statistics.
    pub source: Arc<Source>,
    /// Where its samples come from.
    pub feed: Feed,
    /// Filter of whole samples; `None` is off.
    pub filter: Option<HandFilter>,
    /// The newest sample that was applied.
    applied: Option<Applied>,
}

/// When a sample was applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Applied {
    /// The source's own stamp, nanoseconds.
    pub source_ns: u64,
    /// Arrival, monotonic nanoseconds.
    pub arrival_ns: u64,
    /// The tick that it made.
    pub tick: u64,
}

/// The step that samples are wanted for.
#[derive(Clone, Copy, Debug)]
pub struct StepTime {
    /// The tick that the step makes.
    pub tick: u64,
    /// World time of that tick in seconds, for tracks.
    pub track_s: f64,
    /// Monotonic time, nanoseconds.
    pub now_ns: u64,
}

impl Driver {
    /// A hand with its source.
    pub fn new(
        hand: HandId,
        model: HandModel,
        source: Arc<Source>,
        feed: Feed,
        filter: Option<HandFilter>,
    ) -> Self {
        source.set_hand(Some(hand));
        Self {
            hand,
            model,
            source,
            feed,
            filter,
            applied: None,
        }
    }

    /// Whether its source has gone for good.
    pub fn is_over(&self) -> bool {
        matches!(&self.feed, Feed::Remote { answers } if answers.is_closed())
    }

    /// The newest sample that was applied.
    pub const fn applied(&self) -> Option<Applied> {
        self.applied
    }

    /// Age of that sample in seconds at a monotonic time in nanoseconds.
    pub fn age_s(&self, now_ns: u64) -> f32 {
        self.applied.map_or(0.0, |applied| {
            now_ns.saturating_sub(applied.arrival_ns) as f32 * 1.0e-9
        })
    }

    /// Forgets everything of the epoch before.
    pub fn begin_epoch(&mut self) {
        self.applied = None;
        if let Feed::Device(fusion) = &mut self.feed {
            fusion.forget();
        }
    }

    /// What the hand has in this step. Samples that arrived since the last one are moved to `arrived`.
    pub fn input(&mut self, time: StepTime, arrived: &mut Vec<Arrived>) -> HandInput {
        let first = arrived.len();
        let sample = match &mut self.feed {
            Feed::Track { track, outside } => {
                let (track, outside) = (Arc::clone(track), *outside);
                self.sample_of_track(&track, outside, time)
            }
            Feed::Device(fusion) => {
                self.source.drain(arrived);
                let sample = joined(fusion, &self.source, time, &arrived[first..]);
                if let Some(arrival_ns) = fusion.arrival_ns().filter(|_| sample.is_some()) {
                    self.applied = Some(Applied {
                        source_ns: 0,
                        arrival_ns,
                        tick: time.tick,
                    });
                }
                sample
            }
            Feed::Remote { .. } => {
                self.source.drain(arrived);
                self.newest(time, &arrived[first..])
            }
        };
        HandInput {
            hand: self.hand,
            sample,
        }
    }

    fn sample_of_track(
        &mut self,
        track: &Motion,
        outside: Outside,
        time: StepTime,
    ) -> Option<HandSample> {
        let sample = track.sample_at(time.track_s, outside)?;
        self.source.note(time.now_ns);
        let source_ns = (time.track_s * 1.0e9) as u64;
        self.applied = Some(Applied {
            source_ns,
            arrival_ns: time.now_ns,
            tick: time.tick,
        });
        // The world's own time, so that a run is the same however fast it goes.
        Some(self.filtered(sample, source_ns))
    }

    /// The newest whole sample of a step; the others are counted.
    fn newest(&mut self, time: StepTime, arrived: &[Arrived]) -> Option<HandSample> {
        let mut newest = None;
        for item in arrived {
            // A client speaks of whole hands alone.
            let Seen::Whole(sample) = &item.seen else {
                continue;
            };
            newest = sample
                .as_ref()
                .map(|sample| self.filtered(sample.clone(), item.arrival_ns));
        }
        let last = arrived.last()?;
        self.source.note_superseded(arrived.len() as u64 - 1);
        if newest.is_some() {
            self.applied = Some(Applied {
                source_ns: last.source_ns,
                arrival_ns: last.arrival_ns,
                tick: time.tick,
            });
        }
        let lag_s = self.filter.as_ref().map_or(0.0, HandFilter::lag_s);
        self.source.update(|health| health.lag_s = lag_s);
        newest
    }

    fn filtered(&mut self, sample: HandSample, at_ns: u64) -> HandSample {
        match &mut self.filter {
            Some(filter) => filter.filtered(&sample, at_ns),
            None => sample,
        }
    }
}

/// The hand of two streams in a step.
fn joined(
    fusion: &mut Fusion,
    source: &Source,
    time: StepTime,
    arrived: &[Arrived],
) -> Option<HandSample> {
    let (mut n_wrist, mut n_fingers) = (0_u64, 0_u64);
    for item in arrived {
        let times = Times {
            arrival_ns: item.arrival_ns,
            fitted_ns: item.fitted_ns,
        };
        fusion.push(times, &item.seen);
        match &item.seen {
            Seen::Wrist(_) => n_wrist += 1,
            Seen::Fingers(_) => n_fingers += 1,
            Seen::Whole(_) => {}
        }
    }
    // An interpolated hand goes by way of all of them.
    if fusion.between() == Between::Hold {
        source.note_superseded(n_wrist.saturating_sub(1) + n_fingers.saturating_sub(1));
    }
    let sample = fusion.at(time.now_ns);
    if !arrived.is_empty() {
        let streams = fusion.reports(time.now_ns);
        source.update(|health| {
            health.lag_s = streams[0].lag_s.max(streams[1].lag_s).max(0.0);
            health.streams = Some(streams);
        });
    }
    sample
}

#[cfg(test)]
mod pauses;

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use tsukamu_motion::track::TrackHand;
    use tsukamu_world::hand::joint::Side;
    use tsukamu_world::hand::sample::{FingerPose, JointAngles};

    use super::super::sources::Sources;
    use super::*;

    fn sample(x: f64) -> HandSample {
        let wrist =
            Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::identity());
        HandSample {
            wrist,
            fingers: FingerPose::Angles(JointAngles::default()),
        }
    }

    fn driver(feed: Feed) -> Driver {
        let source = Sources::new().add("a", "remote", String::new(), "running");
        Driver::new(HandId(1), HandModel::adult(Side::Right), source, feed, None)
    }

    fn x(input: &HandInput) -> Option<f64> {
        input
            .sample
            .as_ref()
            .map(|sample| sample.wrist.translation.x)
    }

    #[test]
    fn the_newest_sample_wins_and_the_others_are_counted() {
        let mut driver = driver(Feed::Remote {
            answers: watch::Sender::new(DriveNow::default()),
        });
        for k in 0..3_u32 {
            driver.source.offer(Arrived {
                source_ns: 7,
                arrival_ns: u64::from(k),
                fitted_ns: u64::from(k),
                ticks: None,
                seen: Seen::Whole(Some(sample(k.into()))),
            });
        }
        let mut arrived = Vec::new();
        let time = StepTime {
            tick: 5,
            track_s: 0.1,
            now_ns: 10,
        };
        assert_eq!(x(&driver.input(time, &mut arrived)), Some(2.0));
        assert_eq!(arrived.len(), 3);
        assert_eq!(
            driver.applied(),
            Some(Applied {
                source_ns: 7,
                arrival_ns: 2,
                tick: 5
            })
        );
        let device = driver.source.device(10);
        assert_eq!((device.superseded, device.dropped), (2, 0));
        assert_eq!(
            x(&driver.input(time, &mut arrived)),
            None,
            "no new sample: the world holds the hand"
        );
    }

    #[test]
    fn a_track_is_played_in_world_time() {
        let track = TrackHand {
            side: Side::Right,
            times_s: vec![0.0, 0.1],
            samples: vec![sample(0.0), sample(1.0)],
        };
        let mut driver = driver(Feed::Track {
            track: Arc::new(Motion::Track(track)),
            outside: Outside::NoSample,
        });
        let mut at = |track_s| {
            x(&driver.input(
                StepTime {
                    tick: 1,
                    track_s,
                    now_ns: 0,
                },
                &mut Vec::new(),
            ))
        };
        assert_eq!(at(0.0), Some(0.0));
        assert!(at(0.05).is_some_and(|x| (x - 0.5).abs() < 1e-12));
        assert_eq!(at(0.2), None);
    }
}
