//! Every driver's session is fed with conversations that go wrong: bits that flip, bytes that are lost, repeated and made
//! up, pieces of other devices' records, odd times, ports that come and go. It must not panic, not grow, be back in step
//! within two records, and run and read the truth again when the line is good.
//!
//! `cargo bench -p tsukamu-tests --bench fuzz -- [SUBJECT|all] [--seconds S] [--seed N] [--case K]`
//!
//! `cargo test` runs it for a moment, with a seed that is always the same. A failure prints how to see it again, with all
//! that is said.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

mod case;
mod garble;
mod subjects;
mod vrpn;

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use allocation_counter::measure;

use crate::case::{Known, Outcome};
use crate::garble::{Chance, Transcripts};
use crate::subjects::Subject;

/// What a session, its queues full, and the other end of its line may need together, bytes.
const MEMORY_MAX: u64 = 4_000_000;
/// The name of the part that our VRPN server reads with.
const VRPN_SERVER: &str = "vrpn-server";
/// Failures of one subject after which it is left.
const FAILURES_MAX: usize = 5;
/// Seconds for each subject, when they are not told.
const BENCH_S: f64 = 10.0;
const TEST_S: f64 = 1.0;
/// The seed, when it is not told.
const SEED: u64 = 1998;

thread_local! {
    /// What the last panic of this thread said.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// What is asked for.
#[derive(Clone, Debug)]
struct Wanted {
    subject: Option<String>,
    time: Duration,
    seed: u64,
    case: Option<u64>,
}

/// How one subject did.
#[derive(Debug, Default)]
struct Tally {
    n_cases: u64,
    n_in_step: u64,
    slowest_ns: u64,
    bytes_max: u64,
    failures: Vec<String>,
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    // Cargo says so when it is a benchmark and not a test.
    let is_bench = words.iter().any(|word| word == "--bench");
    let wanted = match wanted(&words, is_bench) {
        Ok(Some(wanted)) => wanted,
        Ok(None) => return ExitCode::SUCCESS,
        Err(mistake) => {
            println!("{mistake}");
            return ExitCode::FAILURE;
        }
    };
    std::panic::set_hook(Box::new(|info| {
        PANIC.with(|panic| *panic.borrow_mut() = info.to_string());
    }));
    if run(&wanted) {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// What the words ask for; nothing for a test of another name.
fn wanted(words: &[String], is_bench: bool) -> Result<Option<Wanted>, String> {
    let mut wanted = Wanted {
        subject: None,
        time: Duration::from_secs_f64(if is_bench { BENCH_S } else { TEST_S }),
        seed: SEED,
        case: None,
    };
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let mut number = || words.next().ok_or_else(|| format!("{word} needs a number"));
        let bad = |error: &dyn std::fmt::Display| format!("{word}: {error}");
        match word.as_str() {
            "--seconds" => {
                let seconds: f64 = number()?.parse().map_err(|error| bad(&error))?;
                wanted.time = Duration::try_from_secs_f64(seconds).map_err(|error| bad(&error))?;
            }
            "--seed" => wanted.seed = number()?.parse().map_err(|error| bad(&error))?,
            "--case" => wanted.case = Some(number()?.parse().map_err(|error| bad(&error))?),
            "all" => {}
            flag if flag.starts_with('-') => {}
            name if names().contains(&name) => wanted.subject = Some(name.to_owned()),
            // The filter of a test run, which means others.
            _ if !is_bench => return Ok(None),
            name => {
                return Err(format!(
                    "no subject {name:?}; there are: all, {}",
                    names().join(", ")
                ));
            }
        }
    }
    Ok(Some(wanted))
}

fn names() -> Vec<&'static str> {
    let subjects = subjects::all();
    let names = subjects.iter().map(|subject| subject.name);
    names.chain([VRPN_SERVER]).collect()
}

/// Everything that is fed, with what it said when all was well.
struct Ward {
    subjects: Vec<Subject>,
    known: Vec<Result<Known, String>>,
    /// What a client of our VRPN server says.
    client: Vec<Vec<u8>>,
}

impl Ward {
    fn new() -> Self {
        let subjects = subjects::all();
        let known = subjects.iter().map(case::learn).collect();
        Self {
            subjects,
            known,
            client: vrpn::client_transcript(),
        }
    }

    /// What all but the devices of one kind say. One of the same kind is no garbage, but another device.
    fn others(&self, kind: &str) -> Vec<&[Vec<u8>]> {
        let pairs = self.subjects.iter().zip(&self.known);
        let others = pairs.filter(|(subject, _)| subject.driver.name() != kind);
        let said = others.filter_map(|(_, known)| Some(known.as_ref().ok()?.said.as_slice()));
        said.chain([self.client.as_slice()]).collect()
    }

    fn feed(&self, name: &'static str, wanted: &Wanted) -> Tally {
        let Some(index) = self
            .subjects
            .iter()
            .position(|subject| subject.name == name)
        else {
            return self.feed_server(wanted);
        };
        let subject = &self.subjects[index];
        let known = match &self.known[index] {
            Ok(known) => known,
            Err(fault) => {
                return Tally {
                    failures: vec![format!("{name} does not start: {fault}")],
                    ..Tally::default()
                };
            }
        };
        let from = Transcripts {
            own: &known.said,
            others: &self.others(subject.driver.name()),
        };
        cases(name, wanted, |chance| {
            let mut result = Err(String::new());
            let info =
                measure(|| result = case::run(subject, known, from, chance, wanted.case.is_some()));
            result.map(|outcome| (outcome, info.bytes_max))
        })
    }

    fn feed_server(&self, wanted: &Wanted) -> Tally {
        let from = Transcripts {
            own: &self.client,
            others: &self.others(""),
        };
        cases(VRPN_SERVER, wanted, |chance| {
            let bytes_max = vrpn::server_side(chance, from)?;
            Ok((Outcome::default(), bytes_max))
        })
    }
}

/// Feeds every subject that is wanted; whether all were well.
fn run(wanted: &Wanted) -> bool {
    let ward = Ward::new();
    println!(
        "seed {}, {:.1} s each",
        wanted.seed,
        wanted.time.as_secs_f64()
    );
    println!(
        "{:>21} {:>9} {:>9} {:>12} {:>8} {:>9}",
        "subject", "cases", "in step", "slowest s", "peak kB", "failures"
    );
    let is_wanted = |name: &&str| {
        wanted
            .subject
            .as_deref()
            .is_none_or(|subject| subject == *name)
    };
    let queue: Mutex<Vec<&'static str>> =
        Mutex::new(names().into_iter().rev().filter(is_wanted).collect());
    let failures = Mutex::new(Vec::new());
    let work = || {
        while let Some(name) = lock(&queue).pop() {
            let tally = ward.feed(name, wanted);
            print_row(name, &tally);
            lock(&failures).extend(tally.failures);
        }
    };
    let n_threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        (0..n_threads).for_each(|_| drop(scope.spawn(work)));
    });
    let failures = lock(&failures);
    failures.iter().for_each(|failure| println!("{failure}"));
    failures.is_empty()
}

