//! The bridge of UDCAP gloves (Udexreal): JSON over UDP, an angle in degrees for each numbered parameter of each hand.
//!
//! No specification was seen. The order of the parameters and their usual ranges (flexion from 0 to -80°) are those that one
//! open reader uses; **what the thumb's parameters mean is a guess.** A calibration file sets each sensor right: its raw
//! values are the degrees as they are sent, and for angles between fingers their difference.

use serde::Deserialize;

use crate::glove::calibrate::{Handedness, SensorCalibration};
use crate::glove::sensor::GloveSensor;
use crate::session::DeviceInfo;
use crate::source::links::FLEXIONS;
use crate::source::session::{Decoder, FoundHand};

/// A port that one program sends to; the sender has to be told any.
pub const USUAL_PORT: u16 = 5555;
/// Its name in messages.
const FAMILY: &str = "UDCAP";
/// Parameters of one hand.
pub(crate) const N_PARAMETERS: usize = 24;
/// Sensors that they are taken for.
const N_SENSORS: usize = 19;

/// Parameters of index to little finger: abduction, MCP, PIP, DIP.
pub(crate) const FINGERS: [[usize; 4]; 4] = [
    [7, 6, 5, 4],
    [11, 10, 9, 8],
    [15, 14, 13, 12],
    [19, 18, 17, 16],
];
/// Parameters of the thumb.
pub(crate) const THUMB: [(GloveSensor, usize); 4] = [
    (GloveSensor::ThumbRotation, 20),
    (GloveSensor::ThumbAbduction, 2),
    (GloveSensor::ThumbMcp, 1),
    (GloveSensor::ThumbIp, 0),
];
/// Abduction from the index finger at which the thumb's second parameter is 0, degrees.
const THUMB_ABDUCTION_AT_ZERO_DEG: f64 = 45.0;
/// Farther than that is no angle, degrees.
const MAX_DEG: f64 = 360.0;

#[derive(Debug, Deserialize)]
struct Message {
    #[serde(rename = "Parameter")]
    parameters: Vec<Parameter>,
}

#[derive(Debug, Deserialize)]
struct Parameter {
    #[serde(rename = "Name")]
    name: String,
    #[serde(rename = "Value")]
    value: f64,
}

/// The calibration of a sensor that the wearer's file does not name.
pub(crate) fn default_of(sensor: GloveSensor) -> SensorCalibration {
    let (raw_at_zero, gain_deg_per_count) = match sensor {
        GloveSensor::ThumbRotation
        | GloveSensor::RingMiddleAbduction
        | GloveSensor::LittleRingAbduction => (0.0, 1.0),
        GloveSensor::ThumbAbduction => (-THUMB_ABDUCTION_AT_ZERO_DEG, 1.0),
        // Bending counts downward, and so does the index finger's spreading.
        _ => (0.0, -1.0),
    };
    SensorCalibration {
        raw_at_zero,
        gain_deg_per_count,
        min_deg: -90.0,
        max_deg: 130.0,
        coupling: None,
    }
}

/// The decoder of UDCAP's messages.
#[derive(Debug, Default)]
pub(crate) struct Udcap {
    seen: [bool; 2],
    told: [bool; 2],
}

impl Decoder for Udcap {
    fn family(&self) -> &'static str {
        FAMILY
    }

    fn default_of(&self, sensor: GloveSensor) -> SensorCalibration {
        default_of(sensor)
    }

    fn take(
        &mut self,
        stamp_ns: u64,
        datagram: &[u8],
        found: &mut Vec<FoundHand>,
    ) -> Result<(), String> {
        let start = datagram
            .windows(2)
            .position(|pair| pair == b"{\"")
            .ok_or("no JSON object")?;
        let mut objects = serde_json::Deserializer::from_slice(&datagram[start..]).into_iter();
        let message: Message = objects
            .next()
            .ok_or("no JSON object")?
            .map_err(|fault| format!("JSON: {fault}"))?;
        for (index, (hand, letter)) in [(Handedness::Left, 'l'), (Handedness::Right, 'r')]
            .into_iter()
            .enumerate()
        {
            let values = values_of(&message.parameters, letter);
            if values.iter().any(Option::is_some) {
                self.seen[index] = true;
                found.push(FoundHand {
                    hand,
                    stamp_ns,
                    raw: Some(raw_from_values(&values)),
                    world_from_wrist: None,
                    device_ticks: None,
                });
            }
        }
        Ok(())
    }

    fn news(&mut self) -> Option<DeviceInfo> {
        if self.told == self.seen {
            return None;
        }
        self.told = self.seen;
        let (identity, hand) = match self.seen {
            [true, true] => ("both hands", None),
            [true, false] => ("left hand", Some(Handedness::Left)),
            _ => ("right hand", Some(Handedness::Right)),
        };
        Some(DeviceInfo {
            family: FAMILY,
            firmware: String::new(),
            identity: identity.to_owned(),
            n_sensors: N_SENSORS,
            hand,
            tick_ns: None,
            rate_hz: None,
        })
    }

    fn forget(&mut self) {
        *self = Self::default();
    }
}

/// The values of one hand by number; of a name that comes twice the last stands.
fn values_of(parameters: &[Parameter], letter: char) -> [Option<f64>; N_PARAMETERS] {
    let mut values = [None; N_PARAMETERS];
    for parameter in parameters {
        let number = parameter.name.strip_prefix(letter);
        let number = number.and_then(|number| number.parse::<usize>().ok());
        if let Some(value) = number.and_then(|number| values.get_mut(number))
            && parameter.value.abs() <= MAX_DEG
        {
            *value = Some(parameter.value);
        }
    }
    values
}

fn raw_from_values(values: &[Option<f64>; N_PARAMETERS]) -> [Option<f64>; GloveSensor::N_SLOTS] {
    let mut raw = [None; GloveSensor::N_SLOTS];
    for (sensor, parameter) in THUMB {
        raw[sensor.slot()] = values[parameter];
    }
    for (sensors, parameters) in FLEXIONS.iter().zip(FINGERS) {
        for (sensor, parameter) in sensors.iter().zip(&parameters[1..]) {
            raw[sensor.slot()] = values[*parameter];
        }
    }
    let [index, middle, ring, little] = FINGERS.map(|[abduction, ..]| values[abduction]);
    for (sensor, this, other) in [
        (GloveSensor::MiddleIndexAbduction, index, middle),
        (GloveSensor::RingMiddleAbduction, ring, middle),
        (GloveSensor::LittleRingAbduction, little, ring),
    ] {
        raw[sensor.slot()] = this.zip(other).map(|(this, other)| this - other);
    }
    raw
}
