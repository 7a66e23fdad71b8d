//! Experiments 1 and 2 of the paper (§5.2): the five operations and the target game, each a built-in scene with a
//! synthetic hand, and what the paper says of them beside what happened.

use std::fmt;

use serde::Serialize;

/// What became of an object, from the events of a run.
pub mod story;

use self::story::{ObjectStory, Stories};
use super::play::play;
use super::table::{Lean, NONE, Table, number};

/// One of the paper's operations.
#[derive(Clone, Copy, Debug)]
pub struct Operation {
    /// The built-in scene.
    pub scene: &'static str,
    /// What the paper describes.
    pub paper: &'static str,
    agrees: fn(&[ObjectStory]) -> bool,
}

/// The five operations and the target game.
pub const OPERATIONS: [Operation; 6] = [
    Operation {
        scene: "operations/free",
        paper: "grasped, moved and set down; pushed with the tip of the index finger (§5.2, operation 1, Fig. 12)",
        agrees: |objects| {
            objects
                .iter()
                .any(|o| o.is_grasped() && o.is_pushed_by(&["index"]) && o.rests())
        },
    },
    Operation {
        scene: "operations/no-thumb",
        paper: "held by fingers without the thumb (operation 2)",
        agrees: |objects| {
            objects
                .iter()
                .any(|o| o.is_grasped() && !o.held_by.iter().any(|f| f == "thumb") && o.rests())
        },
    },
    Operation {
        scene: "operations/flick",
        paper: "a pyramid flicked away by the index finger comes to rest on the floor (operation 3, Fig. 9)",
        agrees: |objects| {
            objects.iter().any(|o| {
                !o.is_grasped()
                    && o.is_pushed_by(&["index"])
                    && o.moved_m > 0.1
                    && o.rests_on_floor()
            })
        },
    },
    Operation {
        scene: "operations/grasp-throw",
        paper: "thrown, flies on a parabola, lies still on the floor (operation 4, Fig. 10)",
        agrees: |objects| {
            objects.iter().any(|o| {
                o.is_grasped()
                    && o.release_m_s > Some(0.5)
                    && o.landed.is_some()
                    && o.rests_on_floor()
            })
        },
    },
    Operation {
        scene: "operations/stack",
        paper: "blocks put on one another stay (operation 5, Fig. 11)",
        agrees: |objects| {
            objects
                .iter()
                .any(|o| story::height_of_stack(objects, &o.name) >= 3)
        },
    },
    Operation {
        scene: "target-game",
        paper: "a block thrown through a target of radius 15 cm, 2 m ahead (experiment 2: 9 of 10 visitors hit it)",
        agrees: |objects| objects.iter().any(|o| o.hit_m.is_some()),
    },
];

/// What happened in all of them.
#[derive(Clone, Debug, Serialize)]
pub struct OperationsReport {
    /// One per operation.
    pub operations: Vec<OperationReport>,
}

/// What happened in one of them.
#[derive(Clone, Debug, Serialize)]
pub struct OperationReport {
    /// The built-in scene.
    pub scene: &'static str,
    /// What the paper describes.
    pub paper: &'static str,
    /// Whether that is what happened.
    pub agrees: bool,
    /// Steps per second.
    pub rate_hz: f64,
    /// World time played, seconds.
    pub duration_s: f64,
    /// What became of each object.
    pub objects: Vec<ObjectStory>,
}

/// Plays all operations. `rate_hz` takes the place of the scenes' step rate; `progress` is told each that is done.
///
/// # Errors
/// When a built-in scene or its hand cannot be had.
pub fn run(
    rate_hz: Option<f64>,
    mut progress: impl FnMut(&str),
) -> anyhow::Result<OperationsReport> {
    let mut operations = Vec::with_capacity(OPERATIONS.len());
    for operation in &OPERATIONS {
        operations.push(operation.run(rate_hz)?);
        progress(operation.scene);
    }
    Ok(OperationsReport { operations })
}

impl Operation {
    /// Plays it.
    ///
    /// # Errors
    /// When its scene or its hand cannot be had.
    pub fn run(&self, rate_hz: Option<f64>) -> anyhow::Result<OperationReport> {
        let mut stories = Stories::default();
        let (mut duration_s, mut rate) = (0.0, 0.0);
        play(self.scene, rate_hz, |world| {
            stories.watch(world);
            (duration_s, rate) = (world.frame().time_s, world.scene().rate_hz);
        })?;
        let objects = stories.told();
        let agrees = (self.agrees)(&objects);
        Ok(OperationReport {
            scene: self.scene,
            paper: self.paper,
            agrees,
            rate_hz: rate,
            duration_s,
            objects,
        })
    }
}

impl fmt::Display for OperationsReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let right = Lean::Right;
        let mut table = Table::new(&[
            ("scene", Lean::Left),
            ("object", Lean::Left),
            ("grasps", right),
            ("held by", Lean::Left),
            ("held s", right),
            ("pushed by", Lean::Left),
            ("release m/s", right),
            ("landed at x, z m", right),
            ("rests on", Lean::Left),
            ("target", Lean::Left),
            ("as in the paper", Lean::Left),
        ]);
        for operation in &self.operations {
            for (index, object) in operation.objects.iter().enumerate() {
                table.add(row(operation, object, index == 0));
            }
        }
        writeln!(out, "{table}")?;
        for operation in &self.operations {
            let verdict = if operation.agrees { "yes" } else { "NO" };
            writeln!(
                out,
                "{:24} {verdict:4} {}",
                operation.scene, operation.paper
            )?;
        }
        let n_agree = self
            .operations
            .iter()
            .filter(|operation| operation.agrees)
            .count();
        write!(
            out,
            "{n_agree} of {} as in the paper",
            self.operations.len()
        )
    }
}

fn row(operation: &OperationReport, object: &ObjectStory, first: bool) -> Vec<String> {
    let words = |names: &[String]| {
        if names.is_empty() {
            NONE.to_owned()
        } else {
            names.join(" ")
        }
    };
    let landed = object
        .landed
        .map_or_else(|| NONE.to_owned(), |[x, _, z]| format!("{x:.3}, {z:.3}"));
    let target = object.hit_m.map_or_else(
        || NONE.to_owned(),
        |miss| format!("hit, {:.1} cm off centre", miss * 100.0),
    );
    let verdict = if operation.agrees { "yes" } else { "NO" };
    vec![
        if first {
            operation.scene.to_owned()
        } else {
            String::new()
        },
        object.name.clone(),
        object.n_grasps.to_string(),
        words(&object.held_by),
        format!("{:.2}", object.held_s),
        words(&object.pushed_by),
        number(object.release_m_s, 2),
        landed,
        object.rests_on.clone().unwrap_or_else(|| NONE.to_owned()),
        target,
        if first {
            verdict.to_owned()
        } else {
            String::new()
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_goes_as_the_paper_describes() {
        let report = run(None, |_| {}).unwrap();
        for operation in &report.operations {
            assert!(operation.agrees, "{report}");
        }
        let text = report.to_string();
        assert!(text.contains("6 of 6 as in the paper"), "{text}");
    }
}
