use std::collections::VecDeque;

use nalgebra::{Isometry3, Point3, Translation3};

use crate::view::{HandView, Joints, ObjectView, WorldView};

/// Share of a new deviation that enters the jitter (RFC 3550, 6.4.1).
const JITTER_GAIN: f64 = 1.0 / 16.0;

/// A short buffer of views by the daemon's time, and the world at any time in it.
///
/// A renderer shows the world a little in the past, where there is a view on either side of the moment it shows:
/// `timeline.at(clock.server_ns(now) - delay)`.
#[derive(Clone, Debug)]
pub struct Timeline {
    entries: VecDeque<Entry>,
    capacity: usize,
    jitter_ns: f64,
    n_out_of_order: u64,
}

#[derive(Clone, Debug)]
struct Entry {
    view: WorldView,
    arrival_ns: u64,
}

/// What became of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pushed {
    /// It is the newest one now.
    Kept,
    /// It belongs to another epoch than those before it, which are forgotten.
    NewEpoch,
    /// It is not newer than the newest one: dropped and counted.
    OutOfOrder,
}

/// How a presented world came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// The time asked for lies before the oldest view, which is shown. Nanoseconds between the two.
    Before(u64),
    /// It lies between two views, or exactly on one.
    Between,
    /// It lies after the newest view, which is shown. Nanoseconds between the two.
    After(u64),
}

/// The world at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Presented {
    /// Whether it is interpolated or held.
    pub placement: Placement,
    /// Poses between those of the views on either side; all else (stamp, states, holders) is that of the earlier one.
    /// An object that only the later one has is not there yet; one that only the earlier one has stands still.
    pub view: WorldView,
}

impl Timeline {
    /// Keeps that many views, at least two.
    pub fn new(capacity: usize) -> Self {
        Self {
            entries: VecDeque::new(),
            capacity: capacity.max(2),
            jitter_ns: 0.0,
            n_out_of_order: 0,
        }
    }

    /// Takes a view that arrived at that time of the client's clock (nanoseconds, any origin).
    pub fn push(&mut self, view: WorldView, arrival_ns: u64) -> Pushed {
        let mut pushed = Pushed::Kept;
        if let Some(newest) = self.entries.back() {
            if newest.view.stamp.epoch != view.stamp.epoch {
                self.entries.clear();
                pushed = Pushed::NewEpoch;
            } else if view.stamp.wall_ns <= newest.view.stamp.wall_ns
                || view.stamp.tick <= newest.view.stamp.tick
            {
                self.n_out_of_order += 1;
                return Pushed::OutOfOrder;
            } else {
                let between_arrivals = arrival_ns as f64 - newest.arrival_ns as f64;
                let between_steps = (view.stamp.wall_ns - newest.view.stamp.wall_ns) as f64;
                self.jitter_ns +=
                    ((between_arrivals - between_steps).abs() - self.jitter_ns) * JITTER_GAIN;
            }
        }
        if self.entries.len() == self.capacity {
            self.entries.pop_front();
        }
        self.entries.push_back(Entry { view, arrival_ns });
        pushed
    }

    /// Forgets all views. To be called when the stream broke: the next views may come from another daemon.
    pub fn clear(&mut self) {
        self.entries.clear();
    }

    /// The newest view.
    pub fn newest(&self) -> Option<&WorldView> {
        self.entries.back().map(|entry| &entry.view)
    }

    /// The newest view that is at least that much world time older than the newest one, or the oldest there is.
    pub fn back_by(&self, world_time_s: f64) -> Option<&WorldView> {
        let limit = self.newest()?.stamp.world_time_s - world_time_s;
        let older = self
            .entries
            .iter()
            .rev()
            .find(|entry| entry.view.stamp.world_time_s <= limit);
        older
            .or_else(|| self.entries.front())
            .map(|entry| &entry.view)
    }

