//! Every driver against its emulator, from the port to a client: start-up, ten seconds of stream, a cable that is pulled
//! three times, spoilt bytes, a stall, and a power cut in mid-record. After each the readings are right as far as the
//! protocol resolves. All devices are on one daemon at once, each on a hand whose other half is a plain device that
//! must not notice anything.

#![allow(
    clippy::print_stdout,
    reason = "the figures are half of what this test is for"
)]

use std::sync::Arc;

use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_motion::track::TrackHand;
use tsukamu_server::emulate::kinds::KINDS;
use tsukamu_server::emulate::{Played, Plug, Plugged, TrackerPlace, Worn};
use tsukamu_server::offline::hands::Motion;

use crate::drivers_kinds::{PROMISES, Promise};
use crate::drivers_lab::Lab;
use crate::drivers_ordeal::{Ordeal, Report, Subject};
use crate::drivers_vrpn::{VRPN, VrpnLine};
use crate::rig::{Folder, daemon_config, hand};
use crate::sources::free_port;

/// Names of the other halves.
const PLAIN: [(&str, &str); 2] = [("plain glove", "cyberglove"), ("plain tracker", "fastrak")];

/// A hand that stays as it is: a computed one at its beginning, without its tremor.
pub(crate) fn still_hand() -> Played {
    let hand = hand("operations/free", "free?start=600");
    let still = TrackHand {
        side: hand.side(),
        times_s: vec![0.0],
        samples: vec![hand.sample_at(0.0)],
    };
    Played {
        motion: Motion::Track(still),
        repeats: false,
    }
}

/// What an emulated device is given; its terminal has no link yet.
pub(crate) fn worn(played: &Played, model: &'static str, baud: u32) -> Worn {
    Worn {
        played: played.clone(),
        calibration: GloveCalibration::default(),
        place: TrackerPlace::default(),
        model,
        plug: Plug {
            link: None,
            baud: Some(baud),
        },
        to: None,
    }
}

/// Plugs one in; what settings say of its port.
fn plug_in(
    promise: &Promise,
    folder: &Folder,
    file: &str,
    played: &Played,
) -> (Box<dyn Plugged>, String) {
    let kind = promise.kind();
    let mut worn = worn(played, promise.model, (kind.baud)(promise.model));
    let port = if promise.is_datagram() {
        let port = free_port();
        worn.to = Some(format!("127.0.0.1:{port}"));
        format!("udp:{port}")
    } else {
        let link = folder.file(file);
        worn.plug.link = Some(link.clone());
        link.display().to_string()
    };
    ((kind.spawn)(worn).unwrap(), port)
}

/// Devices that are plugged in, and the settings that name them.
struct Bench {
    text: String,
    played: Arc<Played>,
    plain: Vec<Box<dyn Plugged>>,
    subjects: Vec<(Subject, Box<dyn Plugged>)>,
}

impl Bench {
    fn new() -> Self {
        Self {
            text: "listen = '127.0.0.1:0'\nscene = 'operations/free'\n".to_owned(),
            played: Arc::new(still_hand()),
            plain: Vec::new(),
            subjects: Vec::new(),
        }
    }

    fn write(&mut self, name: &str, kind: &str, port: &str, settings: &str) {
        self.text +=
            &format!("[[device]]\nname = '{name}'\nkind = '{kind}'\nport = '{port}'\n{settings}");
    }

    /// The other half of a hand.
    fn add_plain(&mut self, folder: &Folder, name: &str, kind: &str) {
        let is_kind = |promise: &&Promise| promise.kind == kind;
        let promise = PROMISES.iter().rfind(is_kind).unwrap();
        let (plugged, port) = plug_in(promise, folder, &name.replace(' ', "-"), &self.played);
        let settings = (promise.kind().settings)(promise.model);
        self.plain.push(plugged);
        self.write(name, kind, &port, &settings);
    }

