//! `.cal` files of the VirtualHand device configuration utility, as one open reader takes them: a title line, then blocks
//! of a heading and one line per sensor; the 7th word of a sensor's line is the offset in counts, the 10th the gain in
//! radians per count, and angle = gain · (raw − offset).
//!
//! The exact meaning is not verified. One version of the utility is said to have stored a ring-finger gain in the
//! wrong place, so the imported angles have to be looked at.

use super::{ImportFault, Imported};
use crate::glove::sensor::GloveSensor as S;

/// Lines of the file, from 0, and the sensors on them. Line 10 is the index finger's unused abduction.
const LINES: [(usize, S); 22] = [
    (2, S::ThumbRotation),
    (3, S::ThumbMcp),
    (4, S::ThumbIp),
    (5, S::ThumbAbduction),
    (7, S::IndexMcp),
    (8, S::IndexPip),
    (9, S::IndexDip),
    (12, S::MiddleMcp),
    (13, S::MiddlePip),
    (14, S::MiddleDip),
    (15, S::MiddleIndexAbduction),
    (17, S::RingMcp),
    (18, S::RingPip),
    (19, S::RingDip),
    (20, S::RingMiddleAbduction),
    (22, S::LittleMcp),
    (23, S::LittlePip),
    (24, S::LittleDip),
    (25, S::LittleRingAbduction),
    (27, S::PalmArch),
    (28, S::WristFlexion),
    (29, S::WristAbduction),
];
/// Words of a line that hold the offset and the gain, from 0.
const WORDS: (usize, usize) = (6, 9);
/// A gain outside this range, as an angle over all 254 counts in degrees, is no joint's.
const USUAL_TURN_DEG: (f64, f64) = (10.0, 720.0);

pub(super) fn read(text: &str) -> Result<Imported, ImportFault> {
    let lines: Vec<&str> = text.lines().collect();
    let wanted = LINES[LINES.len() - 1].0 + 1;
    if lines.len() < wanted {
        let found = lines.len();
        return Err(ImportFault::TooShort { found, wanted });
    }
    let mut imported = Imported::new();
    for (index, sensor) in LINES {
        let words: Vec<&str> = lines[index].split_whitespace().collect();
        let number = |word: usize, wanted| {
            let value = words.get(word).and_then(|word| word.parse::<f64>().ok());
            value
                .filter(|value| value.is_finite())
                .ok_or(ImportFault::NoNumber {
                    line: index + 1,
                    wanted,
                })
        };
        let offset = number(WORDS.0, "the offset (7th word)")?;
        let gain_deg = number(WORDS.1, "the gain (10th word)")?.to_degrees();
        if !imported.add(sensor, offset, gain_deg, 0.0) {
            // A sensor that the glove lacks is there with a gain of 0.
            imported.notes.push(format!(
                "line {}: {sensor:?} has gain 0 and is left out",
                index + 1
            ));
            continue;
        }
        let turn_deg = gain_deg.abs() * 253.0;
        if !(USUAL_TURN_DEG.0..=USUAL_TURN_DEG.1).contains(&turn_deg) {
            imported.notes.push(format!(
                "line {}: {sensor:?} turns {turn_deg:.0}° over all counts, which no joint does",
                index + 1
            ));
        }
        if !(0.0..=255.0).contains(&offset) {
            imported.notes.push(format!(
                "line {}: {sensor:?} is straight at {offset} counts, which the glove cannot send",
                index + 1
            ));
        }
    }
    if imported.sensors.is_empty() {
        return Err(ImportFault::NoSensor);
    }
    Ok(imported)
}

#[cfg(test)]
mod tests {
    use super::{LINES, read};
    use crate::calibration::import::ImportFault;
    use crate::glove::sensor::GloveSensor;

    /// A file in which each sensor's offset is 40 + its slot and its gain 0.01, minus for the wrist's.
    fn sample() -> String {
        let mut lines = vec![String::from("Glove"); 30];
        for (index, sensor) in LINES {
            let gain = if index >= 28 { -0.01 } else { 0.01 };
            lines[index] = format!(
                "   {} a b 1 2 0 {} 8 9 {gain} 11",
                index,
                40 + sensor.slot()
            );
        }
        lines.join("\r\n")
    }

    #[test]
    fn offsets_and_gains_are_found() {
        let imported = read(&sample()).unwrap();
        assert_eq!(imported.sensors.len(), 22);
        assert!(imported.notes.is_empty(), "{:?}", imported.notes);
        let ring = imported.calibration.sensor(GloveSensor::RingPip);
        assert_eq!(ring.raw_at_zero, 53.0);
        assert!((ring.gain_deg_per_count - 0.572_957_795).abs() < 1e-8);
        let shown = imported
            .sensors
            .iter()
            .find(|s| s.sensor == GloveSensor::WristFlexion)
            .unwrap();
        assert!(
            (shown.angles_deg[1] - -38.388_172).abs() < 1e-5,
            "{:?}",
            shown.angles_deg
        );
        assert_eq!(imported.calibration.problems(), []);
    }

    #[test]
    fn what_is_wrong_or_doubtful_is_said() {
        assert_eq!(
            read("a\nb").unwrap_err(),
            ImportFault::TooShort {
                found: 2,
                wanted: 30
            }
        );
        let bad = sample().replace(" 53 8", " x 8");
        let fault = read(&bad).unwrap_err().to_string();
        assert_eq!(
            fault,
            "line 19: the offset (7th word) is missing or no number"
        );
        let odd = sample()
            .replace(" 53 8 9 0.01", " 300 8 9 1.0")
            .replace(" 44 8 9 0.01", " 44 8 9 0");
        let imported = read(&odd).unwrap();
        assert_eq!(imported.sensors.len(), 21);
        let notes = imported.notes.join("\n");
        for part in [
            "IndexMcp has gain 0",
            "RingPip turns 14496°",
            "straight at 300 counts",
        ] {
            assert!(notes.contains(part), "{notes}");
        }
    }
}
