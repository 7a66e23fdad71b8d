//! The one port: what is not plain gRPC.

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tonic::Code;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;
use tsukamu_proto::v1;
use tsukamu_server::daemon::{Daemon, DaemonError, start};
use tsukamu_server::settings::Mode;

use super::support::{config, connect, cubes, daemon, soon, world};

/// The whole answer to an HTTP/1.1 request.
async fn http(daemon: &Daemon, head: &str, body: &[u8]) -> Vec<u8> {
    let mut socket = soon(TcpStream::connect(daemon.local_addr()))
        .await
        .expect("it listens");
    let head = format!(
        "{head}\r\nhost: localhost\r\nconnection: close\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    socket.write_all(head.as_bytes()).await.expect("sent");
    socket.write_all(body).await.expect("sent");
    let mut answer = Vec::new();
    soon(socket.read_to_end(&mut answer))
        .await
        .expect("an answer");
    answer
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn status_page_and_metrics_are_on_the_same_port() {
    let daemon = daemon(cubes(2, 240.0), Mode::Lockstep).await;
    let text = async |path: &str| {
        let answer = http(&daemon, &format!("GET {path} HTTP/1.1"), b"").await;
        String::from_utf8(answer).expect("text")
    };
    let page = text("/").await;
    assert!(
        page.starts_with("HTTP/1.1 200") && page.contains("<title>Tsukamu</title>"),
        "{page}"
    );
    assert!(
        !page.contains("http://") && !page.contains("https://"),
        "the page asks nobody else"
    );
    let status = text("/status.json").await;
    for part in [
        "\"scene\":\"cubes\"",
        "\"mode\":\"lockstep\"",
        "\"n_objects\":3",
        "application/json",
    ] {
        assert!(status.contains(part), "{part} is not in {status}");
    }
    let metrics = text("/metrics").await;
    for part in [
        "tsukamu_steps_total 0",
        "tsukamu_step_time_seconds_count",
        "application/openmetrics-text",
        "# EOF",
    ] {
        assert!(metrics.contains(part), "{part} is not in {metrics}");
    }
    assert!(text("/nothing").await.starts_with("HTTP/1.1 404"));
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn grpc_web_works_over_http_1() {
    let daemon = daemon(cubes(2, 240.0), Mode::Lockstep).await;
    let head =
        "POST /tsukamu.v1.World/GetStatus HTTP/1.1\r\ncontent-type: application/grpc-web+proto";
    let answer = http(&daemon, head, &[0; 5]).await;
    let text = String::from_utf8_lossy(&answer);
    assert!(text.starts_with("HTTP/1.1 200"), "{text}");
    assert!(
        text.contains("grpc-status:0"),
        "the trailers are in the body: {text}"
    );
    assert!(
        text.contains("lockstep") && text.contains("cubes"),
        "and so is the status: {text}"
    );
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_not_there_is_unimplemented() {
    let daemon = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    for path in ["/tsukamu.v1.World/Nothing", "/tsukamu.v2.World/GetScene"] {
        let mut client = tonic::client::Grpc::new(connect(&daemon).await);
        soon(client.ready()).await.expect("a connection");
        let codec = tonic_prost::ProstCodec::<v1::GetSceneRequest, v1::GetSceneResponse>::default();
        let request = tonic::Request::new(v1::GetSceneRequest {});
        let refused = soon(client.unary(request, path.parse().expect("a path"), codec))
            .await
            .expect_err(path);
        assert_eq!(refused.code(), Code::Unimplemented, "{refused}");
    }
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn status_health_and_clock_answer() {
    let daemon = daemon(cubes(2, 240.0), Mode::Lockstep).await;
    let status = soon(world(&daemon).await.get_status(v1::GetStatusRequest {}))
        .await
        .expect("a status")
        .into_inner();
    assert_eq!(
        (status.protocol_major, status.mode.as_str()),
        (1, "lockstep")
    );
    assert_eq!(
        (status.n_objects, status.n_hands, status.rate_hz),
        (3, 0, 240.0)
    );
    let service = "tsukamu.v1.Hands".to_owned();
    let mut health = HealthClient::new(connect(&daemon).await);
    let health = soon(health.check(HealthCheckRequest { service }))
        .await
        .expect("known")
        .into_inner();
    assert_eq!(health.status, 1, "serving");
    let mut clock = v1::clock_client::ClockClient::new(connect(&daemon).await);
    let ping = soon(clock.ping(v1::PingRequest { client_ns: 7 }))
        .await
        .expect("a time")
        .into_inner();
    assert_eq!(ping.client_ns, 7);
    assert!(ping.received_ns <= ping.sent_ns && ping.stamp.is_some());
    let mut devices = v1::devices_client::DevicesClient::new(connect(&daemon).await);
    let list = soon(devices.list_devices(v1::ListDevicesRequest {}))
        .await
        .expect("a list")
        .into_inner();
    assert!(list.devices.is_empty());
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_in_use_is_said() {
    let first = daemon(cubes(0, 240.0), Mode::Lockstep).await;
    let mut config = config(cubes(0, 240.0), Mode::Lockstep);
    config.listen = first.local_addr();
    let fault = start(config).await.expect_err("it is taken");
    assert!(
        matches!(fault, DaemonError::InUse(address) if address == first.local_addr()),
        "{fault}"
    );
    first.shutdown().await.expect("a clean end");
}
