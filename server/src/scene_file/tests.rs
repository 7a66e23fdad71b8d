//! Scene texts in, scenes or mistakes out.

use std::path::Path;

use super::{LoadedScene, builtin, load, parse};
use crate::document::mistake::Mistakes;

fn read(text: &str) -> Result<LoadedScene, Mistakes> {
    parse("s.toml", text, Path::new(""))
}

/// Asserts exactly these mistakes, one line each.
fn check(text: &str, expected: &[&str]) {
    let found = read(text)
        .err()
        .map(|mistakes| mistakes.to_string())
        .unwrap_or_default();
    assert_eq!(found.lines().collect::<Vec<_>>(), expected, "in\n{text}");
}

const CUBE: &str = "[[object]]\nname = 'cube'\nshape = 'box'\nsize = [0.1, 0.1, 0.1]\n";

#[test]
fn an_empty_text_is_an_empty_desk() {
    let loaded = read("").unwrap();
    assert_eq!(
        (
            loaded.scene.name.as_str(),
            loaded.scene.rate_hz,
            loaded.scene.objects.len()
        ),
        ("s", 240.0, 0)
    );
}

#[test]
fn every_key_reaches_the_world() {
    let text = "name = 'n'\nrate_hz = 1000\ngravity = [0, -1.62, 0.5]\nfloor_height = -1\ngrasp_angle_deg = 120\n\
        throw_window_s = 0.05\ntracking_grace_s = 1\nmodel = 'paper'\nhands = ['synthetic:free?seed=2']\n\
        [[object]]\nname = 'p'\nshape = 'prism'\nradius = 0.1\nheight = 0.2\nsides = 8\nposition = [1, 0.5, 2]\n\
        on_floor = true\nrotation_deg = [90, 0, 0]\ngrasp_angle_deg = 180\ndensity = 1000\ncolour = [1, 0, 0.5]\n\
        [[target]]\ncentre = [0, 1, -2]\nnormal = [0, 0, 5]\nradius = 0.2\n";
    let LoadedScene {
        scene,
        default_hands,
        source_text,
    } = read(text).unwrap();
    assert_eq!(
        (scene.name.as_str(), scene.rate_hz, scene.floor_height),
        ("n", 1000.0, -1.0)
    );
    assert_eq!((scene.throw_window_s, scene.tracking_grace_s), (0.05, 1.0));
    assert!((scene.grasp_angle.to_degrees() - 120.0).abs() < 1.0e-12);
    assert_eq!(default_hands[0].to_string(), "synthetic:free?seed=2");
    assert_eq!(source_text, text);
    let object = &scene.objects[0];
    assert_eq!(object.shape.faces().len(), 10);
    // The prism is 0.2 m high and stands 0.5 m above a floor at -1 m.
    assert!(
        (object.pose.translation.vector - nalgebra::Vector3::new(1.0, -0.4, 2.0)).norm() < 1.0e-12
    );
    assert_eq!((object.density, object.colour), (1000.0, [1.0, 0.0, 0.5]));
    let turned = object.pose.rotation * nalgebra::Vector3::z();
    assert!(
        (turned - nalgebra::Vector3::x()).norm() < 1.0e-12,
        "a yaw of 90° turns z to x, not to {turned}"
    );
    assert_eq!(
        (scene.targets[0].normal.z, scene.targets[0].radius),
        (1.0, 0.2)
    );
}

#[test]
fn every_shape_can_be_made() {
    for (keys, faces) in [
        ("shape = 'box'\nsize = [1, 2, 3]", 6),
        ("shape = 'prism'\nradius = 1\nheight = 1", 8),
        ("shape = 'pyramid'\nsize = [1, 2, 3]", 5),
        ("shape = 'l-shape'\nsize = [1, 1, 1]\nthickness = 0.4", 8),
        ("shape = 'ellipsoid'\nsize = [1, 2, 3]", 32),
    ] {
        let text = format!("[[object]]\nname = 'o'\n{keys}\nposition = [0, 0, 0]\non_floor = true");
        assert_eq!(
            read(&text).unwrap().scene.objects[0].shape.faces().len(),
            faces,
            "{keys}"
        );
    }
}

