//! A glove is calibrated, and its tracker finds room and wrist, over gRPC, while the daemon runs.

use std::fs;
use std::sync::{Arc, Mutex};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use tonic::transport::Channel;
use tonic::{Code, Status, Streaming};
use tsukamu_devices::calibration::pose::{CalibrationPose, full_deg, full_pose};
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::glove::calibrate::{
    Coupling, GloveCalibration, Handedness, SensorCalibration,
};
use tsukamu_devices::glove::cyberglove::settings::SensorCount;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_proto::v1;
use tsukamu_proto::v1::calibration_client::CalibrationClient;
use tsukamu_proto::v1::capture_pose_response::Kind as Captured;
use tsukamu_proto::v1::hold_tracker_response::Kind as Held;
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::emulate::TrackerPlace;
use tsukamu_server::emulate::wearing::transmitter_from_sensor;
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::settings;
use tsukamu_server::settings::overrides::Overrides;

use crate::rig::Folder;
use crate::seen::{Seen, soon};

/// Angles by wire slot, radians.
type Angles = [Option<f64>; GloveSensor::N_SLOTS];

/// A hand in an emulated glove, with an emulated receiver on its wrist.
struct Wearer {
    angles: Arc<Mutex<Angles>>,
    wrist: Arc<Mutex<Isometry3<f64>>>,
    place: TrackerPlace,
    _glove: PtyEmulator<CyberGloveEmulator>,
    _tracker: PtyEmulator<FastrakEmulator>,
}

/// What this glove really does on this hand; its thumb's rotation sensor bends with the abduction too.
fn truth() -> GloveCalibration {
    let line = |sensor| {
        let usual = SensorCalibration::default_of(sensor);
        SensorCalibration {
            raw_at_zero: usual.raw_at_zero - 13.0,
            gain_deg_per_count: 0.45,
            ..usual
        }
    };
    let mut truth = GloveCalibration::default().filled(line);
    let rotation = truth.sensors.get_mut(&GloveSensor::ThumbRotation).unwrap();
    rotation.coupling = Some(Coupling {
        sensor: GloveSensor::ThumbAbduction,
        gain_deg_per_count: -0.15,
    });
    truth
}

impl Wearer {
    fn new(folder: &Folder) -> Self {
        let angles: Arc<Mutex<Angles>> = Arc::new(Mutex::new([Some(0.0); GloveSensor::N_SLOTS]));
        let wrist = Arc::new(Mutex::new(Isometry3::translation(0.0, 0.3, 0.0)));
        let place = TrackerPlace {
            station: 1,
            world_from_transmitter: Isometry3::from_parts(
                Translation3::new(0.3, 0.7, -0.2),
                UnitQuaternion::from_euler_angles(0.1, 0.8, -0.2),
            ),
            wrist_from_sensor: Isometry3::from_parts(
                Translation3::new(0.005, 0.02, 0.03),
                UnitQuaternion::from_euler_angles(0.2, -0.1, 0.3),
            ),
        };
        let line = |name: &str| PtySettings {
            link: Some(folder.file(name)),
            baud: 115_200,
        };
        let (bent, calibration) = (Arc::clone(&angles), truth());
        let bend = move |_: u64, glove: &mut CyberGloveEmulator| {
            let counts = calibration.counts(&bent.lock().unwrap(), 1, 254);
            let mut slots = counts.map(|count| count as u8);
            // This glove's ring DIP is broken.
            slots[GloveSensor::RingDip.slot()] = 77;
            glove.set_slots(&slots);
        };
        let glove = CyberGloveEmulator::new(SensorCount::TwentyTwo, Handedness::Right);
        let glove = PtyEmulator::spawn(glove, line("glove"), bend).unwrap();
        let (carried, there) = (Arc::clone(&wrist), place);
        let carry = move |_: u64, tracker: &mut FastrakEmulator| {
            let pose = transmitter_from_sensor(&carried.lock().unwrap(), &there);
            let position = Point3::from(pose.translation.vector);
            tracker.set_pose(there.station, position, pose.rotation);
        };
        let tracker = PtyEmulator::spawn(FastrakEmulator::new(), line("tracker"), carry).unwrap();
        Self {
            angles,
            wrist,
            place,
            _glove: glove,
            _tracker: tracker,
        }
    }

