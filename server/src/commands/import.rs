//! `tsukamud import`

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use tsukamu_devices::calibration::import::ImportFormat;
use tsukamu_devices::glove::calibrate::Handedness;
use tsukamu_motion::hand_csv;
use tsukamu_motion::import::adroit::{AdroitOptions, AdroitPoints};
use tsukamu_motion::import::landmarks21::Landmarks21Options;
use tsukamu_motion::import::leap::LeapOptions;
use tsukamu_motion::import::webxr::WebxrOptions;
use tsukamu_motion::import::{ImportOptions, import as import_text};

use super::Failure;
use super::import_calibration::{Wearing, import_calibration};
use super::output::say;

/// Where the motion or the calibration comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// The simulated Adroit hand.
    Adroit,
    /// Bare hands seen by a Leap Motion controller.
    Leap,
    /// Twenty-one points from a video.
    Landmarks21,
    /// A still hand pose of WebXR's joints.
    Webxr,
    /// A glove calibration of the VirtualHand utility (.cal).
    Virtualhand,
    /// A glove calibration of the Shadow Robot company's glove node (YAML).
    Shadow,
    /// A glove calibration of 22 lines `rad:raw rad:raw`.
    TwoPoint,
}

impl Set {
    const fn name(self) -> &'static str {
        match self {
            Self::Adroit => "adroit",
            Self::Leap => "leap",
            Self::Landmarks21 => "landmarks21",
            Self::Webxr => "webxr",
            Self::Virtualhand => "virtualhand",
            Self::Shadow => "shadow",
            Self::TwoPoint => "two-point",
        }
    }
}

/// Arguments of `tsukamud import`.
#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// The kind of file.
    #[arg(long)]
    from: Set,
    /// The file.
    file: PathBuf,
    /// The hand CSV, or the calibration, to write; a file that is there is replaced.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// adroit: take the points that were commanded, not those that were reached.
    #[arg(long)]
    commanded: bool,
    /// leap: least confidence, 0 to 1; rows of less are "not tracked".
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    min_confidence: Option<f64>,
    /// landmarks21: frames per second of the video, 1 to 1000.
    #[arg(
        long,
        alias = "rate-hz",
        value_name = "HZ",
        allow_negative_numbers = true
    )]
    rate: Option<f64>,
    /// webxr: how long the hand stays, seconds.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// calibrations: who wears the glove.
    #[arg(long, value_name = "NAME")]
    wearer: Option<String>,
    /// calibrations: which hand.
    #[arg(long, value_parser = ["left", "right"])]
    hand: Option<String>,
    /// virtualhand: the angles shown are those of this hand; do not ask.
    #[arg(long)]
    yes: bool,
}

/// What a file is turned into.
enum Kind {
    /// A hand CSV.
    Motion(ImportOptions),
    /// A calibration.
    Calibration(ImportFormat),
}

/// Turns a file of somebody else's into one of ours.
pub(super) fn import(args: &ImportArgs) -> Result<(), Failure> {
    match kind(args)? {
        Kind::Motion(options) => motion(args, &options),
        Kind::Calibration(format) => {
            let wearing = Wearing {
                wearer: args.wearer.as_deref().unwrap_or_default(),
                hand: args.hand.as_deref().map(|hand| match hand {
                    "left" => Handedness::Left,
                    _ => Handedness::Right,
                }),
                is_confirmed: args.yes,
            };
            import_calibration(format, &args.file, &args.output, &wearing)
        }
    }
}