    /// The world at that time of the daemon's clock, nanoseconds since the Unix epoch; `None` while there is no view.
    pub fn at(&self, server_ns: u64) -> Option<Presented> {
        let (oldest, newest) = (&self.entries.front()?.view, &self.entries.back()?.view);
        if server_ns < oldest.stamp.wall_ns {
            let placement = Placement::Before(oldest.stamp.wall_ns - server_ns);
            return Some(Presented {
                placement,
                view: oldest.clone(),
            });
        }
        if server_ns > newest.stamp.wall_ns {
            let placement = Placement::After(server_ns - newest.stamp.wall_ns);
            return Some(Presented {
                placement,
                view: newest.clone(),
            });
        }
        let later_index = self
            .entries
            .partition_point(|entry| entry.view.stamp.wall_ns <= server_ns);
        let earlier = &self.entries[later_index - 1].view;
        let view = match self.entries.get(later_index) {
            Some(later) => interpolate(earlier, &later.view, server_ns),
            None => earlier.clone(),
        };
        Some(Presented {
            placement: Placement::Between,
            view,
        })
    }

    /// How unevenly views arrive, nanoseconds: the smoothed difference between the spacing of arrivals and that of
    /// the steps they show (RFC 3550, 6.4.1). A renderer's delay should be a few times this and one frame.
    pub fn jitter_ns(&self) -> f64 {
        self.jitter_ns
    }

    /// Age of the newest view at that time of the daemon's clock, nanoseconds; negative when it seems to come from
    /// the future, which is the error of the clock's estimate.
    pub fn age_ns(&self, server_ns: u64) -> Option<i64> {
        let wall_ns = self.newest()?.stamp.wall_ns;
        let age = i128::from(server_ns) - i128::from(wall_ns);
        Some(age.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64)
    }

    /// Views per second, by arrival, over the buffer; `None` while there are fewer than two.
    pub fn rate_hz(&self) -> Option<f64> {
        let span_ns = self
            .entries
            .back()?
            .arrival_ns
            .saturating_sub(self.entries.front()?.arrival_ns);
        (span_ns > 0).then(|| (self.entries.len() - 1) as f64 / (span_ns as f64 * 1e-9))
    }

    /// Views that were dropped because they were not newer than the newest.
    pub fn n_out_of_order(&self) -> u64 {
        self.n_out_of_order
    }
}

fn interpolate(earlier: &WorldView, later: &WorldView, server_ns: u64) -> WorldView {
    let span = (later.stamp.wall_ns - earlier.stamp.wall_ns) as f64;
    let share = (server_ns - earlier.stamp.wall_ns) as f64 / span;
    let mut view = earlier.clone();
    for (id, object) in &mut view.objects {
        if let Some(next) = later.objects.get(id) {
            *object = ObjectView {
                pose: between(&object.pose, &next.pose, share),
                ..*object
            };
        }
    }
    for hand in &mut view.hands {
        if let Some(next) = later.hands.iter().find(|next| next.id == hand.id) {
            interpolate_hand(hand, next, share);
        }
    }
    view
}

fn interpolate_hand(hand: &mut HandView, next: &HandView, share: f64) {
    hand.wrist = between(&hand.wrist, &next.wrist, share);
    interpolate_joints(&mut hand.tracked, &next.tracked, share);
    interpolate_joints(&mut hand.shown, &next.shown, share);
}

/// A joint that one of the two lacks stays as it is in the earlier one.
fn interpolate_joints(joints: &mut Joints, next: &Joints, share: f64) {
    for (joint, next) in joints.iter_mut().zip(next) {
        if let (Some(point), Some(next)) = (joint.as_mut(), next) {
            *point = Point3::from(point.coords.lerp(&next.coords, share));
        }
    }
}

/// Straight from one position to the other, and the shorter way round from one rotation to the other.
fn between(a: &Isometry3<f64>, b: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let position = a.translation.vector.lerp(&b.translation.vector, share);
    // There is no answer only where the two rotations are the same but for rounding.
    let rotation = a
        .rotation
        .try_slerp(&b.rotation, share, f64::EPSILON)
        .unwrap_or(a.rotation);
    Isometry3::from_parts(Translation3::from(position), rotation)
}

#[cfg(test)]
#[path = "timeline_tests.rs"]
mod tests;
