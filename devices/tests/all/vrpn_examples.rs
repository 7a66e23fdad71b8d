//! The captured exchanges of VRPN: each decodes to its values and, where it is ours to send, is encoded byte by byte.

use std::net::Ipv4Addr;

use tsukamu_devices::vrpn::address::{Address, Transport};
use tsukamu_devices::vrpn::body::{
    ButtonChange, Motion, PosQuat, Text, decode_button_states, decode_channels, decode_name,
    decode_request, decode_udp_address, encode_button_states, encode_channels, encode_name,
    encode_request, encode_udp_address,
};
use tsukamu_devices::vrpn::cookie::{COOKIE, Cookie};
use tsukamu_devices::vrpn::message::{
    Header, MAX_DATAGRAM, Message, MessageFault, Time, datagrams, encode_with, system,
};

use crate::support::bytes;

/// The message, after a check that its bytes are what it encodes to, but for the padding and, in the captures, the end.
fn whole(captured: &[u8]) -> Message<'_> {
    let (message, n_taken) = Message::decode(captured, false).unwrap().unwrap();
    assert_eq!(n_taken, captured.len());
    let mut again = Vec::new();
    message.encode(&mut again);
    let unpadded = 24 + message.body.len();
    assert_eq!(again[..unpadded], captured[..unpadded]);
    assert_eq!(again.len(), captured.len());
    assert!(again[unpadded..].iter().all(|byte| *byte == 0));
    message
}

fn body(write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out);
    out
}

#[test]
fn the_cookie_is_that_of_7_38() {
    let captured = bytes("76 72 70 6E 3A 20 76 65 72 2E 20 30 37 2E 33 38 20 20 30 00 00 00 00 00");
    assert_eq!(captured, COOKIE);
    let fits = |version: &str| Cookie::Fits {
        version: version.to_owned(),
    };
    assert_eq!(Cookie::judge(&COOKIE), fits("vrpn: ver. 07.38"));
    let with = |text: &[u8]| {
        let mut cookie = [0; 24];
        cookie[..text.len()].copy_from_slice(text);
        Cookie::judge(&cookie)
    };
    // Another minor, and a server that asks for a log of both directions.
    assert_eq!(with(b"vrpn: ver. 07.35  3"), fits("vrpn: ver. 07.35"));
    let foreign = |text: &str| Cookie::Foreign {
        text: text.to_owned(),
    };
    assert_eq!(with(b"vrpn: ver. 06.04  0"), foreign("vrpn: ver. 06.04  0"));
    assert_eq!(
        with(b"HTTP/1.1 400 Bad Request"),
        foreign("HTTP/1.1 400 Bad Request")
    );
    assert_eq!(with(b""), foreign(""));
}

#[test]
fn a_sender_description_names_tracker0() {
    let captured = bytes(
        "00 00 00 25 6B 02 3B 32 00 0B 86 C8 00 00 00 01 FF FF FF FF 00 00 00 01 \
         00 00 00 09 54 72 61 63 6B 65 72 30 00 00 00 00",
    );
    // The capture has its three bytes of padding.
    let captured = [captured, vec![]].concat();
    let message = whole(&captured);
    assert_eq!(
        message.header,
        Header {
            time: Time {
                seconds: 1_795_308_338,
                microseconds: 755_400
            },
            sender: 1,
            kind: system::SENDER_DESCRIPTION,
            sequence: 1,
        }
    );
    assert_eq!(decode_name(message.body).unwrap(), "Tracker0");
    assert_eq!(body(|out| encode_name("Tracker0", out)), message.body);
}

#[test]
fn a_udp_description_names_port_and_address() {
    // The capture leaves out time and sequence.
    let captured = bytes(
        "00 00 00 22 00 00 00 00 00 00 00 00 00 00 AE E8 FF FF FF FD 00 00 00 00 \
         31 32 37 2E 30 2E 30 2E 31 00 00 00 00 00 00 00",
    );
    let message = whole(&captured);
    assert_eq!(message.header.kind, system::UDP_DESCRIPTION);
    assert_eq!(message.header.sender, 44_776);
    assert_eq!(decode_udp_address(message.body), Some(Ipv4Addr::LOCALHOST));
    let own = body(|out| encode_udp_address(Ipv4Addr::LOCALHOST, out));
    assert_eq!(own, message.body);
}

#[test]
fn n1_the_first_pose_of_a_real_server() {
    let header = "00 00 00 58 6B 02 3B 33 00 03 BE 30 00 00 00 01 00 00 00 04 00 00 00 1D ";
    let zeros = "00 ".repeat(56);
    let captured = bytes(&format!("{header}{zeros}3F F0 00 00 00 00 00 00"));
    let message = whole(&captured);
    assert_eq!(
        message.header,
        Header {
            time: Time {
                seconds: 1_795_308_339,
                microseconds: 245_296
            },
            sender: 1,
            kind: 4,
            sequence: 29,
        }
    );
    assert_eq!(message.header.time.unix_us(), Some(1_795_308_339_245_296));
    let pose = PosQuat {
        sensor: 0,
        position: [0.0; 3],
        rotation: [0.0, 0.0, 0.0, 1.0],
    };
    assert_eq!(PosQuat::decode(message.body), Some(pose));
    assert_eq!(body(|out| pose.encode(out)), message.body);
}

