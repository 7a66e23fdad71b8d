//! A device that was opened and did not do what it should.

use std::io;

use tsukamu_devices::driver::Driver;
use tsukamu_devices::fault::Fault;
use tsukamu_devices::place::Place;
use tsukamu_devices::probe::{Candidate, candidates, try_one};
use tsukamu_devices::trial::Trial;

use crate::settings::device::DeviceSettings;

use super::{Diagnosis, Verdict, not_opened};

/// Why there are no readings. What does not answer is looked for at other rates, then in other protocols.
pub(super) fn explain(
    device: &DeviceSettings,
    trial: &Trial,
    progress: &dyn Fn(&str),
) -> io::Result<Diagnosis> {
    let fault = trial.fault.as_ref();
    let words = fault.map_or_else(
        || format!("no reading came; it is {}", state_words(trial)),
        ToString::to_string,
    );
    if let Some(verdict) = fault.and_then(not_opened) {
        return Ok(Diagnosis::new(verdict, words));
    }
    if matches!(
        fault,
        Some(Fault::GloveUnplugged | Fault::Reported { .. } | Fault::Refused { .. })
    ) {
        return Ok(Diagnosis::new(Verdict::Complains, words));
    }
    let Some(path) = device.port.serial_path() else {
        return Ok(network(&device.port, trial, words));
    };
    if !trial.opened {
        return Ok(Diagnosis::new(Verdict::NotADevice, words));
    }
    if let Some(found) = look_for(device, path, progress)? {
        return Ok(recognised(device, &found, words));
    }
    Ok(if trial.stats.bytes == 0 {
        Diagnosis::new(Verdict::Silent, words).advise(
            "switch it on, look after its cable, and whether the port is the one it hangs on",
        )
    } else {
        Diagnosis::new(Verdict::NotUnderstood, words)
            .advise("its bytes are below: compare them with its manual; a glove that prints numbers can be read with kind = \"delimited\"")
    })
}

/// The protocol and rate in which it answers, its own protocol at other rates first.
fn look_for(
    device: &DeviceSettings,
    path: &str,
    progress: &dyn Fn(&str),
) -> io::Result<Option<Candidate>> {
    let own = device.driver.possible_bauds();
    let own = own.iter().filter(|baud| !device.bauds.contains(baud));
    let own = own.map(|baud| Candidate {
        driver: device.driver.clone(),
        baud: *baud,
    });
    let others = candidates()
        .into_iter()
        .filter(|candidate| !is_same(&candidate.driver, &device.driver));
    for candidate in own.chain(others) {
        progress(&format!("asking as a {candidate}"));
        let (_, recognised) = try_one(path, &candidate)?;
        if recognised {
            return Ok(Some(candidate));
        }
    }
    Ok(None)
}

/// Whether two speak one protocol: the models of some kinds speak different ones.
fn is_same(one: &Driver, other: &Driver) -> bool {
    (one.name(), one.model()) == (other.name(), other.model())
}

fn recognised(device: &DeviceSettings, found: &Candidate, words: String) -> Diagnosis {
    let Candidate { driver, baud } = found;
    let is_own = is_same(driver, &device.driver);
    let mut diagnosis = if is_own {
        Diagnosis::new(Verdict::WrongBaud, words).advise(format!("write bauds = [{baud}]"))
    } else {
        Diagnosis::new(Verdict::OtherProtocol, words).advise(format!(
            "write kind = {:?} and bauds = [{baud}]",
            driver.name()
        ))
    };
    if let (false, Some(model)) = (is_own, driver.model()) {
        diagnosis.advice.push(format!("write model = {model:?}"));
    }
    diagnosis.findings.push(format!("it answers as a {found}"));
    diagnosis
}

/// Nothing came from the network, or nothing that is understood.
fn network(place: &Place, trial: &Trial, words: String) -> Diagnosis {
    if trial.stats.bytes > 0 && matches!(place, Place::Vrpn(_)) {
        return Diagnosis::new(Verdict::Complains, words).advise(
            "correct what stands before the @ of its port, or start the device at its server",
        );
    }
    if trial.stats.bytes > 0 {
        return Diagnosis::new(Verdict::NotUnderstood, words)
            .advise("its bytes are below; is the sender set to this protocol?");
    }
    let advice = match place {
        Place::Udp(address) | Place::TcpListen(address) if address.ip().is_loopback() => {
            format!(
                "set the sender to {address}; from another machine it reaches only an address of the network, such as 0.0.0.0:{}",
                address.port()
            )
        }
        Place::Udp(address) | Place::TcpListen(address) => {
            format!(
                "set the sender to this machine and port {}, and let the firewall pass it",
                address.port()
            )
        }
        _ => "is its server running, and does the firewall pass it?".to_owned(),
    };
    Diagnosis::new(Verdict::Silent, words).advise(advice)
}

fn state_words(trial: &Trial) -> String {
    format!("{:?}", trial.state).to_lowercase()
}
