use anyhow::{Context, Result, bail};
use serde_json::json;
use tonic::Streaming;
use tsukamu_client::connect::Client;
use tsukamu_proto::v1::capture_pose_response::Kind;
use tsukamu_proto::v1::{
    BeginCalibrationRequest, BeginCalibrationResponse, CancelCalibrationRequest,
    CapturePoseRequest, CaptureProgress, CaptureRangeRequest, FitCalibrationRequest,
    FitCalibrationResponse, PoseCaptured, PoseToHold, Side, WatchReadingsRequest,
    WatchReadingsResponse,
};

use super::args::CalibrateArgs;
use super::stage::{Show, Stage, enter};
use super::{quality, unsaved, write_here};
use crate::cli::args::SideArg;
use crate::cli::format::{count, printable};
use crate::cli::{output, refusal};

/// Seconds that a pose has to be held, as the daemon counts them.
const HOLD_S: f64 = 1.5;
/// The same for a pose that looks like another one.
const DOUBTED_HOLD_S: f64 = 4.5;
/// Seconds that each pose is waited for.
const PATIENCE_S: f64 = 45.0;
/// Seconds of the quick routine.
const QUICK_S: f64 = 20.0;
/// Pictures per second while nothing is captured yet.
const PREVIEW_HZ: f64 = 20.0;
/// Names of restless sensors that are shown.
const NAMES_MAX: usize = 4;
/// What the quick routine asks for.
const QUICK_WORDS: &str = "Move everything as far as it goes, again and again: fist, flat, spread, the thumb round, the wrist.";

pub(super) async fn glove(client: &Client, args: &CalibrateArgs, as_json: bool) -> Result<()> {
    let mut stage = Stage::open(args, as_json, Show::Picture)?;
    preview(client, args, &mut stage).await?;
    let side = match args.hand {
        None => Side::Unspecified,
        Some(SideArg::Left) => Side::Left,
        Some(SideArg::Right) => Side::Right,
    };
    let request = BeginCalibrationRequest {
        device: args.device.clone(),
        wearer: args.wearer.clone(),
        hand: side.into(),
    };
    let begun = client.calibration().begin_calibration(request).await;
    let begun = begun.map_err(|status| refusal(&status))?.into_inner();
    let done = routine(client, args, &begun, &mut stage).await;
    stage.close();
    let done = match done {
        Ok(fitted) => finish(client, args, &begun, &fitted, as_json).await,
        Err(fault) => Err(fault),
    };
    if done.is_err() {
        // It may be over already; the daemon gives it up by itself too.
        let request = CancelCalibrationRequest { run: begun.run };
        let _ = client.calibration().cancel_calibration(request).await;
    }
    done
}

/// Shows the sensors until Enter is pressed.
async fn preview(client: &Client, args: &CalibrateArgs, stage: &mut Stage) -> Result<()> {
    if !stage.waits() {
        return Ok(());
    }
    let request = WatchReadingsRequest {
        device: args.device.clone(),
        max_rate_hz: PREVIEW_HZ,
    };
    let readings = client.calibration().watch_readings(request).await;
    let mut readings: Streaming<WatchReadingsResponse> =
        readings.map_err(|status| refusal(&status))?.into_inner();
    let words = if args.quick {
        QUICK_WORDS
    } else {
        "Four poses follow, each held still for a second and a half. The first: the hand flat on the table, fingers \
         together."
    };
    stage.picture.title = format!("calibrating {}", args.device);
    words.clone_into(&mut stage.picture.words);
    stage.picture.state = "press Enter to begin".to_owned();
    stage.tell(words)?;
    stage.tell("press Enter to begin")?;
    stage.draw_now()?;
    let mut pressed = enter();
    loop {
        tokio::select! {
            _ = &mut pressed => return Ok(()),
            reading = readings.message() => {
                let reading = reading.map_err(|status| refusal(&status))?;
                stage.picture.take(&reading.context("the daemon has ended the stream")?);
                stage.draw()?;
            }
        }
    }
}

/// Every pose, or the whole range; then what it comes to.
async fn routine(
    client: &Client,
    args: &CalibrateArgs,
    begun: &BeginCalibrationResponse,
    stage: &mut Stage,
) -> Result<FitCalibrationResponse> {
    let wearer = match args.wearer.as_str() {
        "" => "nobody in particular".to_owned(),
        wearer => printable(wearer),
    };
    stage.picture.title = format!("calibrating {} for {wearer}", args.device);
    if args.quick {
        range(client, begun.run, stage).await?;
    } else {
        let n_poses = begun.poses.len();
        for (index, pose) in begun.poses.iter().enumerate() {
            let place = format!("{} of {n_poses}", index + 1);
            stage.picture.title = format!("calibrating {} for {wearer}: pose {place}", args.device);
            hold(client, begun.run, pose, &place, stage).await?;
        }
    }
    let request = FitCalibrationRequest {
        run: begun.run,
        ..FitCalibrationRequest::default()
    };
    let fitted = client.calibration().fit_calibration(request).await;
    Ok(fitted.map_err(|status| refusal(&status))?.into_inner())
}

async fn hold(
    client: &Client,
    run: u64,
    pose: &PoseToHold,
    place: &str,
    stage: &mut Stage,
) -> Result<()> {
    let request = CapturePoseRequest {
        run,
        pose: pose.pose.clone(),
        timeout_s: PATIENCE_S,
    };
    let words = printable(&pose.words);
    stage.tell(&format!("pose {place}, {}: {words}", printable(&pose.pose)))?;
    stage.picture.words = words;
    let answers = client.calibration().capture_pose(request).await;
    let mut answers = answers.map_err(|status| refusal(&status))?.into_inner();
    while let Some(answer) = answers.message().await.map_err(|status| refusal(&status))? {
        match answer.kind {
            Some(Kind::Progress(progress)) => show(stage, &progress)?,
            Some(Kind::Captured(captured)) => return held(stage, &captured),
            None => {}
        }
    }
    bail!("the daemon has ended the stream")
}

