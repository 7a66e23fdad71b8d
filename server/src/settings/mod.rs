//! The daemon's settings: a TOML file, then environment variables, then flags; the later wins.
//!
//! # Keys
//!
//! Every key of this first table is also a flag (`--rate-hz`) and a variable (`TSUKAMU_RATE_HZ`).
//!
//! | key | unit, bounds | default |
//! | --- | --- | --- |
//! | `listen` | address and port; anything but loopback is open to the network | `127.0.0.1:7447` |
//! | `scene` | a built-in scene or a scene file | `demo` |
//! | `hands` | `synthetic:NAME` or hand CSV files (a list in the file; separated by `;` in a flag) | the scene's, unless there is a `[[hand]]` |
//! | `rate_hz` | steps per second, 1 to 4000 | the scene's |
//! | `mode` | `realtime`, or `lockstep`: only a client's `Step` advances the world | `realtime` |
//! | `tracking_grace_s` | s, 0 to 60: how long a hand that is not seen keeps hold | the scene's |
//! | `keyframe_interval_s` | s, 0.05 to 60: how often a frame holds all objects | 1 |
//! | `event_log` | events kept for clients that resume, 16 to 10 000 000 | 65 536 |
//! | `recording_dir` | folder of recordings, made when the first begins | `recordings` |
//! | `record` | `true`: record from the start | `false` |
//! | `record_frames` | `true`: such a recording holds every frame too | `false` |
//! | `record_raw` | `true`: and the raw bytes and samples of the sources | `false` |
//! | `vrpn` | address and port of the VRPN server, TCP and UDP; `--vrpn` alone is `127.0.0.1:3883`; `off` | off |
//! | `vrpn_rate_hz` | poses per second, 1 to 1000; at most the world's steps | 60 |
//! | `vrpn_axes` | axes of the poses: `y_up` (the world's own) or `z_up` | `y_up` |
//! | `log` | log filter, e.g. `info` or `tsukamu_server=debug` | `info` |
//!
//! Each `[[device]]`:
//!
//! | key | unit, bounds | default |
//! | --- | --- | --- |
//! | `name` | text, unique | must be given |
//! | `kind` | gloves: `"cyberglove"`, `"5dt"`, `"lucidglove"`, `"opencyberglove"`, `"delimited"`; trackers: `"fastrak"`, `"isotrak"`, `"liberty"`, `"flock"`; either or both: `"vrpn"`, `"vmc"`, `"rokoko"`, `"udcap"` | must be given |
//! | `port` | the port's path, one of `/dev/serial/by-id`, `by-path` or a link of your own, never `/dev/ttyUSB0`; `udp:PORT`, `tcp:HOST:PORT`, `tcp-listen:PORT`; `vrpn`: `DEVICE@HOST` | must be given |
//! | `bauds` | bit/s, 50 to 4 000 000, tried in turn; at most 8 | that of the device, mostly `[115200]` |
//! | `expected_rate_hz` | samples per second that it should have, 0.1 to 10 000; below 0.8 of that it is said to be slow | what the driver asks for |
//! | `model` | `5dt`: `"5"`, `"5w"` (wireless), `"14"` or `"16"`, must be given; `isotrak`: `"isotrak2"` or `"3space"` | `isotrak`: `"isotrak2"` |
//! | `order` | `5dt` of 5: `"by_hand"`, `"thumb_first"` or `"little_first"`; `opencyberglove`: what its 19 values are, each a sensor or `"skip"` | `"by_hand"`; as published |
//! | `autocalibrate` | `5dt`, `delimited`, `opencyberglove`: `true`: each sensor's range is learnt while the glove is worn, where no calibration says it | `false` |
//! | `columns` | `delimited`: what a line holds, from the left: `"time"`, `"skip"`, a sensor, a finger, or several joined by `+`; at most 64 | must be given, or `layout` |
//! | `layout` | `delimited`: `"homunculus"`: the columns and range of a LeRobot Homunculus | none |
//! | `raw_range` | `delimited`: `[straight, bent]` raw values | `[0, 1023]` |
//! | `time_unit` | `delimited`: of the column `time`: `"s"`, `"ms"`, `"us"` or `"ticks"` | `"ms"` |
//! | `separators`, `prefix`, `start` | `delimited`: what parts columns, what a line begins with, what is sent at the start; at most 256 bytes | `",; \t"`, none, none |
//! | `actor` | `rokoko`: name of the actor, where several are sent | the first |
//! | `sensors` | `cyberglove`: 18 or 22 | the glove's own answer |
//! | `sampling` | `cyberglove`: `"stream"` or `"poll"` (100 Hz) | `"stream"` |
//! | `sample_rate_hz` | `cyberglove`: Hz, 0.01 to 1000 | 100 |
//! | `max` | `lucidglove`: its number for a full curl, 1 to 65535 | found out: 1023, or 4095 once a greater number came |
//! | `hand` | `lucidglove`: `"left"` or `"right"` | what the glove says |
//! | `feedback` | `lucidglove`: `false`: the fingers are never stopped | `true` |
//! | `feedback_max` | `lucidglove`: the number that blocks a finger, 1 to 65535; 1000 for the firmware, 4095 for the stand-alone library | 1000 |
//! | `haptics` | `lucidglove`: `true`: a touch is also a short vibration, of gloves that have it | `false` |
//! | `calibration` | gloves: the wearer's calibration file, beside the settings | none: factory means |
//! | `stations` | stations in use: `fastrak` 1 to 4, they share the rate; `isotrak` 1 and 2; `liberty` 1 to 16 | `[1]` |
//! | `encoding` | `fastrak`: `"binary"` or `"ascii"` | `"binary"` |
//! | `hemisphere` | `fastrak`, `isotrak`, `liberty`: `[x, y, z]` toward the receivers, transmitter space; `flock`: `"forward"`, `"rear"`, `"upper"`, `"lower"`, `"left"` or `"right"` | the unit's own |
//! | `position_filter`, `attitude_filter` | `fastrak`, `isotrak`, `liberty`: the unit's own filter, `[sensitivity, low, high, factor]`, 0 to 1 each | the unit's own |
//! | `counter` | `liberty`: its clock: `"time"` or `"frames"` | `"time"` |
//! | `stylus` | `liberty`: `true`: its button too | `false` |
//! | `birds` | `flock`: addresses in use, 1 to 14 | `[1]` |
//! | `group` | `flock`: `true`: the birds are on a bus and answer in a group | whether `birds` is anything but `[1]` |
//! | `output` | `flock`: `"quaternion"` or `"angles"` | `"quaternion"` |
//! | `invert_quaternion` | `flock`: `true`: every rotation turned round, for firmware that sends them so | `false` |
//! | `buttons` | `flock`: `true`: its buttons too | `false` |
//! | `space` | `vrpn`: axes of its poses: `"y_up"`, `"z_up"` or `"z_down"`; VRPN itself does not say | `"y_up"` |
//! | `scale` | `vrpn`: metres per unit of its positions, above 0 up to 1000; `flock`: its range, `"36in"`, `"72in"` or `"144in"` | 1; `"36in"` |
//! | `channels` | `vrpn`: what each channel measures, from channel 0: names as in calibration files, or `"-"` | none: no glove |
//! | `unit` | `vrpn`: of the channels: `"degrees"`, `"radians"`, or `"raw"` for counts to be calibrated; `delimited`: `"raw"`, `"deg"` or `"rad"` | `"degrees"`; `"raw"` |
//! | `transmitter_position` | trackers: `[x, y, z]` m, world space, within 100 | `[0, 0, 0]` |
//! | `transmitter_rotation_deg` | trackers: `[yaw, pitch, roll]` °, of the transmitter as the driver reports it, y up | `[0, 0, 0]` |
//! | `room` | trackers: a file of these two keys alone, beside the settings, in their place; `tsukamu calibrate --room` writes it | none |
//!
//! Each `[[hand]]`, a hand driven by devices:
//!
//! | key | unit, bounds | default |
//! | --- | --- | --- |
//! | `name` | text, unique | must be given |
//! | `side` | `"left"` or `"right"` | must be given |
//! | `glove` | name of a device that is a glove | must be given |
//! | `tracker` | name of a device that is a tracker; may be the same | must be given |
//! | `station` | station of that tracker, one that it has in use | 1; by `side` where a source sends both hands |
//! | `scale` | size of the hand against an adult's, 0.5 to 2 | 1 |
//! | `point_radius` | m, 0 to 0.05: how far contact points stand out from the joints | 0 |
//! | `palm_contacts` | `true`: the palm touches too | `false` |
//! | `between` | between two samples the hand is `"interpolate"`d (smooth, both streams at one time, later by a little more than the longer of the two sample intervals) or `"hold"`s the newest of both (no lag, in steps) | `"interpolate"` |
//! | `glove_delay_s`, `tracker_delay_s` | s, 0 to 0.2: known latency of that device; its samples are so much older than their arrival, and the other stream waits for them | 0 |
//! | `min_cutoff_hz` | One-Euro filter (Casiez et al. 2012) of both streams: cut-off at rest, Hz, above 0 up to 1000; turns it on | off |
//! | `beta` | that filter: how fast the cut-off rises with speed, 0 to 1000 | 0 |
//! | `glove_min_cutoff_hz`, `tracker_min_cutoff_hz` | the same of one stream: turns that one's filter on, or replaces the number of both | that of both |
//! | `glove_beta`, `tracker_beta` | the same of one stream | that of both |
//! | `glove_predict_s`, `tracker_predict_s` | s, 0 to 0.1: how far that stream may be predicted (LaViola 2003); more than 0.05 seldom pays; the hand is as early as both streams allow, so give both; lag and error show in `tsukamu devices --json` | 0: off |
//! | `feedback_strength` | 0 to 1: share of its glove's full force that stops a finger while it touches something (LucidGloves), or vibrates at it (CyberTouch) | 1 |

