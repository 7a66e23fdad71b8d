//! The one port: gRPC, gRPC-Web, health, reflection, a status page, metrics.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::{get, post};
use axum::serve::ListenerExt;
use serde_json::{Value, json};
use socket2::{SockRef, TcpKeepalive};
use tokio::net::{TcpListener, TcpStream};
use tonic::Status;
use tonic::body::Body;
use tonic::service::Routes;
use tsukamu_proto::FILE_DESCRIPTOR_SET;
use tsukamu_proto::unary::world_server::WorldServer;
use tsukamu_proto::v1::HandStream;
use tsukamu_proto::v1::calibration_server::CalibrationServer;
use tsukamu_proto::v1::clock_server::ClockServer;
use tsukamu_proto::v1::control_server::ControlServer;
use tsukamu_proto::v1::devices_server::DevicesServer;
use tsukamu_proto::v1::hands_server::HandsServer;
use tsukamu_proto::v1::recordings_server::RecordingsServer;

use crate::service::Backend;
use crate::service::calibration::CalibrationService;
use crate::service::clock::ClockService;
use crate::service::control::ControlService;
use crate::service::devices::DevicesService;
use crate::service::hands::HandsService;
use crate::service::recordings::RecordingsService;
use crate::service::world::WorldService;

/// Largest command, in bytes: an object's mesh.
const COMMAND_BYTES_MAX: usize = 64 << 20;
/// Silence after which a peer is asked whether it is still there, and how often then.
const SILENCE: Duration = Duration::from_secs(30);
/// See [`SILENCE`].
const PROBE_INTERVAL: Duration = Duration::from_secs(10);
/// How long bytes may wait for a peer before it counts as gone; also one that is there and takes nothing.
#[cfg(target_os = "linux")]
const UNANSWERED_MAX: Duration = Duration::from_secs(120);
/// The page at `/`.
const PAGE: &str = include_str!("page.html");
/// What Prometheus expects of OpenMetrics text.
const OPEN_METRICS: HeaderValue =
    HeaderValue::from_static("application/openmetrics-text; version=1.0.0; charset=utf-8");
/// What `/status.json` is.
const JSON: HeaderValue = HeaderValue::from_static("application/json");
/// The page may load nothing from anywhere but here.
const PAGE_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; connect-src 'self'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'",
);

/// Serves on that listener until `stop`, and then until every connection is done.
///
/// # Errors
/// When the reflection service refuses the schema, or the listener breaks.
pub async fn serve(
    listener: TcpListener,
    backend: Backend,
    stop: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let app = app(backend)
        .await?
        .into_make_service_with_connect_info::<SocketAddr>();
    // With Nagle's algorithm a small frame waits tens of milliseconds for the one before to be acknowledged.
    let listener = listener.tap_io(|socket| {
        // A socket that refuses is gone already.
        let _ = socket.set_nodelay(true);
        let _ = notice_silence(socket);
    });
    axum::serve(listener, app)
        .with_graceful_shutdown(stop)
        .await
}

/// Lets the system find out that a peer has vanished without a word: a machine that was switched off, a cable.
pub(crate) fn notice_silence(socket: &TcpStream) -> io::Result<()> {
    let socket = SockRef::from(socket);
    socket.set_tcp_keepalive(
        &TcpKeepalive::new()
            .with_time(SILENCE)
            .with_interval(PROBE_INTERVAL),
    )?;
    #[cfg(target_os = "linux")]
    socket.set_tcp_user_timeout(Some(UNANSWERED_MAX))?;
    Ok(())
}

async fn app(backend: Backend) -> io::Result<Router> {
    let frames = |State(backend): State<Backend>, request| backend.watch_frames(request);
    let events = |State(backend): State<Backend>, request| backend.watch_events(request);
    let streams = Router::new()
        .route("/tsukamu.v1.World/WatchFrames", post(frames))
        .route("/tsukamu.v1.World/WatchEvents", post(events))
        .with_state(backend.clone());
    let grpc = services(backend.clone())
        .await?
        .into_axum_router()
        .merge(streams)
        .layer(tonic_web::GrpcWebLayer::new());
    let pages = Router::new()
        .route("/", get(page))
        .route("/status.json", get(status))
        .route("/metrics", get(metrics))
        .with_state(backend);
    Ok(pages.merge(grpc.reset_fallback()).fallback(nothing_here))
}

