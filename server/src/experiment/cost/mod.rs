//! Experiment 3 of the paper (§5.2, Fig. 13): what a step costs against the number of objects and of held ones.
//!
//! Measured is [`World::step`](tsukamu_world::World::step) alone, on one core: two hands posed from joint angles,
//! contacts, grasp test, motion, floor, neighbours, the shown hand and the frame. The held objects are in the hands
//! and on the move in every step; the others lie on the floor.

use std::fmt;
use std::time::Duration;

use serde::Serialize;

/// Fig. 13 as SVG.
pub mod chart;
/// Two hands that hold.
pub mod hands;
/// One measurement.
pub mod measure;

use self::measure::{CostShape, Effort, Load, Measured, measure};
use super::table::{Lean, Table, grouped};

/// Frames per second of the paper with [`PAPER_OBJECTS`] objects of which 2 are held.
pub const PAPER_FPS: f64 = 17.0;
/// Objects of the paper's measurement.
pub const PAPER_OBJECTS: usize = 10;
/// Frames per second below which the paper calls manipulation no longer interactive.
pub const PAPER_FLOOR_FPS: f64 = 12.0;
/// Steps per second that are wanted with 10 objects and 2 held.
pub const WANTED_STEPS_PER_S: f64 = 50_000.0;
/// Largest ratio of step times that is wanted between 10 and 10 000 resting objects.
pub const WANTED_RATIO: f64 = 2.0;

/// What is measured, and for how long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CostOptions {
    /// Fewer numbers of objects and shorter repeats.
    pub quick: bool,
}

/// What the measurement found.
#[derive(Clone, Debug, Serialize)]
pub struct CostReport {
    /// A row per shape, number of objects and number held.
    pub rows: Vec<CostRow>,
    /// The machine's load over the last minute before the start, in runnable threads; `None` where it is not told.
    pub load_before: Option<f64>,
}

/// One measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostRow {
    /// `cube` or `ellipsoid`.
    pub shape: &'static str,
    /// Objects in the world, the held ones among them.
    pub objects: usize,
    /// Objects held.
    pub held: usize,
    /// Median of the repeats, steps per second of one core.
    pub steps_per_s: f64,
    /// Slowest repeat, steps per second.
    pub slowest: f64,
    /// Fastest repeat, steps per second.
    pub fastest: f64,
    /// Whether the wanted objects were held, and no others, in every step measured.
    pub holds: bool,
}

impl CostOptions {
    /// Every load, in the order of the report.
    pub fn loads(&self) -> Vec<Load> {
        let few: &[usize] = if self.quick {
            &[1, 2, 5, 10]
        } else {
            &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10]
        };
        let counts: Vec<usize> = few.iter().chain(&[100, 1000, 10_000]).copied().collect();
        let of_shape = |shape| {
            let counts = counts.clone();
            (0..=2).flat_map(move |held| {
                let counts = counts.clone();
                counts
                    .into_iter()
                    .filter(move |n| *n >= held)
                    .map(move |objects| Load {
                        shape,
                        objects,
                        held,
                    })
            })
        };
        CostShape::ALL.into_iter().flat_map(of_shape).collect()
    }

    const fn effort(self) -> Effort {
        if self.quick {
            Effort {
                n_repeats: 3,
                repeat: Duration::from_millis(60),
            }
        } else {
            Effort {
                n_repeats: 7,
                repeat: Duration::from_millis(150),
            }
        }
    }
}

/// Measures every load. `progress` is told how many are done, of how many.
///
/// # Errors
/// When a scene of the measurement is refused: a mistake of its constants.
pub fn run(
    options: CostOptions,
    mut progress: impl FnMut(usize, usize),
) -> anyhow::Result<CostReport> {
    let loads = options.loads();
    let load_before = load_average();
    let mut rows = Vec::with_capacity(loads.len());
    for load in &loads {
        progress(rows.len(), loads.len());
        rows.push(CostRow::of(*load, &measure(*load, options.effort())?));
    }
    Ok(CostReport { rows, load_before })
}

impl CostRow {
    fn of(load: Load, measured: &Measured) -> Self {
        Self {
            shape: load.shape.name(),
            objects: load.objects,
            held: load.held,
            steps_per_s: measured.steps_per_s,
            slowest: measured.slowest,
            fastest: measured.fastest,
            holds: measured.holds,
        }
    }
}

impl CostReport {
    /// Steps per second of a load, if it was measured.
    pub fn steps_per_s(&self, shape: CostShape, objects: usize, held: usize) -> Option<f64> {
        let is_it =
            |row: &&CostRow| (row.shape, row.objects, row.held) == (shape.name(), objects, held);
        self.rows.iter().find(is_it).map(|row| row.steps_per_s)
    }

