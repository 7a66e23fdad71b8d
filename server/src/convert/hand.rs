//! Hand models and hand samples.

use nalgebra::{Point3, UnitQuaternion};
use tsukamu_proto::v1;
use tsukamu_world::hand::joint::{LINKS_PER_FINGER, N_FINGERS, N_JOINTS};
use tsukamu_world::hand::part::PartLayout;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};
use tsukamu_world::hand::skeleton::{FingerBones, HandModel, Skeleton};
use tsukamu_world::step::HandTouch;

use super::basic::{plus_one, point, pose, pose_from, rotation_from, side, side_from, vec3};
use super::fault::Fault;
use crate::input::intake::DriveNow;
use crate::input::one_euro::{DERIVATIVE_CUTOFF_HZ, OneEuro};
use crate::input::sources::Seen;

/// A hand model as a message.
pub fn hand_model(model: &HandModel) -> v1::HandModel {
    let fingers = &model.skeleton.fingers;
    let rotation = |f: &FingerBones| {
        [
            f.orientation.i,
            f.orientation.j,
            f.orientation.k,
            f.orientation.w,
        ]
    };
    v1::HandModel {
        side: side(model.side).into(),
        bases: fingers
            .iter()
            .flat_map(|f| [f.base.x, f.base.y, f.base.z])
            .collect(),
        base_rotations: fingers.iter().flat_map(rotation).collect(),
        lengths: fingers.iter().flat_map(|f| f.lengths).collect(),
        radii: fingers.iter().flat_map(|f| f.radii).collect(),
        prism_sides: model.prism_sides,
        point_radius: model.point_radius,
        palm_contacts: model.palm_contacts,
    }
}

/// The hand model of that message, validated.
///
/// # Errors
/// When a list has the wrong length or the hand cannot be.
pub fn hand_model_from(message: &v1::HandModel) -> Result<HandModel, Fault> {
    let bases = chunks::<3>(&message.bases, "bases", "15")?;
    let rotations = chunks::<4>(&message.base_rotations, "base_rotations", "20")?;
    let lengths = chunks::<LINKS_PER_FINGER>(&message.lengths, "lengths", "15")?;
    let radii = chunks::<LINKS_PER_FINGER>(&message.radii, "radii", "15")?;
    let mut orientations = [UnitQuaternion::identity(); N_FINGERS];
    for (orientation, rotation) in orientations.iter_mut().zip(rotations) {
        *orientation = rotation_from(rotation, "base_rotations")?;
    }
    let bones = |finger: usize| FingerBones {
        base: Point3::from(bases[finger]),
        orientation: orientations[finger],
        lengths: lengths[finger],
        radii: radii[finger],
    };
    let model = HandModel {
        side: side_from(message.side)?,
        skeleton: Skeleton {
            fingers: std::array::from_fn(bones),
        },
        prism_sides: message.prism_sides,
        point_radius: message.point_radius,
        palm_contacts: message.palm_contacts,
    };
    model.validate()?;
    Ok(model)
}

fn chunks<const N: usize>(
    numbers: &[f64],
    field: &'static str,
    expected: &'static str,
) -> Result<[[f64; N]; N_FINGERS], Fault> {
    if numbers.len() != N * N_FINGERS {
        return Err(Fault::Length {
            field,
            found: numbers.len(),
            expected,
        });
    }
    Ok(std::array::from_fn(|finger| {
        std::array::from_fn(|k| numbers[finger * N + k])
    }))
}

/// A valid sample as a message. `source_ns` is the source's own stamp in nanoseconds, 0 where it has none.
pub fn hand_sample(sample: &HandSample, source_ns: u64) -> v1::HandSample {
    let mut message = v1::HandSample {
        source_ns,
        wrist: Some(pose(&sample.wrist)),
        valid: true,
        ..v1::HandSample::default()
    };
    match &sample.fingers {
        FingerPose::Angles(angles) => message.angles = angles.to_list().to_vec(),
        FingerPose::Points(points) => {
            message.joints = points
                .iter()
                .flat_map(|p| p.map_or([f64::NAN; 3], |p| [p.x, p.y, p.z]))
                .collect();
        }
    }
    message
}

