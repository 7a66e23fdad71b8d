//! How a synthetic hand is named: `synthetic:NAME`, with parameters as `synthetic:NAME?key=value&key=value`.

use thiserror::Error;
use tsukamu_world::hand::joint::Side;

use super::{Name, names};

/// A synthetic hand's name and parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    /// What it does.
    pub name: Name,
    /// `seed`: picks one of many slightly different runs of the motion; 1 unless given.
    pub seed: u64,
    /// `object`: name of the object it takes, or the first that fits.
    pub object: Option<String>,
    /// `to`: where it puts the object, x and z in metres, world space.
    pub to: Option<[f64; 2]>,
    /// `speed`: of a throw or a flick's fingertip, in m/s, 0.2 to 8.
    pub speed: Option<f64>,
    /// `side`: right unless given.
    pub side: Side,
    /// `start`: seconds it waits before it moves, 0 to 600; 0.5 unless given.
    pub start_s: f64,
}

/// Why a text names no synthetic hand.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SpecFault {
    /// No hand of that name.
    #[error("no synthetic hand is called {0:?}: there are {known}", known = known_names())]
    Name(String),
    /// A parameter is not `key=value`.
    #[error("{0:?} is no parameter: parameters are written key=value")]
    NotAPair(String),
    /// No parameter of that name.
    #[error("no parameter is called {0:?}: there are {known}", known = PARAMETERS.join(", "))]
    Parameter(String),
    /// A parameter's value is out of bounds.
    #[error("{key}={value}: it must be {wanted}")]
    Value {
        /// The parameter.
        key: String,
        /// What was given.
        value: String,
        /// What it must be.
        wanted: &'static str,
    },
}

/// The parameters of every synthetic hand; `place` is another name of `to`.
pub const PARAMETERS: [&str; 6] = ["seed", "object", "to", "speed", "side", "start"];
/// Before the name.
const PREFIX: &str = "synthetic:";
/// The built-in scenes of the five operations are listed under this folder; their hands go by either name.
const FOLDER: &str = "operations/";
/// Seconds before a hand moves, unless told otherwise.
const START_S: f64 = 0.5;

impl Spec {
    /// The motion of that name as it is without parameters.
    pub fn new(name: Name) -> Self {
        Self {
            name,
            seed: 1,
            object: None,
            to: None,
            speed: None,
            side: Side::Right,
            start_s: START_S,
        }
    }

    /// Reads `[synthetic:]NAME[?key=value&key=value…]`; commas separate as `?` and `&` do, where no number is expected
    /// to hold one.
    ///
    /// # Errors
    /// The first thing that is unknown or out of bounds.
    pub fn parse(text: &str) -> Result<Self, SpecFault> {
        let text = text.strip_prefix(PREFIX).unwrap_or(text);
        let end = text.find(['?', ',']).unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        let mut spec = Self::new(find_name(name.trim())?);
        for pair in pairs(rest) {
            let (key, value) = pair
                .split_once('=')
                .ok_or_else(|| SpecFault::NotAPair(pair.clone()))?;
            spec.set(key.trim(), value.trim())?;
        }
        Ok(spec)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), SpecFault> {
        let fault = |wanted| SpecFault::Value {
            key: key.to_owned(),
            value: value.to_owned(),
            wanted,
        };
        match key {
            "seed" => {
                self.seed = value
                    .parse()
                    .map_err(|_not_a_number| fault("a whole number, 0 or above"))?
            }
            "object" if value.is_empty() => return Err(fault("the name of an object")),
            "object" => self.object = Some(value.to_owned()),
            "to" | "place" => {
                self.to = Some(place(value).ok_or_else(|| fault("x,z in metres, within 100 m"))?)
            }
            "speed" => {
                let speed = number(value, 0.2, 8.0).ok_or_else(|| fault("0.2 to 8 m/s"))?;
                self.speed = Some(speed);
            }
            "side" => {
                self.side = match value {
                    "left" => Side::Left,
                    "right" => Side::Right,
                    _ => return Err(fault("left or right")),
                };
            }
            "start" => {
                self.start_s = number(value, 0.0, 600.0).ok_or_else(|| fault("0 to 600 s"))?
            }
            _ => return Err(SpecFault::Parameter(key.to_owned())),
        }
        Ok(())
    }
}

fn find_name(text: &str) -> Result<Name, SpecFault> {
    let bare = text.strip_prefix(FOLDER).unwrap_or(text);
    let known = names().iter().find(|known| known.name.text() == bare);
    known
        .map(|known| known.name)
        .ok_or_else(|| SpecFault::Name(text.to_owned()))
}

fn known_names() -> String {
    names()
        .iter()
        .map(|known| known.name.text())
        .collect::<Vec<_>>()
        .join(", ")
}

/// The parameters, separated by `?`, `&` or `,`; a comma between two numbers (as in `to=0.1,-0.3`) separates nothing.
fn pairs(text: &str) -> Vec<String> {
    let mut pairs: Vec<String> = Vec::new();
    for group in text.split(['?', '&']) {
        for part in group.split(',').filter(|part| !part.trim().is_empty()) {
            match pairs.last_mut() {
                Some(last) if part.trim().parse::<f64>().is_ok() => {
                    last.push(',');
                    last.push_str(part);
                }
                _ => pairs.push(part.to_owned()),
            }
        }
    }
    pairs
}

fn place(text: &str) -> Option<[f64; 2]> {
    let (x, z) = text.split_once([',', ' '])?;
    Some([
        number(x.trim(), -100.0, 100.0)?,
        number(z.trim(), -100.0, 100.0)?,
    ])
}

fn number(text: &str, least: f64, most: f64) -> Option<f64> {
    text.parse()
        .ok()
        .filter(|number| (least..=most).contains(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specs_are_read() {
        let spec = Spec::parse("synthetic:grasp-throw?object=cube&seed=3&side=left").unwrap();
        assert_eq!(
            (spec.name, spec.object.as_deref(), spec.seed),
            (Name::GraspThrow, Some("cube"), 3)
        );
        assert_eq!(spec.side, Side::Left);
        let spec = Spec::parse("operations/free,to=0.1,-0.25,start=2").unwrap();
        assert_eq!(
            (spec.name, spec.to, spec.start_s),
            (Name::Free, Some([0.1, -0.25]), 2.0)
        );
        assert_eq!(Spec::parse("stack"), Ok(Spec::new(Name::Stack)));
        assert_eq!(Spec::parse("free?place=0,0").unwrap().to, Some([0.0, 0.0]));
    }

    #[test]
    fn faults_say_what_is_known() {
        let check = |text: &str, expected: &str| {
            assert_eq!(Spec::parse(text).unwrap_err().to_string(), expected);
        };
        let known = "free, no-thumb, flick, grasp-throw, stack, target-game, demo, poses";
        check(
            "synthetic:juggle",
            &format!("no synthetic hand is called \"juggle\": there are {known}"),
        );
        check(
            "free?sead=1",
            "no parameter is called \"sead\": there are seed, object, to, speed, side, start",
        );
        check(
            "free?seed",
            "\"seed\" is no parameter: parameters are written key=value",
        );
        check(
            "free?seed=-1",
            "seed=-1: it must be a whole number, 0 or above",
        );
        check("free?speed=nan", "speed=nan: it must be 0.2 to 8 m/s");
        check("free?to=1", "to=1: it must be x,z in metres, within 100 m");
        check("free?side=both", "side=both: it must be left or right");
        check("free?object=", "object=: it must be the name of an object");
    }
}
