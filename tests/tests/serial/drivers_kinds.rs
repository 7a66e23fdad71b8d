//! What each emulated kind and model promises: its rate, and how near to the truth its protocol can come.

use nalgebra::{Isometry3, UnitQuaternion};
use tsukamu_devices::glove::quick_range::usual_range_deg;
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_proto::v1;
use tsukamu_server::emulate::Played;
use tsukamu_server::emulate::kinds::{Kind, named};

/// How the numbers of a protocol compare with the hand that they are of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fingers {
    /// Each sensor has a number of its own: greatest error of one, degrees.
    EachDeg(f64),
    /// A finger's bend, the mean of its two main joints as a share of their range: greatest error.
    Bend(f64),
}

/// Greatest errors of a wrist, m and rad.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrist {
    pub(crate) metres: f64,
    pub(crate) radians: f64,
}

/// One kind and model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Promise {
    pub(crate) kind: &'static str,
    pub(crate) model: &'static str,
    /// Samples per second that the emulated device sends on a machine with time.
    pub(crate) rate_hz: f64,
    pub(crate) fingers: Option<Fingers>,
    pub(crate) wrist: Option<Wrist>,
    /// Whether it says nothing until it is asked to: what a power cut undoes.
    pub(crate) is_asked: bool,
}

/// Numbers are rounded to the nearest or cut off, and then go through some arithmetic: a step, and a little.
const STEP: f64 = 1.001;
/// A corner of three steps.
const CORNER: f64 = 1.733;
/// Half the last place of a float of 32 bits below 1.
const FLOAT: f64 = 6.0e-8;

const fn glove(
    kind: &'static str,
    model: &'static str,
    rate_hz: f64,
    fingers: Fingers,
    is_asked: bool,
) -> Promise {
    Promise {
        kind,
        model,
        rate_hz,
        fingers: Some(fingers),
        wrist: None,
        is_asked,
    }
}

/// The steps of a position, m, and of the parts of its quaternion.
const fn tracker(
    kind: &'static str,
    model: &'static str,
    rate_hz: f64,
    step_m: f64,
    step: f64,
) -> Promise {
    Promise {
        kind,
        model,
        rate_hz,
        fingers: None,
        wrist: Some(Wrist {
            metres: CORNER * STEP * step_m,
            // Half the angle is the distance of two unit quaternions, which have four parts.
            radians: 2.0 * 2.0 * STEP * step,
        }),
        is_asked: true,
    }
}

/// A program that sends both, in floats or in decimals of the same length.
const fn source(kind: &'static str, model: &'static str) -> Promise {
    Promise {
        kind,
        model,
        rate_hz: 60.0,
        fingers: Some(Fingers::Bend(1.0e-4)),
        wrist: Some(Wrist {
            metres: 1.0e-6,
            radians: 4.0e-6,
        }),
        is_asked: false,
    }
}

/// Rounding of each joint and of their mean, of so many steps in all.
const fn steps(n_steps: f64) -> Fingers {
    Fingers::Bend(1.5 * STEP / n_steps)
}

/// All of them but VRPN, which has no emulator of its own.
pub(crate) const PROMISES: [Promise; 22] = [
    // Half a degree per count, rounded.
    glove(
        "cyberglove",
        "18",
        100.0,
        Fingers::EachDeg(0.25 * STEP),
        true,
    ),
    glove(
        "cyberglove",
        "22",
        100.0,
        Fingers::EachDeg(0.25 * STEP),
        true,
    ),
    glove("lucidglove", "", 46.0, steps(4095.0), false),
    glove("5dt", "5", 100.0, steps(255.0), true),
    glove("5dt", "5w", 60.0, steps(255.0), false),
    glove("5dt", "14", 50.0, steps(4095.0), false),
    glove("5dt", "16", 50.0, steps(4095.0), false),
    glove("delimited", "sketch", 100.0, steps(1023.0), false),
    glove("delimited", "homunculus", 100.0, steps(4095.0), false),
    glove("opencyberglove", "", 120.0, steps(4095.0), false),
    glove("udcap", "", 60.0, Fingers::Bend(1.0e-4), false),
    source("vmc", ""),
    source("rokoko", "json"),
    source("rokoko", "lz4"),
    tracker("fastrak", "", 120.0, FLOAT, FLOAT),
    tracker(
        "isotrak",
        "isotrak2",
        60.0,
        1.6632 / 32_767.0,
        1.0 / 32_767.0,
    ),
    tracker(
        "isotrak",
        "3space",
        60.0,
        65.48 * 0.0254 / 32_768.0,
        1.0 / 32_767.0,
    ),
    tracker("liberty", "liberty", 240.0, FLOAT, FLOAT),
    tracker("liberty", "patriot", 60.0, FLOAT, FLOAT),
    tracker("liberty", "latus", 100.0, FLOAT, FLOAT),
    // 14 bits with a sign, of 36 inches and of 1.
    tracker("flock", "bird", 103.0, 0.9144 / 8192.0, 1.0 / 8192.0),
    tracker("flock", "flock", 206.0, 0.9144 / 8192.0, 1.0 / 8192.0),
];

