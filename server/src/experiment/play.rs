//! A scene with its own hands, watched step by step.

use anyhow::{Context, bail};
use tsukamu_world::input::{Command, HandInput};
use tsukamu_world::{StepInput, World};

use crate::offline::hands::{RunHand, resolve_all};
use crate::scene_file::{LoadedScene, load};

/// World time after the last hand sample in which objects may come to rest, seconds.
const REST_MAX_S: f64 = 20.0;
/// World time that is added when everything is at rest, seconds.
const AFTER_REST_S: f64 = 0.5;

/// Plays a built-in scene or a scene file with its own hands until they are done and everything is at rest; `watch`
/// sees the world after each step. `rate_hz` takes the place of the scene's step rate.
pub(super) fn play(
    name_or_file: &str,
    rate_hz: Option<f64>,
    mut watch: impl FnMut(&World),
) -> anyhow::Result<()> {
    let mut loaded = load(name_or_file)?;
    loaded.scene.rate_hz = rate_hz.unwrap_or(loaded.scene.rate_hz);
    let hands = hands_of(&loaded).with_context(|| name_or_file.to_owned())?;
    let end_s = hands.iter().map(RunHand::end_s).fold(0.0, f64::max);
    let step_s = loaded.scene.step_length_s();
    let mut world = World::new(loaded.scene)?;
    let enter = |hand: &RunHand| Command::AddHand {
        hand: hand.id,
        model: Box::new(hand.model.clone()),
    };
    let mut input = StepInput {
        commands: hands.iter().map(enter).collect(),
        hands: Vec::new(),
    };
    let mut rest_s = 0.0;
    for tick in 1..=((end_s + REST_MAX_S) / step_s).ceil() as u64 {
        let time_s = tick as f64 * step_s;
        let samples = hands.iter().map(|hand| HandInput {
            hand: hand.id,
            sample: hand.sample_at(time_s),
        });
        input.hands.extend(samples);
        world.step(&input);
        watch(&world);
        input.clear();
        let rests = time_s > end_s && world.objects().all(|(_, body)| body.is_resting());
        rest_s = if rests { rest_s + step_s } else { 0.0 };
        if rest_s > AFTER_REST_S {
            break;
        }
    }
    Ok(())
}

fn hands_of(loaded: &LoadedScene) -> anyhow::Result<Vec<RunHand>> {
    match resolve_all(&loaded.default_hands, &loaded.scene) {
        Ok(hands) => Ok(hands),
        Err(faults) => bail!(
            "{}",
            faults
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("\n")
        ),
    }
}
