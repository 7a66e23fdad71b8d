//! Arbitrary bytes in place of a VRPN server's: no panic, no growth, a new connection, and readings again at once.

use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assert_eq, proptest};
use proptest::test_runner::RngSeed;
use tsukamu_devices::session::{PortRequest, Session, SessionState};
use tsukamu_devices::vrpn::body::{
    PosQuat, Text, decode_button_states, decode_channels, decode_name, decode_request,
    decode_udp_address, encode_channels,
};
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::inbound::Inbound;
use tsukamu_devices::vrpn::message::{Header, Message, Time, datagrams, encode_with};

use crate::support::MS;
use crate::vrpn_session::{events, greeting, open, pose, session, settings};

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn messages_come_back_as_they_were(
        times in (any::<u32>(), any::<u32>()), sender in any::<i32>(), kind in -5..i32::MAX,
        sequence in any::<u32>(), body in vec(any::<u8>(), 0..400), more in vec(any::<u8>(), 0..20),
    ) {
        let time = Time { seconds: times.0, microseconds: times.1 };
        let header = Header { time, sender, kind, sequence };
        let mut bytes = Vec::new();
        Message { header, body: &body }.encode(&mut bytes);
        let n_bytes = bytes.len();
        bytes.extend(more);
        let (message, n_taken) = Message::decode(&bytes, false).unwrap().unwrap();
        prop_assert_eq!(message, Message { header, body: &body });
        prop_assert_eq!(n_taken, n_bytes);
        prop_assert_eq!(Message::decode(&bytes[..n_bytes - 1], false).unwrap().is_none() , true);
    }

    #[test]
    fn bodies_of_any_bytes_are_read_or_refused(body in vec(any::<u8>(), 0..200)) {
        let _ = (PosQuat::decode(&body), Text::decode(&body), decode_name(&body));
        let _ = (decode_udp_address(&body), decode_request(&body));
        prop_assert!(decode_channels(&body).is_none_or(|channels| channels.len() <= 128));
        prop_assert!(decode_button_states(&body).is_none_or(|states| 4 * states.len() <= body.len()));
        let n_bytes: usize = datagrams(&body).map(<[u8]>::len).sum();
        prop_assert!(n_bytes <= body.len());
    }

    #[test]
    fn arbitrary_bytes_do_no_harm(
        parts in vec((any::<u32>(), vec(any::<u8>(), 0..300), any::<bool>()), 0..60), greeted in any::<bool>(),
    ) {
        let mut session = session(settings());
        let mut now_ns = 0;
        session.port_opened(0);
        if greeted {
            session.push(0, &greeting("Tracker0"));
        }
        for (pause_ns, junk, is_datagram) in &parts {
            now_ns += u64::from(*pause_ns);
            session.handle_timeout(now_ns);
            if *is_datagram {
                session.push_datagram(now_ns, junk);
            } else {
                session.push(now_ns, junk);
            }
            while session.poll_transmit().is_some() {}
            while session.poll_port_request().is_some() {
                session.port_opened(now_ns);
            }
        }
        prop_assert!(events(&mut session).len() <= 1024);
    }

    // There is nothing in a stream to find the next message by: the connection is made anew, and its first message is
    // a good one. Datagrams stand alone, and the next one is good.
    #[test]
    fn after_garbage_the_next_connection_is_in_step(junk in vec(any::<u8>(), 24..400)) {
        let mut session = open(settings());
        session.push(2 * MS, &junk);
        for now in 1..150 {
            session.handle_timeout(now * 100 * MS);
            if session.poll_port_request() == Some(PortRequest::Reopen) {
                break;
            }
        }
        session.port_opened(16_000 * MS);
        session.push(16_001 * MS, &greeting("Tracker0"));
        let before = session.stats().records;
        session.push(16_002 * MS, &pose(0, 1, 1.0));
        prop_assert_eq!(session.stats().records, before + 1);
        prop_assert_eq!(session.state(), SessionState::Running);
        session.push_datagram(16_003 * MS, &junk);
        session.push_datagram(16_004 * MS, &pose(0, 2, 1.0));
        prop_assert!(session.stats().records >= before + 2);
    }

    #[test]
    fn bytes_in_any_portions_are_the_same(cuts in vec(1_usize..200, 1..80)) {
        let mut all = greeting("Tracker0");
        for number in 0..20 {
            all.extend(pose(number, 5, 1.0));
        }
        let mut session = session(settings());
        session.port_opened(0);
        let mut rest = all.as_slice();
        for cut in cuts.iter().cycle() {
            let (part, after) = rest.split_at((*cut).min(rest.len()));
            session.push(MS, part);
            rest = after;
            if rest.is_empty() {
                break;
            }
        }
        prop_assert_eq!(session.stats().records, 20);
        prop_assert_eq!(session.stats().resyncs, 0);
    }
}

#[test]
fn a_flood_does_not_grow_anything() {
    let mut inbound = Inbound::default();
    inbound.push(&COOKIE);
    assert!(matches!(inbound.next_item(), Ok(Some(_))));
    // A message of the greatest length, of which the rest never comes, and names without end.
    let mut long = Vec::new();
    encode_with(&Header::default(), &mut long, |out| {
        out.resize(24 + 65_000, 0)
    });
    for part in long.chunks(Inbound::MAX_PUSH) {
        inbound.push(part);
        assert!(inbound.rest().len() <= Inbound::CAPACITY);
    }
    assert!(inbound.next_item().unwrap().is_some());
    let mut session = open(settings());
    let mut flood = Vec::new();
    for id in 0..5_000 {
        tsukamu_devices::vrpn::names::describe_sender(
            Time::default(),
            id,
            &format!("device {id}"),
            &mut flood,
        );
    }
    encode_with(
        &Header {
            kind: 12,
            sender: 7,
            ..Header::default()
        },
        &mut flood,
        |out| {
            encode_channels(&[0.0; 128], out);
        },
    );
    for round in 0..20 {
        session.push(round * MS, &flood);
        session.push_datagram(round * MS, &flood);
    }
    assert!(events(&mut session).len() <= 1024);
    assert_eq!(session.poll_port_request(), None);
}
