//! The world by values: scenes and hand scripts in, what happened out.

mod falling;
mod grasping;
mod script;
