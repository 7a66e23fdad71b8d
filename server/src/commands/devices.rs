//! `tsukamud devices`

use std::path::Path;

use clap::Args;
use indicatif::ProgressBar;
use serde_json::{Value, json};
use tsukamu_devices::driver::Driver;
use tsukamu_devices::place::Place;
use tsukamu_devices::ports::access::Access;
use tsukamu_devices::ports::holder::Holder;
use tsukamu_devices::ports::{Port, Usb, list};
use tsukamu_devices::probe::{Candidate, candidates, try_one};
use tsukamu_server::doctor::obstacle;

use super::Failure;
use super::output::{progress_bar, say};

/// Arguments of `tsukamud devices`.
#[derive(Debug, Args)]
pub(super) struct DevicesArgs {
    /// Try the known protocols, on the ports named here or on all that are free; it sends their start-up commands.
    #[arg(long, value_name = "PORT", num_args = 0..)]
    probe: Option<Vec<String>>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// What a probe found on a port.
struct Found {
    candidate: Candidate,
    rate_hz: f64,
}

/// Lists the ports, and what is on them if that is wanted.
pub(super) fn devices(args: &DevicesArgs) -> Result<(), Failure> {
    let ports = list();
    if let Some(named) = args.probe.as_deref().filter(|named| !named.is_empty()) {
        return probe_named(named, args.json);
    }
    let mut rows = Vec::new();
    for port in ports {
        let is_free = port.access == Access::Granted && port.holders.is_empty();
        let found = match args.probe {
            Some(_) if is_free => Some(probe(&port.path.display().to_string())?),
            _ => None,
        };
        rows.push((port, found));
    }
    if args.json {
        let ports: Vec<Value> = rows
            .iter()
            .map(|(port, found)| port_json(port, found.as_ref()))
            .collect();
        return say(&json!({ "ports": ports }).to_string());
    }
    if rows.is_empty() {
        return say(
            "no serial ports on this machine: plug one in, or try `tsukamud emulate hand --motion free`",
        );
    }
    for (port, found) in rows {
        say(&block(&port))?;
        if let Some(found) = found {
            say(&format!("    {}", found_words(found.as_ref())))?;
        }
    }
    Ok(())
}

/// Probes paths that the user names: emulated ones are in no list.
fn probe_named(paths: &[String], as_json: bool) -> Result<(), Failure> {
    let mut all = Vec::new();
    let mut is_all_found = true;
    for path in paths {
        if !matches!(path.parse(), Ok(Place::Serial(_))) || !Path::new(path).exists() {
            return Err(Failure::Usage(format!(
                "{path}: is no serial port that is there; `tsukamud devices` lists them"
            )));
        }
        if let Some(obstacle) = obstacle(path) {
            is_all_found = false;
            let words: Vec<String> = [obstacle.findings, obstacle.advice].concat();
            if as_json {
                all.push(json!({ "path": path, "found": null, "obstacle": words.join("; ") }));
            } else {
                say(&words.join("\n    "))?;
            }
            continue;
        }
        let found = probe(path)?;
        is_all_found &= found.is_some();
        if as_json {
            all.push(json!({ "path": path, "found": found.as_ref().map(found_json) }));
        } else {
            say(&format!("{path}: {}", found_words(found.as_ref())))?;
        }
    }
    if as_json {
        say(&json!({ "ports": all }).to_string())?;
    }
    if is_all_found {
        Ok(())
    } else {
        Err(Failure::Negative)
    }
}

/// Tries every known protocol until one is recognised.
fn probe(path: &str) -> Result<Option<Found>, Failure> {
    let candidates = candidates();
    let bar: ProgressBar = progress_bar(candidates.len() as u64, "protocols");
    for candidate in candidates {
        bar.println(format!("{path}: asking as a {candidate}"));
        let (trial, is_recognised) = try_one(path, &candidate)?;
        bar.inc(1);
        if is_recognised {
            bar.finish_and_clear();
            return Ok(Some(Found {
                candidate,
                rate_hz: trial.rate_hz,
            }));
        }
    }
    bar.finish_and_clear();
    Ok(None)
}

fn found_words(found: Option<&Found>) -> String {
    found.map_or_else(
        || "answers in no protocol that is known".to_owned(),
        |found| {
            // Its older encoding is numbers with commas, as many boards print them.
            let alike = match found.candidate.driver {
                Driver::LucidGlove(_) => {
                    "; a board of your own that prints numbers looks alike: kind = \"delimited\""
                }
                _ => "",
            };
            format!(
                "{}, {:.0} readings per second{alike}",
                found.candidate, found.rate_hz
            )
        },
    )
}

fn block(port: &Port) -> String {
    let mut lines = vec![port.lasting_name().display().to_string()];
    let mut what = format!("now {}", port.path.display());
    if let Some(usb) = &port.usb {
        what = format!("{what} · {}", maker(usb));
    }
    if !port.driver.is_empty() {
        what = format!("{what} · driver {}", port.driver);
    }
    lines.push(format!("    {what}"));
    if let Some(hint) = port.usb.as_ref().and_then(Usb::hint) {
        lines.push(format!("    {hint}"));
    }
    lines.push(format!("    {}", open_words(port)));
    if port.links.is_empty() && port.usb.is_some() {
        lines.push(
            "    no lasting name: two of a kind may change places at the next plugging".to_owned(),
        );
    }
    lines.join("\n")
}

fn maker(usb: &Usb) -> String {
    let words = [usb.manufacturer.as_str(), usb.product.as_str()];
    let named: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
    let serial = if usb.serial.is_empty() {
        String::new()
    } else {
        format!(", serial {}", usb.serial)
    };
    format!(
        "{}{serial} ({:04x}:{:04x})",
        named.join(" "),
        usb.vendor_id,
        usb.product_id
    )
}

fn open_words(port: &Port) -> String {
    let mut words = match (&port.access, port.access.remedy()) {
        (Access::Granted, _) => "this user may open it".to_owned(),
        (Access::Missing, _) => "its node in /dev is missing".to_owned(),
        (Access::Denied { group, .. }, remedy) => format!(
            "this user may not open it (group {group}): {}",
            remedy.unwrap_or_default()
        ),
    };
    if !port.holders.is_empty() {
        let named = |Holder { pid, name }: &Holder| format!("{name} (process {pid})");
        let all: Vec<String> = port.holders.iter().map(named).collect();
        words = format!("{words}; in use by {}", all.join(", "));
    }
    words
}

fn port_json(port: &Port, found: Option<&Option<Found>>) -> Value {
    let usb = port.usb.as_ref().map(|usb| {
        json!({
            "vendor_id": usb.vendor_id, "product_id": usb.product_id, "manufacturer": usb.manufacturer,
            "product": usb.product, "serial": usb.serial,
        })
    });
    let access = match &port.access {
        Access::Granted => "granted",
        Access::Denied { .. } => "denied",
        Access::Missing => "missing",
    };
    let holders: Vec<Value> = port
        .holders
        .iter()
        .map(|holder| json!({ "pid": holder.pid, "name": holder.name }))
        .collect();
    json!({
        "path": port.path, "lasting_name": port.lasting_name(), "links": port.links, "usb": usb,
        "driver": port.driver, "access": access, "remedy": port.access.remedy(), "holders": holders,
        "probed": found.is_some(), "found": found.and_then(Option::as_ref).map(found_json),
    })
}

fn found_json(found: &Found) -> Value {
    let Candidate { driver, baud } = &found.candidate;
    json!({ "kind": driver.name(), "model": driver.model(), "baud": baud, "rate_hz": found.rate_hz })
}