async fn services(backend: Backend) -> io::Result<Routes> {
    let reflection = tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        .build_v1()
        .map_err(io::Error::other)?;
    let (health, health_service) = tonic_health::server::health_reporter();
    health.set_serving::<WorldServer<WorldService>>().await;
    health.set_serving::<HandsServer<HandsService>>().await;
    health.set_serving::<ControlServer<ControlService>>().await;
    health.set_serving::<DevicesServer<DevicesService>>().await;
    health
        .set_serving::<RecordingsServer<RecordingsService>>()
        .await;
    health
        .set_serving::<CalibrationServer<CalibrationService>>()
        .await;
    health.set_serving::<ClockServer<ClockService>>().await;
    let control = ControlServer::new(ControlService(backend.clone()))
        .max_decoding_message_size(COMMAND_BYTES_MAX);
    Ok(Routes::new(WorldServer::new(WorldService(backend.clone())))
        .add_service(HandsServer::new(HandsService(backend.clone())))
        .add_service(control)
        .add_service(DevicesServer::new(DevicesService(backend.clone())))
        .add_service(RecordingsServer::new(RecordingsService(backend.clone())))
        .add_service(CalibrationServer::new(CalibrationService(backend.clone())))
        .add_service(ClockServer::new(ClockService(backend)))
        .add_service(health_service)
        .add_service(reflection))
}

async fn page() -> impl IntoResponse {
    ([(header::CONTENT_SECURITY_POLICY, PAGE_POLICY)], Html(PAGE))
}

async fn metrics(State(backend): State<Backend>) -> impl IntoResponse {
    let sources = backend.devices_now().devices;
    (
        [(header::CONTENT_TYPE, OPEN_METRICS)],
        backend.metrics.text(&sources),
    )
}

/// One stream of a hand on the status page.
fn stream(stream: &HandStream) -> Value {
    json!({
        "lag_s": stream.lag_s, "lead_s": stream.lead_s, "age_s": stream.age_s,
        "position_error_m": stream.position_error_m, "angle_error_rad": stream.angle_error_rad,
    })
}

/// The status page's numbers.
async fn status(State(backend): State<Backend>) -> impl IntoResponse {
    let status = backend.status_now();
    let stamp = status.stamp.unwrap_or_default();
    let devices: Vec<Value> = backend.devices_now().devices.into_iter().map(|device| json!({
        "name": device.name, "kind": device.kind, "place": device.place, "state": device.state,
        "error": device.error, "warnings": device.warnings.iter().map(|warning| &warning.text).collect::<Vec<_>>(), "rate_hz": device.rate_hz, "age_s": device.age_s, "dropped": device.dropped, "superseded": device.superseded,
        "wrist": device.wrist.as_ref().map(stream), "fingers": device.fingers.as_ref().map(stream),
    })).collect();
    let all = json!({
        "version": status.version, "scene": status.scene, "model": status.model, "mode": status.mode,
        "paused": status.paused, "epoch": stamp.epoch, "tick": stamp.tick, "world_time_s": stamp.world_time_s,
        "rate_hz": status.rate_hz, "measured_rate_hz": status.measured_rate_hz, "overruns": status.overruns,
        "step_time_p50_s": status.step_time_p50_s, "step_time_p99_s": status.step_time_p99_s,
        "n_objects": status.n_objects, "n_hands": status.n_hands,
        "n_frame_subscribers": status.n_frame_subscribers, "n_event_subscribers": status.n_event_subscribers,
        "n_events": backend.events.n_events(),
        "frames_sent": backend.metrics.frames_sent.get(), "frames_skipped": backend.metrics.frames_skipped.get(),
        "recording": status.recording, "uptime_s": status.uptime_s, "devices": devices,
    });
    ([(header::CONTENT_TYPE, JSON)], all.to_string())
}

/// A gRPC client is told in its own way that a method is not there.
async fn nothing_here(request: Request) -> Response {
    let kind = request.headers().get(header::CONTENT_TYPE);
    if kind.is_some_and(|kind| kind.as_bytes().starts_with(b"application/grpc")) {
        let status = Status::unimplemented(format!("there is no method {}", request.uri().path()));
        return status.into_http::<Body>().map(axum::body::Body::new);
    }
    (
        StatusCode::NOT_FOUND,
        "nothing here: the status page is at /, metrics at /metrics, gRPC on this port\n",
    )
        .into_response()
}
