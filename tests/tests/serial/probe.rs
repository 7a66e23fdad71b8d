//! Ports of which nobody knows what is on them, and devices that do not do what their settings say.

#![allow(
    clippy::print_stdout,
    reason = "how long a search takes is worth knowing"
)]

use std::path::Path;
use std::time::Instant;

use tsukamu_devices::emulate::Emulator;
use tsukamu_devices::emulate::pty::{PtyEmulator, PtySettings};
use tsukamu_devices::probe::{Candidate, candidates, try_one};
use tsukamu_server::doctor::{Diagnosis, Verdict, examine};
use tsukamu_server::emulate::Plugged;
use tsukamu_server::settings::overrides::Overrides;
use tsukamu_server::settings::parse;

use crate::drivers::{still_hand, worn};
use crate::drivers_kinds::{PROMISES, Promise};

/// What says things of its own, once in ten milliseconds.
#[derive(Clone, Debug)]
struct Talker {
    say: fn(u64) -> Vec<u8>,
    next_ns: u64,
}

const PERIOD_NS: u64 = 10_000_000;

impl Emulator for Talker {
    fn push(&mut self, _: u64, _: &[u8]) {}

    fn poll(&mut self, now_ns: u64) -> Vec<u8> {
        if now_ns < self.next_ns {
            return Vec::new();
        }
        self.next_ns = now_ns + PERIOD_NS;
        (self.say)(now_ns)
    }

    fn deadline(&self) -> Option<u64> {
        Some(self.next_ns)
    }
}

fn talker(say: fn(u64) -> Vec<u8>) -> Box<dyn Plugged> {
    let talker = Talker { say, next_ns: 0 };
    let talker = PtyEmulator::spawn(talker, PtySettings::default(), |_, _| {});
    Box::new(talker.unwrap())
}

fn nothing(_: u64) -> Vec<u8> {
    Vec::new()
}

/// What a machine prints that is no glove and no tracker.
fn random_text(now_ns: u64) -> Vec<u8> {
    let words = [
        "boot",
        "OK",
        "temp=23.4C",
        "ERR 17",
        "~",
        "GPS: no fix",
        "AT+CSQ",
        "[ 12.3] usb",
    ];
    // A number that goes everywhere, from the time.
    let number = (now_ns / PERIOD_NS).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    let word = words[number as usize % words.len()];
    format!("{word} {:x}\r\n", number % 977).into_bytes()
}

/// Plugs one of the emulated serial devices in.
fn device(promise: &Promise) -> Box<dyn Plugged> {
    let kind = promise.kind();
    (kind.spawn)(worn(
        &still_hand(),
        promise.model,
        (kind.baud)(promise.model),
    ))
    .unwrap()
}

/// The first candidate that takes the device for its own.
fn first_claim(path: &Path) -> Option<Candidate> {
    let path = path.display().to_string();
    candidates()
        .into_iter()
        .find(|candidate| try_one(&path, candidate).unwrap().1)
}

/// What a claim says: kind, and model where that can be told.
fn told(claim: Option<&Candidate>) -> String {
    claim.map_or_else(
        || "nothing".to_owned(),
        |candidate| {
            let model = candidate.driver.model();
            let model = model.map_or_else(String::new, |model| format!("-{model}"));
            format!("{}{model}", candidate.driver.name())
        },
    )
}

/// Both at once: a search takes its time, and little else.
#[test]
fn what_is_on_a_port_is_found_and_what_is_wrong_is_said() {
    std::thread::scope(|scope| {
        scope.spawn(each_device_is_found_as_what_it_is);
        scope.spawn(the_doctor_says_what_is_wrong);
    });
}

fn each_device_is_found_as_what_it_is() {
    let begun = Instant::now();
    let serial = PROMISES.iter().filter(|promise| !promise.is_datagram());
    let mut ports: Vec<(String, String, Box<dyn Plugged>)> = serial
        .map(|promise| {
            let expected = match (promise.kind, promise.model) {
                // Numbers between commas are what the oldest LucidGloves send. Other lines have to be described.
                ("delimited", "sketch") => "lucidglove".to_owned(),
                ("delimited", _) => "nothing".to_owned(),
                // A glove of 14 sends the packets of one of 16, with its tilt where that has two more sensors.
                ("5dt", "14") => "5dt-16".to_owned(),
                ("5dt", model) => format!("5dt-{model}"),
                (kind, _) => kind.to_owned(),
            };
            (promise.name(), expected, device(promise))
        })
        .collect();
    for (name, say) in [
        ("silence", nothing as fn(u64) -> Vec<u8>),
        ("text", random_text),
    ] {
        ports.push((name.to_owned(), "nothing".to_owned(), talker(say)));
    }
    let results: Vec<(String, String, String)> = std::thread::scope(|scope| {
        let searches: Vec<_> = ports
            .iter()
            .map(|(name, expected, plugged)| {
                let path = plugged.path().to_path_buf();
                let search = scope.spawn(move || {
                    let claim = first_claim(&path);
                    let time_s = begun.elapsed().as_secs_f64();
                    println!("{name:>21}: {} after {time_s:.1} s", told(claim.as_ref()));
                    told(claim.as_ref())
                });
                (name.clone(), expected.clone(), search)
            })
            .collect();
        let results = searches.into_iter();
        results
            .map(|(name, expected, search)| (name, expected, search.join().unwrap()))
            .collect()
    });
    let wrong: Vec<_> = results
        .iter()
        .filter(|(_, expected, found)| expected != found)
        .collect();
    assert!(wrong.is_empty(), "device, expected, found: {wrong:#?}");
}

