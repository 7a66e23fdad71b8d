//! The frame lane.

use std::time::{SystemTime, UNIX_EPOCH};

use nalgebra::Vector3;
use tsukamu_server::settings::Mode;

use super::support::{config, control, cubes, daemon, next_frame, soon, step, tick, watch, world};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_frame_leaves_when_it_is_made() {
    // tonic has been reported to hand out messages of a stream in batches: then every other frame would come a whole
    // step late. At 20 steps per second there is time to see it, however busy the machine is.
    let daemon = daemon(cubes(3, 20.0), Mode::Realtime).await;
    let mut frames = watch(&mut world(&daemon).await, 0.0).await;
    let mut n_skipped = 0;
    let mut arrivals = Vec::new();
    for _ in 0..21 {
        let frame = next_frame(&mut frames, &mut n_skipped).await;
        let now = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .expect("after 1970")
            .as_nanos() as u64;
        arrivals.push((frame.stamp.expect("a stamp"), now));
    }
    let in_time = arrivals
        .windows(2)
        .filter(|pair| pair[0].1 < pair[1].0.wall_ns)
        .count();
    assert!(
        in_time >= 18,
        "{in_time} of 20 frames came before the next step: {arrivals:?}"
    );
    let consecutive = arrivals
        .windows(2)
        .filter(|pair| pair[0].0.tick + 1 == pair[1].0.tick)
        .count();
    assert!(consecutive >= 18, "{consecutive} of 20 frames in a row");
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_joiner_gets_a_whole_frame_and_then_what_changed() {
    let daemon = daemon(cubes(3, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    step(&mut control, 100).await;
    let mut world = world(&daemon).await;
    let mut frames = watch(&mut world, 0.0).await;
    let mut n_skipped = 0;
    let first = next_frame(&mut frames, &mut n_skipped).await;
    assert_eq!(
        (tick(first.stamp), first.keyframe_tick),
        (100, 100),
        "a keyframe of now, though nothing steps"
    );
    assert_eq!(first.object_ids, [0, 1, 2, 3]);
    assert_eq!((first.positions.len(), first.rotations.len()), (12, 16));
    assert_eq!(first.states[0] & 8, 8, "the cube on the floor rests");
    for wanted in 101..110 {
        step(&mut control, 1).await;
        let frame = next_frame(&mut frames, &mut n_skipped).await;
        assert_eq!((tick(frame.stamp), frame.keyframe_tick), (wanted, 100));
        assert_eq!(
            frame.object_ids,
            [1, 2, 3],
            "the resting cube costs nothing"
        );
        let fall = -0.5 * 9.81 * (wanted * (wanted + 1)) as f64 / (240.0 * 240.0);
        assert!(
            (frame.positions[1] - 1000.0 - fall).abs() < 1e-6,
            "tick {wanted}: {}",
            frame.positions[1]
        );
        assert!((frame.stamp.expect("a stamp").world_time_s - wanted as f64 / 240.0).abs() < 1e-12);
    }
    assert_eq!(n_skipped, 0);
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn deltas_are_cumulative_and_keyframes_come_again() {
    let mut scene = cubes(1, 240.0);
    // The second cube comes to rest on the floor within the run.
    scene.objects[1].pose.translation.vector = Vector3::new(0.0, 0.03, 0.0);
    let mut config = config(scene, Mode::Lockstep);
    config.publish.keyframe_interval_s = 0.2;
    let daemon = tsukamu_server::daemon::start(config)
        .await
        .expect("it starts");
    let (mut control, mut world) = (control(&daemon).await, world(&daemon).await);
    let mut frames = watch(&mut world, 0.0).await;
    let mut n_skipped = 0;
    let first = next_frame(&mut frames, &mut n_skipped).await;
    assert_eq!(first.object_ids, [0, 1]);
    let mut was_in_delta_at_rest = false;
    // Keyframes come by the clock; steps until the second one.
    for _ in 0..1_000_000 {
        step(&mut control, 1).await;
        let frame = next_frame(&mut frames, &mut n_skipped).await;
        if frame.keyframe_tick != first.keyframe_tick {
            assert_eq!(
                frame.keyframe_tick,
                tick(frame.stamp),
                "a new keyframe comes before its deltas"
            );
            assert_eq!(frame.object_ids, [0, 1], "and is whole");
            break;
        }
        let place = frame.object_ids.iter().position(|id| *id == 1);
        was_in_delta_at_rest |= place.is_some_and(|place| frame.states[place] & 8 != 0);
    }
    assert!(
        was_in_delta_at_rest,
        "an object that has come to rest stays in the deltas until the next keyframe"
    );
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_subscriber_that_stops_reading_costs_the_others_nothing() {
    let daemon = daemon(cubes(300, 240.0), Mode::Lockstep).await;
    let mut control = control(&daemon).await;
    let (mut idle_world, mut busy_world) = (world(&daemon).await, world(&daemon).await);
    let mut idle = watch(&mut idle_world, 0.0).await;
    let mut busy = watch(&mut busy_world, 0.0).await;
    let (mut idle_skipped, mut busy_skipped) = (0, 0);
    next_frame(&mut idle, &mut idle_skipped).await;
    next_frame(&mut busy, &mut busy_skipped).await;
    // 300 cubes are 13 kB a frame: 6 MB, far beyond what windows and sockets hold.
    let n_steps = 500;
    for wanted in 1..=n_steps {
        step(&mut control, 1).await;
        let frame = next_frame(&mut busy, &mut busy_skipped).await;
        assert_eq!(tick(frame.stamp), wanted, "each step's frame comes");
    }
    assert_eq!(busy_skipped, 0);
    let mut last = 0;
    while last < n_steps {
        last = tick(next_frame(&mut idle, &mut idle_skipped).await.stamp);
    }
    assert!(
        idle_skipped > 100,
        "it was told of {idle_skipped} skipped frames"
    );
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_subscriber_chooses_its_rate() {
    let daemon = daemon(cubes(1, 1000.0), Mode::Realtime).await;
    let mut world = world(&daemon).await;
    let mut frames = watch(&mut world, 50.0).await;
    let mut n_skipped = 0;
    let mut times = Vec::new();
    for _ in 0..26 {
        times.push(
            next_frame(&mut frames, &mut n_skipped)
                .await
                .stamp
                .expect("a stamp")
                .wall_ns,
        );
    }
    // A late task may only make it slower, a keyframe comes with a delta now and then.
    let seconds = (times[25] - times[0]) as f64 * 1e-9;
    assert!(seconds > 0.4, "25 intervals of 20 ms took {seconds} s");
    for bad in [-1.0, f64::NAN, 1e-9] {
        let request = tsukamu_proto::v1::WatchFramesRequest { max_rate_hz: bad };
        let refused = soon(world.watch_frames(request))
            .await
            .expect_err("no rate");
        assert_eq!(refused.code(), tonic::Code::InvalidArgument, "{refused}");
    }
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn streams_end_cleanly_when_the_daemon_stops() {
    let daemon = daemon(cubes(3, 240.0), Mode::Realtime).await;
    let mut client = world(&daemon).await;
    let mut frames = watch(&mut client, 0.0).await;
    let request = tsukamu_proto::v1::WatchEventsRequest { from_sequence: 1 };
    let mut events = soon(client.watch_events(request))
        .await
        .expect("a stream")
        .into_inner();
    next_frame(&mut frames, &mut 0).await;
    soon(daemon.shutdown()).await.expect("a clean end");
    while soon(frames.message()).await.expect("no error").is_some() {}
    while soon(events.message()).await.expect("no error").is_some() {}
}
