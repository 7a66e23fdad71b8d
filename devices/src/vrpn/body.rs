//! The bodies of the messages that devices and connections send.

use std::net::Ipv4Addr;

use super::message::u32_at;

/// Most channels of one analog message.
pub const MAX_CHANNELS: usize = 128;
/// Longest name that is believed, in bytes; VRPN's own limit is 100.
pub const MAX_NAME: usize = 255;

/// `vrpn_Tracker Pos_Quat`: a pose in the device's own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosQuat {
    /// The sensor, counted from 0.
    pub sensor: i32,
    /// Position, m.
    pub position: [f64; 3],
    /// Rotation: x, y, z, w.
    pub rotation: [f64; 4],
}

impl PosQuat {
    /// Appends the body.
    pub fn encode(&self, out: &mut Vec<u8>) {
        // The filler carries the sensor again, as VRPN writes it.
        put_i32(out, self.sensor);
        put_i32(out, self.sensor);
        put_f64s(out, &self.position);
        put_f64s(out, &self.rotation);
    }

    /// Reads the body; `None` when it is too short.
    #[must_use]
    pub fn decode(body: &[u8]) -> Option<Self> {
        Some(Self {
            sensor: i32_at(body, 0)?,
            position: f64s_at(body, 8)?,
            rotation: f64s_at(body, 32)?,
        })
    }
}

/// `vrpn_Tracker Velocity` and `vrpn_Tracker Acceleration`: how a sensor moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// The sensor, counted from 0.
    pub sensor: i32,
    /// Linear part, m/s or m/s².
    pub linear: [f64; 3],
    /// How far it turns in the interval: x, y, z, w.
    pub rotation: [f64; 4],
    /// The interval, s.
    pub interval_s: f64,
}

impl Motion {
    /// Appends the body.
    pub fn encode(&self, out: &mut Vec<u8>) {
        put_i32(out, self.sensor);
        put_i32(out, self.sensor);
        put_f64s(out, &self.linear);
        put_f64s(out, &self.rotation);
        put_f64s(out, &[self.interval_s]);
    }

    /// Reads the body; `None` when it is too short.
    #[must_use]
    pub fn decode(body: &[u8]) -> Option<Self> {
        let [interval_s] = f64s_at(body, 64)?;
        Some(Self {
            sensor: i32_at(body, 0)?,
            linear: f64s_at(body, 8)?,
            rotation: f64s_at(body, 32)?,
            interval_s,
        })
    }
}

/// Appends the body of `vrpn_Analog Channel`; channels beyond [`MAX_CHANNELS`] are left out.
pub fn encode_channels(channels: &[f64], out: &mut Vec<u8>) {
    let channels = &channels[..channels.len().min(MAX_CHANNELS)];
    put_f64s(out, &[channels.len() as f64]);
    put_f64s(out, channels);
}

/// Reads the body of `vrpn_Analog Channel`; `None` when the count is no count or the body is too short.
#[must_use]
pub fn decode_channels(body: &[u8]) -> Option<Vec<f64>> {
    let [count] = f64s_at(body, 0)?;
    if !(0.0..=MAX_CHANNELS as f64).contains(&count) || count.fract() != 0.0 {
        return None;
    }
    (0..count as usize)
        .map(|index| f64s_at(body, 8 + 8 * index).map(|[value]| value))
        .collect()
}

/// `vrpn_Button Change`: one button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ButtonChange {
    /// The button, counted from 0.
    pub button: i32,
    /// 0 is released, anything else pressed.
    pub state: i32,
}

impl ButtonChange {
    /// Appends the body.
    pub fn encode(&self, out: &mut Vec<u8>) {
        put_i32(out, self.button);
        put_i32(out, self.state);
    }

    /// Reads the body; `None` when it is too short.
    #[must_use]
    pub fn decode(body: &[u8]) -> Option<Self> {
        Some(Self {
            button: i32_at(body, 0)?,
            state: i32_at(body, 4)?,
        })
    }
}

