//! Readings of a device as they are asked for by clients that do not mean it well.

use std::path::Path;

use tonic::Code;
use tsukamu_proto::v1;
use tsukamu_proto::v1::calibration_client::CalibrationClient;
use tsukamu_server::daemon::{DaemonConfig, start};
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{self, Mode};

use super::support::{config, connect, cubes, soon};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rate_of_nearly_nothing_is_refused_and_a_stream_ends_with_the_daemon() {
    let text = "[[device]]\nname = \"glove\"\nkind = \"cyberglove\"\nport = \"/dev/none\"\n";
    let settings = settings::parse("test.toml", text, Path::new(""), &Overrides::default())
        .unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let config = DaemonConfig {
        devices: settings.devices,
        ..config(cubes(0, 240.0), Mode::Realtime)
    };
    let daemon = start(config).await.expect("it starts");
    let mut client = CalibrationClient::new(connect(&daemon).await);
    let request = |max_rate_hz: f64| v1::WatchReadingsRequest {
        device: "glove".to_owned(),
        max_rate_hz,
    };
    for rate_hz in [f64::MIN_POSITIVE, 1.0e-300, 1.0e-30, 0.01] {
        let refused = soon(client.watch_readings(request(rate_hz))).await;
        let refused = refused.expect_err("it is too slow");
        assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
    }
    for rate_hz in [f64::NAN, f64::INFINITY] {
        let refused = soon(client.watch_readings(request(rate_hz))).await;
        let refused = refused.expect_err("it is no rate");
        assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
    }
    let stream = soon(client.watch_readings(request(0.1))).await;
    let mut stream = stream.expect("it is open").into_inner();
    let ended = tokio::spawn(async move { stream.message().await });
    soon(daemon.shutdown()).await.expect("a clean end");
    let last = soon(ended).await.expect("no panic").expect("no error");
    assert!(last.is_none(), "the stream has come to its end");
}
