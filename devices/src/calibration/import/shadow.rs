//! Piecewise-linear calibrations as the Shadow Robot company's glove node reads them: for each sensor, named as in
//! `G_IndexMPJ`, a list of points [normalised raw 0 to 1, degrees], clamped beyond the first and the last.
//!
//! Our calibration is a line. The best line through the points stands for them, and the greatest difference is told.
//! Of YAML only this much is read: names of sensors, and the numbers between one name and the next, taken in pairs; so
//! it does not matter how the lists are nested or broken into lines.

use super::{ImportFault, Imported};
use crate::glove::sensor::GloveSensor as S;

/// The names of that program.
const NAMES: [(&str, S); 22] = [
    ("G_ThumbRotate", S::ThumbRotation),
    ("G_ThumbMPJ", S::ThumbMcp),
    ("G_ThumbIJ", S::ThumbIp),
    ("G_ThumbAb", S::ThumbAbduction),
    ("G_IndexMPJ", S::IndexMcp),
    ("G_IndexPIJ", S::IndexPip),
    ("G_IndexDIJ", S::IndexDip),
    ("G_MiddleMPJ", S::MiddleMcp),
    ("G_MiddlePIJ", S::MiddlePip),
    ("G_MiddleDIJ", S::MiddleDip),
    ("G_MiddleIndexAb", S::MiddleIndexAbduction),
    ("G_RingMPJ", S::RingMcp),
    ("G_RingPIJ", S::RingPip),
    ("G_RingDIJ", S::RingDip),
    ("G_RingMiddleAb", S::RingMiddleAbduction),
    ("G_PinkieMPJ", S::LittleMcp),
    ("G_PinkiePIJ", S::LittlePip),
    ("G_PinkieDIJ", S::LittleDip),
    ("G_PinkieRingAb", S::LittleRingAbduction),
    ("G_PalmArch", S::PalmArch),
    ("G_WristPitch", S::WristFlexion),
    ("G_WristYaw", S::WristAbduction),
];
/// Counts of a normalised value: (raw − 1) / 254 of 8 bits.
const COUNTS: (f64, f64) = (1.0, 254.0);
/// An approximation that is worse than this is told, degrees.
const TOLD_ERROR_DEG: f64 = 1.0;

/// The points of one sensor.
#[derive(Debug)]
struct Curve {
    sensor: S,
    line: usize,
    numbers: Vec<f64>,
}

pub(super) fn read(text: &str) -> Result<Imported, ImportFault> {
    let mut imported = Imported::new();
    let curves = curves(text, &mut imported.notes);
    for curve in curves {
        let line = curve.line;
        if curve.numbers.len() < 4 || !curve.numbers.len().is_multiple_of(2) {
            let wanted = "a list of at least two points [raw, degrees]";
            return Err(ImportFault::NoNumber { line, wanted });
        }
        let points: Vec<(f64, f64)> = curve
            .numbers
            .chunks_exact(2)
            .map(|pair| (COUNTS.0 + COUNTS.1 * pair[0], pair[1]))
            .collect();
        let sensor = curve.sensor;
        let (zero, gain_deg, error_deg) =
            best_line(&points).ok_or(ImportFault::NoSlope { line, sensor })?;
        if !imported.add(sensor, zero, gain_deg, error_deg) {
            return Err(ImportFault::NoSlope { line, sensor });
        }
        if error_deg > TOLD_ERROR_DEG {
            imported.notes.push(format!(
                "line {line}: {sensor:?} is no line; the best one is off by up to {error_deg:.1}°"
            ));
        }
    }
    if imported.sensors.is_empty() {
        return Err(ImportFault::NoSensor);
    }
    Ok(imported)
}

