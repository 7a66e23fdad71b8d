//! What sixteen devices cost: eight gloves and eight trackers of every serial kind, emulated on pseudo-terminals at the pace
//! of their lines, drive eight hands at 1000 steps per second.
//!
//! The daemon is a process of its own (this program again, as `serve`); its time is user and system time from
//! `/proc/PID/stat`. The emulators are in this one, and share the machine's processors with it.
//!
//! `cargo bench -p tsukamu-tests --bench devices`

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

#[path = "../shared/process.rs"]
mod process;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use tonic::transport::Channel;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_motion::synthetic::{SceneInfo, build};
use tsukamu_proto::v1::devices_client::DevicesClient;
use tsukamu_proto::v1::world_client::WorldClient;
use tsukamu_proto::v1::{Device, GetStatusRequest, GetStatusResponse, ListDevicesRequest};
use tsukamu_server::daemon::{DaemonConfig, start};
use tsukamu_server::emulate::kinds::{KINDS, Kind};
use tsukamu_server::emulate::{Played, Plug, Plugged, TrackerPlace, Worn};
use tsukamu_server::offline::hands::Motion;
use tsukamu_server::plan::{Cast, plan};
use tsukamu_server::scene_file::load;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::{self, Mode};

use crate::process::{Server, say};

/// Steps per second.
const RATE_HZ: f64 = 1000.0;
/// What the hands do, and where.
const SCENE: &str = "operations/free";
/// Kind and model of each glove, and of the tracker on the same hand.
const PAIRS: [[(&str, &str); 2]; 8] = [
    [("cyberglove", "22"), ("fastrak", "")],
    [("cyberglove", "18"), ("isotrak", "isotrak2")],
    [("lucidglove", ""), ("liberty", "liberty")],
    [("lucidglove", ""), ("flock", "flock")],
    [("5dt", "16"), ("fastrak", "")],
    [("5dt", "5w"), ("isotrak", "3space")],
    [("delimited", "sketch"), ("liberty", "patriot")],
    [("opencyberglove", ""), ("flock", "flock")],
];
/// Longest start-up of all devices together.
const START_MAX: Duration = Duration::from_secs(60);
/// Time that is measured.
const MEASURING: Duration = Duration::from_secs(20);

