//! The client of VRPN in virtual time, against a server of a few lines.

use std::net::Ipv4Addr;

use tsukamu_devices::fault::Fault;
use tsukamu_devices::glove::calibrate::GloveCalibration;
use tsukamu_devices::session::{DeviceEvent, LinkAbout, PortRequest, Session, SessionState};
use tsukamu_devices::tracker::space::TrackerSpace;
use tsukamu_devices::vrpn::body::{PosQuat, decode_name};
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::message::{Header, Message, Time, encode_with, system};
use tsukamu_devices::vrpn::names::{
    ANALOG_CHANNEL, BUTTON_CHANGE, BUTTON_STATES, PONG, POS_QUAT, describe_sender, describe_type,
};
use tsukamu_devices::vrpn::session::VrpnSession;
use tsukamu_devices::vrpn::settings::VrpnSettings;

use crate::support::{MS, S};

/// Numbers of the server's own choice, unlike ours.
const SENDER: i32 = 7;
const TYPES: [&str; 5] = [POS_QUAT, ANALOG_CHANNEL, BUTTON_CHANGE, BUTTON_STATES, PONG];
const FIRST_TYPE: i32 = 11;

pub(crate) fn settings() -> VrpnSettings {
    VrpnSettings::tracker("Tracker0@tcp://lab".parse().unwrap())
}

pub(crate) fn session(settings: VrpnSettings) -> VrpnSession {
    VrpnSession::new(settings, GloveCalibration::default())
}

/// The number of a type.
fn kind(name: &str) -> i32 {
    FIRST_TYPE + TYPES.iter().position(|known| *known == name).unwrap() as i32
}

/// What a server says first: its cookie, its device, its types.
pub(crate) fn greeting(device: &str) -> Vec<u8> {
    let mut out = COOKIE.to_vec();
    describe_sender(Time::default(), 0, "VRPN Control", &mut out);
    describe_sender(Time::default(), SENDER, device, &mut out);
    for (id, name) in (FIRST_TYPE..).zip(TYPES) {
        describe_type(Time::default(), id, name, &mut out);
    }
    out
}

pub(crate) fn message(name: &str, unix_us: u64, write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let header = Header {
        time: Time::from_unix_ns(unix_us * 1000),
        sender: SENDER,
        kind: kind(name),
        sequence: 3,
    };
    let mut out = Vec::new();
    encode_with(&header, &mut out, write);
    out
}

pub(crate) fn pose(sensor: i32, unix_us: u64, x: f64) -> Vec<u8> {
    let pose = PosQuat {
        sensor,
        position: [x, 2.0, 3.0],
        rotation: [0.0, 0.0, 0.6, 0.8],
    };
    message(POS_QUAT, unix_us, |out| pose.encode(out))
}

pub(crate) fn events(session: &mut VrpnSession) -> Vec<DeviceEvent> {
    std::iter::from_fn(|| session.next_event()).collect()
}

fn states(events: &[DeviceEvent]) -> Vec<SessionState> {
    events
        .iter()
        .filter_map(|event| match event {
            DeviceEvent::State(change) => Some(change.state),
            _ => None,
        })
        .collect()
}

pub(crate) fn sent(session: &mut VrpnSession) -> Vec<u8> {
    std::iter::from_fn(|| session.poll_transmit())
        .flatten()
        .collect()
}

/// A session whose server has greeted.
pub(crate) fn open(settings: VrpnSettings) -> VrpnSession {
    let mut session = session(settings);
    session.port_opening(0);
    session.port_opened(0);
    session.push(MS, &greeting("Tracker0"));
    session
}

/// The messages of what was sent after the cookie.
fn messages(sent: &[u8]) -> Vec<(Header, Vec<u8>)> {
    let mut rest = sent;
    let mut all = Vec::new();
    while let Some((message, n_taken)) = Message::decode(rest, false).unwrap() {
        all.push((message.header, message.body.to_vec()));
        rest = &rest[n_taken..];
    }
    assert!(rest.is_empty());
    all
}

