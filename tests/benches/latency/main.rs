//! How long it takes from a byte on the serial line to a frame at a subscriber, on loopback, at 1000 steps per second.
//!
//! An emulated CyberGlove on a pseudo-terminal bends its index finger with every sixth record and notes the time just
//! before it writes the record. The daemon (driver, hand, world, gRPC) runs on threads of its own. A subscriber in this
//! process notes when the first frame arrives that the bend shows in, and the one in which nine tenths of its way are done:
//! where the daemon interpolates between samples, that is one interval of the glove later. The glove's period is no
//! multiple of the step, so that records come in every phase of it. The line is not paced: the 2 ms that 24 bytes take at
//! 115200 bit/s come on top with real gloves.
//!
//! `cargo bench -p tsukamu-tests --bench latency`

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

mod glove;
mod match_up;
mod table;

use std::path::Path;
use std::time::{Duration, Instant};

use tonic::transport::Endpoint;
use tsukamu_proto::v1::watch_frames_response::Kind;
use tsukamu_proto::v1::world_client::WorldClient;
use tsukamu_proto::v1::{Frame, WatchFramesRequest};
use tsukamu_server::daemon::{Daemon, DaemonConfig, start};
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::settings::{self, Mode, overrides::Overrides};

use crate::glove::{Bends, wear};
use crate::match_up::{MatchUp, Seen, now_ns};

/// Steps per second.
const RATE_HZ: f64 = 1000.0;
/// Time that is measured.
const MEASURING: Duration = Duration::from_secs(90);
/// Longest wait for the daemon's first frame with a tracked hand.
const START_MAX: Duration = Duration::from_secs(20);

fn main() -> anyhow::Result<()> {
    let folder = std::env::temp_dir().join(format!("tsukamu-latency-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let done = run(&folder);
    std::fs::remove_dir_all(&folder)?;
    done
}

fn run(folder: &Path) -> anyhow::Result<()> {
    let bends = Bends::default();
    let worn = wear(folder, &bends)?;
    // The subscriber's runtime is not the daemon's: neither polls the other's sockets.
    let served = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    let daemon = served.block_on(start(config(folder)?))?;
    let watching = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let found = watching.block_on(watch(&daemon, &bends))?;
    let n_bends = bends.n_between(found.counting_since_ns, now_ns());
    served.block_on(daemon.shutdown())?;
    drop(worn);
    table::print(&found, n_bends, RATE_HZ);
    Ok(())
}

/// A daemon at 1000 steps per second with that glove and that tracker.
fn config(folder: &Path) -> anyhow::Result<DaemonConfig> {
    let file = |name: &str| folder.join(name).display().to_string();
    let text = format!(
        "[[device]]\nname = 'glove'\nkind = 'cyberglove'\nport = '{glove}'\nsample_rate_hz = {rate}\n\
         [[device]]\nname = 'tracker'\nkind = 'fastrak'\nport = '{tracker}'\n\
         [[hand]]\nname = 'bench:right'\nside = 'right'\nglove = 'glove'\ntracker = 'tracker'\n",
        glove = file("glove"),
        tracker = file("tracker"),
        rate = glove::RATE_HZ,
    );
    let settings = settings::parse("bench.toml", &text, Path::new(""), &Overrides::default())
        .map_err(|mistakes| anyhow::anyhow!("{mistakes}"))?;
    let mut loaded = load("operations/free").map_err(|mistakes| anyhow::anyhow!("{mistakes}"))?;
    loaded.scene.rate_hz = RATE_HZ;
    let config = DaemonConfig::new(plan(&loaded, Cast::Nobody)?, Mode::Realtime);
    Ok(DaemonConfig {
        devices: settings.devices,
        hands: settings.hands,
        ..config
    })
}

async fn watch(daemon: &Daemon, bends: &Bends) -> anyhow::Result<MatchUp> {
    let address = format!("http://{}", daemon.local_addr());
    let channel = Endpoint::from_shared(address)?
        .tcp_nodelay(true)
        .connect()
        .await?;
    let request = WatchFramesRequest { max_rate_hz: 0.0 };
    let mut frames = WorldClient::new(channel)
        .watch_frames(request)
        .await?
        .into_inner();
    let mut found = MatchUp::default();
    let begin = Instant::now();
    let mut first = None;
    while first.is_none_or(|first: Instant| first.elapsed() < MEASURING) {
        anyhow::ensure!(
            first.is_some() || begin.elapsed() < START_MAX,
            "the glove's hand does not come"
        );
        let message = frames.message().await?;
        let arrival_ns = now_ns();
        match message.and_then(|message| message.kind) {
            Some(Kind::Frame(frame)) => {
                let Some(seen) = seen(&frame, arrival_ns) else {
                    continue;
                };
                first.get_or_insert_with(Instant::now);
                found.take(&seen, bends);
            }
            Some(Kind::Skipped(skipped)) => found.n_skipped += skipped.count,
            None => anyhow::bail!("the frames end"),
        }
    }
    Ok(found)
}

/// What one frame shows of the index finger; `None` before the hand is tracked.
fn seen(frame: &Frame, arrival_ns: u64) -> Option<Seen> {
    let tracked = &frame.hands.first()?.tracked;
    let joint = |index: usize| tracked.get(3 * index..3 * index + 3);
    let (fixed, tip) = (joint(glove::FIXED_JOINT)?, joint(glove::BENT_JOINT)?);
    let square: f32 = fixed.iter().zip(tip).map(|(a, b)| (a - b) * (a - b)).sum();
    square.is_finite().then_some(Seen {
        distance_m: f64::from(square).sqrt(),
        step_ns: frame.stamp.as_ref()?.wall_ns,
        arrival_ns,
    })
}