/// Turns a recorded set's file into a hand CSV.
fn motion(args: &ImportArgs, options: &ImportOptions) -> Result<(), Failure> {
    let file = args.file.display();
    let text = std::fs::read_to_string(&args.file).with_context(|| file.to_string())?;
    if let Some(set) = set_of(&text).filter(|set| *set != args.from) {
        let told = format!("looks like a file for --from {}", set.name());
        return Err(Failure::Usage(format!("{file}: {told}")));
    }
    let track = import_text(&text, options).map_err(|mistakes| {
        let lines: Vec<String> = mistakes
            .to_string()
            .lines()
            .map(|line| format!("{file}: {line}"))
            .collect();
        Failure::Usage(lines.join("\n"))
    })?;
    std::fs::write(&args.output, hand_csv::write(&track))
        .with_context(|| args.output.display().to_string())?;
    let hands: Vec<String> = track
        .hands
        .iter()
        .map(|hand| format!("{} ({} samples)", hand.side.name(), hand.samples.len()))
        .collect();
    let (start, end) = (track.start_s(), track.end_s());
    say(&format!(
        "{}: {}, {start:.3} to {end:.3} s",
        args.output.display(),
        hands.join(" and ")
    ))
}

/// The set that a file plainly is of, by its beginning: the Leap and Adroit tables share most of their columns.
fn set_of(text: &str) -> Option<Set> {
    let header = text.trim_start().lines().next().unwrap_or_default();
    let has = |column: &str| header.split(',').any(|cell| cell.trim() == column);
    if header.starts_with(['{', '[']) {
        Some(Set::Webxr)
    } else if has("hand_id") && has("confidence") {
        Some(Set::Leap)
    } else {
        None
    }
}

/// What is wanted, with the importer's options; a flag of another set is a mistake.
fn kind(args: &ImportArgs) -> Result<Kind, Failure> {
    let of_calibration: &[Set] = &[Set::Virtualhand, Set::Shadow, Set::TwoPoint];
    let flags: [(&str, &[Set], bool); 7] = [
        ("--commanded", &[Set::Adroit], args.commanded),
        (
            "--min-confidence",
            &[Set::Leap],
            args.min_confidence.is_some(),
        ),
        ("--rate", &[Set::Landmarks21], args.rate.is_some()),
        ("--duration", &[Set::Webxr], args.duration.is_some()),
        ("--wearer", of_calibration, args.wearer.is_some()),
        ("--hand", of_calibration, args.hand.is_some()),
        ("--yes", &[Set::Virtualhand], args.yes),
    ];
    let strange = flags
        .iter()
        .find(|(_, sets, given)| *given && !sets.contains(&args.from));
    if let Some((flag, sets, _)) = strange {
        let sets: Vec<&str> = sets.iter().map(|set| set.name()).collect();
        let sets = sets.join(", ");
        return Err(Failure::Usage(format!("{flag} belongs to --from {sets}")));
    }
    Ok(Kind::Motion(match args.from {
        Set::Virtualhand => return Ok(Kind::Calibration(ImportFormat::VirtualHand)),
        Set::Shadow => return Ok(Kind::Calibration(ImportFormat::Shadow)),
        Set::TwoPoint => return Ok(Kind::Calibration(ImportFormat::TwoPoint)),
        Set::Adroit => {
            let points = if args.commanded {
                AdroitPoints::Commanded
            } else {
                AdroitPoints::Reached
            };
            ImportOptions::Adroit(AdroitOptions { points })
        }
        Set::Leap => {
            let default = LeapOptions::default();
            let min_confidence = args.min_confidence.unwrap_or(default.min_confidence);
            ImportOptions::Leap(LeapOptions { min_confidence })
        }
        Set::Landmarks21 => {
            let default = Landmarks21Options::default();
            ImportOptions::Landmarks21(Landmarks21Options {
                rate_hz: args.rate.unwrap_or(default.rate_hz),
                ..default
            })
        }
        Set::Webxr => {
            let default = WebxrOptions::default();
            let duration_s = args.duration.unwrap_or(default.duration_s);
            ImportOptions::Webxr(WebxrOptions {
                duration_s,
                ..default
            })
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_set_is_known_by_its_beginning() {
        let files = [
            ("\n{\"joints\": []}", Some(Set::Webxr)),
            (
                "t_s,frame,hand_id,hand,confidence,palm_x\n0,",
                Some(Set::Leap),
            ),
            ("t_s,palm_x,palm_y\n0,", None),
            ("", None),
        ];
        for (text, expected) in files {
            assert_eq!(set_of(text), expected, "{text}");
        }
    }
}
