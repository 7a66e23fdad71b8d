//! `tsukamu calibrate` against a daemon that follows a script.

use std::pin::Pin;
use std::process::{Command, Output};
use std::sync::{Arc, Mutex};

use serde_json::Value;
use tokio::net::TcpListener;
use tokio_stream::Stream;
use tokio_stream::wrappers::TcpListenerStream;
use tonic::transport::Server;
use tonic::{Request, Response, Status};
use tsukamu_proto::v1;
use tsukamu_proto::v1::calibration_server::{Calibration, CalibrationServer};
use tsukamu_proto::v1::world_server::WorldServer;

use crate::fake::Running;

type Out<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;
type Answer<T> = Result<Response<T>, Status>;

/// What was asked of the daemon.
#[derive(Debug, Default)]
struct Asked {
    begun: Vec<v1::BeginCalibrationRequest>,
    poses: Vec<String>,
    fits: Vec<v1::FitCalibrationRequest>,
    n_cancelled: usize,
    rooms: Vec<v1::SetRoomRequest>,
    n_holds: usize,
}

/// A daemon whose glove has a file of somebody else, and whose hand cannot spread when its device is `stiff`.
#[derive(Clone, Default)]
struct Desk(Arc<Mutex<Asked>>);

fn out<T: Send + 'static>(answers: Vec<Result<T, Status>>) -> Answer<Out<T>> {
    Ok(Response::new(Box::pin(tokio_stream::iter(answers))))
}

fn unscripted<T>() -> Answer<T> {
    Err(Status::unimplemented("not in the script"))
}

#[tonic::async_trait]
impl Calibration for Desk {
    type WatchReadingsStream = Out<v1::WatchReadingsResponse>;
    type CapturePoseStream = Out<v1::CapturePoseResponse>;
    type CaptureRangeStream = Out<v1::CaptureRangeResponse>;
    type HoldTrackerStream = Out<v1::HoldTrackerResponse>;

    async fn watch_readings(
        &self,
        _: Request<v1::WatchReadingsRequest>,
    ) -> Answer<Self::WatchReadingsStream> {
        unscripted()
    }

    async fn get_calibration(
        &self,
        _: Request<v1::GetCalibrationRequest>,
    ) -> Answer<v1::GetCalibrationResponse> {
        unscripted()
    }

    async fn set_calibration(
        &self,
        _: Request<v1::SetCalibrationRequest>,
    ) -> Answer<v1::SetCalibrationResponse> {
        unscripted()
    }

    async fn begin_calibration(
        &self,
        request: Request<v1::BeginCalibrationRequest>,
    ) -> Answer<v1::BeginCalibrationResponse> {
        let pose = |pose: &str| v1::PoseToHold {
            pose: pose.to_owned(),
            words: format!("Make it {pose}."),
        };
        self.0.lock().unwrap().begun.push(request.into_inner());
        Ok(Response::new(v1::BeginCalibrationResponse {
            run: 7,
            poses: vec![pose("flat"), pose("spread")],
            file: "/etc/bob.toml".to_owned(),
            ..v1::BeginCalibrationResponse::default()
        }))
    }

    async fn capture_pose(
        &self,
        request: Request<v1::CapturePoseRequest>,
    ) -> Answer<Self::CapturePoseStream> {
        use v1::capture_pose_response::Kind;
        let pose = request.into_inner().pose;
        let mut asked = self.0.lock().unwrap();
        asked.poses.push(pose.clone());
        let is_stiff = asked.begun.iter().any(|begun| begun.device == "stiff");
        let answer = |kind| {
            Ok(v1::CapturePoseResponse {
                stamp: None,
                kind: Some(kind),
            })
        };
        let moving = Kind::Progress(v1::CaptureProgress {
            state: "moving".to_owned(),
            moving: vec!["index_mcp".to_owned()],
            ..v1::CaptureProgress::default()
        });
        let end = if is_stiff && pose == "spread" {
            Err(Status::deadline_exceeded("the hand was not still in time"))
        } else {
            answer(Kind::Captured(v1::PoseCaptured {
                pose,
                readings: 150,
                unmoved: false,
            }))
        };
        out(vec![answer(moving), end])
    }