#[test]
fn the_client_says_cookie_names_and_ping() {
    let mut session = session(settings());
    session.link_opening(LinkAbout {
        unix_origin_ns: 1_795_308_339 * S,
        datagrams_at: Some((Ipv4Addr::LOCALHOST, 44_776)),
    });
    session.port_opened(0);
    assert_eq!(sent(&mut session), COOKIE, "without waiting");
    session.push(MS, &COOKIE[..10]);
    assert!(sent(&mut session).is_empty());
    session.push(2 * MS, &COOKIE[10..]);
    let said = messages(&sent(&mut session));
    let kinds: Vec<i32> = said.iter().map(|(header, _)| header.kind).collect();
    let (udp, sender, kind) = (
        system::UDP_DESCRIPTION,
        system::SENDER_DESCRIPTION,
        system::TYPE_DESCRIPTION,
    );
    assert_eq!(kinds, [udp, sender, kind, 0]);
    assert_eq!(said[0].0.sender, 44_776);
    assert_eq!(decode_name(&said[1].1).unwrap(), "Tracker0");
    assert_eq!(decode_name(&said[2].1).unwrap(), "vrpn_Base ping_message");
    assert_eq!(said[3].0.sender, said[1].0.sender);
    assert_eq!(said[3].0.time.unix_us(), Some(1_795_308_339_002_000));
}

#[test]
fn poses_become_readings_with_the_servers_time() {
    let mut session = open(VrpnSettings {
        space: TrackerSpace::ZUp,
        scale: 0.01,
        ..settings()
    });
    session.push(5 * MS, &pose(4, 1_000_001, 150.0));
    session.push(6 * MS, &pose(4, 1_000_002, 151.0));
    let all = events(&mut session);
    let readings: Vec<_> = all
        .iter()
        .filter_map(|event| match event {
            DeviceEvent::Tracker(reading) => Some(*reading),
            _ => None,
        })
        .collect();
    assert_eq!(readings.len(), 2);
    let reading = readings[0];
    assert_eq!((reading.station, reading.sequence), (5, 0));
    assert_eq!(
        (reading.stamp_ns, reading.device_ticks),
        (5 * MS, Some(1_000_001))
    );
    let position = reading.position.unwrap();
    assert!((position.coords - nalgebra::Vector3::new(1.5, 0.02, 0.03)).norm() < 1e-12);
    assert!((reading.rotation.unwrap().k - 0.6).abs() < 1e-12);
    // z up, y forward becomes y up, -z forward.
    let world = reading.world_from_sensor().unwrap().translation.vector;
    assert!((world - nalgebra::Vector3::new(1.5, 0.03, -0.02)).norm() < 1e-12);
    assert_eq!(readings[1].sequence, 1);
    let wanted = [
        SessionState::Opening,
        SessionState::Resetting,
        SessionState::Querying,
        SessionState::Running,
    ];
    assert_eq!(states(&all), wanted);
    assert!(all.iter().any(|event| matches!(
        event,
        DeviceEvent::Identified(about) if about.identity == "Tracker0" && about.tick_ns == Some(1000.0)
    )));
}

#[test]
fn poses_that_are_none_are_marked_or_dropped() {
    let mut session = open(settings());
    let bad = PosQuat {
        sensor: 0,
        position: [f64::NAN, 0.0, 0.0],
        rotation: [0.0; 4],
    };
    session.push(2 * MS, &message(POS_QUAT, 1, |out| bad.encode(out)));
    session.push(3 * MS, &message(POS_QUAT, 1, |out| out.extend([0; 40])));
    session.push(3 * MS, &pose(-1, 2, 1.0));
    session.push(3 * MS, &pose(100_000, 2, 1.0));
    let readings: Vec<_> = events(&mut session)
        .into_iter()
        .filter_map(|event| match event {
            DeviceEvent::Tracker(reading) => Some(reading),
            _ => None,
        })
        .collect();
    assert_eq!(readings.len(), 1);
    assert!(!readings[0].position_valid && !readings[0].rotation_valid);
    assert_eq!(readings[0].world_from_sensor(), None);
    assert_eq!(session.stats().dropped_records, 3);
}

