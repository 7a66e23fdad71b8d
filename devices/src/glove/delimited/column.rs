//! What one column of a glove's line is.

use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error, StrDeserializer};

use crate::glove::sensor::GloveSensor;

/// What one column of a line is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Column {
    /// Nothing of use; it need not be a number.
    Skip,
    /// The device's own time.
    Time,
    /// A value that these sensors share.
    Sensors(Vec<GloveSensor>),
}

/// A finger whose two main joints share one value; a DIP without a sensor follows its PIP.
const FINGERS: [(&str, [GloveSensor; 2]); 5] = [
    ("thumb", [GloveSensor::ThumbMcp, GloveSensor::ThumbIp]),
    ("index", [GloveSensor::IndexMcp, GloveSensor::IndexPip]),
    ("middle", [GloveSensor::MiddleMcp, GloveSensor::MiddlePip]),
    ("ring", [GloveSensor::RingMcp, GloveSensor::RingPip]),
    ("little", [GloveSensor::LittleMcp, GloveSensor::LittlePip]),
];

impl Column {
    /// A column by its name in settings: `skip`, `time`, a sensor such as `index_mcp`, a finger (`thumb`, `index`,
    /// `middle`, `ring`, `little`) for its two main joints, or several of the latter two joined by `+`.
    ///
    /// # Errors
    /// The part that is no name, with what it may be.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "skip" => return Ok(Self::Skip),
            "time" => return Ok(Self::Time),
            _ => {}
        }
        let mut sensors = Vec::new();
        for name in text.split('+').map(str::trim) {
            if let Some((_, joints)) = FINGERS.iter().find(|(finger, _)| *finger == name) {
                sensors.extend(joints);
            } else {
                sensors.push(sensor(name).ok_or_else(|| no_name(name))?);
            }
        }
        Ok(Self::Sensors(sensors))
    }

    /// The sensors that the column drives; none for a time or what is skipped.
    #[must_use]
    pub fn sensors(&self) -> &[GloveSensor] {
        match self {
            Self::Skip | Self::Time => &[],
            Self::Sensors(sensors) => sensors,
        }
    }
}

/// The sensor of that name.
fn sensor(name: &str) -> Option<GloveSensor> {
    let name: StrDeserializer<'_, Error> = name.into_deserializer();
    GloveSensor::deserialize(name).ok()
}

fn no_name(name: &str) -> String {
    let sensors: Vec<String> = GloveSensor::ALL.iter().map(name_of).collect();
    format!(
        "{name:?} is neither `skip`, `time`, a finger (thumb, index, middle, ring, little) nor a sensor ({})",
        sensors.join(", ")
    )
}

/// The name of a sensor in settings: that of its variant, with a lower line before each capital but the first.
fn name_of(sensor: &GloveSensor) -> String {
    let mut name = String::new();
    for letter in format!("{sensor:?}").chars() {
        if letter.is_ascii_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.push(letter.to_ascii_lowercase());
    }
    name
}

#[cfg(test)]
mod tests {
    use super::{Column, name_of, sensor};
    use crate::glove::sensor::GloveSensor as S;

    #[test]
    fn columns_have_names() {
        let cases = [
            ("skip", Column::Skip),
            ("time", Column::Time),
            ("wrist_flexion", Column::Sensors(vec![S::WristFlexion])),
            ("ring", Column::Sensors(vec![S::RingMcp, S::RingPip])),
            (
                "index + index_dip",
                Column::Sensors(vec![S::IndexMcp, S::IndexPip, S::IndexDip]),
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(Column::parse(text), Ok(expected));
        }
        for text in ["", "pinky", "index+", "skip+ring", "Ring"] {
            let fault = Column::parse(text).unwrap_err();
            assert!(fault.contains("little_ring_abduction"), "{fault}");
        }
    }

    #[test]
    fn every_sensor_is_found_by_the_name_that_a_message_gives_it() {
        for known in S::ALL {
            assert_eq!(sensor(&name_of(&known)), Some(known));
        }
    }
}
