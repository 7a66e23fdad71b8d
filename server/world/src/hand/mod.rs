//! The virtual hand (Funahashi et al. 1998, §3.1): from a sample to judgement points and segments.

pub mod hand_state;
pub mod joint;
pub mod judgement;
pub mod kinematics;
pub mod limits;
pub mod part;
pub mod prism;
pub mod retract;
pub mod sample;
pub mod show;
pub mod skeleton;