#[test]
fn datagrams_that_come_late_or_broken_are_left_out() {
    let mut session = open(settings());
    let two = [pose(0, 2_000_000, 1.0), pose(0, 2_000_010, 2.0)].concat();
    session.push_datagram(2 * MS, &two);
    session.push_datagram(3 * MS, &pose(0, 2_000_005, 9.0));
    session.push_datagram(4 * MS, &two[..100]);
    session.push_datagram(4 * MS, b"127.0.0.1 1234\0");
    // A name in a datagram is not believed, and the next good one is in step.
    let mut name = Vec::new();
    describe_sender(Time::default(), SENDER, "Other", &mut name);
    session.push_datagram(4 * MS, &name);
    session.push_datagram(5 * MS, &pose(0, 2_000_020, 3.0));
    // A clock that was set back by more than a second goes on.
    session.push_datagram(6 * MS, &pose(0, 500_000, 4.0));
    let xs: Vec<f64> = events(&mut session)
        .iter()
        .filter_map(|event| match event {
            DeviceEvent::Tracker(reading) => reading.position.map(|at| at.x),
            _ => None,
        })
        .collect();
    // What is whole in the broken one is older than what was there.
    assert_eq!(xs, [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(session.stats().resyncs, 2);
}

#[test]
fn silence_is_named_and_ends_the_connection() {
    let mut session = open(settings());
    session.push(2 * MS, &pose(0, 1, 1.0));
    events(&mut session);
    sent(&mut session);
    let mut pings = 0;
    let mut now_ns = 2 * MS;
    while session.poll_port_request() != Some(PortRequest::Reopen) {
        assert!(now_ns < 20 * S);
        now_ns += 50 * MS;
        session.handle_timeout(now_ns);
        pings += sent(&mut session).len() / 24;
        if now_ns < 2_900 * MS {
            assert_eq!(session.state(), SessionState::Running);
        }
        if now_ns > 3_200 * MS {
            assert_eq!(session.state(), SessionState::Stalled);
        }
    }
    assert!((9_900 * MS..10_300 * MS).contains(&now_ns), "{now_ns}");
    assert!((8..=14).contains(&pings), "{pings} pings in ten seconds");
    let fault = session.fault().unwrap().to_string();
    assert!(
        fault.contains("Tracker0@tcp://lab:3883: no response"),
        "{fault}"
    );
    // Another connection, and it runs again.
    session.port_lost(now_ns, session.fault().cloned().unwrap());
    session.port_opened(now_ns);
    session.push(now_ns, &greeting("Tracker0"));
    session.push(now_ns, &pose(0, 2, 1.0));
    assert_eq!(session.state(), SessionState::Running);
    assert_eq!(session.fault(), None);
    assert_eq!(session.stats().restarts, 1);
}

#[test]
fn a_device_that_answers_and_sends_nothing_is_mute() {
    let mut session = open(settings());
    for now in 1..100 {
        let now_ns = now * 100 * MS;
        sent(&mut session);
        session.push(now_ns, &message(PONG, 0, |_| {}));
        session.handle_timeout(now_ns);
    }
    assert_eq!(session.state(), SessionState::Stalled);
    let fault = session.fault().unwrap().to_string();
    assert!(fault.contains("sends nothing"), "{fault}");
    assert_eq!(session.poll_port_request(), None, "the connection is good");
    session.push(10 * S, &pose(0, 1, 1.0));
    assert_eq!(
        (session.state(), session.fault()),
        (SessionState::Running, None)
    );
}

#[test]
fn a_wrong_name_is_told_from_the_names_that_are_there() {
    let mut session = session(settings());
    session.port_opened(0);
    session.push(MS, &greeting("Head"));
    for now in 1..80 {
        session.handle_timeout(now * 50 * MS);
    }
    let fault = session.fault().unwrap().to_string();
    assert!(
        fault.contains("has no device \"Tracker0\"; it names Head"),
        "{fault}"
    );
}

#[test]
fn what_is_no_server_is_named() {
    let mut foreign = session(settings());
    foreign.port_opened(0);
    foreign.push(MS, b"vrpn: ver. 06.04  0\0\0\0\0\0");
    assert_eq!(foreign.poll_port_request(), Some(PortRequest::Reopen));
    let fault = foreign.fault().unwrap().to_string();
    assert!(
        fault.contains("version 07") && fault.contains("06.04"),
        "{fault}"
    );

    let mut silent = session(settings());
    silent.port_opened(0);
    silent.handle_timeout(silent.deadline().unwrap());
    assert_eq!(silent.poll_port_request(), Some(PortRequest::Reopen));
    assert!(
        silent
            .fault()
            .unwrap()
            .to_string()
            .contains("does not greet")
    );
}

#[test]
fn a_server_that_closes_again_and_again_is_no_news() {
    let mut session = session(settings());
    let lost = || Fault::Unplugged {
        path: "x".to_owned(),
    };
    session.port_opening(0);
    session.port_lost(MS, lost());
    events(&mut session);
    for round in 2..50 {
        session.port_opened(round * 100 * MS);
        if round % 2 == 0 {
            session.push(round * 100 * MS, &COOKIE);
        }
        session.port_lost(round * 100 * MS, lost());
    }
    assert_eq!(events(&mut session), []);
}