#[test]
fn n2_a_pose_that_a_real_client_took() {
    let captured = bytes(&format!(
        "00 00 00 58 65 53 F1 00 00 03 D0 90 00 00 00 01 00 00 00 07 00 00 00 00 \
         00 00 00 02 00 00 00 02 3F B9 99 99 99 99 99 9A BF C9 99 99 99 99 99 9A \
         3F D3 33 33 33 33 33 33 {} 3F E6 A0 9E 65 DC 27 DF 3F E6 A0 9E 65 DC 27 DF",
        "00 ".repeat(16)
    ));
    let message = whole(&captured);
    assert_eq!((message.header.sender, message.header.kind), (1, 7));
    let pose = PosQuat::decode(message.body).unwrap();
    assert_eq!((pose.sensor, pose.position), (2, [0.1, -0.2, 0.3]));
    assert_eq!(pose.rotation[..2], [0.0, 0.0]);
    // About half the root of 2, as the client printed it.
    assert_eq!(pose.rotation[2], pose.rotation[3]);
    assert!((2.0 * pose.rotation[2].powi(2) - 1.0).abs() < 1e-4);
    assert_eq!(body(|out| pose.encode(out)), message.body);
}

#[test]
fn n3_button_states_with_stale_padding() {
    let captured = bytes(
        "00 00 00 24 00 00 00 00 00 00 00 00 00 00 00 01 00 00 00 05 00 00 00 00 \
         00 00 00 02 00 00 00 01 00 00 00 01 74 72 6F 6C",
    );
    let message = whole(&captured);
    assert_eq!(decode_button_states(message.body), Some(vec![1, 1]));
    assert_eq!(body(|out| encode_button_states(&[1, 1], out)), message.body);
}

#[test]
fn n4_a_pong_has_no_body() {
    let captured = bytes("00 00 00 18 6B 02 3B 36 00 08 61 D7 00 00 00 01 00 00 00 11 00 00 00 55");
    let message = whole(&captured);
    assert_eq!((message.header.sender, message.header.kind), (1, 17));
    assert!(message.body.is_empty());
}

#[test]
fn n5_a_request_to_connect_back() {
    let captured = bytes("31 32 37 2E 30 2E 30 2E 31 20 34 36 31 31 37 00");
    let asked = decode_request(&captured);
    assert_eq!(asked, Some(("127.0.0.1".to_owned(), 46_117)));
    assert_eq!(encode_request(Ipv4Addr::LOCALHOST, 46_117), captured);
    for bad in [
        &b""[..],
        b"127.0.0.1",
        b"127.0.0.1 ",
        b"127.0.0.1 0",
        b"127.0.0.1 65536",
        b"a 1 2",
        b"\xFF\xFE",
    ] {
        assert_eq!(decode_request(bad), None, "{bad:?}");
    }
}

#[test]
fn bodies_have_the_lengths_of_the_table() {
    let length = |write: &dyn Fn(&mut Vec<u8>)| {
        let mut out = Vec::new();
        encode_with(&Header::default(), &mut out, write);
        assert!(out.len().is_multiple_of(8));
        u32::from_be_bytes(out[..4].try_into().unwrap())
    };
    let motion = Motion {
        sensor: 3,
        linear: [1.0, 2.0, 3.0],
        rotation: [0.0, 0.0, 0.6, 0.8],
        interval_s: 0.25,
    };
    let change = ButtonChange {
        button: 4,
        state: 1,
    };
    let text = Text {
        severity: 2,
        level: 7,
        text: "no light".to_owned(),
    };
    assert_eq!(length(&|out| motion.encode(out)), 96);
    assert_eq!(length(&|out| change.encode(out)), 32);
    assert_eq!(length(&|out| encode_channels(&[1.5, -2.5, 0.0], out)), 56);
    assert_eq!(length(&|out| encode_button_states(&[0, 1, 1], out)), 40);
    assert_eq!(length(&|out| text.encode(out)), 32 + 9);
    assert_eq!(length(&|_| {}), 24);
    assert_eq!(
        Motion::decode(&body(|out| motion.encode(out))),
        Some(motion)
    );
    assert_eq!(
        ButtonChange::decode(&body(|out| change.encode(out))),
        Some(change)
    );
    assert_eq!(Text::decode(&body(|out| text.encode(out))), Some(text));
    let channels = body(|out| encode_channels(&[1.5, -2.5, 0.0], out));
    assert_eq!(decode_channels(&channels), Some(vec![1.5, -2.5, 0.0]));
    let many = body(|out| encode_channels(&[1.0; 200], out));
    assert_eq!(decode_channels(&many).unwrap().len(), 128);
}