/// What a source has seen as a message: of a device its half alone, and no more than the stamp where the hand is lost.
pub fn hand_seen(seen: &Seen, source_ns: u64) -> v1::HandSample {
    let half = v1::HandSample {
        source_ns,
        valid: true,
        ..v1::HandSample::default()
    };
    match seen {
        Seen::Whole(Some(sample)) => hand_sample(sample, source_ns),
        Seen::Wrist(Some(wrist)) => v1::HandSample {
            wrist: Some(pose(wrist)),
            ..half
        },
        Seen::Fingers(Some(angles)) => v1::HandSample {
            angles: angles.to_list().to_vec(),
            ..half
        },
        Seen::Whole(None) | Seen::Wrist(None) | Seen::Fingers(None) => v1::HandSample {
            valid: false,
            ..half
        },
    }
}

/// The sample of that message; `None` when it says that the hand is lost.
///
/// A joint with a coordinate that is not a number is "not tracked". Infinite coordinates pass:
/// [`HandSample::is_finite`] finds them.
///
/// # Errors
/// When a list has the wrong length, or the wrist is missing or not finite.
pub fn hand_sample_from(message: &v1::HandSample) -> Result<Option<HandSample>, Fault> {
    if !message.valid {
        return Ok(None);
    }
    let fingers = match (message.joints.as_slice(), message.angles.as_slice()) {
        ([], []) => return Err(Fault::Missing("joints or angles")),
        (joints, []) => FingerPose::Points(points_from(joints)?),
        ([], angles) => FingerPose::Angles(angles_from(angles)?),
        _ => return Err(Fault::Both("joints", "angles")),
    };
    Ok(Some(HandSample {
        wrist: pose_from(message.wrist.as_ref(), "wrist")?,
        fingers,
    }))
}

fn points_from(numbers: &[f64]) -> Result<[Option<Point3<f64>>; N_JOINTS], Fault> {
    if numbers.len() != 3 * N_JOINTS {
        return Err(Fault::Length {
            field: "joints",
            found: numbers.len(),
            expected: "60",
        });
    }
    Ok(std::array::from_fn(|joint| {
        let point = Point3::new(
            numbers[3 * joint],
            numbers[3 * joint + 1],
            numbers[3 * joint + 2],
        );
        (!point.iter().any(|x| x.is_nan())).then_some(point)
    }))
}

fn angles_from(numbers: &[f64]) -> Result<JointAngles, Fault> {
    let list = numbers.try_into().map_err(|_not_so_long| Fault::Length {
        field: "angles",
        found: numbers.len(),
        expected: "21",
    })?;
    Ok(JointAngles::from_list(list))
}

/// A client's filter settings, checked; `None` is off.
///
/// # Errors
/// When a number is out of bounds.
pub fn one_euro_from(message: Option<&v1::OneEuro>) -> Result<Option<OneEuro>, Fault> {
    let Some(message) = message else {
        return Ok(None);
    };
    let derivative_cutoff_hz = match message.derivative_cutoff_hz {
        0.0 => DERIVATIVE_CUTOFF_HZ,
        cutoff => cutoff,
    };
    let filter = OneEuro {
        min_cutoff_hz: message.min_cutoff_hz,
        beta: message.beta,
        derivative_cutoff_hz,
    };
    filter
        .is_valid()
        .then_some(Some(filter))
        .ok_or_else(|| Fault::Unknown {
            field: "filter",
            value: format!("{filter:?}"),
            allowed: "cut-offs above 0 Hz and a beta of 0 or more",
        })
}

/// How a client's hand stands, as a message. `received_source_ns` is its own stamp of the newest sample received.
pub fn drive_state(
    now: &DriveNow,
    model: &HandModel,
    received_source_ns: u64,
) -> v1::DriveResponse {
    let layout = PartLayout::of(model);
    let contact = |touch: &HandTouch| v1::HandContact {
        object: touch.object.to_bits(),
        part: layout
            .place(touch.part)
            .map_or_else(String::new, |place| place.to_string()),
        point: Some(point(&touch.point)),
        normal: Some(vec3(&touch.normal)),
        force_n: None,
    };
    let state = v1::DriveState {
        applied_source_ns: now.applied_source_ns,
        applied_tick: now.applied_tick,
        dropped: now.n_dropped,
        superseded: now.n_superseded,
        contacts: now.touches.iter().map(contact).collect(),
        holds: plus_one(now.holds.map(|id| id.to_bits())),
        received_source_ns,
    };
    v1::DriveResponse {
        stamp: Some(now.stamp),
        kind: Some(v1::drive_response::Kind::State(state)),
    }
}
