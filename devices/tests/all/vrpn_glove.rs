//! Analogs and buttons of VRPN as a glove.

use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::reading::GloveReading;
use tsukamu_devices::session::{DeviceEvent, Session, SessionState};
use tsukamu_devices::vrpn::body::{ButtonChange, encode_button_states, encode_channels};
use tsukamu_devices::vrpn::names::{ANALOG_CHANNEL, BUTTON_CHANGE, BUTTON_STATES, PONG};
use tsukamu_devices::vrpn::session::VrpnSession;
use tsukamu_devices::vrpn::settings::{ChannelUnit, VrpnSettings};

use crate::support::MS;
use crate::vrpn_session::{events, message, open, sent, settings};

/// A device whose channels 0 and 2 measure something.
fn glove(unit: ChannelUnit) -> VrpnSession {
    open(VrpnSettings {
        channels: vec![
            Some(GloveSensor::ThumbMcp),
            None,
            Some(GloveSensor::IndexMcp),
        ],
        unit,
        ..settings()
    })
}

fn analog(session: &mut VrpnSession, now_ns: u64, channels: &[f64]) {
    let bytes = message(ANALOG_CHANNEL, 9, |out| encode_channels(channels, out));
    session.push(now_ns, &bytes);
}

fn gloves(session: &mut VrpnSession) -> Vec<GloveReading> {
    events(session)
        .into_iter()
        .filter_map(|event| match event {
            DeviceEvent::Glove(reading) => Some(reading),
            _ => None,
        })
        .collect()
}

fn last(session: &mut VrpnSession) -> GloveReading {
    *gloves(session).last().unwrap()
}

fn angle_deg(reading: &GloveReading, sensor: GloveSensor) -> f64 {
    reading.angle_rad(sensor).unwrap().to_degrees()
}

#[test]
fn channels_in_degrees_and_buttons_become_a_glove() {
    let mut session = glove(ChannelUnit::Degrees);
    let states = message(BUTTON_STATES, 1, |out| {
        encode_button_states(&[0, 1, 0, 2], out);
    });
    session.push(2 * MS, &states);
    assert_eq!(gloves(&mut session), [], "nothing is known of its channels");
    analog(&mut session, 3 * MS, &[30.0, 1.0, -90.0]);
    let reading = last(&mut session);
    assert!((angle_deg(&reading, GloveSensor::ThumbMcp) - 30.0).abs() < 1e-12);
    assert!((angle_deg(&reading, GloveSensor::IndexMcp) + 90.0).abs() < 1e-12);
    assert_eq!(reading.sensor(GloveSensor::IndexMcp).unwrap().raw, -90.0);
    assert_eq!(reading.sensor(GloveSensor::IndexPip), None);
    assert_eq!(reading.controls.buttons, 0b1010);
    assert_eq!(reading.device_ticks, Some(9));
    let change = ButtonChange {
        button: 1,
        state: 0,
    };
    let change = message(BUTTON_CHANGE, 10, |out| change.encode(out));
    session.push(4 * MS, &change);
    let reading = last(&mut session);
    assert_eq!(reading.controls.buttons, 0b1000);
    let bend = angle_deg(&reading, GloveSensor::ThumbMcp);
    assert!((bend - 30.0).abs() < 1e-12, "it stands");
}

#[test]
fn raw_channels_are_calibrated_and_radians_taken() {
    let mut session = glove(ChannelUnit::Raw);
    analog(&mut session, 3 * MS, &[60.0, 1.0, 1.0e9]);
    let reading = last(&mut session);
    // Half a degree per count from 40 counts on, up to 107.5 degrees.
    assert!((angle_deg(&reading, GloveSensor::ThumbMcp) - 10.0).abs() < 1e-9);
    assert!(reading.sensor(GloveSensor::IndexMcp).unwrap().clamped);

    let mut session = glove(ChannelUnit::Radians);
    analog(&mut session, 3 * MS, &[0.25]);
    let reading = last(&mut session);
    assert_eq!(reading.angle_rad(GloveSensor::ThumbMcp), Some(0.25));
    let missing = reading.sensor(GloveSensor::IndexMcp);
    assert_eq!(missing, None, "two channels are missing");
    analog(&mut session, 4 * MS, &[f64::NAN, 0.0, f64::INFINITY]);
    let reading = last(&mut session);
    assert_eq!(reading.sensor(GloveSensor::ThumbMcp), None);
    assert_eq!(reading.sensor(GloveSensor::IndexMcp), None);
}

#[test]
fn an_analog_that_does_not_change_stands() {
    let mut session = glove(ChannelUnit::Degrees);
    analog(&mut session, 2 * MS, &[30.0, 0.0, 0.0]);
    let mut stamps = Vec::new();
    for now in 1..=60 {
        let now_ns = now * 100 * MS;
        // The device answers its pings, and sends nothing else.
        if !sent(&mut session).is_empty() {
            session.push(now_ns, &message(PONG, 0, |_| {}));
        }
        session.handle_timeout(now_ns);
        stamps.extend(gloves(&mut session).iter().map(|reading| reading.stamp_ns));
    }
    assert_eq!(session.state(), SessionState::Running);
    let longest = stamps.windows(2).map(|pair| pair[1] - pair[0]).max();
    assert!(longest <= Some(200 * MS), "{longest:?}");
    assert!(*stamps.last().unwrap() >= 5_900 * MS);
}

#[test]
fn an_analog_whose_device_is_gone_does_not_stand() {
    let mut session = glove(ChannelUnit::Degrees);
    analog(&mut session, 2 * MS, &[30.0, 0.0, 0.0]);
    let mut last_ns = 0;
    for now in 1..=60 {
        session.handle_timeout(now * 100 * MS);
        let stamps = gloves(&mut session);
        last_ns = stamps.last().map_or(last_ns, |reading| reading.stamp_ns);
    }
    assert_eq!(session.state(), SessionState::Stalled);
    assert!(last_ns < 3_200 * MS, "{last_ns}");
}
