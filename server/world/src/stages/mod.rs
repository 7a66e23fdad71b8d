//! The stages of a step, in the order of model §4.

/// Objects that no hand touches.
pub(crate) mod free;
/// The hands: their samples, and how they are shown.
pub(crate) mod hands;
/// Which objects hands touch.
pub(crate) mod judge;
/// The frame.
pub(crate) mod publish;
/// How touched objects move.
pub(crate) mod touched;
