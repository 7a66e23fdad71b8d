//! What a sender of the VMC protocol sends: an avatar whose arms end in the given hands.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::source::{Frame, SentHand};
use crate::glove::calibrate::Handedness;
use crate::glove::sensor::GloveSensor;
use crate::source::links::{FLEXIONS, finger_rotations, thumb_links};
use crate::source::unity::{hand_from_wrist, unity_from_position, unity_from_rotation};
use crate::source::vmc::bones::{FIRST_OF_SIDE, HAND, N_SLOTS, link_slot, name};
use crate::source::vmc::frame::thumb_at_rest;
use crate::source::vmc::osc::{Writer, bundle};

/// Messages in a datagram, so that it fits an Ethernet frame.
const MESSAGES_PER_DATAGRAM: usize = 12;
/// Heights of the trunk's bones above their parents, m.
const TRUNK_M: [f64; 4] = [0.95, 0.12, 0.12, 0.13];
/// Distances of shoulder, upper arm and lower arm from their parents, m.
const ARM_M: [f64; 3] = [0.03, 0.12, 0.27];
/// How far the elbow is bent forward, rad.
const ELBOW: f64 = 0.6;
/// Length of a link, m.
const LINK_M: f64 = 0.03;

/// One frame.
pub(super) fn datagrams(frame: &Frame) -> Vec<Vec<u8>> {
    let mut messages = vec![
        Writer::to("/VMC/Ext/OK").whole(1).bytes(),
        Writer::to("/VMC/Ext/T").numbers(&[frame.time_s]).bytes(),
        pose("/VMC/Ext/Root/Pos", "root", &Isometry3::identity()),
    ];
    let trunk = TRUNK_M.map(|height| Isometry3::translation(0.0, height, 0.0));
    for (index, bone) in trunk.iter().enumerate() {
        let name = name(Handedness::Left, 1 + index);
        messages.push(pose("/VMC/Ext/Bone/Pos", &name, bone));
    }
    for (hand, sent) in &frame.hands {
        if let Some(sent) = sent {
            for (slot, bone) in bones(*hand, sent) {
                messages.push(pose("/VMC/Ext/Bone/Pos", &name(*hand, slot), &bone));
            }
        }
    }
    messages.chunks(MESSAGES_PER_DATAGRAM).map(bundle).collect()
}

fn pose(address: &str, name: &str, bone: &Isometry3<f64>) -> Vec<u8> {
    Writer::to(address)
        .text(name)
        .numbers(&unity_from_position(&bone.translation.vector))
        .numbers(&unity_from_rotation(&bone.rotation))
        .bytes()
}

/// The bones of one side by slot, each in its parent.
fn bones(hand: Handedness, sent: &SentHand) -> Vec<(usize, Isometry3<f64>)> {
    let outward = match hand {
        Handedness::Left => -1.0,
        Handedness::Right => 1.0,
    };
    let mut arm = ARM_M.map(|length| Isometry3::translation(outward * length, 0.0, 0.0));
    arm[2].rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), outward * ELBOW);
    let height: f64 = TRUNK_M.iter().sum();
    let root_from_arm = arm
        .iter()
        .fold(Isometry3::translation(0.0, height, 0.0), |chain, bone| {
            chain * bone
        });
    let from_wrist = Isometry3::from_parts(Translation3::identity(), hand_from_wrist(hand));
    let arm_from_hand = root_from_arm.inverse() * sent.world_from_wrist * from_wrist.inverse();
    let mut bones: Vec<(usize, Isometry3<f64>)> = (FIRST_OF_SIDE..HAND).zip(arm).collect();
    bones.push((HAND, arm_from_hand));
    for finger in 0..5 {
        let mut parent = UnitQuaternion::identity();
        for (link, wrist_from_link) in rotations(hand, sent, finger).into_iter().enumerate() {
            let rotation = from_wrist.rotation
                * (parent.inverse() * wrist_from_link)
                * from_wrist.rotation.inverse();
            let place = Translation3::new(outward * LINK_M, 0.0, 0.0);
            bones.push((
                link_slot(finger, link),
                Isometry3::from_parts(place, rotation),
            ));
            parent = wrist_from_link;
        }
    }
    debug_assert_eq!(bones.len(), N_SLOTS - FIRST_OF_SIDE, "every bone is sent");
    bones
}

/// Rotations of a finger's links, each from the wrist's axes.
fn rotations(hand: Handedness, sent: &SentHand, finger: usize) -> [UnitQuaternion<f64>; 3] {
    let right = if finger == 0 {
        let angles = [
            GloveSensor::ThumbRotation,
            GloveSensor::ThumbAbduction,
            GloveSensor::ThumbMcp,
            GloveSensor::ThumbIp,
        ];
        let mut from = thumb_at_rest(Handedness::Right);
        let mut chain = UnitQuaternion::identity();
        thumb_links(angles.map(|sensor| sent.angle(sensor))).map(|to| {
            let turn = UnitQuaternion::rotation_between(&from, &to);
            // Links are never turned by half a turn against the one before.
            chain = turn.unwrap_or_else(UnitQuaternion::identity) * chain;
            from = to;
            chain
        })
    } else {
        let bends = FLEXIONS[finger - 1].map(|sensor| sent.angle(sensor));
        finger_rotations(bends, sent.swings()[finger - 1])
    };
    match hand {
        Handedness::Right => right,
        Handedness::Left => right.map(|turn| mirrored(&turn)),
    }
}

/// A rotation seen in a mirror across x.
fn mirrored(turn: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(turn.w, turn.i, -turn.j, -turn.k))
}
