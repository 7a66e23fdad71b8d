use nalgebra::{Translation3, UnitQuaternion};
use proptest::prelude::{any, proptest};
use proptest::{collection, prop_assert};

use super::*;

const MS: u64 = 1_000_000;
/// When the tests begin: stamps minus delays are times too.
const START_NS: u64 = 1_000 * MS;

fn wrist_at(x: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::identity())
}

fn wrist(x: f64) -> Seen {
    Seen::Wrist(Some(wrist_at(x)))
}

fn fingers(palm_arch: f64) -> Seen {
    Seen::Fingers(Some(JointAngles {
        palm_arch,
        ..JointAngles::default()
    }))
}

fn on_arrival(arrival_ns: u64) -> Times {
    Times {
        arrival_ns,
        fitted_ns: arrival_ns,
    }
}

/// Where a hand's wrist is, in metres, and how far its palm is arched, in radians.
fn shown(sample: &HandSample) -> (f64, f64) {
    let FingerPose::Angles(angles) = &sample.fingers else {
        panic!("a glove gives angles")
    };
    (sample.wrist.translation.x, angles.palm_arch)
}

/// One device: what it says of a time, how often, and how late.
struct Device {
    see: fn(f64) -> Seen,
    interval_ns: u64,
    delay_ns: u64,
    /// Up to how much later still.
    jitter_ns: u64,
}

impl Device {
    fn new(see: fn(f64) -> Seen, interval_ns: u64) -> Self {
        let (delay_ns, jitter_ns) = (0, 0);
        Self {
            see,
            interval_ns,
            delay_ns,
            jitter_ns,
        }
    }

    /// Everything it says in a time, by arrival: it measures seconds since the start.
    fn says(&self, duration_s: f64) -> Vec<(u64, Seen)> {
        let n = (duration_s * 1.0e9) as u64 / self.interval_ns;
        let one = |k: u64| {
            let taken_ns = k * self.interval_ns;
            let late_ns = self.delay_ns + (k * 7_919_317) % self.jitter_ns.max(1);
            let seen = (self.see)(taken_ns as f64 * 1.0e-9);
            (START_NS + taken_ns + late_ns, seen)
        };
        (0..n).map(one).collect()
    }
}

/// What the hand of a fusion shows at each of the steps of a time, with the steps' own times in seconds since the start.
fn played(
    fusion: &mut Fusion,
    mut said: Vec<(u64, Seen)>,
    step_ns: u64,
) -> Vec<(f64, Option<(f64, f64)>)> {
    said.sort_by_key(|(arrival_ns, _)| *arrival_ns);
    let end_ns = said.last().map_or(0, |(arrival_ns, _)| *arrival_ns);
    let (mut next, mut seen) = (said.into_iter().peekable(), Vec::new());
    for now_ns in (START_NS..end_ns).step_by(step_ns as usize) {
        while let Some((arrival_ns, what)) = next.next_if(|(arrival_ns, _)| *arrival_ns <= now_ns) {
            fusion.push(on_arrival(arrival_ns), &what);
        }
        let time_s = (now_ns - START_NS) as f64 * 1.0e-9;
        seen.push((time_s, fusion.at(now_ns).as_ref().map(shown)));
    }
    seen
}

/// A fusion whose streams have these delays and may be predicted so far, in seconds: first the tracker's, then the glove's.
fn fusion(delay_s: [f64; 2], predict_s: [f64; 2]) -> Fusion {
    let stream = |k: usize| StreamSettings {
        delay_s: delay_s[k],
        filter: None,
        predict_s: predict_s[k],
    };
    Fusion::new(FusionSettings {
        between: Between::Interpolate,
        wrist: stream(0),
        fingers: stream(1),
    })
}

/// A tracker at 120 Hz and a glove at 100 Hz that measure the time itself: 1 m/s and 1 rad/s.
fn devices() -> [Device; 2] {
    [
        Device::new(wrist, 8_333_333),
        Device::new(fingers, 10_000_000),
    ]
}

