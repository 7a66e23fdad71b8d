//! Two points per sensor: 22 lines `rad:raw rad:raw`, in an order of that driver's own.

use super::{ImportFault, Imported};
use crate::glove::sensor::GloveSensor;

/// The place in the record of 22 sensors that each line belongs to.
const ORDER: [usize; 22] = [
    21, 20, 3, 0, 1, 2, 4, 10, 5, 6, 7, 19, 8, 9, 11, 14, 12, 13, 15, 18, 16, 17,
];

pub(super) fn read(text: &str) -> Result<Imported, ImportFault> {
    let lines: Vec<(usize, &str)> = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
        .collect();
    if lines.len() < ORDER.len() {
        let (found, wanted) = (lines.len(), ORDER.len());
        return Err(ImportFault::TooShort { found, wanted });
    }
    let mut imported = Imported::new();
    if lines.len() > ORDER.len() {
        let n_more = lines.len() - ORDER.len();
        imported
            .notes
            .push(format!("{n_more} lines after the 22nd are left out"));
    }
    for ((index, line), place) in lines.into_iter().zip(ORDER) {
        let (line_number, sensor) = (index + 1, GloveSensor::ALL[place]);
        let mut points = line.split_whitespace().map(point);
        let (Some(Some((first_rad, first_raw))), Some(Some((second_rad, second_raw)))) =
            (points.next(), points.next())
        else {
            let wanted = "a pair `rad:raw rad:raw`";
            return Err(ImportFault::NoNumber {
                line: line_number,
                wanted,
            });
        };
        let gain = (second_rad - first_rad) / (second_raw - first_raw);
        let zero = first_raw - first_rad / gain;
        if !imported.add(sensor, zero, gain.to_degrees(), 0.0) {
            return Err(ImportFault::NoSlope {
                line: line_number,
                sensor,
            });
        }
    }
    Ok(imported)
}

/// `rad:raw`.
fn point(text: &str) -> Option<(f64, f64)> {
    let (rad, raw) = text.split_once(':')?;
    let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    Some((number(rad)?, number(raw)?))
}

#[cfg(test)]
mod tests {
    use super::{ORDER, read};
    use crate::calibration::import::ImportFault;
    use crate::glove::sensor::GloveSensor;

    #[test]
    fn the_example_of_the_reference_comes_out() {
        let text = "0.000000:62.000000 -1.700000:199.000000\n".repeat(22);
        let imported = read(&text).unwrap();
        assert_eq!(
            imported.sensors.len(),
            22,
            "each line has a sensor of its own"
        );
        let line = imported.calibration.sensor(GloveSensor::IndexMcp);
        assert!((line.gain_deg_per_count.to_radians() - -0.012_408_8).abs() < 1e-7);
        assert!((line.raw_at_zero - 62.0).abs() < 1e-9);
        let at_130 = line.gain_deg_per_count * (130.0 - line.raw_at_zero);
        assert!((at_130 - -48.346).abs() < 1e-3, "{at_130}");
    }

    #[test]
    fn lines_are_in_the_order_of_that_driver() {
        let text: String = (0..22)
            .map(|k| format!("0:{} 1:{}\n", 100 + k, 200 + k))
            .collect();
        let imported = read(&text).unwrap();
        for (line, place) in ORDER.into_iter().enumerate() {
            let zero = imported
                .calibration
                .sensor(GloveSensor::ALL[place])
                .raw_at_zero;
            assert!((zero - (100 + line) as f64).abs() < 1e-9);
        }
    }

    #[test]
    fn mistakes_are_named() {
        let good = "0:62 -1.7:199\n";
        assert_eq!(
            read(good).unwrap_err(),
            ImportFault::TooShort {
                found: 1,
                wanted: 22
            }
        );
        let check = |line: &str, words: &str| {
            let text = format!(
                "# of somebody\n{}{line}\n{}",
                good.repeat(2),
                good.repeat(19)
            );
            assert_eq!(read(&text).unwrap_err().to_string(), words);
        };
        check(
            "0:62",
            "line 4: a pair `rad:raw rad:raw` is missing or no number",
        );
        check(
            "0:62 x:9",
            "line 4: a pair `rad:raw rad:raw` is missing or no number",
        );
        check("0:62 1:62", "line 4: ThumbAbduction has no slope");
    }
}