    async fn capture_range(
        &self,
        _: Request<v1::CaptureRangeRequest>,
    ) -> Answer<Self::CaptureRangeStream> {
        let left = |left_s| {
            Ok(v1::CaptureRangeResponse {
                left_s,
                ..v1::CaptureRangeResponse::default()
            })
        };
        out(vec![left(20.0), left(0.0)])
    }

    async fn fit_calibration(
        &self,
        request: Request<v1::FitCalibrationRequest>,
    ) -> Answer<v1::FitCalibrationResponse> {
        let request = request.into_inner();
        self.0.lock().unwrap().fits.push(request);
        if request.save && !request.replace_wearer {
            let text = "/etc/bob.toml is the calibration of \"bob\"";
            return Err(Status::failed_precondition(text));
        }
        let quality = |sensor: &str, verdict: &str, error_deg| v1::SensorQuality {
            sensor: sensor.to_owned(),
            travel: 180.0,
            noise: 0.5,
            separation: 175.0,
            error_deg,
            score: if verdict == "good" { 0.98 } else { 0.0 },
            verdict: verdict.to_owned(),
        };
        let saved = if request.save { "/etc/bob.toml" } else { "" };
        Ok(Response::new(v1::FitCalibrationResponse {
            toml: "wearer = \"alice\"\n".to_owned(),
            qualities: vec![
                quality("index_mcp", "good", Some(0.6)),
                quality("palm_arch", "dead", None),
            ],
            file: saved.to_owned(),
            ..v1::FitCalibrationResponse::default()
        }))
    }

    async fn cancel_calibration(
        &self,
        _: Request<v1::CancelCalibrationRequest>,
    ) -> Answer<v1::CancelCalibrationResponse> {
        self.0.lock().unwrap().n_cancelled += 1;
        Ok(Response::new(v1::CancelCalibrationResponse::default()))
    }

    async fn hold_tracker(
        &self,
        _: Request<v1::HoldTrackerRequest>,
    ) -> Answer<Self::HoldTrackerStream> {
        use v1::hold_tracker_response::Kind;
        let mut asked = self.0.lock().unwrap();
        asked.n_holds += 1;
        // Each place is held twice before the hand moves on.
        let x = 0.3 * (asked.n_holds.div_ceil(2)) as f64;
        let position = Some(v1::Vec3 { x, y: 0.0, z: 0.0 });
        let held = Kind::Held(v1::TrackerHeld {
            pose: Some(v1::Pose {
                position,
                rotation: None,
            }),
            noise_m: 0.001,
            ..v1::TrackerHeld::default()
        });
        out(vec![Ok(v1::HoldTrackerResponse {
            stamp: None,
            kind: Some(held),
        })])
    }

    async fn set_room(&self, request: Request<v1::SetRoomRequest>) -> Answer<v1::SetRoomResponse> {
        self.0.lock().unwrap().rooms.push(request.into_inner());
        Ok(Response::new(v1::SetRoomResponse {
            edge_m: 0.3,
            residual_m: 0.02,
            toml: "transmitter_position = [1.0, 2.0, 3.0]\n".to_owned(),
            ..v1::SetRoomResponse::default()
        }))
    }

    async fn set_mount(&self, _: Request<v1::SetMountRequest>) -> Answer<v1::SetMountResponse> {
        unscripted()
    }
}