fn said(devices: &[Device; 2], duration_s: f64) -> Vec<(u64, Seen)> {
    devices
        .iter()
        .flat_map(|device| device.says(duration_s))
        .collect()
}

/// Each device up to 1 ms early or late: seen at 240 Hz, no step is much shorter or longer than the others.
#[test]
fn an_even_motion_is_even_in_every_step() {
    let devices = devices().map(|device| Device {
        jitter_ns: 2 * MS,
        ..device
    });
    let seen = played(
        &mut fusion([0.0; 2], [0.0; 2]),
        said(&devices, 2.0),
        4_166_667,
    );
    let seen: Vec<_> = seen
        .iter()
        .skip(60)
        .map(|(_, hand)| hand.expect("seen"))
        .collect();
    assert!(seen.len() > 300);
    for pair in seen.windows(2) {
        let (speed, bend) = (
            (pair[1].0 - pair[0].0) * 240.0,
            (pair[1].1 - pair[0].1) * 240.0,
        );
        assert!(
            (speed - 1.0).abs() < 0.4 && (bend - 1.0).abs() < 0.4,
            "{speed} m/s, {bend} rad/s"
        );
    }
}

/// A glove over Bluetooth that is 60 ms late, beside a tracker that is 5 ms late: with both delays known, wrist and fingers
/// are of one time, and the reported lag is the hand's.
#[test]
fn streams_of_different_delays_are_joined_by_time() {
    let devices = devices().map(|device| Device {
        delay_ns: if device.interval_ns == 10 * MS {
            60 * MS
        } else {
            5 * MS
        },
        ..device
    });
    let mut known = fusion([0.005, 0.06], [0.0; 2]);
    let hands = played(&mut known, said(&devices, 3.0), 4 * MS);
    for (time_s, hand) in &hands[500..] {
        let (x, arch) = hand.expect("seen");
        assert!((x - arch).abs() < 1e-6, "{time_s} s: {x} m, {arch} rad");
    }
    let (time_s, hand) = hands[hands.len() - 1];
    let behind_s = time_s - hand.expect("seen").0;
    let reports = known.reports(START_NS + (time_s * 1.0e9) as u64);
    for report in reports {
        let told_s = report.lag_s + report.delay_s;
        assert!(
            (told_s - behind_s).abs() < 1e-6,
            "{behind_s} s, told {told_s} s"
        );
    }
    assert!((0.06..0.075).contains(&behind_s), "{behind_s} s");

    let mut unknown = fusion([0.0; 2], [0.0; 2]);
    let (_, hand) = played(&mut unknown, said(&devices, 3.0), 4 * MS)[500];
    let (x, arch) = hand.expect("seen");
    assert!(
        (x - arch - 0.055).abs() < 1e-6,
        "nobody told it: {x} m, {arch} rad"
    );
}

#[test]
fn the_hand_s_time_never_runs_back() {
    // The slow glove comes late, and makes the hand wait.
    let slow = Device {
        delay_ns: 80 * MS,
        jitter_ns: 20 * MS,
        ..Device::new(fingers, 50 * MS)
    };
    let mut said = devices()[0].says(4.0);
    said.extend(slow.says(4.0).split_off(20));
    let seen = played(&mut fusion([0.0, 0.08], [0.0; 2]), said, MS);
    let seen: Vec<_> = seen.iter().filter_map(|(_, hand)| *hand).collect();
    assert!(seen.len() > 2000);
    for pair in seen.windows(2) {
        assert!(pair[0].0 <= pair[1].0 && pair[0].1 <= pair[1].1, "{pair:?}");
    }
}

/// Sources that speak seldom, or again after a silence: every sample is seen, at whatever time the step comes after it.
#[test]
fn samples_far_apart_are_each_seen() {
    let mut hand = fusion([0.0; 2], [0.0; 2]);
    for k in 0..5_u64 {
        let (arrival_ns, value) = (START_NS + k * 200 * MS, k as f64);
        hand.push(on_arrival(arrival_ns), &wrist(value));
        hand.push(on_arrival(arrival_ns), &fingers(value));
        let found = hand.at(arrival_ns + 3 * MS).as_ref().map(shown);
        assert_eq!(found, Some((value, value)), "jumped to");
        assert_eq!(hand.at(arrival_ns + 101 * MS), None, "and then it is late");
    }
}

