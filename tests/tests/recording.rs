//! A recording is a proof: replayed, it gives the same digests, or says from which tick on it does not.

#![allow(
    clippy::unwrap_used,
    reason = "a test ends where what it stands on is missing"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use tsukamu_motion::hand_csv;
use tsukamu_motion::track::TrackHand;
use tsukamu_server::offline::hands::{Motion, RunHand};
use tsukamu_server::offline::run::{RunOutcome, RunOutputs, RunRequest, run};
use tsukamu_server::record::export::export;
use tsukamu_server::record::reader::{self, Ending, from_bytes};
use tsukamu_server::record::recover::recover;
use tsukamu_server::record::replay::ReplayFault;
use tsukamu_server::record::verify::{Verification, VerifyFault, verify};
use tsukamu_server::record::writer::{Existing, RecordingFile, RecordingThread};
use tsukamu_server::recorder_handle::{Record, RecordItem, RecordOptions, RecorderHandle};
use tsukamu_server::scene_file::parse;
use tsukamu_world::hand::joint::Side;
use tsukamu_world::hand::sample::{FingerPose, HandSample, JointAngles};
use tsukamu_world::hand::skeleton::HandModel;
use tsukamu_world::state::HandId;

const SCENE: &str = "\
    rate_hz = 240\n\
    [[object]]\nname = 'cube'\nshape = 'box'\nsize = [0.05, 0.05, 0.05]\nposition = [0, 0, -0.3]\non_floor = true\n\
    [[object]]\nname = 'falling'\nshape = 'prism'\nradius = 0.04\nheight = 0.06\nposition = [0.3, 0.4, 0]\nrotation_deg = [20, 30, 10]\n";
const TICKS: u64 = 768;

