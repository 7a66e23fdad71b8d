use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result, bail};
use tsukamu_client::connect::Client;

/// What may be typed.
pub(super) mod args;
/// A glove: poses, or everything as far as it goes.
mod glove;
/// The picture of a glove's sensors.
mod picture;
/// The quality of each sensor.
mod quality;
/// Where the wearer sees what to do.
mod stage;
/// A tracker: the room, or the wrist.
mod tracker;

use super::format::printable;
use args::CalibrateArgs;

pub(crate) async fn calibrate(client: &Client, args: &CalibrateArgs, as_json: bool) -> Result<()> {
    if args.room {
        tracker::room(client, args, as_json).await
    } else if args.mount {
        tracker::mount(client, args, as_json).await
    } else {
        glove::glove(client, args, as_json).await
    }
}

/// What to do so that the daemon still has it after its next start; `key` is the one of the device that names a file.
fn unsaved(args: &CalibrateArgs, key: &str) -> String {
    let device = printable(&args.device);
    args.output.as_ref().map_or_else(
        || format!("not kept: the settings name no file for {device}; -o FILE writes one here, for `{key} = \"FILE\"`"),
        |file| {
            let file = file.display();
            format!("to keep it: `{key} = \"{file}\"` in the [[device]] of {device}")
        },
    )
}

/// Writes a result; a file that is there is replaced only if that is wanted.
fn write_here(file: &Path, text: &str, replace: bool) -> Result<()> {
    let opened = match replace {
        true => File::create(file),
        false => File::create_new(file),
    };
    match opened {
        Err(fault) if fault.kind() == ErrorKind::AlreadyExists => {
            bail!("{} is there already: --replace replaces it", file.display())
        }
        opened => {
            let written = opened.and_then(|mut file| file.write_all(text.as_bytes()));
            written.with_context(|| format!("cannot write {}", file.display()))
        }
    }
}