/// What is kept is whole whatever panicked.
fn lock<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

fn print_row(name: &str, tally: &Tally) {
    println!(
        "{name:>21} {:>9} {:>9} {:>12.1} {:>8} {:>9}",
        tally.n_cases,
        tally.n_in_step,
        tally.slowest_ns as f64 * 1.0e-9,
        tally.bytes_max / 1000,
        tally.failures.len()
    );
}

/// Case after case until the time is over; or one, if one is wanted.
fn cases(
    name: &'static str,
    wanted: &Wanted,
    mut one: impl FnMut(&mut Chance) -> Result<(Outcome, u64), String>,
) -> Tally {
    let mut tally = Tally::default();
    let begun = Instant::now();
    let mut number = wanted.case.unwrap_or(0);
    loop {
        let mut chance = Chance::new(wanted.seed, name, number);
        let result = catch_unwind(AssertUnwindSafe(|| one(&mut chance)));
        let result = result.unwrap_or_else(|_panic| {
            let said = PANIC.with(|panic| panic.borrow().clone());
            Err(format!("panicked: {said}"))
        });
        let result = result.and_then(|(outcome, bytes)| {
            tally.bytes_max = tally.bytes_max.max(bytes);
            if bytes > MEMORY_MAX {
                return Err(format!("needed {bytes} bytes"));
            }
            Ok(outcome)
        });
        tally.n_cases += 1;
        match result {
            Ok(outcome) => {
                tally.n_in_step += u64::from(outcome.in_step);
                tally.slowest_ns = tally.slowest_ns.max(outcome.recovery_ns);
            }
            Err(fault) => tally.failures.push(format!(
                "{name}: {fault}\n  again: cargo bench -p tsukamu-tests --bench fuzz -- {name} --seed {} --case {number}",
                wanted.seed
            )),
        }
        number += 1;
        let is_over = wanted.case.is_some() || begun.elapsed() >= wanted.time;
        if is_over || tally.failures.len() >= FAILURES_MAX {
            return tally;
        }
    }
}
