use std::time::Instant;

use anyhow::{Result, bail};
use serde_json::{Value, json};
use tsukamu_client::connect::Client;
use tsukamu_proto::v1::hold_tracker_response::Kind;
use tsukamu_proto::v1::{
    HoldTrackerRequest, Pose, SetMountRequest, SetMountResponse, SetRoomRequest, TrackerHeld, Vec3,
};

use super::args::{CalibrateArgs, Point};
use super::stage::{Show, Stage, enter};
use super::{unsaved, write_here};
use crate::cli::format::printable;
use crate::cli::{output, refusal};

/// Seconds that the sensor is waited for.
const PATIENCE_S: f64 = 60.0;
/// How far the sensor has to go from one point to the next where nobody presses Enter, m.
const NEXT_POINT_M: f64 = 0.08;
/// The three points of the table.
const POINTS: [&str; 3] = [
    "Touch the table's near left corner with the sensor",
    "Touch the near edge to the right of it, far from the corner",
    "Touch the table on its far side, anywhere away from the edge",
];
/// A plane through points that are farther off than this is not the table's, m.
const GOOD_RESIDUAL_M: f64 = 0.01;

pub(super) async fn room(client: &Client, args: &CalibrateArgs, as_json: bool) -> Result<()> {
    let mut stage = Stage::open(args, as_json, Show::Lines)?;
    let mut points: Vec<Vec3> = Vec::new();
    let mut noises: Vec<f64> = Vec::new();
    for (index, words) in POINTS.iter().enumerate() {
        prompt(&mut stage, &format!("{} of 3: {words}", index + 1)).await?;
        let last = points.last().copied().filter(|_| !stage.waits());
        let held = hold(client, args, &mut stage, last).await?;
        let place = position(&held);
        stage.tell(&format!(
            "  held at {:.3}, {:.3}, {:.3} m in the transmitter's space, ± {:.1} mm",
            place.x,
            place.y,
            place.z,
            held.noise_m * 1e3
        ))?;
        noises.push(held.noise_m);
        points.push(place);
    }
    let request = |save: bool| SetRoomRequest {
        device: args.device.clone(),
        points: points.clone(),
        corner: args.at.map(vec3),
        apply: true,
        save,
    };
    let (answer, refused) = match client.calibration().set_room(request(!args.no_save)).await {
        Err(status) if !args.no_save && status.code() == tonic::Code::FailedPrecondition => {
            let answer = client.calibration().set_room(request(false)).await;
            (answer, Some(status.message().to_owned()))
        }
        answer => (answer, None),
    };
    let answer = answer.map_err(|status| refusal(&status))?.into_inner();
    if let Some(file) = &args.output {
        write_here(file, &answer.toml, args.replace)?;
    }
    if as_json {
        let place = answer.transmitter_position.unwrap_or_default();
        output::json(&json!({
            "device": args.device, "applied": true, "file": (!answer.file.is_empty()).then_some(&answer.file),
            "refused": refused, "output": args.output, "transmitter_position": [place.x, place.y, place.z],
            "transmitter_rotation_deg": answer.transmitter_rotation_deg, "residual_m": answer.residual_m,
            "noise_m": noises, "edge_m": answer.edge_m, "toml": answer.toml,
        }))?;
        return Ok(());
    }
    let noise_mm = noises.iter().fold(0.0_f64, |most, noise| most.max(*noise)) * 1e3;
    output::line(&format!(
        "the edge from the first point to the second is {:.3} m: compare it with a ruler; points ± {noise_mm:.1} mm, {:.1} mm off \
         their plane",
        answer.edge_m,
        answer.residual_m * 1e3
    ))?;
    if answer.residual_m > GOOD_RESIDUAL_M {
        output::line("the points are not of one plane: touch them again")?;
    }
    told(args, &answer.toml, &answer.file, refused.as_deref(), "room")
}

pub(super) async fn mount(client: &Client, args: &CalibrateArgs, as_json: bool) -> Result<()> {
    let mut stage = Stage::open(args, as_json, Show::Lines)?;
    let wrist = match args.at {
        Some(Point([x, y, z])) => format!(", the middle of the wrist over {x}, {y}, {z} m"),
        None => String::new(),
    };
    let words = format!(
        "Lay the hand flat on the table, palm down, fingers straight away from you (world -z){wrist}"
    );
    prompt(&mut stage, &words).await?;
    let held = hold(client, args, &mut stage, None).await?;
    let request = |save: bool| SetMountRequest {
        device: args.device.clone(),
        station: args.station,
        held: held.pose,
        wrist: args.at.map(vec3),
        apply: true,
        save,
    };
    let (answer, refused) = match client.calibration().set_mount(request(!args.no_save)).await {
        Err(status) if !args.no_save && status.code() == tonic::Code::FailedPrecondition => {
            let answer = client.calibration().set_mount(request(false)).await;
            (answer, Some(status.message().to_owned()))
        }
        answer => (answer, None),
    };
    let answer = answer.map_err(|status| refusal(&status))?.into_inner();
    if let Some(file) = &args.output {
        write_here(file, &answer.toml, args.replace)?;
    }
    if as_json {
        output::json(&mount_value(args, &answer, &held, refused.as_deref()))?;
        return Ok(());
    }
    output::line(&format!(
        "held ± {:.1} mm and {:.2}°; for the hand of {}",
        held.noise_m * 1e3,
        held.noise_rad.to_degrees(),
        printable(&answer.glove)
    ))?;
    if args.at.is_none() {
        output::line(
            "only the rotation is new: --at X,Y,Z tells where the wrist lies, and finds the position too",
        )?;
    }
    told(
        args,
        &answer.toml,
        &answer.file,
        refused.as_deref(),
        "calibration",
    )
}

