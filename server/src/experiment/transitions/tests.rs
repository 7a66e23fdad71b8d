use super::*;

use ContactState::{Free, Grasped, PushedAtOne, PushedAtSeveral};

fn object(spans: &[(ContactState, f64)]) -> ObjectStates {
    let mut object = ObjectStates {
        name: "cube".to_owned(),
        spans: Vec::new(),
    };
    let mut from_s = 0.0;
    for (state, length_s) in spans {
        object.add(*state, from_s, from_s + length_s);
        from_s += length_s;
    }
    object
}

#[test]
fn equal_states_join_and_others_do_not() {
    let joined = object(&[(Free, 0.1), (Free, 0.1), (PushedAtOne, 0.1), (Free, 0.1)]);
    let states: Vec<ContactState> = joined.spans.iter().map(|span| span.state).collect();
    assert_eq!(states, [Free, PushedAtOne, Free]);
    assert!((joined.spans[0].until_s - 0.2).abs() < 1e-12);
    assert!((joined.time_in_s(Free) - 0.3).abs() < 1e-12);
}

#[test]
fn an_object_that_was_away_leaves_a_gap() {
    let mut object = object(&[(Free, 0.1)]);
    object.add(Free, 0.5, 0.6);
    assert_eq!(object.spans.len(), 2);
}

#[test]
fn pushing_is_counted_up_to_the_grasp_it_leads_to() {
    let check = |spans: &[(ContactState, f64)], expected: &[f64]| {
        let found = object(spans).pushes_before_grasps_s();
        assert_eq!(found.len(), expected.len(), "{found:?}");
        assert!(
            found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-12),
            "{found:?}"
        );
    };
    check(
        &[
            (Free, 1.0),
            (PushedAtOne, 0.05),
            (PushedAtSeveral, 0.10),
            (Grasped, 1.0),
        ],
        &[0.15],
    );
    check(
        &[
            (Free, 1.0),
            (PushedAtOne, 0.5),
            (Free, 1.0),
            (Grasped, 1.0),
            (Free, 1.0),
        ],
        &[0.0],
    );
    check(
        &[(Grasped, 1.0), (PushedAtOne, 0.1), (Grasped, 1.0)],
        &[0.0],
    );
    check(&[(PushedAtOne, 1.0)], &[]);
}

#[test]
fn the_picture_has_a_row_for_each_touched_object() {
    let touched = object(&[(Free, 1.0), (PushedAtOne, 0.1), (Grasped, 1.0), (Free, 0.4)]);
    let idle = ObjectStates {
        name: "idle <&>".to_owned(),
        ..object(&[(Free, 2.5)])
    };
    let transitions = Transitions {
        title: "a & b".to_owned(),
        duration_s: 2.5,
        objects: vec![touched, idle],
    };
    let svg = chart::draw(&transitions).unwrap();
    assert!(svg.contains("cube") && svg.contains("grasped") && svg.contains("push-n"));
    assert!(
        svg.contains("a &amp; b") && !svg.contains("idle"),
        "one object is never touched: it has no row"
    );
    assert!(svg.contains("1 more object is never touched"));
}