/// Runs `tsukamu calibrate` to its end; nobody is there to press Enter.
async fn calibrate(args: &[&str]) -> (Output, Desk) {
    let running = Running::start().await;
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let desk = Desk::default();
    let serving = Server::builder()
        .add_service(WorldServer::new(running.fake.clone()))
        .add_service(CalibrationServer::new(desk.clone()))
        .serve_with_incoming(TcpListenerStream::new(listener));
    let task = tokio::spawn(async move { serving.await.unwrap() });
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsukamu"));
    command
        .env_remove("TSUKAMU_ADDRESS")
        .args(["--address", &address, "calibrate"])
        .args(args)
        .stdin(std::process::Stdio::null());
    let output = tokio::task::spawn_blocking(move || command.output().unwrap());
    let output = output.await.unwrap();
    task.abort();
    (output, desk)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[tokio::test]
async fn a_glove_is_led_through_its_poses_and_judged() {
    let (output, desk) = calibrate(&["glove", "--wearer", "alice", "--hand", "left"]).await;
    assert!(output.status.success(), "{output:?}");
    let told = text(&output.stdout);
    for part in [
        "pose 1 of 2, flat: Make it flat.",
        "pose 2 of 2, spread: Make it spread.",
        "held: 150 readings",
        "index mcp  180     0.50   175      0.6°   0.98   good",
        "dead: taken for absent",
        "dead: palm arch. If the glove has them",
        "in force now",
        "not saved: /etc/bob.toml is the calibration of \"bob\"; --replace does it",
    ] {
        assert!(told.contains(part), "{part} is missing in\n{told}");
    }
    let asked = desk.0.lock().unwrap();
    assert_eq!(asked.begun[0].wearer, "alice");
    assert_eq!(asked.begun[0].hand(), v1::Side::Left);
    assert_eq!(asked.poses, ["flat", "spread"]);
    let uses: Vec<(bool, bool)> = asked.fits.iter().map(|fit| (fit.apply, fit.save)).collect();
    assert_eq!(uses, [(false, false), (true, true), (true, false)]);
    assert_eq!(asked.n_cancelled, 0);
}

#[tokio::test]
async fn the_result_is_written_here_and_replaced_only_on_request() {
    let file = std::env::temp_dir().join(format!("tsukamu-calibrate-{}.toml", std::process::id()));
    let path = file.to_str().unwrap();
    let args = ["glove", "--quick", "--json", "-o", path];
    let (output, _) = calibrate(&args).await;
    let value: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!(
        (&value["applied"], &value["file"]),
        (&true.into(), &Value::Null)
    );
    assert_eq!(value["sensors"][1]["verdict"], "dead");
    assert!(
        value["refused"].as_str().unwrap().contains("bob"),
        "{value}"
    );
    assert_eq!(
        std::fs::read_to_string(&file).unwrap(),
        "wearer = \"alice\"\n"
    );
    let (again, desk) = calibrate(&args).await;
    let (replaced, other) = calibrate(&[&args[..], &["--replace"]].concat()).await;
    std::fs::remove_file(&file).unwrap();
    assert!(!again.status.success() && text(&again.stderr).contains("is there already"));
    let n_cancelled = desk.0.lock().unwrap().n_cancelled;
    assert_eq!(n_cancelled, 1, "what cannot be written is given up");
    let value: Value = serde_json::from_str(&text(&replaced.stdout)).unwrap();
    assert_eq!(value["file"], "/etc/bob.toml");
    assert!(
        other.0.lock().unwrap().poses.is_empty(),
        "the quick routine has no poses"
    );
}

#[tokio::test]
async fn a_pose_that_is_not_held_ends_the_run_with_the_reason() {
    let (output, desk) = calibrate(&["stiff"]).await;
    assert_eq!(output.status.code(), Some(1));
    let told = text(&output.stderr);
    assert!(told.contains("the hand was not still in time"), "{told}");
    let asked = desk.0.lock().unwrap();
    assert_eq!((asked.fits.len(), asked.n_cancelled), (0, 1));
}

#[tokio::test]
async fn the_room_takes_three_places() {
    let (output, desk) = calibrate(&["tracker", "--room", "--at", "-0.5,0,1"]).await;
    assert!(output.status.success(), "{output:?}");
    let told = text(&output.stdout);
    for part in [
        "3 of 3: Touch the table",
        "is 0.300 m: compare it with a ruler; points ± 1.0 mm, 20.0 mm off their plane",
        "the points are not of one plane",
        "    transmitter_position = [1.0, 2.0, 3.0]",
        "for `room = \"FILE\"`",
    ] {
        assert!(told.contains(part), "{part} is missing in\n{told}");
    }
    let asked = desk.0.lock().unwrap();
    let room = &asked.rooms[0];
    let places: Vec<f64> = room
        .points
        .iter()
        .map(|point| (point.x * 10.0).round())
        .collect();
    assert_eq!(
        places,
        [3.0, 6.0, 9.0],
        "a place that is held twice counts once"
    );
    assert_eq!(
        room.corner.unwrap(),
        v1::Vec3 {
            x: -0.5,
            y: 0.0,
            z: 1.0
        }
    );
}
