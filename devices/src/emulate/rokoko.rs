//! What Rokoko Studio sends.

use nalgebra::Vector3;
use serde_json::{Map, Value, json};

use super::source::{Frame, SentHand};
use crate::glove::calibrate::Handedness;
use crate::glove::sensor::GloveSensor;
use crate::source::links::{FLEXIONS, finger_rotations, thumb_links};
use crate::source::unity::{unity_from_position, unity_from_rotation};

/// First joints of the fingers of a right hand in the wrist's space, m.
const BASES_M: [[f64; 3]; 5] = [
    [-0.027, -0.016, -0.034],
    [-0.024, 0.0, -0.092],
    [0.0, 0.0, -0.095],
    [0.020, 0.0, -0.090],
    [0.038, 0.0, -0.081],
];
/// Lengths of the links, m.
const LINKS_M: [f64; 3] = [0.044, 0.026, 0.023];
/// Names of the joints.
const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Little"];
const JOINTS: [&str; 4] = ["Proximal", "Medial", "Distal", "Tip"];

/// One frame.
pub(super) fn json(frame: &Frame) -> Vec<u8> {
    let mut body = Map::new();
    for (hand, sent) in &frame.hands {
        if let Some(sent) = sent {
            put_hand(*hand, sent, &mut body);
        }
    }
    let [left, right] = frame.hands.map(|(_, sent)| sent.is_some());
    json!({
        "version": "3,0",
        "fps": 60,
        "scene": {
            "timestamp": frame.time_s,
            "actors": [{
                "name": "Tsukamu",
                "meta": {
                    "hasGloves": left || right, "hasLeftGlove": left, "hasRightGlove": right,
                    "hasBody": true, "hasFace": false,
                },
                "dimensions": { "totalHeight": 1.8, "hipHeight": 1.0 },
                "body": body,
            }],
            "props": [],
        },
    })
    .to_string()
    .into_bytes()
}

fn put_hand(hand: Handedness, sent: &SentHand, body: &mut Map<String, Value>) {
    let side = match hand {
        Handedness::Left => "left",
        Handedness::Right => "right",
    };
    let rotation = unity_from_rotation(&sent.world_from_wrist.rotation);
    let mut put = |name: String, right_hand_place: Vector3<f64>| {
        let place = match hand {
            Handedness::Left => {
                Vector3::new(-right_hand_place.x, right_hand_place.y, right_hand_place.z)
            }
            Handedness::Right => right_hand_place,
        };
        let place = sent.world_from_wrist * nalgebra::Point3::from(place);
        let [x, y, z] = unity_from_position(&place.coords);
        let [qx, qy, qz, qw] = rotation;
        let joint = json!({
            "position": { "x": x, "y": y, "z": z },
            "rotation": { "x": qx, "y": qy, "z": qz, "w": qw },
        });
        body.insert(name, joint);
    };
    put(format!("{side}Hand"), Vector3::zeros());
    for (index, finger) in FINGERS.iter().enumerate() {
        let mut place = Vector3::from(BASES_M[index]);
        put(format!("{side}{finger}{}", JOINTS[0]), place);
        for (link, direction) in directions(sent, index).into_iter().enumerate() {
            place += direction * LINKS_M[link];
            put(format!("{side}{finger}{}", JOINTS[link + 1]), place);
        }
    }
}

/// Directions of a finger's links, of a right hand, in the wrist's space.
fn directions(sent: &SentHand, finger: usize) -> [Vector3<f64>; 3] {
    if finger == 0 {
        let sensors = [
            GloveSensor::ThumbRotation,
            GloveSensor::ThumbAbduction,
            GloveSensor::ThumbMcp,
            GloveSensor::ThumbIp,
        ];
        return thumb_links(sensors.map(|sensor| sent.angle(sensor)));
    }
    let bends = FLEXIONS[finger - 1].map(|sensor| sent.angle(sensor));
    finger_rotations(bends, sent.swings()[finger - 1]).map(|turn| turn * -Vector3::z())
}

/// An LZ4 frame that holds the bytes as blocks that are not compressed: what every reader of the format takes.
pub(super) fn lz4_frame(content: &[u8]) -> Vec<u8> {
    // Version 1, independent blocks; blocks of 64 KiB. The last byte is the header's checksum, xxHash32 of the two.
    let mut bytes = vec![0x04, 0x22, 0x4D, 0x18, 0x60, 0x40, 0x82];
    for block in content.chunks(65_536) {
        bytes.extend((block.len() as u32 | 1 << 31).to_le_bytes());
        bytes.extend(block);
    }
    bytes.extend([0; 4]);
    bytes
}