pub mod calibration;
pub mod device;
pub mod hand;
pub mod overrides;
pub mod vrpn;
pub mod room;

mod general;
mod stream;

#[cfg(test)]
mod tests;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use crate::document::keys::with_top_table;
use crate::document::mistake::{Mistakes, Sheet};
use crate::scene_file::hands::HandSourceSpec;
use device::DeviceSettings;
use hand::HandSettings;
use overrides::Overrides;
use vrpn::VrpnSettings;

/// Where the daemon listens unless it is told otherwise.
pub const LISTEN_DEFAULT: &str = "127.0.0.1:7447";

/// Every setting of the daemon, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Address and port of gRPC, status page and metrics.
    pub listen: SocketAddr,
    /// What is simulated.
    pub world: WorldSettings,
    /// What clients are given.
    pub publish: PublishSettings,
    /// What is written to disk.
    pub recording: RecordingSettings,
    /// The VRPN server; `None` is off.
    pub vrpn: Option<VrpnSettings>,
    /// Filter of the log.
    pub log: String,
    /// Hands from files and computed ones. `None`: the scene's own, unless `hands` has some.
    pub sources: Option<Vec<HandSourceSpec>>,
    /// Gloves and trackers.
    pub devices: Vec<DeviceSettings>,
    /// Hands driven by them.
    pub hands: Vec<HandSettings>,
}

