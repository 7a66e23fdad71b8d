//! Devices of the network: their places, and the hands that they make.

use std::path::Path;

use tsukamu_devices::place::Place;

use crate::settings::overrides::Overrides;
use crate::settings::{Settings, parse};

fn read(text: &str) -> Result<Settings, String> {
    parse("t.toml", text, Path::new(""), &Overrides::default())
        .map_err(|mistakes| mistakes.to_string())
}

#[test]
fn a_source_of_both_hands_has_a_station_for_each() {
    for kind in ["vmc", "rokoko"] {
        let settings = read(&format!(
            "[[device]]\nname = 'a'\nkind = '{kind}'\nport = 'udp:9000'\n\
             [[hand]]\nname = 'l'\nside = 'left'\nglove = 'a'\ntracker = 'a'\n\
             [[hand]]\nname = 'r'\nside = 'right'\nglove = 'a'\ntracker = 'a'\n"
        ))
        .unwrap();
        let stations: Vec<u16> = settings.hands.iter().map(|hand| hand.station).collect();
        assert_eq!(stations, [1, 2]);
        assert_eq!(
            settings.devices[0].port,
            Place::Udp("127.0.0.1:9000".parse().unwrap())
        );
        assert_eq!(settings.devices[0].driver.name(), kind);
    }
}

#[test]
fn places_that_do_not_suit_are_mistakes() {
    for (kind, port, expected) in [
        (
            "vmc",
            "/dev/x",
            "t.toml:4:8: device[0].port: is \"/dev/x\"; its sender sends datagrams: give udp:PORT, such as udp:39539",
        ),
        (
            "rokoko",
            "tcp:host:1",
            "t.toml:4:8: device[0].port: is \"tcp:host:1\"; its sender sends datagrams: give udp:PORT, such as udp:14043",
        ),
        (
            "udcap",
            "udp:host",
            "t.toml:4:8: device[0].port: is \"udp:host\"; after `udp:` must come PORT or ADDRESS:PORT, the port from 1 to 65535",
        ),
        (
            "cyberglove",
            "Tracker0@lab",
            "t.toml:4:8: device[0].port: is \"Tracker0@lab:3883\", a device of a VRPN server; its kind is vrpn",
        ),
    ] {
        let text = format!("[[device]]\nname = 'a'\nkind = '{kind}'\nport = '{port}'\n");
        assert_eq!(read(&text).unwrap_err().trim(), expected);
    }
}

#[test]
fn one_place_is_one_device_however_it_is_written() {
    let text = "[[device]]\nname = 'a'\nkind = 'vmc'\nport = 'udp:9000'\n\
                [[device]]\nname = 'b'\nkind = 'udcap'\nport = 'udp:127.0.0.1:9000'\n";
    let mistakes = read(text).unwrap_err();
    assert!(
        mistakes.contains("is \"udp:127.0.0.1:9000\", which another device is on"),
        "{mistakes}"
    );
}

#[test]
fn the_actor_of_rokoko_is_named() {
    let text =
        "[[device]]\nname = 'a'\nkind = 'rokoko'\nport = 'udp:0.0.0.0:14043'\nactor = 'me'\n";
    let driver = read(text).unwrap().devices.remove(0).driver;
    let tsukamu_devices::driver::Driver::Rokoko(settings) = driver else {
        panic!("{driver:?}")
    };
    assert_eq!(settings.actor.as_deref(), Some("me"));
}