#[test]
fn bodies_that_lie_about_their_length_are_refused() {
    assert_eq!(PosQuat::decode(&[0; 63]), None);
    assert_eq!(Motion::decode(&[0; 71]), None);
    assert_eq!(ButtonChange::decode(&[0; 7]), None);
    assert_eq!(Text::decode(&[0; 7]), None);
    for count in [f64::NAN, -1.0, 0.5, 2.0, 129.0, 1.0e300, f64::INFINITY] {
        let lie = body(|out| out.extend([count, 1.0].iter().flat_map(|x| x.to_be_bytes())));
        assert_eq!(decode_channels(&lie), None, "{count}");
    }
    assert_eq!(
        decode_button_states(&bytes("7F FF FF FF 00 00 00 01")),
        None
    );
    assert_eq!(decode_button_states(&bytes("FF FF FF FF")), None);
    assert_eq!(decode_name(&bytes("00 00 00 09 54 00")), None);
    assert_eq!(decode_name(&bytes("FF FF FF FF 54 00")), None);
}

#[test]
fn headers_that_cannot_be_are_refused_early() {
    let header = |length: u32, kind: i32| {
        let mut out = length.to_be_bytes().to_vec();
        out.extend([0; 12]);
        out.extend(kind.to_be_bytes());
        out
    };
    let fault = |bytes: &[u8]| Message::decode(bytes, false).unwrap_err();
    assert_eq!(fault(&header(23, 0)[..4]), MessageFault::TooShort(23));
    assert_eq!(
        fault(&header(65_537, 0)[..4]),
        MessageFault::TooLong(65_537)
    );
    assert_eq!(fault(&header(24, -6)), MessageFault::UnknownSystemType(-6));
    for kind in [-5, -4, -3, -2, -1, 0, i32::MAX] {
        assert_eq!(Message::decode(&header(24, kind), false), Ok(None));
    }
}

#[test]
fn datagrams_hold_whole_messages() {
    let pose = PosQuat {
        sensor: 1,
        position: [1.0; 3],
        rotation: [0.0, 0.0, 0.0, 1.0],
    };
    let mut all = Vec::new();
    for sequence in 0..50 {
        let header = Header {
            sequence,
            ..Header::default()
        };
        encode_with(&header, &mut all, |out| pose.encode(out));
    }
    let parts: Vec<&[u8]> = datagrams(&all).collect();
    // 16 messages of 88 bytes fit into 1472.
    let lengths: Vec<usize> = parts.iter().map(|part| part.len()).collect();
    assert_eq!(lengths, [16 * 88, 16 * 88, 16 * 88, 2 * 88]);
    assert!(lengths.iter().all(|length| *length <= MAX_DATAGRAM));
    assert_eq!(parts.concat(), all);
    assert_eq!(datagrams(&[]).count(), 0);
    assert_eq!(datagrams(&[0; 3]).count(), 0);
}

#[test]
fn names_of_devices_are_those_of_vrpn() {
    let cases = [
        (
            "Tracker0@tcp://lab:4000",
            "Tracker0",
            Transport::Tcp,
            "lab",
            4000,
        ),
        (
            "Tracker0@tcp://lab",
            "Tracker0",
            Transport::Tcp,
            "lab",
            3883,
        ),
        ("Tracker0@tcp:lab", "Tracker0", Transport::Tcp, "lab", 3883),
        (
            "Hand0@10.0.0.7",
            "Hand0",
            Transport::UdpRequest,
            "10.0.0.7",
            3883,
        ),
        (
            "Hand0@x-vrpn://pc:9",
            "Hand0",
            Transport::UdpRequest,
            "pc",
            9,
        ),
        ("a b@[::1]:7", "a b", Transport::UdpRequest, "::1", 7),
    ];
    for (text, device, transport, host, port) in cases {
        let address: Address = text.parse().unwrap();
        let expected = Address {
            device: device.to_owned(),
            transport,
            host: host.to_owned(),
            port,
        };
        assert_eq!(address, expected, "{text}");
        assert_eq!(address.to_string().parse(), Ok(address), "{text}");
    }
    for bad in [
        "",
        "Tracker0",
        "@host",
        "T@",
        "T@tcp://",
        "T@host:",
        "T@host:0",
        "T@host:65536",
        "T@mpi://host",
        "T@ho st",
        "T@[::1",
        "T@host/dir",
    ] {
        let fault = bad.parse::<Address>().unwrap_err().to_string();
        assert!(fault.contains("Tracker0@tcp://host"), "{bad}: {fault}");
    }
}
