//! Step inputs and the commands in them.

use tsukamu_proto::v1;
use tsukamu_proto::v1::world_command::Kind;
use tsukamu_world::StepInput;
use tsukamu_world::input::{Command, HandInput};
use tsukamu_world::state::{HandId, ObjectId};

use super::fault::Fault;
use super::hand::{hand_model, hand_model_from, hand_sample, hand_sample_from};
use super::scene::{Shapes, model_from, object, object_from};

/// The input of the step that makes `tick`, as a message. `hand_name` gives the names of hands that enter.
pub fn step_input(
    epoch: u64,
    tick: u64,
    input: &StepInput,
    hand_name: impl Fn(HandId) -> String,
) -> v1::StepInput {
    let hand = |hand: &HandInput| v1::HandInput {
        hand: hand.hand.0,
        sample: hand.sample.as_ref().map(|sample| hand_sample(sample, 0)),
    };
    v1::StepInput {
        epoch,
        tick,
        hands: input.hands.iter().map(hand).collect(),
        commands: input
            .commands
            .iter()
            .map(|c| command(c, &hand_name))
            .collect(),
    }
}

/// The input of that message.
///
/// # Errors
/// The first part that cannot be one.
pub fn step_input_from(message: &v1::StepInput) -> Result<StepInput, Fault> {
    let hand = |hand: &v1::HandInput| {
        let sample = hand.sample.as_ref().map_or(Ok(None), hand_sample_from)?;
        if sample.as_ref().is_some_and(|sample| !sample.is_finite()) {
            return Err(Fault::NotFinite("hand sample"));
        }
        Ok(HandInput {
            hand: HandId(hand.hand),
            sample,
        })
    };
    Ok(StepInput {
        commands: message
            .commands
            .iter()
            .map(command_from)
            .collect::<Result<_, _>>()?,
        hands: message
            .hands
            .iter()
            .map(hand)
            .collect::<Result<_, Fault>>()?,
    })
}

/// A command as a message.
fn command(command: &Command, hand_name: &impl Fn(HandId) -> String) -> v1::WorldCommand {
    let kind = match command {
        Command::AddHand { hand, model } => Kind::AddHand(v1::AddHand {
            hand: hand.0,
            name: hand_name(*hand),
            model: Some(hand_model(model)),
        }),
        Command::RemoveHand(hand) => Kind::RemoveHand(hand.0),
        // The id is the world's to choose, and the object stands at its start.
        Command::AddObject(spec) => {
            Kind::AddObject(object(ObjectId::from_bits(0), spec, &spec.pose, 0.0))
        }
        Command::RemoveObject(id) => Kind::RemoveObject(id.to_bits()),
        Command::Release(id) => Kind::Release(id.to_bits()),
        Command::Reset => Kind::Reset(true),
        Command::SetModel(model) => Kind::SetModel(model.name().to_owned()),
    };
    v1::WorldCommand { kind: Some(kind) }
}

fn command_from(message: &v1::WorldCommand) -> Result<Command, Fault> {
    Ok(
        match message.kind.as_ref().ok_or(Fault::Missing("command"))? {
            Kind::AddHand(added) => Command::AddHand {
                hand: HandId(added.hand),
                model: Box::new(hand_model_from(
                    added.model.as_ref().ok_or(Fault::Missing("model"))?,
                )?),
            },
            Kind::RemoveHand(hand) => Command::RemoveHand(HandId(*hand)),
            Kind::AddObject(object) => {
                Command::AddObject(Box::new(object_from(object, &mut Shapes::new())?))
            }
            Kind::RemoveObject(id) => Command::RemoveObject(ObjectId::from_bits(*id)),
            Kind::Release(id) => Command::Release(ObjectId::from_bits(*id)),
            Kind::Reset(_) => Command::Reset,
            Kind::SetModel(name) => Command::SetModel(model_from(name)?),
        },
    )
}
