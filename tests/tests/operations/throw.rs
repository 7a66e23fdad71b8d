//! Operation 4, grasp and throw (Fig. 10), and experiment 2, the target game.

use nalgebra::{Point3, Vector3};
use tsukamu_world::frame::EventKind;

use crate::drive::{RATES_HZ, Run, for_all, run};

const GRAVITY: f64 = 9.81;

/// The last tick in the hand, the position and the velocity there, the tick of landing.
struct Flight {
    start: u64,
    from: Point3<f64>,
    velocity: Vector3<f64>,
    landed: u64,
}

fn flight(run: &Run, what: &str) -> Flight {
    let thrown = run.events_of(0, "thrown");
    assert_eq!(thrown.len(), 1, "{what}");
    let EventKind::Thrown { velocity } = thrown[0].1 else {
        unreachable!()
    };
    let start = thrown[0].0 - 1;
    let landed = run
        .events_of(0, "landed")
        .into_iter()
        .map(|(tick, _)| tick)
        .find(|tick| *tick > start);
    let from = run.position(start, 0);
    let seen = (from - run.position(start - 1, 0)) * run.rate_hz;
    assert!(
        (seen - velocity).norm() < 1e-9,
        "{what}: thrown at {velocity}, moved at {seen}"
    );
    Flight {
        start,
        from,
        velocity,
        landed: landed.unwrap_or_else(|| panic!("{what}: never landed")),
    }
}

/// Equation (3) summed up: P₀ + k v Δt + g Δt² k(k+1)/2, k steps after the release; k need not be whole.
fn closed_form(flight: &Flight, rate_hz: f64, k: f64) -> Point3<f64> {
    let dt = 1.0 / rate_hz;
    flight.from + flight.velocity * (k * dt)
        - Vector3::y() * (GRAVITY * dt * dt * k * (k + 1.0) / 2.0)
}

#[test]
fn a_cube_is_thrown_flies_by_the_closed_form_and_comes_to_rest() {
    for_all("operations/grasp-throw", "grasp-throw", 0.0, check_throw);
}

fn check_throw(run: &Run, what: &str) {
    let flight = flight(run, what);
    let speed = flight.velocity.norm();
    assert!(
        (1.5..3.0).contains(&speed) && flight.velocity.y > 0.5 && flight.velocity.z < -1.0,
        "{what}: {speed} m/s"
    );
    for tick in flight.start..flight.landed {
        let exact = closed_form(&flight, run.rate_hz, (tick - flight.start) as f64);
        let off = (run.position(tick, 0) - exact).norm();
        assert!(
            off < 1e-6,
            "{what}, tick {tick}: off the closed form by {off} m"
        );
    }
    assert!(
        flight.landed - flight.start > (0.3 * run.rate_hz) as u64,
        "{what}"
    );
    assert!(
        run.last(0).resting && run.vertices_on_floor(0) == 4,
        "{what}"
    );
    assert!(run.last(0).pose.translation.z < -0.9, "{what}");
}

/// Where the closed form comes down to the height at which the cube touched the floor, between two steps.
fn landing(run: &Run, what: &str) -> Vector3<f64> {
    let flight = flight(run, what);
    let height = run.position(flight.landed, 0).y;
    let mut k = [
        (flight.landed - flight.start - 1) as f64,
        (flight.landed - flight.start) as f64,
    ];
    for _ in 0..50 {
        let middle = 0.5 * (k[0] + k[1]);
        let above = closed_form(&flight, run.rate_hz, middle).y > height;
        k[usize::from(!above)] = middle;
    }
    closed_form(&flight, run.rate_hz, k[0]).coords
}

#[test]
fn landing_points_converge_with_the_step_length() {
    for seed in [1, 2, 3] {
        let points = RATES_HZ.map(|rate| {
            let what = format!("seed {seed} at {rate} Hz");
            landing(
                &run(
                    "operations/grasp-throw",
                    &format!("grasp-throw?seed={seed}"),
                    rate,
                    0.0,
                ),
                &what,
            )
        });
        let limit = landing(
            &run(
                "operations/grasp-throw",
                &format!("grasp-throw?seed={seed}"),
                4000.0,
                0.0,
            ),
            "limit",
        );
        // The closed form lies g Δt t/2 below the parabola, and the release comes up to a step late on a straight line:
        // both are of first order, and together below 4.5 m/s times Δt at this speed.
        let off = points.map(|point| (point - limit).norm());
        for (off, rate) in off.iter().zip(RATES_HZ) {
            assert!(*off < 4.5 / rate, "seed {seed}: {off} m off at {rate} Hz");
        }
        assert!(
            off[0] > off[1] && off[1] > off[2] && off[2] > off[3],
            "seed {seed}: {off:?}"
        );
    }
}

#[test]
fn a_block_is_thrown_through_the_target() {
    for_all("target-game", "target-game", 0.0, check_target);
}

fn check_target(run: &Run, what: &str) {
    let hits = run.events_of(0, "hit_target");
    assert_eq!(hits.len(), 1, "{what}");
    let EventKind::HitTarget { distance, .. } = hits[0].1 else {
        unreachable!()
    };
    assert!(distance < 0.15, "{what}: {distance}");
    let from = run.position(flight(run, what).start, 0);
    assert!(
        (from.z - run.scene.targets[0].centre.z).abs() > 1.3,
        "{what}: thrown from {from}"
    );
    assert!(run.last(0).resting, "{what}");
}
