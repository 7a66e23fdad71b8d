//! What the bridge of UDCAP gloves sends.

use serde_json::{Value, json};

use super::source::{Frame, SentHand};
use crate::glove::calibrate::Handedness;
use crate::glove::sensor::GloveSensor;
use crate::source::links::FLEXIONS;
use crate::source::udcap::{FINGERS, N_PARAMETERS, THUMB, default_of};

/// One frame; a name stands before the object, as one reader has seen it.
pub(super) fn json(frame: &Frame) -> Vec<u8> {
    let mut parameters: Vec<Value> = Vec::new();
    for (hand, sent) in &frame.hands {
        let letter = match hand {
            Handedness::Left => 'l',
            Handedness::Right => 'r',
        };
        if let Some(sent) = sent {
            for (number, value) in values(sent).into_iter().enumerate() {
                parameters.push(json!({ "Name": format!("{letter}{number}"), "Value": value }));
            }
        }
    }
    let mut bytes = b"UDCAP ".to_vec();
    bytes.extend(json!({ "Parameter": parameters }).to_string().into_bytes());
    bytes
}

/// Degrees by number.
fn values(sent: &SentHand) -> [f64; N_PARAMETERS] {
    let mut values = [0.0; N_PARAMETERS];
    for (sensor, parameter) in THUMB {
        values[parameter] = raw_degrees(sent, sensor);
    }
    for (sensors, parameters) in FLEXIONS.iter().zip(FINGERS) {
        for (sensor, parameter) in sensors.iter().zip(&parameters[1..]) {
            values[*parameter] = raw_degrees(sent, *sensor);
        }
    }
    let [index, _, ring, little] = FINGERS.map(|[abduction, ..]| abduction);
    values[index] = raw_degrees(sent, GloveSensor::MiddleIndexAbduction);
    values[ring] = raw_degrees(sent, GloveSensor::RingMiddleAbduction);
    values[little] = values[ring] + raw_degrees(sent, GloveSensor::LittleRingAbduction);
    values
}

/// What is sent for the angle of a sensor.
fn raw_degrees(sent: &SentHand, sensor: GloveSensor) -> f64 {
    let calibration = default_of(sensor);
    let degrees = sent.angle(sensor).to_degrees();
    calibration.raw_at_zero + degrees / calibration.gain_deg_per_count
}