impl Promise {
    pub(crate) fn kind(&self) -> &'static Kind {
        named(self.kind).unwrap()
    }

    /// Its name as a device.
    pub(crate) fn name(&self) -> String {
        match self.model {
            "" => self.kind.to_owned(),
            model => format!("{}-{model}", self.kind),
        }
    }

    /// Whether it comes as datagrams, of which nobody can tell that a cable is out.
    pub(crate) fn is_datagram(&self) -> bool {
        ["vmc", "rokoko", "udcap"].contains(&self.kind)
    }
}

/// How far a reading is from the hand, in what the promise is given in; infinite where it has no such numbers.
pub(crate) fn fingers_error(
    promise: Fingers,
    reading: &v1::WatchReadingsResponse,
    played: &Played,
) -> f64 {
    let angles = played.sensor_angles_at(0).expect("all joints are computed");
    let worn_deg = |sensor: GloveSensor| angles[sensor.slot()].map(f64::to_degrees);
    let read_deg = |sensor: GloveSensor| {
        let line = reading.sensors.iter();
        let mut line = line.filter(|line| line.sensor == sensor.name());
        line.next().map(|line| line.angle_deg)
    };
    if !reading.valid {
        return f64::INFINITY;
    }
    let errors = match promise {
        Fingers::EachDeg(_) => GloveSensor::ALL
            .into_iter()
            .filter_map(|sensor| Some((read_deg(sensor)? - worn_deg(sensor)?).abs()))
            .collect::<Vec<f64>>(),
        Fingers::Bend(_) => FINGERS
            .iter()
            .map(
                |joints| match (bend(joints, read_deg), bend(joints, worn_deg)) {
                    (Some(read), Some(worn)) => (read - worn).abs(),
                    _ => f64::INFINITY,
                },
            )
            .collect(),
    };
    if errors.len() < FINGERS.len() {
        return f64::INFINITY;
    }
    errors.into_iter().fold(0.0, f64::max)
}

/// The two main joints of index to little finger.
const FINGERS: [[GloveSensor; 2]; 4] = [
    [GloveSensor::IndexMcp, GloveSensor::IndexPip],
    [GloveSensor::MiddleMcp, GloveSensor::MiddlePip],
    [GloveSensor::RingMcp, GloveSensor::RingPip],
    [GloveSensor::LittleMcp, GloveSensor::LittlePip],
];

fn bend(joints: &[GloveSensor; 2], angle_deg: impl Fn(GloveSensor) -> Option<f64>) -> Option<f64> {
    let mut sum = 0.0;
    for joint in joints {
        let (min_deg, max_deg) = usual_range_deg(*joint);
        sum += (angle_deg(*joint)? - min_deg) / (max_deg - min_deg);
    }
    Some(sum / 2.0)
}

/// How far a wrist is from the hand's, m and rad.
pub(crate) fn wrist_error(wrist: &Isometry3<f64>, played: &Played) -> Wrist {
    let worn = played.sample_at(0).expect("the hand is tracked").wrist;
    let between = worn.inverse() * wrist;
    Wrist {
        metres: between.translation.vector.norm(),
        radians: between.rotation.angle_to(&UnitQuaternion::identity()),
    }
}
