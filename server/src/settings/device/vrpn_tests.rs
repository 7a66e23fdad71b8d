//! `kind = "vrpn"`: texts in, drivers or mistakes out.

use std::path::Path;

use tsukamu_devices::driver::{Driver, Role};
use tsukamu_devices::glove::sensor::GloveSensor;
use tsukamu_devices::tracker::space::TrackerSpace;
use tsukamu_devices::vrpn::settings::ChannelUnit;

use crate::settings::overrides::Overrides;
use crate::settings::parse;

fn read(keys: &str) -> Result<Driver, String> {
    let text = format!("[[device]]\nname = 'a'\nkind = 'vrpn'\n{keys}\n");
    parse("t.toml", &text, Path::new(""), &Overrides::default())
        .map(|settings| settings.devices[0].driver.clone())
        .map_err(|mistakes| mistakes.to_string())
}

#[test]
fn a_tracker_and_a_glove_are_read() {
    let tracker = read("port = 'Tracker0@lab'").expect("a tracker");
    assert_eq!(tracker.role(), Role::Tracker);
    assert!(tracker.has_station(1) && tracker.has_station(1024));
    assert!(!tracker.has_station(0) && !tracker.has_station(1025));
    let text = "port = 'Glove0@tcp://lab:4000'\nspace = 'z_up'\nscale = 0.01\n\
                channels = ['-', 'index_mcp']\nunit = 'raw'";
    let Ok(Driver::Vrpn(glove)) = read(text) else {
        panic!("it is good")
    };
    assert_eq!(glove.address.to_string(), "Glove0@tcp://lab:4000");
    assert_eq!((glove.space, glove.scale), (TrackerSpace::ZUp, 0.01));
    assert_eq!(glove.channels, [None, Some(GloveSensor::IndexMcp)]);
    assert_eq!((glove.unit, glove.role()), (ChannelUnit::Raw, Role::Both));
}

#[test]
fn mistakes_are_named() {
    for (keys, expected) in [
        ("port = '/dev/x'", "must be a device of a VRPN server"),
        ("port = 'T@host:0'", "the port is no number"),
        ("port = 'T@h'\nscale = 0", "device[0].scale"),
        ("port = 'T@h'\nspace = 'up'", "device[0].space"),
        (
            "port = 'T@h'\nunit = 'raw'",
            "does nothing without channels",
        ),
        (
            "port = 'T@h'\nchannels = ['elbow']",
            "is \"elbow\"; it must be \"-\" or one of thumb_rotation",
        ),
        ("port = 'T@h'\nchannels = ['-', '-']", "name no sensor"),
        (
            "port = 'T@h'\nchannels = ['ring_pip', 'ring_pip']",
            "which another channel measures",
        ),
    ] {
        let found = read(keys).expect_err(keys);
        assert!(found.contains(expected), "{keys}: {found}");
        assert_eq!(found.lines().count(), 1, "{keys}: {found}");
    }
}