#[test]
fn a_half_that_is_blind_leaves_no_hand_and_nothing_is_predicted_through_it() {
    let mut hand = fusion([0.0; 2], [0.05; 2]);
    played(&mut hand, said(&devices(), 1.0), MS);
    let now_ns = START_NS + 1_000 * MS;
    assert!(hand.at(now_ns).is_some());
    hand.push(on_arrival(now_ns), &Seen::Wrist(None));
    assert_eq!(hand.at(now_ns), None, "the tracker sees nothing");
    hand.push(on_arrival(now_ns + 8 * MS), &wrist(7.0));
    let (x, _) = hand
        .at(now_ns + 8 * MS)
        .as_ref()
        .map(shown)
        .expect("seen again");
    assert_eq!(x, 7.0, "as if it had not moved before");
}

#[test]
fn a_stream_that_pauses_stands_until_it_is_silent_too_long() {
    for is_wrist in [true, false] {
        let mut hand = fusion([0.0; 2], [0.0; 2]);
        played(&mut hand, said(&devices(), 1.0), MS);
        let mut last = None;
        for k in 0..40_u64 {
            let now_ns = START_NS + 1_000 * MS + k * 10 * MS;
            let value = 1.0 + k as f64 * 0.01;
            let seen = if is_wrist {
                fingers(value)
            } else {
                wrist(value)
            };
            hand.push(on_arrival(now_ns), &seen);
            let found = hand.at(now_ns).as_ref().map(shown);
            assert_eq!(
                found.is_some(),
                k <= 23 + u64::from(!is_wrist),
                "{k}, {found:?}"
            );
            last = found.or(last);
        }
        let (x, arch) = last.expect("seen");
        let (stands, moves) = if is_wrist { (x, arch) } else { (arch, x) };
        assert!(stands < 1.0 && moves > 1.2, "{stands}, {moves}");
    }
}

#[test]
fn prediction_takes_lag_away_and_its_error_is_measured() {
    // A wrist that swings by 10 cm at 1 Hz, fingers that bend by half a radian.
    let swing = |time_s: f64| (std::f64::consts::TAU * time_s).sin();
    let seen_wrist = |time_s: f64| wrist(0.1 * (std::f64::consts::TAU * time_s).sin());
    let seen_fingers = |time_s: f64| fingers(0.5 * (std::f64::consts::TAU * time_s).sin());
    let devices = [
        Device::new(seen_wrist, 8_333_333),
        Device::new(seen_fingers, 10 * MS),
    ];
    let mut hand = fusion([0.0; 2], [0.04; 2]);
    let seen = played(&mut hand, said(&devices, 4.0), MS);
    let [wrist, fingers] = hand.reports(START_NS + 4_000 * MS);
    assert!((-0.03..-0.025).contains(&wrist.lag_s), "ahead: {wrist:?}");
    assert!((fingers.lag_s - wrist.lag_s).abs() < 1e-9, "{fingers:?}");
    assert!(
        wrist.lead_s < 0.04 && (fingers.lead_s - 0.04).abs() < 1e-6,
        "as far as it needs"
    );
    let (mut ahead, mut late) = (0.0, 0.0);
    for (time_s, hand) in &seen[1000..] {
        let (x, _) = hand.expect("seen");
        ahead += (x - 0.1 * swing(time_s - wrist.lag_s)).powi(2);
        late += (0.1 * swing(*time_s) - 0.1 * swing(time_s - wrist.lag_s)).powi(2);
    }
    let rms = |sum: f64| (sum / (seen.len() - 1000) as f64).sqrt();
    assert!(
        rms(ahead) < 0.4 * rms(late),
        "{} m, {} m",
        rms(ahead),
        rms(late)
    );
    let told = wrist.error.expect("predicted");
    let (error_m, moved_m) = (
        told.predicted.position_m.expect("a place"),
        told.unpredicted.position_m.expect("a place"),
    );
    // In 38 ms the wrist moves 0.1 sin(2π t) by 16.9 mm rms.
    assert!((0.016..0.018).contains(&moved_m), "{moved_m} m");
    assert!(error_m < 0.3 * moved_m && error_m > 0.0, "{error_m} m");
    let told = fingers.error.expect("predicted");
    assert_eq!(told.predicted.position_m, None);
    assert!(
        told.predicted.angle_rad < 0.5 * told.unpredicted.angle_rad,
        "{told:?}"
    );
}

