//! What a subscriber costs: frames of 100 moving objects at 60 Hz to 100, 500 and 1000 subscribers, in frames per second
//! of the server's processor time, beside the same bytes over raw TCP.
//!
//! The server is a process of its own (this program again, as `serve` or `raw`); its time is user and system time from
//! `/proc/PID/stat`. Every subscriber has a connection of its own. The raw server writes one message of a frame's mean size to
//! each of its sockets 60 times a second and does nothing else.
//!
//! `cargo bench -p tsukamu-tests --bench fanout`

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

mod count;
mod grpc;
#[path = "../shared/process.rs"]
mod process;
mod raw;

use std::time::Duration;

use crate::process::Server;

/// Moving objects.
const N_OBJECTS: usize = 100;
/// Frames per second.
const RATE_HZ: f64 = 60.0;
/// Subscribers.
const SUBSCRIBERS: [usize; 3] = [100, 500, 1000];
/// Time for all to have joined and had their first frames.
const SETTLING: Duration = Duration::from_secs(2);
/// Time that is measured.
const MEASURING: Duration = Duration::from_secs(8);
/// Share of raw TCP that is wanted, percent.
const WANTED_PERCENT: f64 = 60.0;

/// What one load came to.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    /// Frames per second of the server's processor time.
    frames_per_cpu_s: f64,
    /// Processor time per time.
    cpu_share: f64,
    /// Frames that arrived, of those that should have.
    delivered: f64,
    /// Mean size of a message, bytes.
    message_bytes: f64,
}

fn main() -> anyhow::Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.first().map(String::as_str) {
        Some("serve") => grpc::serve(),
        Some("raw") => raw::serve(
            words
                .get(1)
                .and_then(|bytes| bytes.parse().ok())
                .unwrap_or(0),
        ),
        _ => measure(),
    }
}

fn measure() -> anyhow::Result<()> {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!("{N_OBJECTS} moving objects at {RATE_HZ} Hz, one connection per subscriber, loopback");
    println!(
        "load of the machine before the start {}",
        load.split_whitespace().next().unwrap_or("not told")
    );
    println!(
        "{:>11} {:>6} {:>20} {:>8} {:>11} {:>9} {:>12}",
        "subscribers", "", "frames/CPU-second", "CPU %", "delivered %", "bytes", "of raw TCP"
    );
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    for n in SUBSCRIBERS {
        let server = Server::start(&["serve"])?;
        let grpc = runtime.block_on(grpc::watch(&server, n))?;
        drop(server);
        let bytes = grpc.message_bytes.round().to_string();
        let server = Server::start(&["raw", &bytes])?;
        let raw = runtime.block_on(raw::watch(&server, n))?;
        drop(server);
        let percent = 100.0 * grpc.frames_per_cpu_s / raw.frames_per_cpu_s;
        row(n, "gRPC", &grpc, &format!("{percent:.0} %"));
        row(n, "raw", &raw, "");
    }
    println!("wanted: {WANTED_PERCENT:.0} % of raw TCP or better, 99 % delivered at 500");
    Ok(())
}

fn row(n: usize, kind: &str, outcome: &Outcome, share: &str) {
    println!(
        "{n:>11} {kind:>6} {:>20.0} {:>8.1} {:>11.2} {:>9.0} {share:>12}",
        outcome.frames_per_cpu_s,
        100.0 * outcome.cpu_share,
        100.0 * outcome.delivered,
        outcome.message_bytes,
    );
}