    fn bend(&self, angle_deg: impl Fn(GloveSensor) -> f64) {
        let mut angles = self.angles.lock().unwrap();
        for sensor in GloveSensor::ALL {
            angles[sensor.slot()] = Some(angle_deg(sensor).to_radians());
        }
    }

    /// Puts the receiver, not the wrist, to a point of the world.
    fn touch(&self, point: [f64; 3]) {
        let world_from_sensor = Isometry3::from_parts(
            Translation3::from(point),
            UnitQuaternion::from_euler_angles(0.4, 0.3, 0.2),
        );
        *self.wrist.lock().unwrap() = world_from_sensor * self.place.wrist_from_sensor.inverse();
    }
}

/// A daemon that knows of glove and tracker nothing but where they are.
async fn daemon(folder: &Folder) -> Daemon {
    let file = |name: &str| folder.file(name).display().to_string();
    fs::write(folder.file("wearer.toml"), "wearer = 'bob'\n").unwrap();
    fs::write(
        folder.file("room.toml"),
        "transmitter_position = [9, 9, 9]\n",
    )
    .unwrap();
    let text = format!(
        "listen = '127.0.0.1:0'\nscene = 'operations/free'\nrecording_dir = '{0}'\n\
         [[device]]\nname = 'glove'\nkind = 'cyberglove'\nport = '{0}'\ncalibration = '{1}'\n\
         [[device]]\nname = 'tracker'\nkind = 'fastrak'\nport = '{2}'\nroom = '{3}'\n\
         [[hand]]\nname = 'alice:right'\nside = 'right'\nglove = 'glove'\ntracker = 'tracker'\n",
        file("glove"),
        file("wearer.toml"),
        file("tracker"),
        file("room.toml"),
    );
    let settings = settings::parse(
        "t.toml",
        &text,
        std::path::Path::new(""),
        &Overrides::default(),
    )
    .unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let plan = plan(&load(&settings.world.scene).unwrap(), Cast::Nobody).unwrap();
    start(DaemonConfig {
        listen: settings.listen,
        devices: settings.devices,
        hands: settings.hands,
        ..DaemonConfig::new(plan, settings.world.mode)
    })
    .await
    .unwrap()
}

async fn client(daemon: &Daemon) -> CalibrationClient<Channel> {
    let address = format!("http://{}", daemon.local_addr());
    CalibrationClient::connect(address).await.unwrap()
}

async fn begin(client: &mut CalibrationClient<Channel>) -> Result<u64, Status> {
    let request = v1::BeginCalibrationRequest {
        device: "glove".to_owned(),
        wearer: "alice".to_owned(),
        hand: v1::Side::Right.into(),
    };
    Ok(client.begin_calibration(request).await?.into_inner().run)
}

/// Holds a pose to the end, and says what was told meanwhile.
async fn hold(
    client: &mut CalibrationClient<Channel>,
    run: u64,
    pose: CalibrationPose,
) -> (v1::PoseCaptured, Vec<String>) {
    let request = v1::CapturePoseRequest {
        run,
        pose: pose.name().to_owned(),
        timeout_s: 60.0,
    };
    let mut answers = client.capture_pose(request).await.unwrap().into_inner();
    let mut states = Vec::new();
    while let Some(answer) = answers.message().await.unwrap() {
        match answer.kind.unwrap() {
            Captured::Progress(progress) => states.push(progress.state),
            Captured::Captured(captured) => return (captured, states),
        }
    }
    panic!("the stream ended before {pose:?} was held");
}

