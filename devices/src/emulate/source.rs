//! Programs that send hands over the network: frames at a fixed rate, each as one datagram or several.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::Emulator;
use super::line_fault::LineFaults;
use super::{rokoko, udcap, vmc};
use crate::glove::calibrate::Handedness;
use crate::glove::sensor::GloveSensor;

/// Time between frames, ns: 60 Hz.
const PERIOD_NS: u64 = 16_666_667;

/// One hand as it is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SentHand {
    /// What the sensors of a glove would read, rad by slot; `None` is 0.
    pub angles: [Option<f64>; GloveSensor::N_SLOTS],
    /// `world_from_wrist` with y up, m.
    pub world_from_wrist: Isometry3<f64>,
}

impl SentHand {
    /// A flat hand in the origin.
    #[must_use]
    pub fn flat() -> Self {
        Self {
            angles: [None; GloveSensor::N_SLOTS],
            world_from_wrist: Isometry3::identity(),
        }
    }

    /// The angle of a sensor, rad.
    pub(super) fn angle(&self, sensor: GloveSensor) -> f64 {
        self.angles[sensor.slot()].unwrap_or(0.0)
    }

    /// How far index to little finger are turned toward the thumb, rad: the middle finger not at all.
    pub(super) fn swings(&self) -> [f64; 4] {
        let ring = -self.angle(GloveSensor::RingMiddleAbduction);
        [
            self.angle(GloveSensor::MiddleIndexAbduction),
            0.0,
            ring,
            ring - self.angle(GloveSensor::LittleRingAbduction),
        ]
    }
}

/// One frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// Time since the sender's start, s.
    pub(super) time_s: f64,
    /// Left and right hand.
    pub(super) hands: [(Handedness, Option<SentHand>); 2],
}

/// What is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceKind {
    /// Bones by the VMC protocol, a frame as several bundles.
    Vmc,
    /// Rokoko's JSON, plain.
    Rokoko,
    /// Rokoko's JSON in an LZ4 frame.
    RokokoLz4,
    /// The JSON of the UDCAP bridge.
    Udcap,
}

/// A sender of hands. Each [`Emulator::poll`] gives one datagram, or nothing.
#[derive(Debug, Clone)]
pub struct SourceEmulator {
    /// What goes wrong on the way; a dropped byte is one of a datagram.
    pub faults: LineFaults,
    kind: SourceKind,
    hands: [(Handedness, Option<SentHand>); 2],
    started_ns: Option<u64>,
    next_ns: u64,
    waiting: VecDeque<Vec<u8>>,
}

impl SourceEmulator {
    /// A sender without hands.
    #[must_use]
    pub fn new(kind: SourceKind) -> Self {
        Self {
            faults: LineFaults::none(),
            kind,
            hands: [(Handedness::Left, None), (Handedness::Right, None)],
            started_ns: None,
            next_ns: 0,
            waiting: VecDeque::new(),
        }
    }

    /// Poses a hand, or takes it away.
    pub fn set_hand(&mut self, hand: Handedness, sent: Option<SentHand>) {
        for (of, place) in &mut self.hands {
            if *of == hand {
                *place = sent;
            }
        }
    }

    fn datagrams(&self, now_ns: u64) -> Vec<Vec<u8>> {
        let since_ns = now_ns - self.started_ns.unwrap_or(now_ns).min(now_ns);
        let frame = Frame {
            time_s: since_ns as f64 * 1.0e-9,
            hands: self.hands,
        };
        match self.kind {
            SourceKind::Vmc => vmc::datagrams(&frame),
            SourceKind::Rokoko => vec![rokoko::json(&frame)],
            SourceKind::RokokoLz4 => vec![rokoko::lz4_frame(&rokoko::json(&frame))],
            SourceKind::Udcap => vec![udcap::json(&frame)],
        }
    }
}

impl Emulator for SourceEmulator {
    /// Nobody answers a sender.
    fn push(&mut self, _now_ns: u64, _bytes: &[u8]) {}

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        if self.started_ns.is_none() {
            self.started_ns = Some(now_ns);
            self.next_ns = now_ns;
        }
        if self.waiting.is_empty() && now_ns >= self.next_ns {
            self.waiting.extend(self.datagrams(now_ns));
            self.next_ns += PERIOD_NS;
            if self.next_ns <= now_ns {
                // What could not be sent in time is not sent at all.
                self.next_ns = now_ns + PERIOD_NS;
            }
        }
        match self.waiting.pop_front() {
            Some(datagram) => self.faults.apply(datagram),
            None => Vec::new(),
        }
    }

    fn deadline(&self) -> Option<u64> {
        Some(if self.waiting.is_empty() {
            self.next_ns
        } else {
            0
        })
    }
}
