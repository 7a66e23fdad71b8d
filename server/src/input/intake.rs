//! All sources of the world, and what they give to each step. The tick thread owns it.

use std::sync::Arc;

use tokio::sync::watch;
use tsukamu_motion::track::Outside;
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::input::HandInput;
use tsukamu_world::state::HandId;
use tsukamu_world::step::HandTouch;

use super::between::{Between, Joined};
use super::filter::HandFilter;
use super::sources::{Arrived, News, Source};
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
    Device {
        /// Between samples.
        between: Between,
    },
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
    /// Its filter; `None` is off.
    pub filter: Option<HandFilter>,
    /// Between samples.
    interpolator: Joined,
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
            interpolator: Joined::default(),
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
        self.interpolator = Joined::default();
    }

    /// What the hand has in this step. Samples that arrived since the last one are moved to `arrived`.
    pub fn input(&mut self, time: StepTime, arrived: &mut Vec<Arrived>) -> HandInput {
        let sample = match &self.feed {
            Feed::Track { track, outside } => {
                self.sample_of_track(&Arc::clone(track), *outside, time)
            }
            Feed::Device { between } => self.sample_of_lane(*between, time, arrived),
            Feed::Remote { .. } => self.sample_of_lane(Between::Hold, time, arrived),
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
        Some(self.filtered(sample, source_ns, News::Whole))
    }

    fn sample_of_lane(
        &mut self,
        between: Between,
        time: StepTime,
        arrived: &mut Vec<Arrived>,
    ) -> Option<HandSample> {
        let first = arrived.len();
        self.source.drain(arrived);
        let mut newest = None;
        for item in &arrived[first..] {
            newest = item
                .sample
                .as_ref()
                .map(|sample| self.filtered(sample.clone(), item.arrival_ns, item.news));
            if between == Between::Interpolate {
                self.interpolator
                    .push(item.arrival_ns, newest.as_ref(), item.news);
            }
        }
        if let Some(last) = arrived[first..].last() {
            // An interpolated hand goes by way of all of them.
            if between == Between::Hold {
                let n_older = arrived.len() - first - 1;
                self.source.note_superseded(n_older as u64);
            }
            if last.sample.is_some() {
                self.applied = Some(Applied {
                    source_ns: last.source_ns,
                    arrival_ns: last.arrival_ns,
                    tick: time.tick,
                });
            }
            let lag_s = self.filter.as_ref().map_or(0.0, HandFilter::lag_s);
            let lag_s = lag_s + self.interpolator.lag_ns() as f64 * 1.0e-9;
            self.source.update(|health| health.lag_s = lag_s);
        }
        match between {
            Between::Hold => newest,
            Between::Interpolate => self.interpolator.at(time.now_ns),
        }
    }

    fn filtered(&mut self, sample: HandSample, at_ns: u64, news: News) -> HandSample {
        match &mut self.filter {
            Some(filter) => filter.filtered(&sample, at_ns, news),
            None => sample,
        }
    }
}

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
                sample: Some(sample(k.into())),
                news: News::Whole,
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
