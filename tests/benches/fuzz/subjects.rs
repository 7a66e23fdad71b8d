//! Every session that is fed, with the device that it is made for.

use nalgebra::{Isometry3, Point3, UnitQuaternion};
use tsukamu_devices::driver::Driver;
use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::cyberglove::CyberGloveEmulator;
use tsukamu_devices::emulate::delimited::DelimitedEmulator;
use tsukamu_devices::emulate::fastrak::FastrakEmulator;
use tsukamu_devices::emulate::fivedt::FiveDtEmulator;
use tsukamu_devices::emulate::flock::FlockEmulator;
use tsukamu_devices::emulate::isotrak::IsotrakEmulator;
use tsukamu_devices::emulate::liberty::LibertyEmulator;
use tsukamu_devices::emulate::lucidglove::{LucidGloveBuild, LucidGloveEmulator};
use tsukamu_devices::emulate::opencyberglove::OpenCyberGloveEmulator;
use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::glove::calibrate::{GloveCalibration, Handedness};
use tsukamu_devices::glove::cyberglove::settings::{CyberGloveSettings, Sampling, SensorCount};
use tsukamu_devices::glove::delimited::column::Column;
use tsukamu_devices::glove::delimited::settings::DelimitedSettings;
use tsukamu_devices::glove::fivedt::settings::{FiveDtSettings, Model as FiveDtModel};
use tsukamu_devices::glove::lucidglove::protocol::Encoding as LucidEncoding;
use tsukamu_devices::glove::lucidglove::settings::LucidGloveSettings;
use tsukamu_devices::glove::opencyberglove::format::OpenCyberGloveSettings;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::session::Session;
use tsukamu_devices::source::rokoko::settings::RokokoSettings;
use tsukamu_devices::tracker::fastrak::decode::Encoding;
use tsukamu_devices::tracker::fastrak::settings::FastrakSettings;
use tsukamu_devices::tracker::flock::settings::FlockSettings;
use tsukamu_devices::tracker::isotrak::protocol::Model as IsotrakModel;
use tsukamu_devices::tracker::isotrak::settings::IsotrakSettings;
use tsukamu_devices::tracker::liberty::protocol::Model as LibertyModel;
use tsukamu_devices::tracker::liberty::settings::LibertySettings;

use crate::vrpn::{VrpnServer, vrpn_settings};

/// The other end of a line.
pub(crate) trait Line {
    fn hear(&mut self, now_ns: u64, bytes: &[u8]);
    fn say(&mut self, now_ns: u64) -> Vec<u8>;
    fn due_ns(&self) -> Option<u64>;
    /// The port is opened again: a cable keeps what the device was told, a connection does not.
    fn reopen(&mut self, _now_ns: u64) {}
}

impl<E: Emulator> Line for E {
    fn hear(&mut self, now_ns: u64, bytes: &[u8]) {
        self.push(now_ns, bytes);
    }

    fn say(&mut self, now_ns: u64) -> Vec<u8> {
        self.poll(now_ns)
    }

    fn due_ns(&self) -> Option<u64> {
        self.deadline()
    }
}

/// One of them.
#[derive(Clone, Debug)]
pub(crate) struct Subject {
    pub(crate) name: &'static str,
    pub(crate) driver: Driver,
    pub(crate) line: fn() -> Box<dyn Line>,
}

impl Subject {
    pub(crate) fn session(&self) -> Box<dyn Session + Send> {
        self.driver.session(GloveCalibration::default())
    }
}

/// Where trackers are.
fn place() -> (Point3<f64>, UnitQuaternion<f64>) {
    let turn = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3);
    (Point3::new(0.2, 0.1, -0.1), turn)
}

fn subject(name: &'static str, driver: Driver, line: fn() -> Box<dyn Line>) -> Subject {
    Subject { name, driver, line }
}

