//! VRPN clients that are rude, slow, foreign or many.

use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpStream, UdpSocket};
use tsukamu_devices::vrpn::body::encode_request;
use tsukamu_devices::vrpn::cookie::COOKIE;
use tsukamu_devices::vrpn::message::Message;
use tsukamu_devices::vrpn::names::PONG;
use tsukamu_server::daemon::{Daemon, DaemonError, start};
use tsukamu_server::settings::Mode;
use tsukamu_server::vrpn::VrpnFault;

use super::support::{cubes, soon};
use super::vrpn_probe::{Probe, address, vrpn_config, vrpn_daemon};

/// Bytes as a literal shows them.
fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace()
        .map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal"))
        .collect()
}

/// Waits until the server has dropped so many clients.
async fn dropped(daemon: &Daemon, n: u64) {
    let counter = &daemon.backend().metrics.vrpn.clients_dropped;
    soon(async {
        while counter.get() < n {
            tokio::task::yield_now().await;
        }
    })
    .await;
    assert_eq!(counter.get(), n);
}

/// Everything that comes until the connection ends.
async fn rest(mut stream: TcpStream) -> Vec<u8> {
    let mut all = Vec::new();
    // A reset is an end, too.
    let _ = soon(stream.read_to_end(&mut all)).await;
    all
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_exchange_is_that_of_vrpn_byte_by_byte() {
    let daemon = vrpn_daemon(cubes(0, 240.0), Mode::Lockstep, 60.0).await;
    let mut stream = soon(TcpStream::connect(address(&daemon)))
        .await
        .expect("it listens");
    let mut cookie = [0; 24];
    soon(stream.read_exact(&mut cookie))
        .await
        .expect("without waiting");
    let expected = "76 72 70 6E 3A 20 76 65 72 2E 20 30 37 2E 33 38 20 20 30 00 00 00 00 00";
    assert_eq!(cookie.to_vec(), bytes(expected));
    // A client of version 07.35 that opens `Objects` and pings it: sender 2, type 17 of its own counting.
    let client = "76 72 70 6E 3A 20 76 65 72 2E 20 30 37 2E 33 35 20 20 30 00 00 00 00 00 \
        00 00 00 24 65 53 F1 00 00 03 D0 90 00 00 00 02 FF FF FF FF 00 00 00 01 \
        00 00 00 08 4F 62 6A 65 63 74 73 00 74 72 6F 6C \
        00 00 00 33 65 53 F1 00 00 03 D0 90 00 00 00 11 FF FF FF FE 00 00 00 02 \
        00 00 00 17 76 72 70 6E 5F 42 61 73 65 20 70 69 6E 67 5F 6D 65 73 73 61 67 65 00 00 00 00 00 00 \
        00 00 00 18 65 53 F1 00 00 03 D0 90 00 00 00 02 00 00 00 11 00 00 00 03";
    stream.write_all(&bytes(client)).await.expect("sent");
    let mut head = [0; 48 + 40 + 40 + 56];
    soon(stream.read_exact(&mut head))
        .await
        .expect("descriptions");
    // The times are those of the day.
    for message in [0, 48, 88, 128] {
        head[message + 4..message + 12].fill(0);
    }
    let expected = "\
        00 00 00 29 00 00 00 00 00 00 00 00 00 00 00 00 FF FF FF FF 00 00 00 00 \
        00 00 00 0D 56 52 50 4E 20 43 6F 6E 74 72 6F 6C 00 00 00 00 00 00 00 00 \
        00 00 00 24 00 00 00 00 00 00 00 00 00 00 00 01 FF FF FF FF 00 00 00 00 \
        00 00 00 08 4F 62 6A 65 63 74 73 00 00 00 00 00 \
        00 00 00 22 00 00 00 00 00 00 00 00 00 00 00 02 FF FF FF FF 00 00 00 00 \
        00 00 00 06 57 6F 72 6C 64 00 00 00 00 00 00 00 \
        00 00 00 32 00 00 00 00 00 00 00 00 00 00 00 00 FF FF FF FE 00 00 00 00 \
        00 00 00 16 76 72 70 6E 5F 54 72 61 63 6B 65 72 20 50 6F 73 5F 51 75 61 74 00 \
        00 00 00 00 00 00";
    assert_eq!(head.to_vec(), bytes(expected));
    // A pong of `Objects`, sender 1, type 5 of the server's counting, without a body.
    let mut said = Vec::new();
    let pong = loop {
        let mut part = [0; 1024];
        let n_bytes = soon(stream.read(&mut part)).await.expect("more");
        assert!(n_bytes > 0, "it goes on");
        said.extend_from_slice(&part[..n_bytes]);
        let mut rest = said.as_slice();
        let mut found = None;
        while let Some((message, n_taken)) = Message::decode(rest, false).expect("good") {
            if message.header.kind == 5 {
                found = Some(rest[..n_taken].to_vec());
            }
            rest = &rest[n_taken..];
        }
        if let Some(found) = found {
            break found;
        }
    };
    assert_eq!(pong[..4], bytes("00 00 00 18"));
    assert_eq!(pong[12..], bytes("00 00 00 01 00 00 00 05 00 00 00 00"));
    daemon.shutdown().await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_no_client_is_turned_away() {
    let daemon = vrpn_daemon(cubes(0, 240.0), Mode::Realtime, 60.0).await;
    let to = address(&daemon);
    let header = |length: &str, kind: &str| {
        format!("{length} 00 00 00 00 00 00 00 00 00 00 00 00 {kind} 00 00 00 00")
    };
    let bad: Vec<Vec<u8>> = vec![
        b"vrpn: ver. 06.04  0\0\0\0\0\0".to_vec(),
        b"GET / HTTP/1.1\r\nhost: x\r\n\r\n".to_vec(),
        [
            COOKIE.to_vec(),
            bytes(&header("00 00 00 17", "00 00 00 00")),
        ]
        .concat(),
        [
            COOKIE.to_vec(),
            bytes(&header("00 01 00 01", "00 00 00 00")),
        ]
        .concat(),
        [
            COOKIE.to_vec(),
            bytes(&header("00 00 00 18", "FF FF FF FA")),
        ]
        .concat(),
        [COOKIE.to_vec(), vec![0xFF; 4000]].concat(),
    ];
    for (round, bad) in (1..).zip(&bad) {
        let mut stream = soon(TcpStream::connect(to)).await.expect("it listens");
        stream.write_all(bad).await.expect("sent");
        let said = rest(stream).await;
        assert!(said.len() < 24 || said[..24] == COOKIE, "{round}");
        dropped(&daemon, round).await;
    }
    // Datagrams that are none, and one that names a port at which nobody listens.
    let socket = UdpSocket::bind("127.0.0.1:0").await.expect("a port");
    let free = {
        let probe = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        probe.local_addr().expect("an address").port()
    };
    for datagram in [
        b"\xFF\xFE".to_vec(),
        vec![b'1'; 500],
        Vec::new(),
        encode_request([127, 0, 0, 1].into(), free),
    ] {
        socket.send_to(&datagram, to).await.expect("sent");
    }
    dropped(&daemon, bad.len() as u64 + 1).await;
    let mut good = Probe::connect(to).await;
    good.open("Objects").await;
    good.open("Nothing").await;
    let pong = good
        .find(|seen| (seen.kind == PONG).then(|| seen.sender.clone()))
        .await;
    assert_eq!(pong, "Objects");
    good.tick().await;
    soon(daemon.shutdown()).await.expect("a clean end");
    while good.next().await.is_some() {}
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_takes_nothing_is_dropped_and_stops_nobody() {
    let daemon = vrpn_daemon(cubes(300, 240.0), Mode::Realtime, 240.0).await;
    let to = address(&daemon);
    let stalled = Probe::connect(to).await;
    let mut good = Probe::connect(to).await;
    let begin = std::time::Instant::now();
    let mut last = good.tick().await;
    let counter = &daemon.backend().metrics.vrpn.clients_dropped;
    let mut n_pictures = 0;
    while counter.get() == 0 {
        let tick = good.tick().await;
        assert!(tick > last, "newest wins, and nothing comes twice");
        last = tick;
        n_pictures += 1;
        assert!(
            begin.elapsed() < Duration::from_secs(60),
            "it is never dropped"
        );
    }
    assert!(begin.elapsed() >= Duration::from_secs(5));
    // The machine may be busy: but it is not the stalled one that the other waits for.
    assert!(n_pictures > 20, "{n_pictures} pictures");
    good.tick().await;
    drop(stalled);
    soon(daemon.shutdown()).await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn three_hundred_clients_are_served() {
    let daemon = vrpn_daemon(cubes(3, 60.0), Mode::Realtime, 20.0).await;
    let to = address(&daemon);
    let mut clients = Vec::new();
    for _ in 0..300 {
        let mut probe = Probe::connect(to).await;
        probe.open("Objects").await;
        clients.push(probe);
    }
    let mut newest = 0;
    for probe in &mut clients {
        probe.find(|seen| seen.pose_of("Objects")).await;
        newest = newest.max(probe.tick().await);
    }
    // All of them go on.
    for probe in &mut clients {
        while probe.tick().await <= newest {}
    }
    let metrics = &daemon.backend().metrics;
    assert!(metrics.text(&[]).contains("tsukamu_vrpn_clients 300\n"));
    assert_eq!(metrics.vrpn.clients_dropped.get(), 0);
    soon(daemon.shutdown()).await.expect("a clean end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_in_use_is_said() {
    let first = vrpn_daemon(cubes(0, 240.0), Mode::Lockstep, 60.0).await;
    let mut config = vrpn_config(cubes(0, 240.0), Mode::Lockstep, 60.0);
    if let Some(vrpn) = &mut config.vrpn {
        vrpn.listen = address(&first);
    }
    let fault = start(config).await.expect_err("it is taken");
    let is_named =
        matches!(fault, DaemonError::Vrpn(VrpnFault::InUse(at)) if at == address(&first));
    assert!(is_named, "{fault}");
    first.shutdown().await.expect("a clean end");
}
