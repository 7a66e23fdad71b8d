//! What a kind of glove that sends by itself says, and how it is made to: what [`Listening`] needs to know of it.
//!
//! [`Listening`]: crate::glove::listening::Listening

use crate::glove::calibrate::{Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::reading::Controls;
use crate::session::DeviceInfo;

/// A kind of glove that sends by itself. It sees bytes only: no port and no clock.
pub trait Format {
    /// The device family, for messages.
    const FAMILY: &'static str;

    /// When to worry.
    fn limits(&self) -> Limits;

    /// Greatest minus least raw value that the device can send.
    fn raw_span(&self) -> f64;

    /// What a sensor is taken for that the wearer's file does not name.
    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration;

    /// Whether ranges are learned from what the sensors show.
    fn learns_ranges(&self) -> bool {
        false
    }

    /// What came before is forgotten: the port was opened, or the device is made to start again.
    fn begin(&mut self) {}

    /// The question of a step of the start-up; `None` after the last.
    fn question(&self, _step: usize) -> Option<Question> {
        None
    }

    /// Up to where the bytes hold the answer to a step; `None` while they do not.
    fn answer(&mut self, _step: usize, _bytes: &[u8]) -> Option<usize> {
        None
    }

    /// What stands at the front of these bytes.
    fn cut(&mut self, bytes: &[u8]) -> Cut;

    /// What is known of the device.
    fn info(&self) -> DeviceInfo;

    /// The bytes that make the device quiet.
    fn farewell(&self) -> &'static [u8] {
        &[]
    }
}

/// When a device is silent for too long, or makes no sense for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Time without a record after which something is done, ns.
    pub silence_ns: u64,
    /// How often that is done in vain before the port is opened again.
    pub tries: u32,
    /// Length of a short record, bytes.
    pub record_bytes: usize,
    /// Bytes without a record after which something is done.
    pub garbage_bytes: usize,
}

/// Something that is sent while a device starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// What is sent.
    pub bytes: Vec<u8>,
    /// How long the answer may take, ns; `None` when there is none.
    pub answer_ns: Option<u64>,
    /// Whether a device that does not answer is none of this family; otherwise the start-up goes on.
    pub needed: bool,
}

/// What stands at the front of the bytes.
#[expect(
    clippy::large_enum_variant,
    reason = "a box would cost an allocation for each of some hundred records in a second"
)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cut {
    /// Too little to tell.
    Wait,
    /// So many bytes that belong there and say nothing.
    Filler(usize),
    /// So many bytes that do not belong there.
    Bad(usize),
    /// So many bytes in which the device said something about itself.
    About(usize),
    /// A record of so many bytes.
    Record(usize, Sample),
}

/// What a record holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Raw values by wire slot; `None` for a sensor that the device lacks.
    pub raw: [Option<f64>; GloveSensor::N_SLOTS],
    /// The device's own counter, unwrapped.
    pub device_ticks: Option<u64>,
    /// Which hand the device says that it is for.
    pub hand: Option<Handedness>,
    /// Buttons and axes.
    pub controls: Controls,
}

impl Sample {
    /// A record without anything in it.
    pub const EMPTY: Self = Self {
        raw: [None; GloveSensor::N_SLOTS],
        device_ticks: None,
        hand: None,
        controls: Controls::NONE,
    };
}
