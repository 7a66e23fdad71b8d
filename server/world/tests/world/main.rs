//! The world by values: scenes and hand scripts in, what happened out.

mod determinism;
mod falling;
mod floor_cases;
mod grasping;
mod hands_together;
mod laws;
mod script;
mod steady;