    /// A device, and a hand that it is half of.
    fn add(&mut self, promise: Promise, plugged: Box<dyn Plugged>, port: &str, settings: &str) {
        let name = promise.name();
        self.write(&name, promise.kind, port, settings);
        let [(plain_glove, _), (plain_tracker, _)] = PLAIN;
        let part = |is_own, plain| if is_own { name.as_str() } else { plain };
        let glove = part(promise.fingers.is_some(), plain_glove);
        let tracker = part(promise.wrist.is_some(), plain_tracker);
        self.text += &format!(
            "[[hand]]\nname = 'hand of {name}'\nside = 'right'\nglove = '{glove}'\ntracker = '{tracker}'\n"
        );
        let subject = Subject {
            promise,
            name,
            played: Arc::clone(&self.played),
            hand: 0,
        };
        self.subjects.push((subject, plugged));
    }
}

/// All devices.
async fn set_up(folder: &Folder) -> Bench {
    let mut bench = Bench::new();
    for (name, kind) in PLAIN {
        bench.add_plain(folder, name, kind);
    }
    for promise in PROMISES {
        let settings = (promise.kind().settings)(promise.model);
        let (plugged, port) = plug_in(&promise, folder, &promise.name(), &bench.played);
        bench.add(promise, plugged, &port, &settings);
    }
    let line = VrpnLine::new(folder, &bench.played).await;
    let port = line.port();
    bench.add(VRPN, Box::new(line), &port, "");
    bench
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn every_driver_starts_streams_and_recovers() {
    let covered: usize = KINDS.iter().map(|kind| kind.models.len()).sum();
    assert_eq!(covered, PROMISES.len(), "a kind or model is not tried");
    let folder = Folder::new("drivers");
    let Bench {
        text,
        plain,
        mut subjects,
        ..
    } = set_up(&folder).await;
    let lab = Arc::new(Lab::new(daemon_config(&text)).await);
    for (subject, _) in &mut subjects {
        let name = format!("hand of {}", subject.name);
        let row = lab.row_that(&name, "is in the world", |row| row.hand > 0);
        subject.hand = row.await.hand;
    }
    let names: Vec<String> = subjects
        .iter()
        .map(|(subject, _)| subject.name.clone())
        .collect();
    let tasks: Vec<_> = subjects
        .into_iter()
        .map(|(subject, plugged)| tokio::spawn(Ordeal::run(Arc::clone(&lab), subject, plugged)))
        .collect();
    let mut failures = Vec::new();
    println!(
        "{:>21} {:>7} {:>7} {:>20} {:>5} {:>7} {:>9} {:>7} {:>7} {:>6}",
        "device",
        "start s",
        "Hz",
        "back after s",
        "bad",
        "noise s",
        "stall",
        "after s",
        "power s",
        "error"
    );
    for (name, task) in names.iter().zip(tasks) {
        match task.await {
            Ok(report) => print_row(name, &report),
            Err(error) => failures.push(format!("{name}: {error}")),
        }
    }
    println!("all in {:.1} s", lab.started.elapsed().as_secs_f64());
    assert!(failures.is_empty(), "{failures:#?}");
    let n_stutters = lab.ruler.n_stutters_since(lab.started);
    println!("pauses of this program by the machine: {n_stutters}");
    for (name, _) in PLAIN {
        let row = lab.row(name).await;
        assert_eq!(row.losses, 0, "{row:?}");
        // What was lost in such a pause is not the neighbour's doing.
        assert!(n_stutters > 0 || row.resyncs + row.dropped == 0, "{row:?}");
    }
    lab.end().await;
    drop(plain);
}

fn print_row(name: &str, report: &Report) {
    let back: Vec<String> = report
        .back_s
        .iter()
        .map(|time_s| format!("{time_s:.2}"))
        .collect();
    println!(
        "{name:>21} {:>7.2} {:>7.1} {:>20} {:>5} {:>7.2} {:>9} {:>7.2} {:>7.2} {:>6.3}",
        report.start_s,
        report.rate_hz,
        back.join(" "),
        report.n_bad,
        report.after_noise_s,
        report.told,
        report.after_stall_s,
        report.after_cut_s,
        report.worst
    );
}