/// A folder of one test's own, gone with it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path =
            std::env::temp_dir().join(format!("tsukamu-recording-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A flat hand that sweeps forward through the cube.
fn sweeping_hand() -> RunHand {
    let at = |time_s: f64| HandSample {
        wrist: Isometry3::translation(0.0, 0.03, 0.1 - 0.15 * time_s),
        fingers: FingerPose::Angles(JointAngles::default()),
    };
    let times_s: Vec<f64> = (0..=120).map(|k| f64::from(k) / 60.0).collect();
    let samples = times_s.iter().map(|time_s| at(*time_s)).collect();
    let motion = Motion::Track(TrackHand {
        side: Side::Right,
        times_s,
        samples,
    });
    RunHand {
        id: HandId(0),
        name: "sweep".to_owned(),
        model: HandModel::adult(Side::Right),
        motion,
    }
}

/// Runs the session, which all tests are about, into a recording.
fn record_to(path: &Path) -> RunOutcome {
    let loaded = parse("test", SCENE, Path::new("")).unwrap();
    let request = RunRequest {
        scene: loaded.scene,
        source_text: loaded.source_text,
        hands: vec![sweeping_hand()],
        duration_s: Some(TICKS as f64 / 240.0),
    };
    let recording = RecordingFile::create(path, Existing::Keep, &BTreeMap::new()).unwrap();
    let outputs = RunOutputs {
        recording: Some(recording),
        poses: None,
    };
    run::<std::io::Sink>(request, outputs, |_| {}).unwrap()
}

/// The session's recording as bytes, and what it came to.
fn session(name: &str) -> (Folder, Vec<u8>, RunOutcome) {
    let folder = Folder::new(name);
    let path = folder.file("session.mcap");
    let outcome = record_to(&path);
    let bytes = fs::read(&path).unwrap();
    (folder, bytes, outcome)
}

fn check(bytes: &[u8]) -> Verification {
    verify(from_bytes(bytes), |_| {})
}

/// The session's recording with its records changed.
fn rewritten(folder: &Folder, bytes: &[u8], change: impl FnOnce(&mut Vec<Record>)) -> Vec<u8> {
    let mut records: Vec<Record> = from_bytes(bytes).collect();
    change(&mut records);
    let path = folder.file("changed.mcap");
    let mut file = RecordingFile::create(&path, Existing::Replace, &BTreeMap::new()).unwrap();
    records
        .iter()
        .for_each(|record| file.write(record).unwrap());
    file.finish(0).unwrap();
    fs::read(path).unwrap()
}

#[test]
fn a_recording_of_an_offline_run_verifies() {
    let (_folder, bytes, outcome) = session("verifies");
    assert!(
        outcome.events.iter().any(|event| event.kind == "pushed"),
        "the hand must touch the cube"
    );
    let found = check(&bytes);
    assert_eq!(found.fault, None);
    assert_eq!(
        (
            found.epochs,
            found.ticks,
            found.digests,
            found.unchecked_ticks
        ),
        (1, TICKS, 4, 0)
    );
    assert_eq!(found.ending, Some(Ending::Complete));
    let last = from_bytes(&bytes).filter_map(|record| match record.item {
        RecordItem::Digest(digest) => Some(digest.digest),
        _ => None,
    });
    assert_eq!(last.last(), Some(outcome.world.digest()));
}

#[test]
fn a_changed_input_is_found_at_the_next_digest() {
    let (folder, bytes, _) = session("input");
    let changed = rewritten(&folder, &bytes, |records| {
        let inputs = records
            .iter_mut()
            .filter_map(|record| match &mut record.item {
                RecordItem::Input(input) if input.tick == 300 => Some(input),
                _ => None,
            });
        let wrists = inputs.map(|input| {
            input.hands[0]
                .sample
                .as_mut()
                .unwrap()
                .wrist
                .as_mut()
                .unwrap()
        });
        let n_changed = wrists
            .map(|wrist| wrist.position.as_mut().unwrap().z -= 1.0e-9)
            .count();
        assert_eq!(n_changed, 1);
    });
    let found = check(&changed);
    let Some(VerifyFault::Differs {
        epoch: 1,
        tick: 480,
        last_equal: 240,
        ..
    }) = found.fault
    else {
        panic!("a nanometre must be found, not {:?}", found.fault)
    };
}

#[test]
fn a_changed_digest_is_named_by_its_tick() {
    let (folder, bytes, _) = session("digest");
    let changed = rewritten(&folder, &bytes, |records| {
        for record in records {
            if let RecordItem::Digest(digest) = &mut record.item {
                digest.digest ^= u64::from(digest.tick == 720);
            }
        }
    });
    let found = check(&changed);
    assert!(
        matches!(
            found.fault,
            Some(VerifyFault::Differs {
                tick: 720,
                last_equal: 480,
                ..
            })
        ),
        "{:?}",
        found.fault
    );
    let text = found
        .fault
        .map(|fault| fault.to_string())
        .unwrap_or_default();
    assert!(text.contains("epoch 1, tick 720"), "{text}");
}

#[test]
fn a_missing_input_is_a_gap() {
    let (folder, bytes, _) = session("gap");
    let changed = rewritten(&folder, &bytes, |records| {
        records.retain(
            |record| !matches!(&record.item, RecordItem::Input(input) if input.tick == 500),
        );
    });
    let gap = ReplayFault::Gap {
        epoch: 1,
        last: 499,
        next_epoch: 1,
        next: 501,
    };
    assert_eq!(check(&changed).fault, Some(VerifyFault::Replay(gap)));
}

#[test]
fn epochs_are_worlds_of_their_own() {
    let (folder, bytes, _) = session("epochs");
    let twice = rewritten(&folder, &bytes, |records| {
        let mut second = records.clone();
        for record in &mut second {
            match &mut record.item {
                RecordItem::Scene(scene) => scene.epoch = 2,
                RecordItem::Input(input) => input.epoch = 2,
                RecordItem::Digest(digest) => digest.epoch = 2,
                _ => {}
            }
        }
        records.append(&mut second);
    });
    let found = check(&twice);
    assert_eq!(
        (found.fault, found.epochs, found.ticks, found.digests),
        (None, 2, 2 * TICKS, 8)
    );
}

#[test]
fn a_recording_cut_anywhere_verifies_up_to_the_cut() {
    let (_folder, bytes, _) = session("cut");
    let mut digests = 0;
    for length in (0..bytes.len()).step_by(97) {
        let found = check(&bytes[..length]);
        match &found.fault {
            None => assert!(found.digests > 0),
            Some(fault) => assert_eq!(fault, &VerifyFault::Nothing, "cut at {length}"),
        }
        assert!(found.digests >= digests, "cut at {length}");
        assert_ne!(found.ending, Some(Ending::Complete), "cut at {length}");
        digests = found.digests;
    }
    assert_eq!(digests, 4);
}

#[test]
fn a_flipped_byte_is_found_or_harmless() {
    let (_folder, bytes, _) = session("flip");
    for at in (0..bytes.len()).step_by(61) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x10;
        let found = check(&changed);
        let is_whole = found.digests == 4 && found.ticks == TICKS;
        assert!(is_whole || found.fault.is_some(), "byte {at}: {found:?}");
    }
}

#[test]
fn what_was_synced_survives_a_writer_that_never_ends() {
    let (folder, bytes, _) = session("killed");
    let path = folder.file("killed.mcap");
    let mut file = RecordingFile::create(&path, Existing::Keep, &BTreeMap::new()).unwrap();
    let records: Vec<Record> = from_bytes(&bytes).collect();
    let (before, after) = records.split_at(records.len() / 2);
    before.iter().for_each(|record| file.write(record).unwrap());
    file.sync().unwrap();
    after.iter().for_each(|record| file.write(record).unwrap());
    // A killed process runs no destructor.
    std::mem::forget(file);
    let killed = fs::read(&path).unwrap();
    assert_eq!(from_bytes(&killed).count(), before.len());
    let found = check(&killed);
    assert_eq!((found.fault, found.ending), (None, Some(Ending::Cut)));
    let whole = folder.file("whole.mcap");
    let (finished, ending) = recover(&path, &whole).unwrap();
    assert_eq!(
        (finished.messages, ending),
        (before.len() as u64, Ending::Cut)
    );
    let found = check(&fs::read(&whole).unwrap());
    assert_eq!((found.fault, found.ending), (None, Some(Ending::Complete)));
}

#[test]
fn the_thread_writes_what_the_handle_is_offered() {
    let (folder, bytes, _) = session("thread");
    let path = folder.file("thread.mcap");
    let file = RecordingFile::create(&path, Existing::Keep, &BTreeMap::new()).unwrap();
    let (handle, receiver) = RecorderHandle::channel(RecordOptions::default());
    let thread = RecordingThread::spawn(file, receiver, handle.dropped_counter());
    from_bytes(&bytes).for_each(|record| handle.offer(record.wall_ns, record.item));
    drop(handle);
    let finished = thread.finish().unwrap();
    assert_eq!(
        (finished.messages, finished.dropped),
        (from_bytes(&bytes).count() as u64, 0)
    );
    assert_eq!(check(&fs::read(&path).unwrap()).fault, None);
    let again = RecordingFile::create(&path, Existing::Keep, &BTreeMap::new());
    assert!(again.is_err(), "a recording is never written over unasked");
}

#[test]
fn an_export_has_a_row_for_everything() {
    let (folder, bytes, outcome) = session("export");
    let tables = folder.file("tables");
    let recording = reader::open(&folder.file("session.mcap")).unwrap();
    assert_eq!(
        export(recording, &tables, |_| {}).unwrap(),
        Ending::Complete
    );
    let lines = |name: &str| {
        fs::read_to_string(tables.join(name))
            .unwrap()
            .lines()
            .count() as u64
            - 1
    };
    assert_eq!(lines("poses.csv"), 2 * TICKS);
    assert_eq!(lines("hands.csv"), TICKS);
    assert_eq!(lines("events.csv"), outcome.events.len() as u64);
    assert_eq!(lines("inputs.csv"), TICKS + 1);
    let hands = fs::read_to_string(tables.join("hands.csv")).unwrap();
    let track = hand_csv::read(&hands).unwrap();
    assert_eq!(
        track.hands[0].samples.len(),
        480,
        "the hand was seen for 2 s at 240 steps per second"
    );
    assert!(!bytes.is_empty());
}

#[test]
fn a_session_is_kept_through_recovery() {
    let folder = Folder::new("metadata");
    let (first, second) = (folder.file("first.mcap"), folder.file("second.mcap"));
    let about = BTreeMap::from([
        ("scene".to_owned(), "mine".to_owned()),
        ("build".to_owned(), "old".to_owned()),
    ]);
    let file = RecordingFile::create(&first, Existing::Keep, &about).unwrap();
    file.finish(0).unwrap();
    recover(&first, &second).unwrap();
    let session = reader::session(&second).unwrap();
    assert_eq!(
        (session["scene"].as_str(), session["build"].as_str()),
        ("mine", "old")
    );
    assert!(session["recovered_from"].ends_with("first.mcap"));
}

#[test]
fn other_bytes_are_no_recording() {
    for bytes in [&b""[..], b"hello", &[0; 4096], mcap_magic_only().as_slice()] {
        let found = check(bytes);
        assert!(found.fault.is_some(), "{bytes:?}: {found:?}");
    }
    assert!(reader::open(Path::new("no-such.mcap")).is_err());
}

fn mcap_magic_only() -> Vec<u8> {
    [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'].repeat(2)
}