#[test]
fn all_mistakes_are_reported_at_once_with_their_places() {
    check(
        "rate_hz = 9000\ngravity = [0, 9.81, 0]\nnane = 'x'\nmodel = 'papier'\ntracking_grace_s = 'long'\n\
         [[object]]\nshape = 'box'\nsize = [0.1, -0.1, 0.1]\nposition = [0, 0]\n",
        &[
            "s.toml:1:11: rate_hz: is 9000; it must be from 1 to 4000 steps per second",
            "s.toml:2:11: gravity: points upward (y is 9.81); y must not be above 0",
            "s.toml:3:1: nane: is no known key; did you mean name?",
            "s.toml:4:9: model: is \"papier\"; it must be one of \"paper\"; did you mean \"paper\"?",
            "s.toml:5:20: tracking_grace_s: is text; it must be a number",
            "s.toml:6:1: object[0].name: is missing: give a text, unique in the scene",
            "s.toml:8:14: object[0].size[1]: is -0.1; it must be above 0 and at most 1000 m",
            "s.toml:9:12: object[0].position: is a list of 2; it must be 3 numbers [x, y, z]",
        ],
    );
}

#[test]
fn mistakes_of_single_keys() {
    for (text, expected) in [
        (
            "[[object]]\nname = 'a'\nposition = [0, 1, 0]",
            "s.toml:1:1: object[0].shape: is missing: give one of box, prism, pyramid, l-shape, ellipsoid, mesh",
        ),
        (
            "hands = ['synthetic:']",
            "s.toml:1:10: hands[0]: no synthetic hand is called \"\": there are free, no-thumb, flick, grasp-throw, stack, target-game, demo, poses",
        ),
        (
            "hands = ['no-such.csv']",
            "s.toml:1:10: hands[0]: names \"no-such.csv\"; there is no such file, and no synthetic:NAME",
        ),
        (
            "hands = 'synthetic:free'",
            "s.toml:1:9: hands: is text; it must be a list of texts in brackets",
        ),
        (
            "object = 3",
            "s.toml:1:10: object: is a integer; it must be tables, each under [[object]]",
        ),
        (
            "rate_hz = nan",
            "s.toml:1:11: rate_hz: is NaN; it must be from 1 to 4000 steps per second",
        ),
        (
            "[[target]]\ncentre = [0, 0, 0]\nnormal = [0, 0, 0]",
            "s.toml:3:10: target[0].normal: is no direction; give a vector toward the thrower",
        ),
        (
            "[[target]]\nradius = 1",
            "s.toml:1:1: target[0].centre: is missing: give [x, y, z] in metres",
        ),
    ] {
        check(text, &[expected]);
    }
}

#[test]
fn mistakes_of_an_object_among_others() {
    for (keys, expected) in [
        (
            "position = [0, 0.04, 0]",
            "s.toml:5:12: object[0].position: object \"cube\": it reaches 0.0100 m below the floor; raise its position by as much",
        ),
        (
            "position = [0, 1, 0]\nrotation = [0, 0, 0, 0.5]",
            "s.toml:6:12: object[0].rotation: has the length 0.5000; a unit quaternion has 1",
        ),
        (
            "position = [0, 1, 0]\nrotation = [0, 0, 0, 1]\nrotation_deg = [0, 0, 0]",
            "s.toml:7:16: object[0].rotation_deg: is given beside rotation; give one of the two",
        ),
        (
            "position = [0, 1, 0]\nthickness = 1",
            "s.toml:6:1: object[0].thickness: is no known key; known are name, shape, size, rotation, rotation_deg, position, on_floor, grasp_angle_deg, density, colour",
        ),
        (
            "position = [0, 1, 0]\n[[object]]\nname = 'cube'\nshape = 'box'\nsize = [1, 1, 1]\nposition = [0, 1, 0]",
            "s.toml:7:8: object[1].name: is \"cube\", which another object carries; names must be unique",
        ),
        (
            "position = [0, 20000, 0]",
            "s.toml:5:16: object[0].position[1]: is 20000; it must be from -10000 to 10000 m",
        ),
    ] {
        check(&format!("{CUBE}{keys}"), &[expected]);
    }
}

#[test]
fn errors_of_syntax_are_reported_beside_the_others() {
    let text = read("rate_hz = 9000\nname = = 3\n")
        .unwrap_err()
        .to_string();
    assert!(
        text.contains("s.toml:1:11: rate_hz") && text.contains("s.toml:2:"),
        "{text}"
    );
}

#[test]
fn built_in_scenes_are_clean_and_name_their_hand() {
    for name in builtin::names() {
        let loaded = load(name).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        assert_eq!(loaded.scene.name, name);
        assert!(
            !loaded.scene.objects.is_empty() && !loaded.default_hands.is_empty(),
            "{name}"
        );
    }
    let unknown = load("operations/stak").unwrap_err().to_string();
    assert!(unknown.contains("operations/stack"), "{unknown}");
}
