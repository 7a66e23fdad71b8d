//! What one device goes through, and how a client sees that it is right again.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tsukamu_client::view::HandView;
use tsukamu_proto::v1;
use tsukamu_proto::v1::event::Kind;
use tsukamu_server::emulate::{Played, Plugged};

use crate::drivers_kinds::{Fingers, Promise, Wrist, fingers_error, wrist_error};
use crate::drivers_lab::{Lab, PATIENCE};

/// How long a stream is looked at.
const STREAM: Duration = Duration::from_secs(10);
/// How often, if the machine gives it no time.
const STREAMS_MAX: u32 = 5;
/// What a rate may be of what is promised, on a machine that is busy with sixty threads of this test.
const RATE_SHARES: (f64, f64) = (0.75, 1.1);
/// How long bytes are spoilt, a device is stalled, and is without power.
const SPOILT: Duration = Duration::from_secs(3);
const STALL: Duration = Duration::from_secs(3);
const POWER_CUT: Duration = Duration::from_secs(1);
/// Share of the bytes.
const NOISE: f64 = 0.01;
/// How long a spoilt byte may be on its way.
const ON_ITS_WAY: Duration = Duration::from_millis(500);
/// Looks in a row after which a reading counts as right, and at all: from then on none may be wrong.
const RIGHT: u32 = 5;
const LOOKS: u32 = 15;
/// A device and what it is to be.
pub(crate) struct Subject {
    pub(crate) promise: Promise,
    pub(crate) name: String,
    pub(crate) played: Arc<Played>,
    /// Number of its hand: its id + 1.
    pub(crate) hand: u32,
}

/// What came of it; times in seconds.
#[derive(Debug, Default)]
pub(crate) struct Report {
    pub(crate) start_s: f64,
    pub(crate) rate_hz: f64,
    pub(crate) back_s: Vec<f64>,
    /// Lost steps and records while bytes were spoilt.
    pub(crate) n_bad: u64,
    pub(crate) after_noise_s: f64,
    pub(crate) told: String,
    pub(crate) after_stall_s: f64,
    pub(crate) after_cut_s: f64,
    /// Greatest error as a share of the tolerance.
    pub(crate) worst: f64,
}

/// Looks at readings until they are right and stay so.
#[derive(Debug)]
struct Settling {
    begun: Instant,
    n_right: u32,
    /// When the present row of right ones began.
    since: Option<Instant>,
    worst: f64,
    last_wrong: f64,
}

impl Settling {
    fn new() -> Self {
        Self {
            begun: Instant::now(),
            n_right: 0,
            since: None,
            worst: 0.0,
            last_wrong: 0.0,
        }
    }

    /// Takes an error as a share of the tolerance; true when enough were right.
    fn take(&mut self, name: &str, share: f64) -> bool {
        if share <= 1.0 {
            self.since.get_or_insert_with(Instant::now);
            self.n_right += 1;
            self.worst = self.worst.max(share);
        } else {
            assert!(
                self.n_right < RIGHT,
                "{name}: was right, and is {share} off: {self:?}"
            );
            (self.n_right, self.since, self.worst) = (0, None, 0.0);
            self.last_wrong = share;
        }
        self.n_right == LOOKS
    }

    /// From its beginning to the first reading that was right, s.
    fn took_s(&self) -> f64 {
        let since = self.since.unwrap_or(self.begun);
        since.duration_since(self.begun).as_secs_f64()
    }
}

/// One device on its way through all of it.
pub(crate) struct Ordeal {
    lab: Arc<Lab>,
    subject: Subject,
    report: Report,
}

