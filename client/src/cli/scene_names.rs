use std::collections::BTreeMap;

use tsukamu_proto::v1::Scene;

use super::format::printable;

/// What a scene calls its objects and hands.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SceneNames {
    objects: BTreeMap<u64, String>,
    hands: BTreeMap<u32, String>,
}

impl SceneNames {
    pub(crate) fn of(scene: &Scene) -> Self {
        Self {
            objects: scene
                .objects
                .iter()
                .map(|object| (object.id, printable(&object.name)))
                .collect(),
            hands: scene
                .hands
                .iter()
                .map(|hand| (hand.id, printable(&hand.name)))
                .collect(),
        }
    }

    /// The object's name, or its number where the scene has none.
    pub(crate) fn object(&self, id: u64) -> String {
        self.known_object(id)
            .unwrap_or_else(|| format!("object {id}"))
    }

    pub(crate) fn known_object(&self, id: u64) -> Option<String> {
        self.objects.get(&id).cloned()
    }

    /// The hand's name, or its number where the scene has none.
    pub(crate) fn hand(&self, id: u32) -> String {
        self.hands
            .get(&id)
            .cloned()
            .unwrap_or_else(|| format!("hand {id}"))
    }
}
