//! What a run came to, for programs and for people.

use std::fmt::{self, Write as _};

use serde::Serialize;
use tsukamu_world::state::Body;

use super::event_record::EventRecord;
use super::poses::holder;
use super::run::RunOutcome;
use super::timing::StepTimeUs;

/// The object that `--json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct RunReport {
    /// Name of the scene.
    pub scene: String,
    /// Name of the model.
    pub model: &'static str,
    /// Steps per second of world time.
    pub rate_hz: f64,
    /// Steps done.
    pub ticks: u64,
    /// World time, in seconds.
    pub duration_s: f64,
    /// The state after the last step as one number, 16 hexadecimal digits.
    pub digest: String,
    /// The objects after the last step.
    pub objects: Vec<ObjectReport>,
    /// Everything that happened, in order.
    pub events: Vec<EventRecord>,
    /// How long steps took.
    pub step_time_us: StepTimeUs,
    /// World time per time of the steps.
    pub realtime_factor: f64,
}

/// One object after the last step.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectReport {
    /// Its name.
    pub name: String,
    /// `free`, `push-1`, `push-n` or `grasped`.
    pub state: &'static str,
    /// Its centre of gravity, in metres, world space.
    pub position: [f64; 3],
    /// Its rotation as x, y, z, w.
    pub rotation: [f64; 4],
    /// Whether it lies still.
    pub resting: bool,
    /// Name of the hand that it follows.
    pub hand: Option<String>,
}

impl RunReport {
    /// The report of a run.
    pub fn of(outcome: RunOutcome) -> Self {
        let RunOutcome {
            world,
            names,
            events,
            step_time_us,
            realtime_factor,
            ..
        } = outcome;
        let object = |body: &Body| ObjectReport {
            name: body.spec.name.clone(),
            state: body.contact.name(),
            position: body.pose.translation.vector.into(),
            rotation: body.pose.rotation.coords.into(),
            resting: body.is_resting(),
            hand: Some(holder(body, &names)).filter(|name| !name.is_empty()),
        };
        let (scene, ticks) = (world.scene(), world.state().tick);
        Self {
            scene: scene.name.clone(),
            model: scene.model.name(),
            rate_hz: scene.rate_hz,
            ticks,
            duration_s: ticks as f64 * scene.step_length_s(),
            digest: format!("{:016x}", world.digest()),
            objects: world.objects().map(|(_, body)| object(body)).collect(),
            events,
            step_time_us,
            realtime_factor,
        }
    }
}

/// Events listed for people; of contacts there are too many.
const LISTED_MAX: usize = 200;

impl fmt::Display for RunReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            scene,
            model,
            rate_hz,
            ticks,
            duration_s,
            ..
        } = self;
        writeln!(
            out,
            "{scene}, model {model}: {ticks} steps at {rate_hz} Hz, {duration_s:.3} s of world time"
        )?;
        let StepTimeUs { p50, p99, max } = self.step_time_us;
        writeln!(
            out,
            "a step takes {p50:.1} µs (99 %: {p99:.1} µs, longest {max:.1} µs), {:.0} times as fast as real time",
            self.realtime_factor
        )?;
        writeln!(out, "digest {}\n", self.digest)?;
        self.write_objects(out)?;
        writeln!(out)?;
        self.write_events(out)
    }
}

impl RunReport {
    fn write_objects(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self
            .objects
            .iter()
            .map(|object| object.name.chars().count())
            .max()
            .unwrap_or(0)
            .max(6);
        writeln!(
            out,
            "{:width$}  {:8} {:>9} {:>9} {:>9}  held by",
            "object", "state", "x m", "y m", "z m"
        )?;
        for object in &self.objects {
            let [x, y, z] = object.position;
            let state = if object.resting {
                "at rest"
            } else {
                object.state
            };
            let hand = object.hand.as_deref().unwrap_or("-");
            writeln!(
                out,
                "{:width$}  {state:8} {x:9.4} {y:9.4} {z:9.4}  {hand}",
                object.name
            )?;
        }
        Ok(())
    }

    fn write_events(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_contact = |event: &&EventRecord| event.kind.starts_with("contact_");
        let n_contacts = self.events.iter().filter(is_contact).count();
        let others = self.events.iter().filter(|event| !is_contact(event));
        let listed = || others.clone().take(LISTED_MAX);
        let widths = listed().map(|event| whose(event).chars().count());
        let width = widths.max().unwrap_or(0).max(12);
        writeln!(
            out,
            "{:>9}  {:width$} {:12} why",
            "time s", "object", "what"
        )?;
        for event in listed() {
            writeln!(
                out,
                "{:9.4}  {:width$} {:12} {}",
                event.time_s,
                whose(event),
                event.kind,
                why(event)
            )?;
        }
        let n_hidden = others.count().saturating_sub(LISTED_MAX);
        if n_hidden > 0 {
            writeln!(out, "and {n_hidden} more")?;
        }
        write!(
            out,
            "besides, {n_contacts} contacts began or ended (--json lists them)"
        )
    }
}

/// Name of the object that an event is about, or else of the hand.
fn whose(event: &EventRecord) -> &str {
    let name = event.object.as_deref().or(event.hand.as_deref());
    name.unwrap_or("-")
}

/// The reason of an event with its most telling number.
fn why(event: &EventRecord) -> String {
    let mut text = event.reason.replace('_', " ");
    let number = |key: &str| event.details.get(key).and_then(serde_json::Value::as_f64);
    let word = |key: &str| event.details.get(key).and_then(serde_json::Value::as_str);
    let told = match (number("angle_rad"), number("speed"), number("distance")) {
        (Some(angle), _, _) => write!(text, ", {:.1}°", angle.to_degrees()),
        (_, Some(speed), _) => write!(text, ", {speed:.2} m/s"),
        (_, _, Some(distance)) => write!(text, ", {distance:.3} m from it"),
        _ => Ok(()),
    };
    told.expect("a String takes all that is written to it");
    if let Some(other) = word("on").or_else(|| word("by")).or_else(|| word("target")) {
        text.push(' ');
        text.push_str(other);
    }
    text
}
