//! The frames of Liberty, Patriot and Latus, written out: the inverse of their `decode.rs`.

use crate::emulate::liberty::Sensor;
use crate::tracker::liberty::protocol::{GOOD, Model};
use crate::tracker::space::{METRES_PER_CENTIMETRE, METRES_PER_INCH};

/// The counters at a frame, and the command that it answers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    pub(crate) time_ms: u32,
    pub(crate) n_frames: u32,
    pub(crate) command: u8,
}

fn place(sensor: &Sensor, is_centimetres: bool) -> [f64; 3] {
    let metres = if is_centimetres {
        METRES_PER_CENTIMETRE
    } else {
        METRES_PER_INCH
    };
    (sensor.receiver.pose.translation.vector / metres).into()
}

fn degrees(sensor: &Sensor) -> [f64; 3] {
    let (roll, elevation, azimuth) = sensor.receiver.pose.rotation.euler_angles();
    [azimuth, elevation, roll].map(f64::to_degrees)
}

fn wxyz(sensor: &Sensor) -> [f64; 4] {
    let rotation = sensor.receiver.pose.rotation;
    [rotation.w, rotation.i, rotation.j, rotation.k]
}

/// One station's frame. Positions are in centimetres or inches.
pub(crate) fn binary_frame(
    model: Model,
    station: u8,
    sensor: &Sensor,
    moment: Moment,
    is_centimetres: bool,
) -> Vec<u8> {
    let floats = |values: &[f64]| -> Vec<u8> {
        values
            .iter()
            .flat_map(|value| (*value as f32).to_le_bytes())
            .collect()
    };
    let payload: Vec<u8> = sensor
        .list
        .iter()
        .flat_map(|item| match item {
            0 => b" ".to_vec(),
            1 => b"\r\n".to_vec(),
            2 => floats(&place(sensor, is_centimetres)),
            4 => floats(&degrees(sensor)),
            7 => floats(&wxyz(sensor)),
            8 => moment.time_ms.to_le_bytes().to_vec(),
            9 => moment.n_frames.to_le_bytes().to_vec(),
            10 => u32::from(sensor.pressed).to_le_bytes().to_vec(),
            _ => Vec::new(),
        })
        .collect();
    let [first, second] = model.preamble();
    let error = sensor.error.unwrap_or(GOOD);
    let mut frame = vec![first, second, station, moment.command, error, 0];
    frame.extend((payload.len() as i16).to_le_bytes());
    frame.extend(payload);
    frame
}

/// One station's frame as text.
pub(crate) fn ascii_frame(
    station: u8,
    sensor: &Sensor,
    moment: Moment,
    is_centimetres: bool,
) -> Vec<u8> {
    let numbers =
        |values: &[f64]| -> String { values.iter().map(|value| format!("{value:9.3}")).collect() };
    let mut text = format!("{station:02}{}", char::from(moment.command));
    for item in &sensor.list {
        text += &match item {
            0 => " ".to_owned(),
            1 => "\r\n".to_owned(),
            2 => numbers(&place(sensor, is_centimetres)),
            4 => numbers(&degrees(sensor)),
            7 => numbers(&wxyz(sensor)),
            8 => format!("{:10}", moment.time_ms),
            9 => format!("{:10}", moment.n_frames),
            10 => format!(" {}", u8::from(sensor.pressed)),
            _ => String::new(),
        };
    }
    text.into_bytes()
}

/// The answer to `^V`; units send 196 to 247 bytes.
pub(crate) fn introduction(model: Model) -> Vec<u8> {
    const LENGTH: usize = 196;
    let text = format!(
        "0  {} emulated electronics unit\r\nFirmware version 1.2.3\r\n",
        model.family()
    );
    let width = LENGTH - 2;
    format!("{text:<width$}\r\n").into_bytes()
}
