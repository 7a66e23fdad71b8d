//! Hands on objects: push, grasp, carry, throw, losing track.

use nalgebra::{Isometry3, Vector3};
use tsukamu_world::World;
use tsukamu_world::frame::{EventKind, ReleaseReason};
use tsukamu_world::hand::sample::HandSample;
use tsukamu_world::state::ContactState;

use crate::script::{cube, hand_with, idle, kinds, object, position, run, scene};

const THUMB_TIP: usize = 3;
const INDEX_TIP: usize = 7;

/// A thumb tip and an index tip on both sides of x, `gap` apart, around a centre; the wrist behind.
fn pinch(centre: Vector3<f64>, gap: f64) -> HandSample {
    let half = Vector3::new(gap / 2.0, 0.0, 0.0);
    let wrist = centre + Vector3::new(0.0, 0.05, 0.15);
    hand_with(
        wrist.into(),
        &[
            (THUMB_TIP, (centre - half).into()),
            (INDEX_TIP, (centre + half).into()),
        ],
    )
}

#[test]
fn a_fingertip_pushes_a_cube_by_exactly_its_way() {
    let mut world = World::new(scene(
        240.0,
        vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
    ))
    .unwrap();
    let script = (0..=40).map(|i| {
        let x = -0.045 + 0.001 * f64::from(i);
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.025, 0.0])])
    });
    let events = run(&mut world, script);
    assert!(kinds(&events).contains(&"pushed"), "{events:?}");
    // The tip ends at x = -0.005, 20 mm behind where the face was.
    assert!(
        (position(&world, 0).x - 0.02).abs() < 1e-9,
        "{}",
        position(&world, 0)
    );
    assert!((position(&world, 0).y - 0.025).abs() < 1e-12);
}

#[test]
fn pinch_carry_and_open() {
    let mut world = World::new(scene(
        240.0,
        vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
    ))
    .unwrap();
    let at = |t: f64| Vector3::new(0.0, 0.025 + t, 0.0);
    let close = (0..30).map(|i| pinch(at(0.0), 0.07 - 0.001 * f64::from(i)));
    let lift = (0..100).map(|i| pinch(at(0.001 * f64::from(i)), 0.041));
    let events = run(&mut world, close.chain(lift));
    let grasped = events
        .iter()
        .find(|(_, e)| e.kind.name() == "grasped")
        .expect("grasped");
    let EventKind::Grasped { angle, .. } = grasped.1.kind else {
        unreachable!()
    };
    assert!((angle - std::f64::consts::PI).abs() < 1e-9);
    assert!(
        (position(&world, 0).y - 0.124).abs() < 1e-9,
        "{}",
        position(&world, 0)
    );
    let open = (0..30).map(|i| pinch(at(0.099), 0.041 + 0.001 * f64::from(i)));
    let mut later = Vec::new();
    for one in open {
        let frame = world.step(&crate::script::sample(one));
        later.extend(frame.events.iter().map(|e| (frame.tick, e.clone())));
    }
    later.extend(idle(&mut world, 200));
    let released = later
        .iter()
        .find(|(_, e)| e.kind.name() == "released")
        .expect("released");
    assert_eq!(
        released.1.kind,
        EventKind::Released {
            reason: ReleaseReason::ContactsGone
        }
    );
    assert!((position(&world, 0).y - 0.025).abs() < 1e-9);
    assert_eq!(kinds(&later).last(), Some(&"hand_lost"));
}

#[test]
fn a_held_object_keeps_its_pose_in_the_wrists_space_at_any_speed() {
    let mut world = World::new(scene(
        60.0,
        vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
    ))
    .unwrap();
    run(
        &mut world,
        (0..30).map(|i| pinch(Vector3::new(0.0, 0.025, 0.0), 0.07 - 0.001 * f64::from(i))),
    );
    let held = |world: &World| {
        let (_, body) = world.objects().next().unwrap();
        assert_eq!(body.contact, ContactState::Grasped);
        world.hands()[0].wrist().inv_mul(&body.pose)
    };
    let start = held(&world);
    for i in 0..60 {
        // 6 m/s, turning a rad/s.
        let motion = Isometry3::new(
            Vector3::new(0.1 * f64::from(i), 0.3, 0.0),
            Vector3::new(0.0, f64::from(i) / 60.0, 0.0),
        );
        let mut sample = pinch(Vector3::new(0.0, 0.025, 0.0), 0.041);
        sample.wrist = motion * sample.wrist;
        if let tsukamu_world::hand::sample::FingerPose::Points(points) = &mut sample.fingers {
            for point in points.iter_mut().flatten() {
                *point = motion * *point;
            }
        }
        world.step(&crate::script::sample(sample));
        let now = held(&world);
        assert!(
            (now.translation.vector - start.translation.vector).norm() < 1e-12,
            "step {i}"
        );
        assert!(now.rotation.angle_to(&start.rotation) < 1e-7, "step {i}");
    }
}

