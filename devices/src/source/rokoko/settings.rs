//! What of a stream is taken.

/// Settings of a Rokoko source.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RokokoSettings {
    /// Name of the actor whose hands are taken; `None` for the first actor with hands.
    pub actor: Option<String>,
}