#[test]
fn a_prediction_fades_out_when_the_stream_stops() {
    let mut hand = fusion([0.0; 2], [0.1; 2]);
    played(&mut hand, said(&devices(), 1.0), MS);
    let mut glove = |k: u64| {
        let now_ns = START_NS + 1_000 * MS + k * 10 * MS;
        hand.push(on_arrival(now_ns), &fingers(1.0));
        hand.at(now_ns).as_ref().map(shown).map(|(x, _)| x)
    };
    let seen: Vec<f64> = (0..24).filter_map(&mut glove).collect();
    // The last sample of the tracker before the last step of the first second.
    let last = 118.0 * 8_333_333.0e-9;
    assert!(
        seen.iter().all(|x| *x < last + 0.1),
        "never beyond 0.1 s at 1 m/s: {seen:?}"
    );
    assert!(
        seen.iter().any(|x| *x > last + 0.05),
        "it was predicted: {seen:?}"
    );
    let end = seen[seen.len() - 1];
    assert!(
        (end - last).abs() < 1e-9,
        "it stands where it was seen: {end}"
    );
}

/// Held, the hand is the newest of both and nothing is waited for.
#[test]
fn a_held_hand_takes_the_newest_of_both() {
    let mut hand = Fusion::new(FusionSettings {
        between: Between::Hold,
        ..FusionSettings::default()
    });
    hand.push(on_arrival(START_NS), &wrist(1.0));
    assert_eq!(hand.at(START_NS), None, "no glove yet");
    hand.push(on_arrival(START_NS + MS), &fingers(2.0));
    let found = hand.at(START_NS + MS).as_ref().map(shown);
    assert_eq!(found, Some((1.0, 2.0)));
    assert_eq!(hand.at(START_NS + 2 * MS), None, "nothing new");
    hand.push(on_arrival(START_NS + 3 * MS), &wrist(3.0));
    let found = hand.at(START_NS + 3 * MS).as_ref().map(shown);
    assert_eq!(found, Some((3.0, 2.0)));
}

proptest! {
    /// Whatever the stamps: no panic, and every hand is one that the world takes.
    #[test]
    fn any_stamps_do_no_harm(
        items in collection::vec((any::<bool>(), 0_u64..400, -300_i64..300, -1.0..1.0_f64, 0_u8..20), 1..200),
        predict_s in 0.0..0.1_f64,
    ) {
        let mut hand = fusion([0.02, 0.0], [predict_s; 2]);
        let mut now_ns = START_NS;
        for (is_wrist, wait_ms, skew_ms, value, kind) in items {
            now_ns += wait_ms * MS / 20;
            let times = Times {
                arrival_ns: now_ns,
                fitted_ns: now_ns.saturating_add_signed(skew_ms * MS as i64),
            };
            let seen = match (kind, is_wrist) {
                (0, true) => Seen::Wrist(None),
                (0, false) => Seen::Fingers(None),
                (_, true) => wrist(value),
                (_, false) => fingers(value),
            };
            hand.push(times, &seen);
            if let Some(sample) = hand.at(now_ns) {
                prop_assert!(sample.is_valid());
            }
            let _ = hand.reports(now_ns);
        }
    }
}