#[test]
fn a_hand_that_is_lost_holds_through_the_grace_time_and_then_lets_go() {
    let mut world = World::new(scene(
        240.0,
        vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
    ))
    .unwrap();
    let lift = (0..100).map(|i| pinch(Vector3::new(0.0, 0.025 + 0.001 * f64::from(i), 0.0), 0.041));
    run(
        &mut world,
        (0..30)
            .map(|i| pinch(Vector3::new(0.0, 0.025, 0.0), 0.07 - 0.001 * f64::from(i)))
            .chain(lift),
    );
    let held_at = position(&world, 0);
    // 0.25 s at 240 Hz are 60 steps.
    assert!(idle(&mut world, 60).is_empty());
    assert_eq!(position(&world, 0), held_at);
    let events = idle(&mut world, 1);
    let reasons: Vec<_> = events.iter().map(|(_, e)| e.kind.clone()).collect();
    assert!(reasons.contains(&EventKind::HandLost));
    assert!(
        reasons.contains(&EventKind::Released {
            reason: ReleaseReason::TrackingLost
        }),
        "{reasons:?}"
    );
    idle(&mut world, 240);
    assert!((position(&world, 0).y - 0.025).abs() < 1e-9);
}

#[test]
fn a_throw_flies_by_the_closed_form_from_its_release() {
    for rate in [60.0, 240.0, 1000.0, 2000.0] {
        let dt = 1.0 / rate;
        let mut world = World::new(scene(
            rate,
            vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
        ))
        .unwrap();
        let n = (0.2 * rate) as u32;
        let close = (0..n).map(|i| {
            pinch(
                Vector3::new(0.0, 0.025, 0.0),
                0.07 - 0.03 * f64::from(i) / f64::from(n),
            )
        });
        // Up and forward, accelerating to 3 m/s in 0.4 s; then open within one step at full speed.
        let m = (0.4 * rate) as u32;
        let at = |i: u32| {
            let t = f64::from(i) * dt;
            let s = 0.5 * 7.5 * t * t;
            Vector3::new(0.0, 0.025 + 0.6 * s, -0.8 * s)
        };
        let swing = (1..=m).map(|i| pinch(at(i), 0.041));
        run(&mut world, close.chain(swing));
        assert_eq!(
            world.objects().next().unwrap().1.contact,
            ContactState::Grasped,
            "{rate}"
        );
        let p0 = position(&world, 0);
        let v = world.objects().next().unwrap().1.displacement / dt;
        let mut k = 0.0;
        let mut open = 0.041;
        loop {
            open += 0.02;
            let frame = world.step(&crate::script::sample(pinch(at(m + 1 + k as u32), open)));
            k += 1.0;
            if frame.events.iter().any(|e| e.kind.name() == "landed") {
                break;
            }
            let exact =
                p0 + v * (k * dt) + Vector3::new(0.0, -9.81, 0.0) * (dt * dt * k * (k + 1.0) / 2.0);
            assert!(
                (position(&world, 0) - exact).norm() < 1e-6,
                "{rate} Hz, step {k}"
            );
            assert!(k < 10.0 * rate);
        }
        let on_floor = position(&world, 0);
        assert!(on_floor.z < -0.5, "{rate} Hz: {on_floor}");
    }
}

#[test]
fn a_fast_fingertip_does_not_tunnel_through_a_thin_plate() {
    use tsukamu_world::polyhedron::shapes;
    let plate = shapes::cuboid(&Vector3::new(0.005, 0.1, 0.1)).unwrap();
    let mut world = World::new(scene(60.0, vec![object("a", plate, [0.0, 0.05, 0.0])])).unwrap();
    // 10 m/s at 60 Hz: 167 mm a step, through a plate of 5 mm.
    let script = (0..3).map(|i| {
        let x = -0.2 + f64::from(i) * 10.0 / 60.0;
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.05, 0.0])])
    });
    run(&mut world, script);
    let tip = -0.2 + 2.0 * 10.0 / 60.0;
    assert!(
        (position(&world, 0).x - (tip + 0.0025)).abs() < 1e-9,
        "{}",
        position(&world, 0)
    );
}

