//! A hand that a client drives, for VRPN to show.

use nalgebra::{UnitQuaternion, Vector3};
use tokio_stream::wrappers::ReceiverStream;
use tsukamu_proto::v1;
use tsukamu_proto::v1::drive_request::Kind as Ask;
use tsukamu_proto::v1::drive_response::Kind;
use tsukamu_proto::v1::hands_client::HandsClient;
use tsukamu_server::daemon::Daemon;
use tsukamu_server::settings::Mode;

use super::hands::{ask, open, state_where};
use super::support::{connect, control, cubes, next, soon, step};
use super::vrpn_probe::vrpn_daemon;

/// A client that drives `alice:right`; the hand goes when this does.
pub(crate) struct Alice {
    requests: tokio::sync::mpsc::Sender<v1::DriveRequest>,
    answers: tonic::Streaming<v1::DriveResponse>,
}

/// Turned by 90 degrees about y.
pub(crate) fn rotation() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2)
}

impl Alice {
    pub(crate) async fn enter(daemon: &Daemon) -> Self {
        let mut hands = HandsClient::new(connect(daemon).await);
        let (requests, receiver) = tokio::sync::mpsc::channel(8);
        let mut answers = soon(hands.drive(ReceiverStream::new(receiver)))
            .await
            .expect("a stream")
            .into_inner();
        requests.send(open("alice:right")).await.expect("sent");
        let opened = next(&mut answers).await.kind;
        assert!(matches!(opened, Some(Kind::Opened(_))));
        Self { requests, answers }
    }

    /// Sends a sample, and waits until the daemon has it: wrist at `x`, index finger bent by 0.5 rad.
    pub(crate) async fn sample(&mut self, source_ns: u64, x: f64) {
        let turned = rotation();
        let mut angles = vec![0.0; 21];
        angles[4] = 0.5;
        let sample = v1::HandSample {
            source_ns,
            wrist: Some(v1::Pose {
                position: Some(v1::Vec3 { x, y: 1.0, z: 0.0 }),
                rotation: Some(v1::Quat {
                    x: turned.i,
                    y: turned.j,
                    z: turned.k,
                    w: turned.w,
                }),
            }),
            joints: Vec::new(),
            angles,
            valid: true,
        };
        self.requests
            .send(ask(Ask::Sample(sample)))
            .await
            .expect("sent");
        state_where(&mut self.answers, |state| {
            state.received_source_ns == source_ns
        })
        .await;
    }
}

/// A daemon in lockstep after one step, with the hand of `alice:right` at x = 0.25.
pub(crate) async fn stage() -> (Daemon, Alice) {
    let daemon = vrpn_daemon(cubes(1, 240.0), Mode::Lockstep, 500.0).await;
    let mut alice = Alice::enter(&daemon).await;
    alice.sample(10, 0.25).await;
    step(&mut control(&daemon).await, 1).await;
    (daemon, alice)
}
