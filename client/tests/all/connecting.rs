use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use tonic::transport::Server;
use tsukamu_client::connect::{Client, ConnectOptions};
use tsukamu_client::connect_error::ConnectError;
use tsukamu_client::retry::RetryPolicy;
use tsukamu_proto::PROTOCOL_MAJOR;

use crate::fake::{Running, options};

async fn refusal(options: ConnectOptions) -> ConnectError {
    Client::connect(options)
        .await
        .expect_err("there is no daemon that we speak with")
}

#[tokio::test]
async fn nobody_listens() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let error = refusal(ConnectOptions {
        retry: RetryPolicy::ONCE,
        ..options(address)
    })
    .await;
    assert!(
        matches!(error, ConnectError::Unreachable { .. }),
        "{error:?}"
    );
    let text = error.to_string();
    for part in [
        &format!("http://{address}"),
        "refused",
        "tsukamud",
        "--address",
    ] {
        assert!(text.contains(part), "{part} is missing in: {text}");
    }
    assert!(!text.contains('\n'));
}

#[tokio::test]
async fn a_daemon_that_starts_late_is_found() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let connecting = tokio::spawn(Client::connect(options(address)));
    // The first attempts find nobody.
    tokio::time::sleep(Duration::from_millis(100)).await;
    let _running = Running::start_on(TcpListener::bind(address).await.unwrap());
    let client = connecting.await.unwrap().unwrap();
    assert_eq!(client.status().await.unwrap().version, "9.8.7");
}

#[tokio::test]
async fn another_protocol_is_refused_at_once() {
    let running = Running::start().await;
    running.script().status.protocol_major = PROTOCOL_MAJOR + 1;
    let error = refusal(options(running.fake.address)).await;
    assert!(
        matches!(&error, ConnectError::Version { daemon, daemon_major, client_major, .. }
            if daemon == "9.8.7" && *daemon_major == PROTOCOL_MAJOR + 1 && *client_major == PROTOCOL_MAJOR),
        "{error:?}"
    );
}

#[tokio::test]
async fn another_grpc_service_is_no_daemon() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let incoming = tokio_stream::wrappers::TcpListenerStream::new(listener);
    let routes = tonic::service::Routes::default();
    tokio::spawn(
        Server::builder()
            .add_routes(routes)
            .serve_with_incoming(incoming),
    );
    let error = refusal(options(address)).await;
    assert!(
        matches!(error, ConnectError::WrongService { .. }),
        "{error:?}"
    );
}

#[tokio::test]
async fn a_web_server_is_no_daemon() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        while let Ok((mut stream, _)) = listener.accept().await {
            let mut buffer = [0; 1024];
            let _ = stream.read(&mut buffer).await;
            let _ = stream
                .write_all(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n")
                .await;
        }
    });
    let error = refusal(ConnectOptions {
        retry: RetryPolicy::ONCE,
        ..options(address)
    })
    .await;
    // Which of the two depends on whether its answer or its hanging up is seen first.
    assert!(
        matches!(
            error,
            ConnectError::WrongService { .. } | ConnectError::HungUp { .. }
        ),
        "{error:?}"
    );
}

#[tokio::test]
async fn silence_ends() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let error = refusal(ConnectOptions {
        timeout: Duration::from_millis(100),
        ..options(address)
    })
    .await;
    assert!(
        matches!(error, ConnectError::WrongService { .. }),
        "{error:?}"
    );
    assert!(error.to_string().contains("0.1 s"), "{error}");
    drop(listener);
}
