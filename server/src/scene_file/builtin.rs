//! The scenes that the daemon carries with it.

/// Names and texts, in the order in which they are listed.
const SCENES: [(&str, &str); 7] = [
    ("demo", include_str!("../scenes/demo.toml")),
    (
        "operations/free",
        include_str!("../scenes/operations/free.toml"),
    ),
    (
        "operations/no-thumb",
        include_str!("../scenes/operations/no-thumb.toml"),
    ),
    (
        "operations/flick",
        include_str!("../scenes/operations/flick.toml"),
    ),
    (
        "operations/grasp-throw",
        include_str!("../scenes/operations/grasp-throw.toml"),
    ),
    (
        "operations/stack",
        include_str!("../scenes/operations/stack.toml"),
    ),
    ("target-game", include_str!("../scenes/target-game.toml")),
];

/// The names of all built-in scenes.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|(name, _)| *name)
}

/// The text of a built-in scene.
pub fn text(name: &str) -> Option<&'static str> {
    SCENES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}