/// How time passes in the daemon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// By the clock, at the step rate.
    #[default]
    Realtime,
    /// Only by a client's `Step`.
    Lockstep,
}

impl Mode {
    /// The name in settings and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Realtime => "realtime",
            Self::Lockstep => "lockstep",
        }
    }
}

/// What is simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSettings {
    /// A built-in scene's name, or a scene file.
    pub scene: String,
    /// Steps per second in place of the scene's, 1 to 4000.
    pub rate_hz: Option<f64>,
    /// How time passes.
    pub mode: Mode,
    /// Grace time in seconds in place of the scene's, 0 to 60.
    pub tracking_grace_s: Option<f64>,
}

/// What clients are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishSettings {
    /// Seconds between frames that hold all objects, 0.05 to 60.
    pub keyframe_interval_s: f64,
    /// Events kept for clients that resume, 16 to 10 000 000.
    pub event_log: usize,
}

/// What is written to disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingSettings {
    /// Folder of recordings.
    pub dir: PathBuf,
    /// Whether to record from the start.
    pub from_start: bool,
    /// Whether such a recording holds every frame.
    pub frames: bool,
    /// Whether it holds raw bytes and samples.
    pub raw: bool,
}

/// Settings from a file's text and what overrides it. Files named in it are looked for in `folder`.
///
/// # Errors
/// Every mistake, each with file, line, column and key, or with the flag or variable that holds it.
pub fn parse(
    origin: &str,
    text: &str,
    folder: &Path,
    overrides: &Overrides,
) -> Result<Settings, Mistakes> {
    let mut sheet = Sheet::new(origin, text);
    let settings = with_top_table(&mut sheet, |top, sheet| {
        general::read(top, sheet, folder, overrides)
    });
    let mistakes = sheet.into_mistakes();
    match settings {
        Some(settings) => mistakes.or_value(settings),
        None => Err(mistakes),
    }
}

/// Settings from a file, or from the defaults where none is named, and what overrides them.
///
/// # Errors
/// When the file cannot be read, or every mistake in it.
pub fn load(file: Option<&Path>, overrides: &Overrides) -> Result<Settings, Mistakes> {
    let Some(file) = file else {
        return parse("settings", "", Path::new(""), overrides);
    };
    let origin = file.display().to_string();
    let text = std::fs::read_to_string(file)
        .map_err(|fault| Mistakes::one(&origin, format!("cannot be read: {fault}")))?;
    parse(
        &origin,
        &text,
        file.parent().unwrap_or_else(|| Path::new("")),
        overrides,
    )
}
