use tsukamu_proto::v1;

use super::*;

/// A frame in which each object is at (x, 0, 0) in the given state byte, held by the given hand id + 1.
fn frame(
    epoch: u64,
    tick: u64,
    keyframe_tick: u64,
    objects: &[(u64, f64, u8, u32)],
    removed: &[u64],
) -> Frame {
    Frame {
        stamp: Some(v1::Stamp {
            epoch,
            tick,
            world_time_s: tick as f64 / 100.0,
            wall_ns: 1_000 * tick,
        }),
        keyframe_tick,
        object_ids: objects.iter().map(|object| object.0).collect(),
        positions: objects
            .iter()
            .flat_map(|object| [object.1, 0.0, 0.0])
            .collect(),
        rotations: objects.iter().flat_map(|_| [0.0, 0.0, 0.0, 1.0]).collect(),
        states: objects.iter().map(|object| object.2).collect(),
        holders: objects.iter().map(|object| object.3).collect(),
        removed_ids: removed.to_vec(),
        scene_version: 3,
        hands: Vec::new(),
    }
}

/// What is shown: `tick: id@x …`, with `r` for resting, `g` for grasped and the holder's id.
fn shown(fold: &FrameFold) -> String {
    let Some(view) = fold.view() else {
        return "nothing".into();
    };
    let mut text = format!("{}:", view.stamp.tick);
    for (id, object) in &view.objects {
        text += &format!(" {id}@{}", object.pose.translation.x);
        text += if object.resting { "r" } else { "" };
        text += if object.state == ContactState::Grasped {
            "g"
        } else {
            ""
        };
        text += &object
            .holder
            .map(|hand| format!("h{hand}"))
            .unwrap_or_default();
    }
    text
}

fn check(frames: &[Frame], expected: &str) {
    let mut fold = FrameFold::default();
    for frame in frames {
        let _ = fold.apply(frame);
    }
    assert_eq!(shown(&fold), expected);
}

fn keyframe() -> Frame {
    frame(
        1,
        10,
        10,
        &[(1, 0.1, 9, 0), (2, 0.2, 1, 0), (3, 0.3, 1, 0)],
        &[],
    )
}

#[test]
fn deltas_are_cumulative_against_the_keyframe() {
    check(&[], "nothing");
    check(&[keyframe()], "10: 1@0.1r 2@0.2 3@0.3");
    let first = frame(1, 11, 10, &[(2, 0.5, 4, 1)], &[]);
    let second = frame(1, 12, 10, &[(2, 0.6, 4, 1), (3, 0.4, 1, 0)], &[]);
    let third = frame(1, 13, 10, &[(3, 0.7, 1, 0)], &[]);
    check(&[keyframe(), first.clone()], "11: 1@0.1r 2@0.5gh0 3@0.3");
    check(
        &[keyframe(), first.clone(), second.clone()],
        "12: 1@0.1r 2@0.6gh0 3@0.4",
    );
    // Lost in between: the same end.
    check(&[keyframe(), second.clone()], "12: 1@0.1r 2@0.6gh0 3@0.4");
    // An object that a delta does not name stands as in the keyframe, whatever an earlier delta said.
    check(
        &[keyframe(), first, second, third],
        "13: 1@0.1r 2@0.2 3@0.7",
    );
}

#[test]
fn objects_come_and_go() {
    let removed = frame(1, 11, 10, &[], &[2]);
    let added = frame(1, 12, 10, &[(9, 0.9, 1, 0)], &[2]);
    let back = frame(1, 13, 10, &[], &[]);
    check(&[keyframe(), removed.clone()], "11: 1@0.1r 3@0.3");
    check(
        &[keyframe(), removed.clone(), added.clone()],
        "12: 1@0.1r 3@0.3 9@0.9",
    );
    check(&[keyframe(), added.clone()], "12: 1@0.1r 3@0.3 9@0.9");
    check(
        &[keyframe(), removed, added, back],
        "13: 1@0.1r 2@0.2 3@0.3",
    );
}

#[test]
fn what_cannot_be_applied_leaves_the_view_alone() {
    let mut fold = FrameFold::default();
    let early = frame(1, 5, 4, &[], &[]);
    assert_eq!(
        fold.apply(&early),
        Err(FrameFault::MissingKeyframe { wanted: 4 })
    );
    assert_eq!(fold.apply(&keyframe()), Ok(Applied::Keyframe));
    assert_eq!(
        fold.apply(&frame(1, 12, 10, &[(1, 0.9, 1, 0)], &[])),
        Ok(Applied::Delta)
    );
    let before = shown(&fold);
    let stale = frame(1, 11, 10, &[(1, 0.5, 1, 0)], &[]);
    assert_eq!(
        fold.apply(&stale),
        Err(FrameFault::Stale {
            tick: 11,
            shown: 12
        })
    );
    let other_epoch = frame(2, 13, 10, &[], &[]);
    assert_eq!(
        fold.apply(&other_epoch),
        Err(FrameFault::MissingKeyframe { wanted: 10 })
    );
    let mut short = frame(1, 13, 10, &[(1, 0.5, 1, 0)], &[]);
    short.rotations.pop();
    assert_eq!(
        fold.apply(&short),
        Err(FrameFault::Length {
            array: "rotations",
            expected: 4,
            found: 3
        })
    );
    let nan = frame(1, 13, 10, &[(1, f64::NAN, 1, 0)], &[]);
    assert_eq!(
        fold.apply(&nan),
        Err(FrameFault::Pose {
            of: "object 1".into()
        })
    );
    let mut no_rotation = frame(1, 13, 10, &[(1, 0.5, 1, 0)], &[]);
    no_rotation.rotations = vec![0.0; 4];
    assert_eq!(
        fold.apply(&no_rotation),
        Err(FrameFault::Pose {
            of: "object 1".into()
        })
    );
    let mut no_stamp = keyframe();
    no_stamp.stamp = None;
    assert_eq!(fold.apply(&no_stamp), Err(FrameFault::NoStamp));
    assert_eq!(shown(&fold), before);
}

#[test]
fn a_keyframe_of_a_new_epoch_replaces_everything() {
    let next = frame(2, 0, 0, &[(7, 0.0, 1, 0)], &[]);
    check(&[keyframe(), next], "0: 7@0");
}

#[test]
fn hands_are_read() {
    let mut tracked = vec![f32::NAN; 60];
    tracked[57..].copy_from_slice(&[0.5, 1.5, -2.5]);
    let hand = HandFrame {
        id: 4,
        side: Side::Left.into(),
        tracking: Tracking::Held.into(),
        wrist: None,
        tracked,
        shown: Vec::new(),
        holds: 3,
        sample_age_s: 0.25,
    };
    let mut whole = keyframe();
    whole.hands = vec![hand.clone()];
    let mut fold = FrameFold::default();
    fold.apply(&whole).unwrap();
    let view = &fold.view().unwrap().hands[0];
    assert_eq!(
        (view.id, view.side, view.tracking),
        (4, Side::Left, Tracking::Held)
    );
    assert_eq!((view.holds, view.sample_age_s), (Some(2), 0.25));
    assert_eq!(view.tracked[18], None);
    assert_eq!(view.tracked[19], Some(Point3::new(0.5, 1.5, -2.5)));
    assert_eq!(view.shown, [None; N_JOINTS]);

    whole.hands[0].shown = vec![0.0; 59];
    let fault = FrameFault::Length {
        array: "shown joints",
        expected: 60,
        found: 59,
    };
    assert_eq!(FrameFold::default().apply(&whole), Err(fault));
}