impl Ordeal {
    pub(crate) async fn run(
        lab: Arc<Lab>,
        subject: Subject,
        mut plugged: Box<dyn Plugged>,
    ) -> Report {
        let report = Report::default();
        let mut ordeal = Self {
            lab,
            subject,
            report,
        };
        let started = ordeal.lab.started;
        let since = ordeal.settle().await.since.unwrap();
        ordeal.report.start_s = since.duration_since(started).as_secs_f64();
        ordeal.stream().await;
        for _ in 0..3 {
            ordeal.pull_and_plug(plugged.as_mut()).await;
        }
        ordeal.is_told_once().await;
        ordeal.spoil(plugged.as_mut()).await;
        ordeal.stall(plugged.as_mut()).await;
        ordeal.cut_power(plugged.as_mut()).await;
        ordeal.report
    }

    async fn row(&self) -> v1::Device {
        self.lab.row(&self.subject.name).await
    }

    async fn row_that(&self, what: &str, will_do: impl Fn(&v1::Device) -> bool) -> v1::Device {
        self.lab.row_that(&self.subject.name, what, will_do).await
    }

    /// Ten seconds at the promised rate, without a lost byte. What a machine costs that gives this program no time is not
    /// the device's fault: then it is looked at again.
    async fn stream(&mut self) {
        for _ in 0..STREAMS_MAX {
            let (begun, before) = (Instant::now(), self.row().await);
            tokio::time::sleep(STREAM).await;
            let after = self.row().await;
            let rate_hz = (after.samples - before.samples) as f64 / begun.elapsed().as_secs_f64();
            let share = rate_hz / self.subject.promise.rate_hz;
            let n_lost = after.resyncs + after.dropped - before.resyncs - before.dropped;
            let (least, most) = RATE_SHARES;
            if n_lost == 0 && (least..=most).contains(&share) && after.state == "running" {
                self.report.rate_hz = rate_hz;
                return;
            }
            let n_stutters = self.lab.ruler.n_stutters_since(begun);
            assert!(n_stutters > 0, "{rate_hz} Hz, {n_lost} lost: {after:?}");
        }
        panic!(
            "{}: this machine has no ten seconds for it",
            self.subject.name
        );
    }

    /// The hand is lost when half of it is.
    async fn loses_the_hand(&self, first_event: usize, what: &str) {
        let is_lost = |event: &v1::Event, kind: &Kind| {
            event.hand == self.subject.hand && matches!(kind, Kind::HandLost(_))
        };
        let what = format!("{}: {what} loses the hand", self.subject.name);
        self.lab.event_from(first_event, &what, is_lost).await;
    }

    /// Pulls the cable and plugs it in again.
    async fn pull_and_plug(&mut self, plugged: &mut dyn Plugged) {
        let first_event = self.lab.n_events();
        plugged.unplug();
        self.loses_the_hand(first_event, "a pulled cable").await;
        // Nobody can tell a sender of datagrams that is gone from one that is silent.
        let state = if self.subject.promise.is_datagram() {
            "stalled"
        } else {
            "absent"
        };
        let row = self.row_that(state, |row| row.state == state).await;
        assert!(!row.error.is_empty(), "{row:?}");
        plugged.plug().unwrap();
        let back_s = self.settle().await.took_s();
        self.report.back_s.push(back_s);
    }

    /// One event for each loss and each return.
    async fn is_told_once(&self) {
        let expected: &[bool] = if self.subject.promise.is_datagram() {
            &[]
        } else {
            &[true, false, true, false, true, false]
        };
        let row = self.row_that("running", |row| row.state == "running").await;
        let name = &self.subject.name;
        assert_eq!(self.lab.comings_and_goings(name), expected, "{name}");
        assert_eq!(row.losses, expected.len() as u64 / 2, "{row:?}");
    }

    /// Bytes are replaced by others: that is counted, and passes.
    async fn spoil(&mut self, plugged: &mut dyn Plugged) {
        let count = |row: &v1::Device| row.resyncs + row.dropped + row.losses;
        let before = count(&self.row().await);
        plugged.spoil(NOISE);
        tokio::time::sleep(SPOILT).await;
        plugged.spoil(0.0);
        // What is still on its way may be spoilt.
        tokio::time::sleep(ON_ITS_WAY).await;
        let what = "spoilt bytes are counted";
        let row = self.row_that(what, |row| count(row) > before).await;
        self.report.n_bad = count(&row) - before;
        self.report.after_noise_s = self.settle().await.took_s();
    }