/// The numbers after each sensor's name.
fn curves(text: &str, notes: &mut Vec<String>) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    let mut is_open = false;
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let is_part =
            |letter: char| letter.is_alphanumeric() || matches!(letter, '_' | '.' | '-' | '+');
        for word in line
            .split(|letter| !is_part(letter))
            .filter(|word| !word.is_empty())
        {
            if let Some((_, sensor)) = NAMES.iter().find(|(name, _)| *name == word) {
                curves.retain(|curve| curve.sensor != *sensor);
                curves.push(Curve {
                    sensor: *sensor,
                    line: index + 1,
                    numbers: Vec::new(),
                });
                is_open = true;
            } else if let Some(number) = word.parse::<f64>().ok().filter(|value| value.is_finite())
            {
                if let Some(curve) = curves.last_mut().filter(|_| is_open) {
                    curve.numbers.push(number);
                }
            } else if word.starts_with("G_") {
                notes.push(format!("line {}: {word} is no known sensor", index + 1));
                is_open = false;
            }
        }
    }
    curves
}

/// Zero and gain of the best line, and the greatest difference between it and the points, degrees. `None` without a slope.
fn best_line(points: &[(f64, f64)]) -> Option<(f64, f64, f64)> {
    let n = points.len() as f64;
    let mean_raw = points.iter().map(|(raw, _)| raw).sum::<f64>() / n;
    let mean_deg = points.iter().map(|(_, deg)| deg).sum::<f64>() / n;
    let (mut along, mut across) = (0.0, 0.0);
    for (raw, deg) in points {
        along += (raw - mean_raw).powi(2);
        across += (raw - mean_raw) * (deg - mean_deg);
    }
    let gain = across / along;
    let zero = mean_raw - mean_deg / gain;
    let off = points
        .iter()
        .map(|(raw, deg)| (gain * (raw - zero) - deg).abs());
    let error = off.fold(0.0, f64::max);
    (gain.is_finite() && gain != 0.0 && error.is_finite()).then_some((zero, gain, error))
}

#[cfg(test)]
mod tests {
    use super::read;
    use crate::calibration::import::ImportFault;
    use crate::glove::sensor::GloveSensor;

    #[test]
    fn the_example_of_the_reference_comes_out() {
        for text in [
            "G_IndexMPJ: [[0.307087, 0], [0.586614, 90]]\n",
            "cyberglove:\n  - G_IndexMPJ: # bent\n      - [0.307087, 0.0]\n      - - 0.586614\n        - 90\n",
        ] {
            let imported = read(text).unwrap();
            let line = imported.calibration.sensor(GloveSensor::IndexMcp);
            // 0.307087 of 254 is 78 counts above 1; 0.586614 is 149.
            assert!(
                (line.raw_at_zero - 79.0).abs() < 1e-3,
                "{}",
                line.raw_at_zero
            );
            assert!((line.gain_deg_per_count - 90.0 / 71.0).abs() < 1e-5);
            assert_eq!(imported.sensors.len(), 1);
            assert!(imported.sensors[0].error_deg < 1e-9 && imported.notes.is_empty());
        }
    }

    #[test]
    fn a_bent_curve_is_approximated_and_its_error_told() {
        let imported =
            read("G_ThumbAb: [[0, 0], [0.5, 60], [1.0, 60]]\nG_Nose: [[0, 1]]\n").unwrap();
        assert!((imported.sensors[0].error_deg - 20.0).abs() < 1e-6);
        let notes = imported.notes.join("\n");
        assert!(notes.contains("off by up to 20.0°"), "{notes}");
        assert!(
            notes.contains("line 2: G_Nose is no known sensor"),
            "{notes}"
        );
    }

    #[test]
    fn mistakes_are_named() {
        assert_eq!(read("a: [1, 2]\n").unwrap_err(), ImportFault::NoSensor);
        let check = |text: &str, words: &str| {
            assert_eq!(read(text).unwrap_err().to_string(), words);
        };
        let wanted = "a list of at least two points [raw, degrees] is missing or no number";
        check("\nG_PalmArch: [[0, 1]]", &format!("line 2: {wanted}"));
        check("G_PalmArch: [[0, 1], [0.5]]", &format!("line 1: {wanted}"));
        check(
            "G_PalmArch: [[0.5, 1], [0.5, 9]]",
            "line 1: PalmArch has no slope",
        );
    }
}
