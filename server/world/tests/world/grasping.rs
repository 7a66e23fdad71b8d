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
    hand_with(wrist.into(), &[(THUMB_TIP, (centre - half).into()), (INDEX_TIP, (centre + half).into())])
}

#[test]
fn a_fingertip_pushes_a_cube_by_exactly_its_way() {
    let mut world = World::new(scene(240.0, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])).unwrap();
    let script = (0..=40).map(|i| {
        let x = -0.045 + 0.001 * f64::from(i);
        hand_with([x - 0.1, 0.1, 0.1], &[(INDEX_TIP, [x, 0.025, 0.0])])
    });
    let events = run(&mut world, script);
    assert!(kinds(&events).contains(&"pushed"), "{events:?}");
    // The tip ends at x = -0.005, 20 mm behind where the face was.
    assert!((position(&world, 0).x - 0.02).abs() < 1e-9, "{}", position(&world, 0));
    assert!((position(&world, 0).y - 0.025).abs() < 1e-12);
}

#[test]
fn pinch_carry_and_open() {
    let mut world = World::new(scene(240.0, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])).unwrap();
    let at = |t: f64| Vector3::new(0.0, 0.025 + t, 0.0);
    let close = (0..30).map(|i| pinch(at(0.0), 0.07 - 0.001 * f64::from(i)));
    let lift = (0..100).map(|i| pinch(at(0.001 * f64::from(i)), 0.041));
    let events = run(&mut world, close.chain(lift));
    let grasped = events.iter().find(|(_, e)| e.kind.name() == "grasped").expect("grasped");
    let EventKind::Grasped { angle, .. } = grasped.1.kind else { unreachable!() };
    assert!((angle - std::f64::consts::PI).abs() < 1e-9);
    assert!((position(&world, 0).y - 0.124).abs() < 1e-9, "{}", position(&world, 0));
    let open = (0..30).map(|i| pinch(at(0.099), 0.041 + 0.001 * f64::from(i)));
    let mut later = Vec::new();
    for one in open {
        let frame = world.step(&crate::script::sample(one));
        later.extend(frame.events.iter().map(|e| (frame.tick, e.clone())));
    }
    later.extend(idle(&mut world, 200));
    let released = later.iter().find(|(_, e)| e.kind.name() == "released").expect("released");
    assert_eq!(released.1.kind, EventKind::Released { reason: ReleaseReason::ContactsGone });
    assert!((position(&world, 0).y - 0.025).abs() < 1e-9);
    assert_eq!(kinds(&later).last(), Some(&"hand_lost"));
}

#[test]
fn a_held_object_keeps_its_pose_in_the_wrists_space_at_any_speed() {
    let mut world = World::new(scene(60.0, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])).unwrap();
    run(&mut world, (0..30).map(|i| pinch(Vector3::new(0.0, 0.025, 0.0), 0.07 - 0.001 * f64::from(i))));
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
        assert!((now.translation.vector - start.translation.vector).norm() < 1e-12, "step {i}");
        assert!(now.rotation.angle_to(&start.rotation) < 1e-7, "step {i}");
    }
}

#[test]
fn a_hand_that_is_lost_holds_through_the_grace_time_and_then_lets_go() {
    let mut world = World::new(scene(240.0, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])).unwrap();
    let lift = (0..100).map(|i| pinch(Vector3::new(0.0, 0.025 + 0.001 * f64::from(i), 0.0), 0.041));
    run(
        &mut world,
        (0..30).map(|i| pinch(Vector3::new(0.0, 0.025, 0.0), 0.07 - 0.001 * f64::from(i))).chain(lift),
    );
    let held_at = position(&world, 0);
    // 0.25 s at 240 Hz are 60 steps.
    assert!(idle(&mut world, 60).is_empty());
    assert_eq!(position(&world, 0), held_at);
    let events = idle(&mut world, 1);
    let reasons: Vec<_> = events.iter().map(|(_, e)| e.kind.clone()).collect();
    assert!(reasons.contains(&EventKind::HandLost));
    assert!(reasons.contains(&EventKind::Released { reason: ReleaseReason::TrackingLost }), "{reasons:?}");
    idle(&mut world, 240);
    assert!((position(&world, 0).y - 0.025).abs() < 1e-9);
}

#[test]
fn a_throw_flies_by_the_closed_form_from_its_release() {
    for rate in [60.0, 240.0, 1000.0, 2000.0] {
        let dt = 1.0 / rate;
        let mut world = World::new(scene(rate, vec![object("a", cube(0.05), [0.0, 0.025, 0.0])])).unwrap();
        let n = (0.2 * rate) as u32;
        let close = (0..n).map(|i| pinch(Vector3::new(0.0, 0.025, 0.0), 0.07 - 0.03 * f64::from(i) / f64::from(n)));
        // Up and forward, accelerating to 3 m/s in 0.4 s; then open within one step at full speed.
        let m = (0.4 * rate) as u32;
        let at = |i: u32| {
            let t = f64::from(i) * dt;
            let s = 0.5 * 7.5 * t * t;
            Vector3::new(0.0, 0.025 + 0.6 * s, -0.8 * s)
        };
        let swing = (1..=m).map(|i| pinch(at(i), 0.041));
        run(&mut world, close.chain(swing));
        assert_eq!(world.objects().next().unwrap().1.contact, ContactState::Grasped, "{rate}");
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
            let exact = p0 + v * (k * dt) + Vector3::new(0.0, -9.81, 0.0) * (dt * dt * k * (k + 1.0) / 2.0);
            assert!((position(&world, 0) - exact).norm() < 1e-6, "{rate} Hz, step {k}");
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
    assert!((position(&world, 0).x - (tip + 0.0025)).abs() < 1e-9, "{}", position(&world, 0));
}
