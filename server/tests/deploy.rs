//! What an operator installs beside the settings: unit, udev rules, scripts, image.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy")
}

fn text(name: &str) -> String {
    std::fs::read_to_string(deploy().join(name)).unwrap_or_else(|fault| panic!("{name}: {fault}"))
}

/// A tool's answer; `None` where it is not installed, or of a version that does not know the command.
fn tool(name: &str, args: &[&str]) -> Option<Output> {
    let output = Command::new(name).args(args).output().ok()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let knows = !said.contains("Unknown command") && !said.contains("unrecognized option");
    if !knows {
        skipped(name, "it is too old for this");
    }
    knows.then_some(output)
}

#[expect(
    clippy::print_stderr,
    reason = "whoever runs the tests is to know what was not checked"
)]
fn skipped(name: &str, why: &str) {
    eprintln!("skipped: {name}: {why}");
}

fn all_of(output: &Output) -> String {
    let said = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    said.concat()
}

/// The unit with the binary of this build in place of the installed one, in a folder of its own.
struct Unit(PathBuf);

impl Unit {
    fn new(test: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("tsukamu-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let unit = text("tsukamud.service");
        let unit = unit.replace("/usr/bin/tsukamud", env!("CARGO_BIN_EXE_tsukamud"));
        std::fs::write(folder.join("tsukamud.service"), unit).expect("a file");
        Self(folder)
    }

    fn path(&self) -> String {
        self.0.join("tsukamud.service").display().to_string()
    }
}

impl Drop for Unit {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn the_unit_is_one_that_systemd_understands() {
    let unit = Unit::new("unit-verify");
    let Some(output) = tool("systemd-analyze", &["verify", "--man=no", &unit.path()]) else {
        return skipped("systemd-analyze verify", "there is no such tool here");
    };
    let said = all_of(&output);
    // Where no systemd runs it says so, and of other units it says much.
    let mine: Vec<&str> = said
        .lines()
        .filter(|line| line.contains("tsukamud.service"))
        .collect();
    assert!(mine.is_empty(), "{said}");
}

#[test]
fn the_unit_exposes_little() {
    let unit = Unit::new("unit-security");
    // In tenths; 0 is no exposure. What remains is the network, the ports and the group that opens them.
    let limit = "--threshold=20";
    let args = [
        "security",
        "--offline=true",
        "--no-pager",
        limit,
        &unit.path(),
    ];
    let Some(output) = tool("systemd-analyze", &args) else {
        return skipped("systemd-analyze security", "there is no such tool here");
    };
    assert!(output.status.success(), "{}", all_of(&output));
}

#[test]
fn the_unit_asks_for_what_the_daemon_does() {
    let unit = text("tsukamud.service");
    let has = |line: &str| unit.lines().any(|found| found == line);
    for line in [
        "Type=notify",
        "WatchdogSec=20",
        "DynamicUser=yes",
        "SupplementaryGroups=dialout",
        "StateDirectory=tsukamu",
        "RuntimeDirectory=tsukamu",
        "DevicePolicy=closed",
        "CapabilityBoundingSet=",
        "NoNewPrivileges=yes",
        "SystemCallFilter=@system-service",
    ] {
        assert!(has(line), "{line}");
    }
    // The protocol of the manager needs local sockets.
    assert!(has("RestrictAddressFamilies=AF_INET AF_INET6 AF_UNIX"));
    let devices = unit
        .lines()
        .filter_map(|line| line.strip_prefix("DeviceAllow="));
    for device in devices {
        assert!(
            device.starts_with("char-") && device.ends_with(" rw"),
            "{device}"
        );
    }
}

#[test]
fn the_rules_are_ones_that_udev_understands() {
    let rules = deploy().join("60-tsukamu.rules").display().to_string();
    let Some(output) = tool("udevadm", &["verify", &rules]) else {
        return skipped("udevadm verify", "there is no such tool here");
    };
    assert!(output.status.success(), "{}", all_of(&output));
}

#[test]
fn every_rule_assigns_something_to_something() {
    let text = text("60-tsukamu.rules");
    let rules: Vec<&str> = text
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .collect();
    assert_eq!(rules.len(), 4);
    for rule in &rules {
        let parts: Vec<&str> = rule.split(", ").collect();
        let is_match = |part: &&&str| part.contains("==\"");
        assert!(parts.iter().any(|part| is_match(&part)), "{rule}");
        assert!(parts.iter().any(|part| !is_match(&part)), "{rule}");
        assert!(
            parts.iter().all(|part| part.matches('"').count() == 2),
            "{rule}"
        );
    }
    let opens = rules
        .iter()
        .filter(|rule| rule.contains("TAG+=\"uaccess\""));
    assert!(
        opens.clone().count() == 2 && opens.clone().all(|rule| rule.contains("GROUP=\"dialout\""))
    );
    assert!(!text.contains("0666"), "no port is open to everybody");
}

#[test]
fn the_scripts_are_ones_that_a_shell_understands() {
    for name in ["ci.sh", "package.sh"] {
        let script = deploy().join(name);
        let output = Command::new("bash").arg("-n").arg(&script).output();
        let Ok(output) = output else {
            return skipped("bash", "there is no such shell here");
        };
        assert!(output.status.success(), "{}", all_of(&output));
    }
}

#[test]
fn the_image_runs_as_nobody_special_and_is_asked_how_it_does() {
    let text = text("Containerfile");
    let n_stages = text
        .lines()
        .filter(|line| line.starts_with("FROM "))
        .count();
    assert_eq!(n_stages, 2);
    let last = text.rsplit("FROM ").next().expect("a stage");
    assert!(last.contains("\nUSER tsukamu\n"));
    assert!(last.contains("CMD [\"tsukamu\", \"status\"]"));
    let root = deploy().join("..");
    for folder in text.lines().filter_map(|line| line.strip_prefix("COPY ")) {
        for path in folder
            .split(' ')
            .filter(|path| !path.starts_with(['-', '/', '.']))
        {
            assert!(root.join(path).exists(), "COPY {path}");
        }
    }
}

#[test]
fn the_example_client_is_as_short_as_promised() {
    let example = std::fs::read_to_string(deploy().join("../examples/drive_hand.py"));
    let n_lines = example.expect("the example").lines().count();
    assert!(n_lines < 60, "{n_lines}");
}