/// The mount for programs.
fn mount_value(
    args: &CalibrateArgs,
    answer: &SetMountResponse,
    held: &TrackerHeld,
    refused: Option<&str>,
) -> Value {
    let pose = answer.mount.unwrap_or_default();
    let (p, q) = (
        pose.position.unwrap_or_default(),
        pose.rotation.unwrap_or_default(),
    );
    json!({
        "device": args.device, "glove": answer.glove, "applied": true,
        "file": (!answer.file.is_empty()).then_some(&answer.file), "refused": refused, "output": args.output,
        "position_m": [p.x, p.y, p.z], "rotation_xyzw": [q.x, q.y, q.z, q.w],
        "noise_m": held.noise_m, "noise_rad": held.noise_rad, "toml": answer.toml,
    })
}

/// Says what is in force and what was written.
fn told(
    args: &CalibrateArgs,
    toml: &str,
    file: &str,
    refused: Option<&str>,
    key: &str,
) -> Result<()> {
    output::line("in force now:")?;
    for line in toml.lines() {
        output::line(&format!("    {}", printable(line)))?;
    }
    if let Some(file) = &args.output {
        output::line(&format!("written here: {}", file.display()))?;
    }
    output::line(&match (refused, file) {
        (Some(refused), _) => format!("not saved: {}", printable(refused)),
        (None, "") => unsaved(args, key),
        (None, file) => format!("saved: {}", printable(file)),
    })?;
    Ok(())
}

/// Says what to do, and waits for Enter where somebody is there to press it.
async fn prompt(stage: &mut Stage, words: &str) -> Result<()> {
    if !stage.waits() {
        return stage.tell(&format!("{words}, and hold still."));
    }
    stage.tell(&format!("{words}, and press Enter."))?;
    // An end of standard input is as good as Enter.
    let _ = enter().await;
    Ok(())
}

/// Waits until the sensor is still, away from the last point where there is one.
async fn hold(
    client: &Client,
    args: &CalibrateArgs,
    stage: &mut Stage,
    away_from: Option<Vec3>,
) -> Result<TrackerHeld> {
    let begun = Instant::now();
    let mut is_again = false;
    loop {
        let request = HoldTrackerRequest {
            device: args.device.clone(),
            station: args.station,
            timeout_s: PATIENCE_S,
        };
        let answers = client.calibration().hold_tracker(request).await;
        let mut answers = answers.map_err(|status| refusal(&status))?.into_inner();
        let mut found = None;
        while let Some(answer) = answers.message().await.map_err(|status| refusal(&status))? {
            match answer.kind {
                Some(Kind::Progress(progress)) => match progress.state.as_str() {
                    "blind" => stage
                        .tell("  the tracker sees nothing: is the receiver plugged in and near?")?,
                    _ if is_again => {}
                    "holding" => stage.tell("  hold still")?,
                    _ => stage.tell("  waiting for the sensor to be still")?,
                },
                Some(Kind::Held(held)) => found = Some(held),
                None => {}
            }
        }
        let Some(held) = found else {
            bail!("the daemon has ended the stream");
        };
        let is_next = away_from.is_none_or(|last| distance(position(&held), last) > NEXT_POINT_M);
        if is_next {
            return Ok(held);
        }
        is_again = true;
        stage.tell("  still at the last point")?;
        if begun.elapsed().as_secs_f64() > PATIENCE_S {
            bail!("the sensor stayed where the last point was");
        }
    }
}

fn position(held: &TrackerHeld) -> Vec3 {
    held.pose
        .as_ref()
        .and_then(|pose: &Pose| pose.position)
        .unwrap_or_default()
}

fn distance(a: Vec3, b: Vec3) -> f64 {
    (a.x - b.x).hypot(a.y - b.y).hypot(a.z - b.z)
}

const fn vec3(Point([x, y, z]): Point) -> Vec3 {
    Vec3 { x, y, z }
}