    /// The device stands still for a time: that is told, and passes.
    async fn stall(&mut self, plugged: &mut dyn Plugged) {
        let is_well = |row: &v1::Device| tellings(row).is_empty();
        self.row_that("nothing is told", is_well).await;
        let first_event = self.lab.n_events();
        plugged.stall(STALL);
        let row = self.row_that("a stall is told", |row| !is_well(row)).await;
        self.report.told = tellings(&row);
        self.loses_the_hand(first_event, "a stall").await;
        self.report.after_stall_s = self.settle().await.took_s();
        self.row_that("its end is told", is_well).await;
    }

    /// The device comes back as it was when it was switched on: what it has to be asked for is asked for again.
    async fn cut_power(&mut self, plugged: &mut dyn Plugged) {
        let n_before = self.row().await.reconnects;
        let first_event = self.lab.n_events();
        plugged.cut_power(POWER_CUT);
        self.loses_the_hand(first_event, "a power cut").await;
        self.report.after_cut_s = self.settle().await.took_s();
        if self.subject.promise.is_asked {
            self.row_that("its start-up is done again", |row| {
                row.reconnects > n_before
            })
            .await;
        }
    }

    /// Waits until fingers and wrist are as the hand is, and stay so.
    async fn settle(&mut self) -> Settling {
        let mut settling = Settling::new();
        if let Some(fingers) = self.subject.promise.fingers {
            let look = self.settle_fingers(fingers, &mut settling);
            if tokio::time::timeout(PATIENCE, look).await.is_err() {
                panic!("fingers: {settling:?}; {:?}", self.row().await);
            }
        }
        let fingers_since = settling.since;
        if let Some(wrist) = self.subject.promise.wrist {
            settling.n_right = 0;
            let look = self.settle_wrist(wrist, &mut settling);
            if tokio::time::timeout(PATIENCE, look).await.is_err() {
                panic!("wrist: {settling:?}; {:?}", self.row().await);
            }
        }
        settling.since = fingers_since.or(settling.since);
        self.report.worst = self.report.worst.max(settling.worst);
        settling
    }

    async fn settle_fingers(&self, fingers: Fingers, settling: &mut Settling) {
        let (Fingers::EachDeg(tolerance) | Fingers::Bend(tolerance)) = fingers;
        let request = v1::WatchReadingsRequest {
            device: self.subject.name.clone(),
            max_rate_hz: 0.0,
        };
        let stream = self.lab.client.calibration().watch_readings(request).await;
        let mut stream = stream.unwrap().into_inner();
        loop {
            let reading = stream.message().await.unwrap().expect("it goes on");
            let error = fingers_error(fingers, &reading, &self.subject.played);
            if settling.take(&self.subject.name, error / tolerance) {
                return;
            }
        }
    }

    async fn settle_wrist(&self, promised: Wrist, settling: &mut Settling) {
        let Subject {
            name, played, hand, ..
        } = &self.subject;
        let mut last_tick = None;
        let is_enough = |tick: u64, hand: &HandView| {
            // A hand that stands where it was, for want of a sample, is neither right nor wrong.
            if hand.tracking != v1::Tracking::Tracked || last_tick == Some(tick) {
                return false;
            }
            last_tick = Some(tick);
            let error = wrist_error(&hand.wrist, played);
            let share = (error.metres / promised.metres).max(error.radians / promised.radians);
            settling.take(name, share)
        };
        self.lab.hand_that(*hand, is_enough).await;
    }
}

/// How a row tells that no samples come.
fn tellings(row: &v1::Device) -> String {
    if row.state != "running" && !row.error.is_empty() {
        return row.state.clone();
    }
    let silent = row.warnings.iter().find(|warning| warning.code == "silent");
    silent.map_or_else(String::new, |warning| warning.code.clone())
}
