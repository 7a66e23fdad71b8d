//! The world by values: scenes and hand scripts in, what happened out.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its scene has failed"
)]

mod determinism;
mod extremes;
mod falling;
mod floor_cases;
mod grasping;
mod hands_together;
mod laws;
mod letting_go;
mod neighbours;
mod script;
mod snapshots;
mod steady;
