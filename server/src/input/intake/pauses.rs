//! A hand that holds an object, and cables that are pulled and plugged in again: from what a glove and a tracker say to
//! what the world makes of it, in virtual time.

use nalgebra::Vector3;
use tsukamu_motion::synthetic::{SceneInfo, SyntheticHand, build};
use tsukamu_world::frame::EventKind;
use tsukamu_world::input::Command;
use tsukamu_world::{StepInput, World};

use super::super::fusion::FusionSettings;
use super::super::sources::Sources;
use super::*;
use crate::emulate::wearing::joint_angles_of;
use crate::scene_file::load;

const MS: u64 = 1_000_000;
/// Intervals of an emulated tracker and glove, in nanoseconds.
const INTERVALS_NS: [u64; 2] = [8_333_333, 10_000_000];

/// A world with one hand of devices, whose wearer does a synthetic motion.
struct Worn {
    world: World,
    driver: Driver,
    wearer: SyntheticHand,
    tick: u64,
    /// When the tracker and the glove speak next, and whether their cables are in.
    next_ns: [u64; 2],
    is_plugged: [bool; 2],
    /// Time at which the wearer stands still, seconds; `None` is never.
    stands_s: Option<f64>,
}

impl Worn {
    fn new(between: Between) -> Self {
        let scene = load("operations/free").unwrap().scene;
        let wearer = build("free", &SceneInfo::from(&scene)).unwrap();
        let source = Sources::new().add("h", "hand", String::new(), "running");
        let settings = FusionSettings {
            between,
            ..FusionSettings::default()
        };
        let feed = Feed::Device(Box::new(Fusion::new(settings)));
        let model = HandModel::adult(wearer.side());
        let driver = Driver::new(HandId(1), model, source, feed, None);
        Self {
            world: World::new(scene).unwrap(),
            driver,
            wearer,
            tick: 0,
            next_ns: [0; 2],
            is_plugged: [true; 2],
            stands_s: None,
        }
    }

    /// What a device says at a monotonic time.
    fn say(&self, device: usize, at_ns: u64) {
        let time_s = at_ns as f64 * 1.0e-9;
        let sample = self
            .wearer
            .sample_at(time_s.min(self.stands_s.unwrap_or(time_s)));
        let seen = if device == 0 {
            Seen::Wrist(Some(sample.wrist))
        } else {
            Seen::Fingers(joint_angles_of(&sample, self.wearer.side()))
        };
        self.driver.source.offer(Arrived {
            source_ns: 0,
            arrival_ns: at_ns,
            fitted_ns: at_ns,
            ticks: None,
            seen,
        });
    }

    /// One step; what happened in it.
    fn step(&mut self) -> Vec<EventKind> {
        self.tick += 1;
        let track_s = self.tick as f64 / self.world.scene().rate_hz;
        let now_ns = (track_s * 1.0e9) as u64;
        for (device, interval_ns) in INTERVALS_NS.into_iter().enumerate() {
            while self.next_ns[device] <= now_ns {
                if self.is_plugged[device] {
                    self.say(device, self.next_ns[device]);
                }
                self.next_ns[device] += interval_ns;
            }
        }
        let time = StepTime {
            tick: self.tick,
            track_s,
            now_ns,
        };
        let mut input = StepInput::default();
        if self.tick == 1 {
            input.commands.push(Command::AddHand {
                hand: self.driver.hand,
                model: Box::new(self.driver.model.clone()),
            });
        }
        input.hands.push(self.driver.input(time, &mut Vec::new()));
        let frame = self.world.step(&input);
        frame
            .events
            .iter()
            .map(|event| event.kind.clone())
            .collect()
    }

    /// Steps for a time in milliseconds; everything that happened.
    fn run(&mut self, time_ms: u64) -> Vec<EventKind> {
        let n = (time_ms as f64 * 1.0e-3 * self.world.scene().rate_hz).round() as u64;
        (0..n).flat_map(|_| self.step()).collect()
    }

    fn holds(&self) -> bool {
        self.world.objects().any(|(_, body)| body.hold.is_some())
    }

    /// Where the object is, world space, metres.
    fn place(&self) -> Vector3<f64> {
        let (_, body) = self.world.objects().next().expect("there is one");
        body.pose.translation.vector
    }

    /// Runs until the hand has held the object for a while, and then lets the wearer stand.
    fn grasp(&mut self) {
        for _ in 0..20_000 {
            self.step();
            if self.holds() {
                break;
            }
        }
        self.run(200);
        assert!(self.holds(), "it was grasped");
        self.stands_s = Some(self.tick as f64 / self.world.scene().rate_hz);
        self.run(50);
    }
}

fn is_loss(kind: &EventKind) -> bool {
    matches!(kind, EventKind::HandLost | EventKind::Released { .. })
}

#[test]
fn a_cable_that_is_back_within_the_grace_time_loses_nothing() {
    for between in [Between::Interpolate, Between::Hold] {
        for cables in [[false, true], [true, false], [false, false]] {
            let mut worn = Worn::new(between);
            worn.grasp();
            let grace_ms = (worn.world.scene().tracking_grace_s * 1000.0) as u64;
            worn.is_plugged = cables;
            let mut happened = worn.run(grace_ms - 20);
            worn.is_plugged = [true; 2];
            happened.extend(worn.run(300));
            assert!(
                !happened.iter().any(is_loss),
                "{between:?} {cables:?}: {happened:?}"
            );
            assert!(worn.holds(), "{between:?} {cables:?}");
        }
    }
}

/// The wearer carries on while nobody sees it, and the hand is somewhere else when it is seen again.
#[test]
fn what_is_carried_meanwhile_is_still_held() {
    for cables in [[false, true], [true, false], [false, false]] {
        let mut worn = Worn::new(Between::Interpolate);
        worn.grasp();
        worn.stands_s = None;
        let before = worn.place();
        let grace_ms = (worn.world.scene().tracking_grace_s * 1000.0) as u64;
        worn.is_plugged = cables;
        let mut happened = worn.run(grace_ms - 20);
        worn.is_plugged = [true; 2];
        happened.extend(worn.run(60));
        let way_m = (worn.place() - before).norm();
        assert!(way_m > 0.03, "{cables:?}: it was carried by {way_m} m");
        assert!(!happened.iter().any(is_loss), "{cables:?}: {happened:?}");
        assert!(worn.holds(), "{cables:?}");
    }
}

#[test]
fn a_cable_that_stays_out_loses_the_hand_and_what_it_holds() {
    for cables in [[false, true], [true, false], [false, false]] {
        let mut worn = Worn::new(Between::Interpolate);
        worn.grasp();
        worn.is_plugged = cables;
        let happened = worn.run(800);
        assert!(happened.iter().any(is_loss), "{cables:?}: {happened:?}");
        assert!(!worn.holds(), "{cables:?}");
        worn.is_plugged = [true; 2];
        worn.run(50);
        assert!(worn.driver.age_s(worn.tick * MS) < 0.1, "seen again");
    }
}