    /// How much longer a step takes with 10 000 resting objects than with 10.
    pub fn resting_ratio(&self, shape: CostShape, held: usize) -> Option<f64> {
        Some(self.steps_per_s(shape, 10, held)? / self.steps_per_s(shape, 10_000, held)?)
    }
}

impl fmt::Display for CostReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let right = Lean::Right;
        let mut table = Table::new(&[
            ("shape", Lean::Left),
            ("objects", right),
            ("held", right),
            ("steps/s", right),
            ("slowest", right),
            ("fastest", right),
            ("µs/step", right),
            ("held all the time", Lean::Left),
        ]);
        for row in &self.rows {
            table.add(vec![
                row.shape.to_owned(),
                row.objects.to_string(),
                row.held.to_string(),
                grouped(row.steps_per_s),
                grouped(row.slowest),
                grouped(row.fastest),
                format!("{:.2}", 1.0e6 / row.steps_per_s),
                if row.holds { "yes" } else { "NO" }.to_owned(),
            ]);
        }
        writeln!(out, "{table}")?;
        for shape in CostShape::ALL {
            let name = shape.name();
            if let Some(rate) = self.steps_per_s(shape, PAPER_OBJECTS, 2) {
                let (rate, times) = (grouped(rate), grouped(rate / PAPER_FPS));
                let wanted = grouped(WANTED_STEPS_PER_S);
                writeln!(
                    out,
                    "{name}: 10 objects, 2 held: {rate} steps/s (wanted {wanted}), {times} times the paper's 17"
                )?;
            }
            let ratios: Vec<String> = (0..=2)
                .filter_map(|held| self.resting_ratio(shape, held))
                .map(|ratio| format!("{ratio:.2}"))
                .collect();
            let ratios = ratios.join(", ");
            writeln!(
                out,
                "{name}: from 10 to 10 000 objects a step takes {ratios} times as long (0, 1, 2 held; wanted < {WANTED_RATIO})"
            )?;
        }
        match self.load_before {
            Some(load) => write!(out, "load of the machine before the start: {load:.2}"),
            None => write!(out, "load of the machine before the start: not told"),
        }
    }
}

/// The load average of the last minute, where the system tells it.
fn load_average() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg")
        .ok()?
        .split_whitespace()
        .next()?
        .parse()
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_load_is_measured_once() {
        let loads = CostOptions { quick: false }.loads();
        // 13 numbers of objects by 3 numbers held, less "1 object, 2 held", for two shapes.
        assert_eq!(loads.len(), 2 * (13 * 3 - 1));
        assert!(loads.contains(&Load {
            shape: CostShape::Ellipsoid,
            objects: 10_000,
            held: 2
        }));
        assert!(loads.iter().all(|load| load.held <= load.objects));
    }

    #[test]
    fn what_is_said_to_be_held_is_held() {
        let effort = Effort {
            n_repeats: 1,
            repeat: Duration::ZERO,
        };
        for shape in CostShape::ALL {
            for held in 0..=2 {
                let measured = measure(
                    Load {
                        shape,
                        objects: 4,
                        held,
                    },
                    effort,
                )
                .unwrap();
                assert!(measured.holds, "{} {held}", shape.name());
                assert!(measured.steps_per_s > 0.0 && measured.steps_per_s.is_finite());
            }
        }
    }

    #[test]
    fn the_picture_names_every_line_and_the_papers_marks() {
        let row = |shape: CostShape, objects, held| CostRow {
            shape: shape.name(),
            objects,
            held,
            steps_per_s: 60_000.0 / (held + 1) as f64,
            slowest: 1.0,
            fastest: 2.0,
            holds: true,
        };
        let loads = CostOptions { quick: true }.loads();
        let rows = loads
            .iter()
            .map(|load| row(load.shape, load.objects, load.held))
            .collect();
        let report = CostReport {
            rows,
            load_before: None,
        };
        assert_eq!(report.resting_ratio(CostShape::Cube, 1), Some(1.0));
        let svg = chart::draw(&report).unwrap();
        for words in [
            "cube, 2 held",
            "ellipsoid, 0 held",
            "17 frames/s",
            "12 frames/s",
            "steps per second",
        ] {
            assert!(svg.contains(words), "{words}");
        }
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["rows"][0]["shape"], "cube");
        assert!(json["rows"][0]["steps_per_s"].is_f64());
    }
}
