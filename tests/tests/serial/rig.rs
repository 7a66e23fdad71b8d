//! A hand that wears an emulated glove and an emulated tracker, and the settings that plug them in.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_motion::synthetic::{SceneInfo, SyntheticHand, build};
use tsukamu_server::daemon::DaemonConfig;
use tsukamu_server::emulate::TrackerPlace;
use tsukamu_server::emulate::wearing::{joint_angles_of, sensor_angles, transmitter_from_sensor};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{self, calibration as calibration_file};
use tsukamu_world::hand::joint::Side;

/// The wearer: the sample that is installed with the daemon.
const CALIBRATION: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../deploy/calibration-right.toml"
);
/// Where the transmitter is, world space, metres.
const TRANSMITTER: [f64; 3] = [0.2, 0.3, -0.1];
/// Its turn about y, degrees.
const TRANSMITTER_YAW_DEG: f64 = 30.0;

/// A folder of one test's own, gone with it.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path =
            std::env::temp_dir().join(format!("tsukamu-serial-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// How far the motion is; before it begins the hand stands as at its beginning.
#[derive(Debug, Default)]
pub(crate) struct Stage(Mutex<Played>);

#[derive(Clone, Copy, Debug, Default)]
struct Played {
    /// How far it was when it last stood, seconds.
    before_s: f64,
    /// Since when it goes on, if it does.
    since: Option<Instant>,
}

impl Stage {
    /// The motion begins, or begins again.
    pub(crate) fn begin(&self) {
        self.set(0.0, Some(Instant::now()));
    }

    /// The hand goes back to where it begins.
    pub(crate) fn rest(&self) {
        self.set(0.0, None);
    }

    /// The hand stands where it is.
    pub(crate) fn stand(&self) {
        self.set(self.time_s(), None);
    }

    /// The hand goes on from where it stands.
    pub(crate) fn go_on(&self) {
        self.set(self.time_s(), Some(Instant::now()));
    }

    fn set(&self, before_s: f64, since: Option<Instant>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Played { before_s, since };
    }

    /// Time of the motion, seconds.
    pub(crate) fn time_s(&self) -> f64 {
        let played = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let since_s = played
            .since
            .map_or(0.0, |since| since.elapsed().as_secs_f64());
        played.before_s + since_s
    }
}

/// A glove and a tracker, worn by a hand that moves when its stage says so.
pub(crate) struct Worn {
    pub(crate) stage: Arc<Stage>,
    hand: Arc<SyntheticHand>,
    pub(crate) glove: PtyEmulator<CyberGloveEmulator>,
    pub(crate) tracker: PtyEmulator<FastrakEmulator>,
}

impl Worn {
    pub(crate) fn new(folder: &Folder, sensors: SensorCount, name: &str) -> Self {
        let stage = Arc::new(Stage::default());
        let hand = Arc::new(hand(&format!("operations/{name}"), name));
        let line = |name: &str| PtySettings {
            link: Some(folder.file(name)),
            baud: 115_200,
        };
        let (wearer, time, calibration) = (Arc::clone(&hand), Arc::clone(&stage), calibration());
        let bend = move |_: u64, glove: &mut CyberGloveEmulator| {
            let sample = wearer.sample_at(time.time_s());
            let angles = joint_angles_of(&sample, Side::Right).expect("all joints are computed");
            let counts = calibration.counts(&sensor_angles(&angles), 1, 254);
            glove.set_slots(&counts.map(|count| count as u8));
        };
        let glove = CyberGloveEmulator::new(sensors, Handedness::Right);
        let glove = PtyEmulator::spawn(glove, line("glove"), bend).unwrap();
        let (wearer, time, place) = (Arc::clone(&hand), Arc::clone(&stage), place());
        let carry = move |_: u64, tracker: &mut FastrakEmulator| {
            let sample = wearer.sample_at(time.time_s());
            let pose = transmitter_from_sensor(&sample.wrist, &place);
            tracker.set_pose(
                place.station,
                Point3::from(pose.translation.vector),
                pose.rotation,
            );
        };
        let tracker = PtyEmulator::spawn(FastrakEmulator::new(), line("tracker"), carry).unwrap();
        Self {
            stage,
            hand,
            glove,
            tracker,
        }
    }

    /// Where the wrist is before the motion begins, world space.
    pub(crate) fn wrist(&self) -> Isometry3<f64> {
        self.hand.sample_at(0.0).wrist
    }

    /// Pulls both cables.
    pub(crate) fn unplug(&self) {
        self.glove.unplug();
        self.tracker.unplug();
    }

    /// Plugs both in again, the other way round.
    pub(crate) fn plug(&mut self) {
        self.tracker.plug().unwrap();
        self.glove.plug().unwrap();
    }
}

/// The synthetic hand of that text in that scene.
pub(crate) fn hand(scene: &str, spec: &str) -> SyntheticHand {
    build(spec, &SceneInfo::from(&load(scene).unwrap().scene)).unwrap()
}

/// The wearer's calibration.
pub(crate) fn calibration() -> GloveCalibration {
    calibration_file::load(Path::new(CALIBRATION)).unwrap()
}

/// Where the tracker really is, said in another way than in the settings.
pub(crate) fn place() -> TrackerPlace {
    let turn =
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), TRANSMITTER_YAW_DEG.to_radians());
    TrackerPlace {
        station: 2,
        world_from_transmitter: Isometry3::from_parts(Translation3::from(TRANSMITTER), turn),
        wrist_from_sensor: calibration().mount.wrist_from_sensor(),
    }
}

/// A daemon as a user would set it up in a file.
pub(crate) fn config(folder: &Folder, scene: &str, n_sensors: u32) -> DaemonConfig {
    let file = |name: &str| folder.file(name).display().to_string();
    let text = format!(
        "listen = '127.0.0.1:0'\nscene = '{scene}'\nrecording_dir = '{folder}'\n\
         [[device]]\nname = 'glove'\nkind = 'cyberglove'\nport = '{glove}'\nsensors = {n_sensors}\n\
         calibration = '{CALIBRATION}'\n\
         [[device]]\nname = 'tracker'\nkind = 'fastrak'\nport = '{tracker}'\nstations = [2]\nencoding = 'binary'\n\
         transmitter_position = {TRANSMITTER:?}\ntransmitter_rotation_deg = [{TRANSMITTER_YAW_DEG}, 0, 0]\n\
         [[hand]]\nname = 'alice:right'\nside = 'right'\nglove = 'glove'\ntracker = 'tracker'\nstation = 2\n",
        folder = folder.0.display(),
        glove = file("glove"),
        tracker = file("tracker"),
    );
    daemon_config(&text)
}

/// A daemon with these settings, on which nothing moves by itself.
pub(crate) fn daemon_config(text: &str) -> DaemonConfig {
    let settings = settings::parse("test.toml", text, Path::new(""), &Overrides::default())
        .unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let plan = plan(&load(&settings.world.scene).unwrap(), Cast::Nobody).unwrap();
    DaemonConfig {
        listen: settings.listen,
        mode: settings.world.mode,
        plan,
        publish: settings.publish,
        recording: settings.recording,
        vrpn: settings.vrpn,
        devices: settings.devices,
        hands: settings.hands,
        session: BTreeMap::new(),
    }
}