/// All of them.
pub(crate) fn all() -> Vec<Subject> {
    let mut all = cybergloves();
    all.extend(simple_gloves());
    all.extend(fivedts());
    all.extend(polhemus());
    all.extend(flocks());
    all.extend(sources());
    all.push(subject("vrpn", Driver::Vrpn(vrpn_settings()), || {
        Box::new(VrpnServer::default())
    }));
    all
}

fn cybergloves() -> Vec<Subject> {
    let glove = |sampling| {
        Driver::CyberGlove(CyberGloveSettings {
            sampling,
            ..CyberGloveSettings::default()
        })
    };
    let period_ns = 10_000_000;
    vec![
        subject("cyberglove-18", glove(Sampling::Stream), || {
            Box::new(CyberGloveEmulator::new(
                SensorCount::Eighteen,
                Handedness::Right,
            ))
        }),
        subject("cyberglove-22", glove(Sampling::Stream), || {
            Box::new(CyberGloveEmulator::new(
                SensorCount::TwentyTwo,
                Handedness::Left,
            ))
        }),
        subject(
            "cyberglove-polled",
            glove(Sampling::Poll { period_ns }),
            || {
                Box::new(CyberGloveEmulator::new(
                    SensorCount::TwentyTwo,
                    Handedness::Right,
                ))
            },
        ),
    ]
}

fn lucidglove(encoding: LucidEncoding, joints: bool) -> Box<dyn Line> {
    let mut glove = LucidGloveEmulator::new(LucidGloveBuild {
        encoding,
        joints,
        splay: joints,
        info: joints.then_some(Handedness::Right),
        ..LucidGloveBuild::default()
    });
    glove.set_curls([100, 900, 2000, 3000, 4000]);
    Box::new(glove)
}

fn delimited(settings: DelimitedSettings) -> Box<dyn Line> {
    let mut glove = DelimitedEmulator::new(settings);
    glove.set_slots(&std::array::from_fn(|slot| 100.0 + 20.0 * slot as f64));
    Box::new(glove)
}

fn sketch() -> DelimitedSettings {
    let columns = ["time", "thumb", "index", "middle", "ring", "little"];
    let columns = columns.into_iter().map(Column::parse);
    DelimitedSettings::new(columns.filter_map(Result::ok).collect())
}

fn simple_gloves() -> Vec<Subject> {
    let lucidglove_driver = || Driver::LucidGlove(LucidGloveSettings::default());
    vec![
        subject("lucidglove", lucidglove_driver(), || {
            lucidglove(LucidEncoding::Alpha, false)
        }),
        subject("lucidglove-joints", lucidglove_driver(), || {
            lucidglove(LucidEncoding::Alpha, true)
        }),
        subject("lucidglove-legacy", lucidglove_driver(), || {
            lucidglove(LucidEncoding::Legacy, false)
        }),
        subject("delimited-sketch", Driver::Delimited(sketch()), || {
            delimited(sketch())
        }),
        subject(
            "delimited-homunculus",
            Driver::Delimited(DelimitedSettings::homunculus()),
            || delimited(DelimitedSettings::homunculus()),
        ),
        subject(
            "opencyberglove",
            Driver::OpenCyberGlove(OpenCyberGloveSettings::default()),
            || {
                let mut glove = OpenCyberGloveEmulator::new();
                glove.set_slots(&std::array::from_fn(|slot| 700 + 50 * slot as u16));
                Box::new(glove)
            },
        ),
    ]
}

fn fivedt(model: FiveDtModel) -> Box<dyn Line> {
    let mut glove = FiveDtEmulator::new(model, Handedness::Right);
    let full = model.raw_max() as u16;
    glove.set_slots(&[full / 3; GloveSensor::N_SLOTS]);
    Box::new(glove)
}