/// A thumb and an index finger with all their joints, bent toward each other, tips `gap` apart.
fn whole_pinch(centre: Vector3<f64>, gap: f64) -> HandSample {
    let wrist = centre + Vector3::new(0.0, 0.10, 0.15);
    let mut joints = Vec::new();
    for (first, side) in [(0, -1.0), (4, 1.0)] {
        let tip = centre + Vector3::new(side * gap / 2.0, 0.0, 0.0);
        let chain = [
            tip + Vector3::new(side * 0.035, 0.055, 0.045),
            tip + Vector3::new(side * 0.034, 0.040, 0.022),
            tip + Vector3::new(side * 0.014, 0.018, 0.005),
            tip,
        ];
        joints.extend((first..).zip(chain.map(Into::into)));
    }
    hand_with(wrist.into(), &joints)
}

#[test]
fn a_shown_finger_never_goes_more_than_a_millimetre_into_what_it_holds() {
    use tsukamu_world::query::point::signed_distance;
    let mut world = World::new(scene(
        240.0,
        vec![object("a", cube(0.05), [0.0, 0.025, 0.0])],
    ))
    .unwrap();
    let close = (0..60).map(|i| {
        whole_pinch(
            Vector3::new(0.0, 0.03, 0.0),
            0.07 - 0.001 * f64::from(i.min(34)),
        )
    });
    run(&mut world, close);
    let mut deepest_tracked = 0.0_f64;
    for i in 0..120 {
        let centre = Vector3::new(0.0, 0.03 + 0.001 * f64::from(i), 0.0);
        // The grip tightens and loosens while it carries.
        let gap = 0.036 + 0.006 * f64::from(i % 20) / 20.0;
        world.step(&crate::script::sample(whole_pinch(centre, gap)));
        let (_, body) = world.objects().next().unwrap();
        assert_eq!(body.contact, ContactState::Grasped, "step {i}");
        let depth = |p: &nalgebra::Point3<f64>| {
            -signed_distance(&body.spec.shape, &body.pose.inverse_transform_point(p)).distance
        };
        let hand = &world.frame().hands[0];
        for (shown, tracked) in hand
            .shown
            .iter()
            .flatten()
            .zip(hand.tracked.iter().flatten())
        {
            assert!(
                depth(shown) < 1e-3,
                "step {i}: {} mm deep",
                depth(shown) * 1e3
            );
            deepest_tracked = deepest_tracked.max(depth(tracked));
        }
    }
    assert!(
        deepest_tracked > 5e-3,
        "the tracked tips must be inside for this to say anything: {deepest_tracked}"
    );
}

#[test]
fn a_shown_finger_does_not_go_through_a_thin_plate_that_the_others_hold() {
    use tsukamu_world::polyhedron::shapes;
    use tsukamu_world::query::segment_depth::max_depth_above;
    let plate = shapes::cuboid(&Vector3::new(0.004, 0.1, 0.1)).unwrap();
    let mut world = World::new(scene(240.0, vec![object("a", plate, [0.0, 0.05, 0.0])])).unwrap();
    // The middle finger bends from in front of the plate to behind it; none of its joints ends inside.
    let hand = |bend: f64, gap: f64| {
        let mut hand = whole_pinch(Vector3::new(0.0, 0.05, 0.0), gap);
        if let tsukamu_world::hand::sample::FingerPose::Points(points) = &mut hand.fingers {
            for (step, x) in [0.06, 0.04, 0.03 - bend, 0.02 - 2.0 * bend]
                .into_iter()
                .enumerate()
            {
                let away = 0.012 * step as f64;
                points[8 + step] = Some([x, 0.09 - away, 0.04 - away].into());
            }
        }
        hand
    };
    let close = (0..60).map(|i| hand(0.0, 0.03 - 0.0005 * f64::from(i.min(55))));
    let bend = (0..60).map(|i| hand(0.0004 * f64::from(i), 0.002));
    run(&mut world, close.chain(bend));
    let (_, body) = world.objects().next().unwrap();
    assert_eq!(body.contact, ContactState::Grasped);
    let frame = &world.frame().hands[0];
    let depth = |joints: &[Option<nalgebra::Point3<f64>>]| {
        let places: Vec<_> = joints[8..12]
            .iter()
            .flatten()
            .map(|p| body.pose.inverse_transform_point(p))
            .collect();
        let links = places.windows(2);
        links
            .map(|ends| max_depth_above(&body.spec.shape, &ends[0], &ends[1], 0.0))
            .fold(0.0, f64::max)
    };
    assert!(depth(&frame.tracked) > 1.5e-3, "{}", depth(&frame.tracked));
    assert!(depth(&frame.shown) < 1e-3, "{}", depth(&frame.shown));
}