/// Appends the body of `vrpn_Button States`.
pub fn encode_button_states(states: &[i32], out: &mut Vec<u8>) {
    put_i32(out, states.len() as i32);
    for state in states {
        put_i32(out, *state);
    }
}

/// Reads the body of `vrpn_Button States`; `None` when it is shorter than its count says.
#[must_use]
pub fn decode_button_states(body: &[u8]) -> Option<Vec<i32>> {
    let count = usize::try_from(i32_at(body, 0)?).ok()?;
    // The body is at most 64 KiB, so this bounds the count before anything is reserved.
    if count > body.len() / 4 {
        return None;
    }
    (0..count)
        .map(|index| i32_at(body, 4 + 4 * index))
        .collect()
}

/// `vrpn_Base text_message`: words for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// 0 normal, 1 warning, 2 error.
    pub severity: u32,
    /// The sender's own grading within the severity.
    pub level: u32,
    /// The words.
    pub text: String,
}

impl Text {
    /// Appends the body.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.severity.to_be_bytes());
        out.extend_from_slice(&self.level.to_be_bytes());
        out.extend_from_slice(self.text.as_bytes());
        out.push(0);
    }

    /// Reads the body; `None` when it is too short. The NUL may be missing.
    #[must_use]
    pub fn decode(body: &[u8]) -> Option<Self> {
        Some(Self {
            severity: u32_at(body, 0)?,
            level: u32_at(body, 4)?,
            text: until_nul(body.get(8..)?),
        })
    }
}

/// Appends the body of a description: the length of the name with its NUL, the name, a NUL.
pub fn encode_name(name: &str, out: &mut Vec<u8>) {
    out.extend_from_slice(&(name.len() as u32 + 1).to_be_bytes());
    out.extend_from_slice(name.as_bytes());
    out.push(0);
}

/// Reads the body of a description; `None` when it is shorter than it says, or the name longer than [`MAX_NAME`].
#[must_use]
pub fn decode_name(body: &[u8]) -> Option<String> {
    let length = u32_at(body, 0)? as usize;
    if length > MAX_NAME + 1 {
        return None;
    }
    Some(until_nul(body.get(4..4 + length)?))
}

/// Appends the body of a UDP description: the address in dotted form and a NUL.
pub fn encode_udp_address(address: Ipv4Addr, out: &mut Vec<u8>) {
    out.extend_from_slice(address.to_string().as_bytes());
    out.push(0);
}

/// Reads the body of a UDP description; `None` when it is no dotted address.
#[must_use]
pub fn decode_udp_address(body: &[u8]) -> Option<Ipv4Addr> {
    until_nul(body).parse().ok()
}

/// The datagram that asks a server to connect back: `<own address> <own TCP port>` and a NUL.
#[must_use]
pub fn encode_request(address: Ipv4Addr, port: u16) -> Vec<u8> {
    format!("{address} {port}\0").into_bytes()
}

/// Reads such a datagram: the address as it was written (a name in old clients) and the port.
#[must_use]
pub fn decode_request(datagram: &[u8]) -> Option<(String, u16)> {
    let text = until_nul(datagram.get(..datagram.len().min(MAX_NAME))?);
    let mut words = text.split_ascii_whitespace();
    let (address, port) = (words.next()?, words.next()?.parse().ok()?);
    (port > 0 && words.next().is_none()).then(|| (address.to_owned(), port))
}

fn until_nul(bytes: &[u8]) -> String {
    let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}

fn put_i32(out: &mut Vec<u8>, value: i32) {
    out.extend_from_slice(&value.to_be_bytes());
}

fn put_f64s(out: &mut Vec<u8>, values: &[f64]) {
    for value in values {
        out.extend_from_slice(&value.to_be_bytes());
    }
}

fn i32_at(bytes: &[u8], at: usize) -> Option<i32> {
    u32_at(bytes, at).map(u32::cast_signed)
}

fn f64s_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[f64; N]> {
    let part = bytes.get(at..at + 8 * N)?;
    let mut values = [0.0; N];
    for (value, word) in values.iter_mut().zip(part.chunks_exact(8)) {
        *value = f64::from_be_bytes(word.try_into().ok()?);
    }
    Some(values)
}
