use std::path::PathBuf;

use crate::cli::args::SideArg;

/// Arguments of `tsukamu calibrate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "A glove: four poses, each held still for a second and a half; together well under half a minute. A tracker: \
                  --room touches three points of the table with the sensor, --mount lays the hand flat on it."
)]
pub(crate) struct CalibrateArgs {
    /// The device, as `tsukamu devices` lists it.
    pub(crate) device: String,
    /// Who wears the glove.
    #[arg(long, default_value = "", value_name = "NAME")]
    pub(crate) wearer: String,
    /// Which hand [default: what the calibration says].
    #[arg(long)]
    pub(crate) hand: Option<SideArg>,
    /// Write the result to a file here too; one that is there is replaced with --replace only.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Only least and greatest values: move everything as far as it goes for 20 s.
    #[arg(long, conflicts_with_all = ["mount", "room"])]
    pub(crate) quick: bool,
    /// Where a tracker's sensor sits on the wrist: the hand lies flat.
    #[arg(long, conflicts_with = "room")]
    pub(crate) mount: bool,
    /// Where a tracker's transmitter stands in the room: three points of the table.
    #[arg(long)]
    pub(crate) room: bool,
    /// Station of the tracker, from 1.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_535))]
    pub(crate) station: u32,
    /// Metres, world space: with --room the table's near left corner [default: 0,0,0], with --mount the wrist
    /// [default: unknown, only the rotation is found].
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub(crate) at: Option<Point>,
    /// Do not write the daemon's own file.
    #[arg(long)]
    pub(crate) no_save: bool,
    /// Replace the file of another wearer.
    #[arg(long)]
    pub(crate) replace: bool,
    /// Begin without waiting for Enter.
    #[arg(long)]
    pub(crate) now: bool,
    /// Print lines even on a terminal.
    #[arg(long)]
    pub(crate) plain: bool,
}

/// Three coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point(pub(crate) [f64; 3]);

fn point(text: &str) -> Result<Point, String> {
    let wrong = || "it must be three numbers with commas, such as 0.1,0,-0.3".to_owned();
    let parts: Vec<f64> = text
        .split(',')
        .map(|part| {
            part.trim()
                .parse::<f64>()
                .ok()
                .filter(|value| value.is_finite())
        })
        .collect::<Option<_>>()
        .ok_or_else(wrong)?;
    Ok(Point(
        parts.try_into().map_err(|_others: Vec<f64>| wrong())?,
    ))
}

#[cfg(test)]
mod tests {
    use super::{Point, point};

    #[test]
    fn points_are_three_numbers() {
        assert_eq!(point("0.1, -2,3"), Ok(Point([0.1, -2.0, 3.0])));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,nan"] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
    }
}