/// Examines a device of that kind at that place.
fn diagnose(kind: &str, more: &str, place: &str) -> Diagnosis {
    let text = format!("[[device]]\nname = 'x'\nkind = '{kind}'\nport = '{place}'\n{more}");
    let settings = parse("test.toml", &text, Path::new(""), &Overrides::default())
        .unwrap_or_else(|mistakes| panic!("{mistakes}"));
    examine(&settings.devices[0], &|_| {}).unwrap()
}

fn promise(kind: &str, model: &str) -> &'static Promise {
    let suits = |promise: &&Promise| promise.kind == kind && promise.model == model;
    PROMISES.iter().find(suits).unwrap()
}

/// What is on a port, what its settings say that it is, and what the doctor has to find.
struct Patient {
    what: &'static str,
    /// Nothing where there is no such port.
    plugged: Option<Box<dyn Plugged>>,
    kind: &'static str,
    settings: &'static str,
    verdict: Verdict,
    /// In what is found or advised.
    words: &'static [&'static str],
}

impl Patient {
    const fn new(
        what: &'static str,
        plugged: Option<Box<dyn Plugged>>,
        kind: &'static str,
        verdict: Verdict,
        words: &'static [&'static str],
    ) -> Self {
        Self {
            what,
            plugged,
            kind,
            settings: "",
            verdict,
            words,
        }
    }
}

fn on(kind: &str, model: &str) -> Option<Box<dyn Plugged>> {
    Some(device(promise(kind, model)))
}

/// Ports with nothing on them that is known.
fn without_a_device() -> [Patient; 3] {
    let (silent, strange) = (Some(talker(nothing)), Some(talker(random_text)));
    [
        Patient::new(
            "no port",
            None,
            "fastrak",
            Verdict::Missing,
            &["is not there"],
        ),
        Patient::new(
            "silence",
            silent,
            "cyberglove",
            Verdict::Silent,
            &["switch it on"],
        ),
        Patient::new(
            "text",
            strange,
            "fastrak",
            Verdict::NotUnderstood,
            &["delimited"],
        ),
    ]
}

/// Ports with another device on them than settings say. A wrong line rate cannot be shown: a pseudo-terminal has none.
fn with_another_device() -> [Patient; 3] {
    let other = Verdict::OtherProtocol;
    let fastrak = &["answers as a fastrak", "kind = \"fastrak\""];
    let lucidglove = &["answers as a lucidglove", "kind = \"lucidglove\""];
    let model = &["model 16", "model = \"16\""];
    let of_16 = Patient::new("16 in place of 5", on("5dt", "16"), "5dt", other, model);
    [
        Patient::new("no glove", on("fastrak", ""), "cyberglove", other, fastrak),
        Patient::new(
            "no tracker",
            on("lucidglove", ""),
            "liberty",
            other,
            lucidglove,
        ),
        Patient {
            settings: "model = '5'\n",
            ..of_16
        },
    ]
}

fn with_their_device() -> [Patient; 3] {
    let well = |what, model, words| Patient::new(what, on(what, model), what, Verdict::Well, words);
    [
        well(
            "cyberglove",
            "22",
            &["CyberGlove", "22 sensors", "readings per second"],
        ),
        well("liberty", "patriot", &["Patriot", "readings per second"]),
        well("opencyberglove", "", &["OpenCyberGlove", "19 sensors"]),
    ]
}

fn the_doctor_says_what_is_wrong() {
    let begun = Instant::now();
    let patients: Vec<Patient> = without_a_device()
        .into_iter()
        .chain(with_another_device())
        .chain(with_their_device())
        .collect();
    let diagnoses: Vec<Diagnosis> = std::thread::scope(|scope| {
        let examine = |patient: &Patient| {
            let missing = || "/dev/serial/by-id/usb-nobody".to_owned();
            let path = |plugged: &dyn Plugged| plugged.path().display().to_string();
            let place = patient.plugged.as_deref().map_or_else(missing, path);
            let Patient {
                what,
                kind,
                settings,
                ..
            } = *patient;
            scope.spawn(move || {
                let diagnosis = diagnose(kind, settings, &place);
                let time_s = begun.elapsed().as_secs_f64();
                let Diagnosis {
                    verdict,
                    findings,
                    advice,
                    ..
                } = &diagnosis;
                let name = verdict.name();
                println!("{what}: {name} after {time_s:.1} s: {findings:?} {advice:?}");
                diagnosis
            })
        };
        let examinations: Vec<_> = patients.iter().map(examine).collect();
        let results = examinations.into_iter();
        results.map(|one| one.join().unwrap()).collect()
    });
    for (patient, diagnosis) in patients.iter().zip(&diagnoses) {
        assert_eq!(
            diagnosis.verdict, patient.verdict,
            "{}: {diagnosis:?}",
            patient.what
        );
        let said = [diagnosis.findings.join(" "), diagnosis.advice.join(" ")].join(" ");
        for words in patient.words {
            assert!(
                said.contains(words),
                "{}: no {words:?} in {said:?}",
                patient.what
            );
        }
    }
}
