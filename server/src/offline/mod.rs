//! Running a scene against hand motion offline, faster than real time.

/// Events with names and reasons, one shape for JSON, tables and CSV.
pub mod event_record;
/// From a hand's spec to its motion.
pub mod hands;
/// Names of what events and poses refer to by number.
pub mod names;
/// Object poses as a table, a row per tick and object.
pub mod poses;
/// What a run came to, for programs and for people.
pub mod report;
/// The run itself.
pub mod run;

mod recorder;
/// How long steps take.
pub mod timing;
