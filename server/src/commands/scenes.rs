//! `tsukamud scenes`

use tsukamu_server::scene_file::{builtin, load};

use super::Failure;
use super::output::say;

/// Lists the built-in scenes with what is in them.
pub(super) fn scenes() -> Result<(), Failure> {
    for name in builtin::names() {
        let loaded = load(name).map_err(|mistakes| Failure::Usage(mistakes.to_string()))?;
        let objects: Vec<&str> = loaded
            .scene
            .objects
            .iter()
            .map(|object| object.name.as_str())
            .collect();
        let hands: Vec<String> = loaded
            .default_hands
            .iter()
            .map(ToString::to_string)
            .collect();
        say(&format!(
            "{name:24} {:32} {}",
            hands.join(", "),
            objects.join(", ")
        ))?;
    }
    Ok(())
}