fn main() -> anyhow::Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [first, file, ..] = words.as_slice()
        && first == "serve"
    {
        return serve(Path::new(file));
    }
    let folder = std::env::temp_dir().join(format!("tsukamu-devices-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let done = measure(&folder);
    std::fs::remove_dir_all(&folder)?;
    done
}

/// Runs a daemon with those settings until it is killed.
fn serve(file: &Path) -> anyhow::Result<()> {
    let settings = settings::load(Some(file), &Overrides::default())
        .map_err(|mistakes| anyhow::anyhow!("{mistakes}"))?;
    let mut loaded = load(SCENE).map_err(|mistakes| anyhow::anyhow!("{mistakes}"))?;
    loaded.scene.rate_hz = RATE_HZ;
    let config = DaemonConfig {
        devices: settings.devices,
        hands: settings.hands,
        ..DaemonConfig::new(plan(&loaded, Cast::Nobody)?, Mode::Realtime)
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    runtime.block_on(async {
        let daemon = start(config).await?;
        say(daemon.local_addr())?;
        daemon.failed().await;
        Ok(())
    })
}

fn measure(folder: &Path) -> anyhow::Result<()> {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!("16 devices, 8 hands, {RATE_HZ} steps per second, {SCENE}");
    println!(
        "load of the machine before the start {}",
        load.split_whitespace().next().unwrap_or("not told")
    );
    let (plugged, file) = plug_in(folder)?;
    let server = Server::start(&["serve", &file.display().to_string()])?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let done = runtime.block_on(watch(&server));
    drop(plugged);
    done
}

/// Emulates every device, and writes the settings that name them.
fn plug_in(folder: &Path) -> anyhow::Result<(Vec<Box<dyn Plugged>>, PathBuf)> {
    let loaded = load(SCENE).map_err(|mistakes| anyhow::anyhow!("{mistakes}"))?;
    let motion = build("free", &SceneInfo::from(&loaded.scene))?;
    let played = Played {
        motion: Motion::Synthetic(Box::new(motion)),
        repeats: true,
    };
    let (mut plugged, mut text) = (Vec::new(), String::new());
    for (index, pair) in PAIRS.iter().enumerate() {
        for (part, (kind, model)) in ["glove", "tracker"].into_iter().zip(pair) {
            let kind = KINDS
                .iter()
                .find(|row| row.name == *kind)
                .context("a kind")?;
            let name = format!("{part}{index}");
            plugged.push(emulate(kind, model, &played, folder.join(&name))?);
            let port = folder.join(&name).display().to_string();
            write!(
                text,
                "[[device]]\nname = {name:?}\nkind = {:?}\nport = {port:?}\n{}",
                kind.name,
                (kind.settings)(model)
            )?;
        }
        write!(
            text,
            "[[hand]]\nname = \"hand{index}\"\nside = \"right\"\nglove = \"glove{index}\"\ntracker = \"tracker{index}\"\n"
        )?;
    }
    let file = folder.join("settings.toml");
    std::fs::write(&file, text)?;
    Ok((plugged, file))
}

fn emulate(
    kind: &Kind,
    model: &str,
    played: &Played,
    link: PathBuf,
) -> anyhow::Result<Box<dyn Plugged>> {
    let model = kind.models.iter().find(|name| **name == model);
    let model = model.with_context(|| format!("{} has no such model", kind.name))?;
    let worn = Worn {
        played: played.clone(),
        calibration: GloveCalibration::default(),
        place: TrackerPlace::default(),
        model,
        plug: Plug {
            link: Some(link),
            baud: Some((kind.baud)(model)),
        },
        to: None,
    };
    Ok((kind.spawn)(worn)?)
}

/// Waits until all run, then measures.
async fn watch(server: &Server) -> anyhow::Result<()> {
    let channel = Channel::from_shared(format!("http://{}", server.address()))?
        .connect()
        .await?;
    let mut devices = DevicesClient::new(channel.clone());
    let begin = Instant::now();
    loop {
        let list = list(&mut devices).await?;
        let n_running = list
            .iter()
            .filter(|device| device.state == "running")
            .count();
        if n_running == 2 * PAIRS.len() {
            break;
        }
        anyhow::ensure!(
            begin.elapsed() < START_MAX,
            "only {n_running} devices run: {list:#?}"
        );
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    println!("all run after {:.1} s", begin.elapsed().as_secs_f64());
    let mut world = WorldClient::new(channel);
    let (start, cpu_s) = (Instant::now(), server.cpu_s()?);
    let (before, list_before) = (status(&mut world).await?, list(&mut devices).await?);
    tokio::time::sleep(MEASURING).await;
    let (after, list_after) = (status(&mut world).await?, list(&mut devices).await?);
    let time_s = start.elapsed().as_secs_f64();
    let cpu_percent = 100.0 * (server.cpu_s()? - cpu_s) / time_s;
    table(&list_before, &list_after, time_s);
    let ticks = |status: &GetStatusResponse| status.stamp.map_or(0, |stamp| stamp.tick);
    println!(
        "{:.2} steps/s, {} overruns, step p99 {:.0} us, {cpu_percent:.1} % of one processor in all",
        (ticks(&after) - ticks(&before)) as f64 / time_s,
        after.overruns - before.overruns,
        after.step_time_p99_s * 1.0e6
    );
    Ok(())
}

fn table(before: &[Device], after: &[Device], time_s: f64) {
    println!(
        "{:>10} {:>15} {:>9} {:>8} {:>8}",
        "device", "kind", "samples/s", "resyncs", "dropped"
    );
    for (old, new) in before.iter().zip(after) {
        println!(
            "{:>10} {:>15} {:>9.1} {:>8} {:>8}",
            new.name,
            new.kind,
            (new.samples - old.samples) as f64 / time_s,
            new.resyncs - old.resyncs,
            new.dropped - old.dropped
        );
    }
}

/// The devices without the hands that they make.
async fn list(devices: &mut DevicesClient<Channel>) -> anyhow::Result<Vec<Device>> {
    let list = devices
        .list_devices(ListDevicesRequest {})
        .await?
        .into_inner();
    let is_device = |device: &Device| device.kind != "hand";
    Ok(list.devices.into_iter().filter(is_device).collect())
}

async fn status(world: &mut WorldClient<Channel>) -> anyhow::Result<GetStatusResponse> {
    Ok(world.get_status(GetStatusRequest {}).await?.into_inner())
}