async fn newest(readings: &mut Streaming<v1::WatchReadingsResponse>) -> v1::WatchReadingsResponse {
    readings.message().await.unwrap().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_glove_is_fitted_to_its_wearer_without_a_restart() {
    let folder = Folder::new("calibrate");
    let wearer = Wearer::new(&folder);
    let daemon = daemon(&folder).await;
    let seen = Seen::connect(&daemon).await;
    seen.devices_become("running").await;
    let mut client = client(&daemon).await;
    let run = begin(&mut client).await.unwrap();
    let busy = begin(&mut client).await.unwrap_err();
    assert_eq!(busy.code(), Code::ResourceExhausted, "{busy}");
    for pose in CalibrationPose::ALL {
        wearer.bend(|sensor| pose.target_deg(sensor).unwrap_or(0.0));
        let (captured, states) = hold(&mut client, run, pose).await;
        assert!(captured.readings >= 8 && !captured.unmoved, "{captured:?}");
        assert!(states.iter().any(|state| state == "holding"), "{states:?}");
    }
    let fit = |save, replace_wearer| v1::FitCalibrationRequest {
        run,
        apply: true,
        save,
        replace_wearer,
    };
    let refused = client.fit_calibration(fit(true, false)).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
    assert!(
        refused.message().contains("the calibration of \"bob\""),
        "{refused}"
    );
    let fitted = client
        .fit_calibration(fit(true, true))
        .await
        .unwrap()
        .into_inner();
    for quality in &fitted.qualities {
        let sensor = GloveSensor::from_name(&quality.sensor).unwrap();
        let expected = match sensor {
            GloveSensor::RingDip => "dead",
            sensor if full_pose(sensor).is_none() => "not_asked",
            _ => "good",
        };
        assert_eq!(quality.verdict, expected, "{quality:?}");
    }
    let saved = settings::calibration::load(&folder.file("wearer.toml")).unwrap();
    assert_eq!(
        (saved.wearer.as_str(), saved.hand),
        ("alice", Some(Handedness::Right))
    );
    assert!(saved.sensor(GloveSensor::ThumbRotation).coupling.is_some());
    let over = client.fit_calibration(fit(false, false)).await.unwrap_err();
    assert_eq!(over.code(), Code::NotFound, "{over}");

    // The angles are now those of the joints.
    wearer.bend(|sensor| 0.6 * full_deg(sensor));
    check_readings(&mut client).await;
    daemon.shutdown().await.unwrap();
}

/// All joints are bent by six tenths: but for the glove's steps that is soon what is read, and the absent sensor is gone.
async fn check_readings(client: &mut CalibrationClient<Channel>) {
    let request = v1::WatchReadingsRequest {
        device: "glove".to_owned(),
        max_rate_hz: 100.0,
    };
    let mut readings = client.watch_readings(request).await.unwrap().into_inner();
    let mut worst = String::new();
    for _ in 0..500 {
        let reading = newest(&mut readings).await;
        let off = reading.sensors.iter().find(|read| {
            let sensor = GloveSensor::from_name(&read.sensor).unwrap();
            let wanted = 0.6 * full_deg(sensor);
            let is_off = (read.angle_deg - wanted).abs() > 1.5;
            sensor == GloveSensor::RingDip || full_pose(sensor).is_some() && is_off
        });
        match off {
            None => return,
            Some(read) => worst = format!("{read:?}"),
        }
    }
    panic!("the angles are not those of the joints: {worst}");
}

/// Touches a point with the receiver until it has been held there.
async fn touched(
    client: &mut CalibrationClient<Channel>,
    wearer: &Wearer,
    point: [f64; 3],
) -> v1::Vec3 {
    wearer.touch(point);
    let expected = wearer
        .place
        .world_from_transmitter
        .inverse_transform_point(&Point3::from(point));
    // What was under way when the hand jumped is of the point before.
    loop {
        let held = held(client).await;
        let found = held.pose.unwrap().position.unwrap();
        if (Point3::new(found.x, found.y, found.z) - expected).norm() < 0.001 {
            return found;
        }
    }
}

async fn held(client: &mut CalibrationClient<Channel>) -> v1::TrackerHeld {
    let request = v1::HoldTrackerRequest {
        device: "tracker".to_owned(),
        station: 1,
        timeout_s: 60.0,
    };
    let mut answers = client.hold_tracker(request).await.unwrap().into_inner();
    while let Some(answer) = answers.message().await.unwrap() {
        if let Held::Held(held) = answer.kind.unwrap() {
            return held;
        }
    }
    panic!("the stream ended before the sensor was held");
}

#[tokio::test(flavor = "multi_thread")]
async fn three_points_and_a_flat_hand_put_the_wrist_where_it_is() {
    let folder = Folder::new("room");
    let wearer = Wearer::new(&folder);
    let daemon = daemon(&folder).await;
    let seen = Seen::connect(&daemon).await;
    seen.devices_become("running").await;
    let mut client = client(&daemon).await;
    find_the_room(&mut client, &wearer, &folder).await;

    let wrist = Isometry3::translation(0.1, 0.03, -0.2);
    *wearer.wrist.lock().unwrap() = wrist;
    let sensor =
        (wearer.place.world_from_transmitter.inverse() * wrist * wearer.place.wrist_from_sensor)
            .translation
            .vector;
    find_the_mount(&mut client, &wearer, &folder, sensor).await;

    // In force at once: the hand is where it is.
    let shown = async {
        while (seen.wrist().await.translation.vector - wrist.translation.vector).norm() > 0.005 {}
    };
    soon("the wrist in its place", shown).await;
    daemon.shutdown().await.unwrap();
}

/// Three points of the table say where the transmitter stands; three in a line do not.
async fn find_the_room(client: &mut CalibrationClient<Channel>, wearer: &Wearer, folder: &Folder) {
    let table = [[-0.2, 0.0, 0.1], [0.4, 0.0, 0.1], [0.1, 0.0, -0.5]];
    let mut points = Vec::new();
    for point in table {
        points.push(touched(client, wearer, point).await);
    }
    let room = |points: Vec<v1::Vec3>| v1::SetRoomRequest {
        device: "tracker".to_owned(),
        points,
        corner: Some(v1::Vec3 {
            x: -0.2,
            y: 0.0,
            z: 0.1,
        }),
        apply: true,
        save: true,
    };
    let line = vec![points[0], points[1], points[1]];
    let refused = client.set_room(room(line)).await.unwrap_err();
    assert!(refused.message().contains("off the line"), "{refused}");
    let found = client.set_room(room(points)).await.unwrap().into_inner();
    assert!(
        (found.edge_m - 0.6).abs() < 0.002 && found.residual_m < 0.001,
        "{found:?}"
    );
    let saved = settings::room::load(&folder.file("room.toml")).unwrap();
    let error = saved.inverse() * wearer.place.world_from_transmitter;
    assert!(error.translation.vector.norm() < 0.002 && error.rotation.angle() < 0.005);
}

/// A hand that lies flat says how the sensor sits on it, once it lies where `sensor` is, in the tracker's space.
async fn find_the_mount(
    client: &mut CalibrationClient<Channel>,
    wearer: &Wearer,
    folder: &Folder,
    sensor: Vector3<f64>,
) {
    let flat = loop {
        let held = held(client).await;
        let at = held.pose.unwrap().position.unwrap();
        if (Vector3::new(at.x, at.y, at.z) - sensor).norm() < 0.001 {
            break held;
        }
    };
    let mount = v1::SetMountRequest {
        device: "tracker".to_owned(),
        station: 1,
        held: flat.pose,
        wrist: Some(v1::Vec3 {
            x: 0.1,
            y: 0.03,
            z: -0.2,
        }),
        apply: true,
        save: true,
    };
    let nobody = v1::SetMountRequest {
        station: 3,
        ..mount.clone()
    };
    let refused = client.set_mount(nobody).await.unwrap_err();
    assert!(refused.message().contains("no hand"), "{refused}");
    let found = client.set_mount(mount).await.unwrap().into_inner();
    assert_eq!(found.glove, "glove");
    let saved = settings::calibration::load(&folder.file("wearer.toml")).unwrap();
    assert_eq!(
        saved.wearer, "bob",
        "a mount does not change who wears the glove"
    );
    let error = saved.mount.wrist_from_sensor().inverse() * wearer.place.wrist_from_sensor;
    assert!(error.translation.vector.norm() < 0.003 && error.rotation.angle() < 0.01);
}
