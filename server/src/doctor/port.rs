//! A serial port before it is opened.

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use tsukamu_devices::ports::access::Access;
use tsukamu_devices::ports::holder::{Holder, holders};
use tsukamu_devices::ports::{Port, list};

use super::{Diagnosis, Verdict};

/// This program's name as the kernel has it.
const OURSELVES: &str = "tsukamud";

/// Why a port cannot be opened, as far as that can be seen without opening it; `None` when nothing is in the way.
pub(super) fn examine(path: &str) -> Option<Diagnosis> {
    let access = Access::of(Path::new(path));
    if access == Access::Missing {
        return Some(missing(path, &list()));
    }
    let target = fs::canonicalize(path).ok();
    if target.as_deref().is_some_and(|target| !is_terminal(target)) {
        return Some(Diagnosis::new(
            Verdict::NotADevice,
            format!("{path} is not a serial port"),
        ));
    }
    if let Access::Denied { group, .. } = &access {
        let whose = if group.is_empty() {
            "a folder above it is closed to this user".to_owned()
        } else {
            format!("it belongs to the group {group}, and this user is not in it")
        };
        let diagnosis = Diagnosis::new(
            Verdict::NoPermission,
            format!("{path} may not be opened: {whose}"),
        );
        return Some(match access.remedy() {
            Some(remedy) => diagnosis.advise(remedy),
            None => diagnosis,
        });
    }
    let held = holders(Path::new("/proc"), &target?);
    // An emulator holds both ends of its own line.
    let other = held
        .iter()
        .find(|holder| holder.pid != std::process::id() && !is_emulator(holder));
    other.map(|holder| busy(path, holder))
}

/// Whether it can be a serial line: a device of characters, and one of those that the kernel counts as terminals.
fn is_terminal(target: &Path) -> bool {
    if !fs::metadata(target).is_ok_and(|found| found.file_type().is_char_device()) {
        return false;
    }
    let terminals = Path::new("/sys/class/tty");
    let is_known = || {
        target
            .file_name()
            .is_some_and(|name| terminals.join(name).exists())
    };
    target.starts_with("/dev/pts") || !terminals.exists() || is_known()
}

/// Whether that is `tsukamud emulate`, which keeps its own end of a pseudo-terminal open.
fn is_emulator(holder: &Holder) -> bool {
    let words = fs::read(format!("/proc/{}/cmdline", holder.pid)).unwrap_or_default();
    words
        .split(|byte| *byte == 0)
        .any(|word| word == b"emulate")
}

fn busy(path: &str, holder: &Holder) -> Diagnosis {
    let Holder { pid, name } = holder;
    let diagnosis = Diagnosis::new(
        Verdict::Busy,
        format!("{path} is in use by {name} (process {pid})"),
    );
    if name == OURSELVES {
        diagnosis.advise(
            "the daemon has it: `tsukamu devices` shows how it does; stop the daemon to examine it here",
        )
    } else {
        diagnosis.advise(format!("end that program: kill {pid}"))
    }
}

/// Nothing is there: what is?
fn missing(path: &str, ports: &[Port]) -> Diagnosis {
    let is_dangling = fs::symlink_metadata(path).is_ok();
    let finding = if is_dangling {
        format!("{path} is a link to nothing: the device behind it is gone")
    } else {
        format!("{path} is not there")
    };
    let diagnosis = Diagnosis::new(Verdict::Missing, finding);
    if ports.is_empty() {
        return diagnosis.advise("plug it in: this machine has no serial port at all now");
    }
    let names: Vec<String> = ports
        .iter()
        .map(|port| port.lasting_name().display().to_string())
        .collect();
    diagnosis.advise(format!(
        "plug it in, or correct its port; there are: {}",
        names.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn port(path: &str, links: &[&str]) -> Port {
        Port {
            path: PathBuf::from(path),
            links: links.iter().map(PathBuf::from).collect(),
            usb: None,
            driver: String::new(),
            access: Access::Granted,
            holders: Vec::new(),
        }
    }

    #[test]
    fn what_is_no_serial_line_is_told_so_and_nobody_is_to_be_killed_for_it() {
        for path in ["/dev/null", "/tmp", "/proc/self/status"] {
            let seen = examine(path).unwrap();
            assert_eq!(seen.verdict, Verdict::NotADevice, "{path}: {seen:?}");
            assert!(seen.advice.is_empty(), "{path}: {seen:?}");
        }
    }

    #[test]
    fn a_path_that_leads_nowhere_is_told_with_what_is_there() {
        let there = [port("/dev/ttyUSB3", &["/dev/serial/by-id/usb-A"])];
        let diagnosis = missing("/dev/serial/by-id/usb-B", &there);
        assert_eq!(diagnosis.verdict, Verdict::Missing);
        assert!(diagnosis.advice[0].contains("by-id/usb-A"), "{diagnosis:?}");
        let nothing = missing("/dev/nothing", &[]);
        assert!(
            nothing.advice[0].contains("no serial port at all"),
            "{nothing:?}"
        );
    }

    #[test]
    fn whoever_has_it_is_named() {
        let holder = |name: &str| Holder {
            pid: 7,
            name: name.to_owned(),
        };
        let other = busy("/dev/ttyUSB0", &holder("minicom"));
        assert!(other.findings[0].contains("minicom (process 7)"));
        assert_eq!(other.advice, ["end that program: kill 7"]);
        let daemon = busy("/dev/ttyUSB0", &holder(OURSELVES));
        assert!(daemon.advice[0].contains("tsukamu devices"));
    }
}