fn show(stage: &mut Stage, progress: &CaptureProgress) -> Result<()> {
    if let Some(readings) = &progress.readings {
        stage.picture.take(readings);
    }
    stage.picture.moving.clone_from(&progress.moving);
    let left_s = HOLD_S * (1.0 - progress.share);
    let (state, line) = match progress.state.as_str() {
        "holding" => (
            format!("hold still: {left_s:.1} s"),
            "  hold still".to_owned(),
        ),
        "doubtful" => {
            let left_s = DOUBTED_HOLD_S * (1.0 - progress.share);
            (
                format!("this looks like another pose; if it is not, hold still: {left_s:.1} s"),
                "  this looks like another pose; if it is not, hold still for 4.5 s".to_owned(),
            )
        }
        "unmoved" => (
            "now the next pose".to_owned(),
            "  waiting for the pose".to_owned(),
        ),
        "blind" => {
            let words = "nothing arrives from the glove: is it plugged in and worn?".to_owned();
            (words.clone(), format!("  {words}"))
        }
        _ if progress.moving.is_empty() => (
            "hold still".to_owned(),
            "  waiting for the hand to be still".to_owned(),
        ),
        _ => {
            let names: Vec<String> = progress
                .moving
                .iter()
                .take(NAMES_MAX)
                .map(|name| printable(name))
                .collect();
            let more = if progress.moving.len() > NAMES_MAX {
                " …"
            } else {
                ""
            };
            let names = names.join(", ");
            (
                format!("still moving: {names}{more}"),
                "  waiting for the hand to be still".to_owned(),
            )
        }
    };
    stage.picture.state = state;
    stage.picture.share = Some(progress.share);
    stage.tell(&line)?;
    stage.draw()
}

fn held(stage: &mut Stage, captured: &PoseCaptured) -> Result<()> {
    let unmoved = if captured.unmoved {
        "; no sensor had moved since the pose before"
    } else {
        ""
    };
    stage.picture.state = "held".to_owned();
    stage.picture.share = Some(1.0);
    stage.tell(&format!(
        "  held: {}{unmoved}",
        count(captured.readings.into(), "reading")
    ))?;
    stage.draw_now()
}

async fn range(client: &Client, run: u64, stage: &mut Stage) -> Result<()> {
    let request = CaptureRangeRequest {
        run,
        duration_s: QUICK_S,
    };
    QUICK_WORDS.clone_into(&mut stage.picture.words);
    stage.tell(&format!("{QUICK_WORDS} It takes {QUICK_S} s."))?;
    let answers = client.calibration().capture_range(request).await;
    let mut answers = answers.map_err(|status| refusal(&status))?.into_inner();
    while let Some(answer) = answers.message().await.map_err(|status| refusal(&status))? {
        if let Some(readings) = &answer.readings {
            stage.picture.take(readings);
        }
        stage.picture.state = format!("{:.0} s left", answer.left_s.ceil());
        stage.picture.share = Some(1.0 - answer.left_s / QUICK_S);
        stage.draw()?;
    }
    Ok(())
}

/// Shows how good it is, writes it and puts it in force.
async fn finish(
    client: &Client,
    args: &CalibrateArgs,
    begun: &BeginCalibrationResponse,
    fitted: &FitCalibrationResponse,
    as_json: bool,
) -> Result<()> {
    if !as_json {
        for line in quality::lines(&fitted.qualities) {
            output::line(&line)?;
        }
    }
    if let Some(file) = &args.output {
        write_here(file, &fitted.toml, args.replace)?;
    }
    let may_save = !args.no_save && !begun.file.is_empty();
    let apply = |save: bool| FitCalibrationRequest {
        run: begun.run,
        apply: true,
        save,
        replace_wearer: args.replace,
    };
    let mut refused = None;
    let applied = match client.calibration().fit_calibration(apply(may_save)).await {
        // What was measured is worth more than the file: it is in force all the same, and the refusal is told.
        Err(status) if may_save => {
            refused = Some(status.message().to_owned());
            client.calibration().fit_calibration(apply(false)).await
        }
        answer => answer,
    };
    let applied = applied.map_err(|status| refusal(&status))?.into_inner();
    if as_json {
        output::json(&json!({
            "device": args.device, "wearer": args.wearer, "applied": true,
            "file": (!applied.file.is_empty()).then_some(&applied.file), "refused": refused,
            "output": args.output, "sensors": quality::values(&fitted.qualities), "toml": fitted.toml,
        }))?;
        return Ok(());
    }
    if let Some(advice) = quality::advice(&fitted.qualities) {
        output::line(&advice)?;
    }
    output::line(&format!(
        "in force now: {} reads by this calibration",
        args.device
    ))?;
    if let Some(file) = &args.output {
        output::line(&format!("written here: {}", file.display()))?;
    }
    output::line(&match (&refused, applied.file.as_str()) {
        (Some(refused), _) => format!(
            "not saved: {}; --replace does it, -o FILE keeps this one here",
            printable(refused)
        ),
        (None, "") if args.no_save => {
            "not saved, as asked: the daemon forgets it when it ends".to_owned()
        }
        (None, "") => unsaved(args, "calibration"),
        (None, file) => format!("saved: {}", printable(file)),
    })?;
    Ok(())
}