fn fivedts() -> Vec<Subject> {
    let glove = |model| {
        Driver::FiveDt(FiveDtSettings {
            model,
            ..FiveDtSettings::default()
        })
    };
    vec![
        subject("5dt-5", glove(FiveDtModel::Five), || {
            fivedt(FiveDtModel::Five)
        }),
        subject("5dt-5w", glove(FiveDtModel::FiveWireless), || {
            fivedt(FiveDtModel::FiveWireless)
        }),
        subject("5dt-14", glove(FiveDtModel::Fourteen), || {
            fivedt(FiveDtModel::Fourteen)
        }),
        subject("5dt-16", glove(FiveDtModel::Sixteen), || {
            fivedt(FiveDtModel::Sixteen)
        }),
    ]
}

fn fastrak() -> Box<dyn Line> {
    let mut tracker = FastrakEmulator::new();
    let (position, rotation) = place();
    tracker.set_pose(1, position, rotation);
    Box::new(tracker)
}

fn isotrak(model: IsotrakModel) -> Box<dyn Line> {
    let mut tracker = IsotrakEmulator::new(model);
    let (position, rotation) = place();
    tracker.set_pose(1, position, rotation);
    Box::new(tracker)
}

fn liberty(model: LibertyModel) -> Box<dyn Line> {
    let mut tracker = LibertyEmulator::new(model);
    let (position, rotation) = place();
    tracker.set_pose(1, position, rotation);
    Box::new(tracker)
}

fn polhemus() -> Vec<Subject> {
    let fastrak_driver = |encoding| {
        Driver::Fastrak(FastrakSettings {
            encoding,
            ..FastrakSettings::default()
        })
    };
    let isotrak_driver = |model| {
        Driver::Isotrak(IsotrakSettings {
            model,
            ..IsotrakSettings::default()
        })
    };
    let liberty_driver = || Driver::Liberty(LibertySettings::default());
    vec![
        subject("fastrak", fastrak_driver(Encoding::Binary), fastrak),
        subject("fastrak-ascii", fastrak_driver(Encoding::Ascii), fastrak),
        subject("isotrak2", isotrak_driver(IsotrakModel::IsotrakTwo), || {
            isotrak(IsotrakModel::IsotrakTwo)
        }),
        subject("3space", isotrak_driver(IsotrakModel::ThreeSpace), || {
            isotrak(IsotrakModel::ThreeSpace)
        }),
        subject("liberty", liberty_driver(), || {
            liberty(LibertyModel::Liberty)
        }),
        subject("patriot", liberty_driver(), || {
            liberty(LibertyModel::Patriot)
        }),
        subject("latus", liberty_driver(), || liberty(LibertyModel::Latus)),
    ]
}

fn birds(mut tracker: FlockEmulator) -> Box<dyn Line> {
    let (position, rotation) = place();
    tracker.set_pose(1, position, rotation);
    Box::new(tracker)
}

fn flocks() -> Vec<Subject> {
    vec![
        subject(
            "flock-bird",
            Driver::Flock(FlockSettings::default()),
            || birds(FlockEmulator::alone()),
        ),
        subject(
            "flock-group",
            Driver::Flock(FlockSettings {
                birds: vec![1, 2],
                ..FlockSettings::default()
            }),
            || birds(FlockEmulator::group(2)),
        ),
    ]
}

fn source(kind: SourceKind) -> Box<dyn Line> {
    let mut sender = SourceEmulator::new(kind);
    let (position, rotation) = place();
    let hand = SentHand {
        angles: [Some(0.3); GloveSensor::N_SLOTS],
        world_from_wrist: Isometry3::from_parts(position.into(), rotation),
    };
    sender.set_hand(Handedness::Right, Some(hand));
    Box::new(sender)
}

fn sources() -> Vec<Subject> {
    let rokoko = || Driver::Rokoko(RokokoSettings::default());
    vec![
        subject("vmc", Driver::Vmc, || source(SourceKind::Vmc)),
        subject("rokoko", rokoko(), || source(SourceKind::Rokoko)),
        subject("rokoko-lz4", rokoko(), || source(SourceKind::RokokoLz4)),
        subject("udcap", Driver::Udcap, || source(SourceKind::Udcap)),
    ]
}
