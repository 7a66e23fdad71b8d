//! How a hand's two streams are treated: the keys `glove_*`, `tracker_*`, and those that are of both.

use crate::document::bounds::Bounds;
use crate::document::keys::Keys;
use crate::document::mistake::Sheet;
use crate::input::fusion::{Between, FusionSettings};
use crate::input::one_euro::{DERIVATIVE_CUTOFF_HZ, OneEuro};
use crate::input::predict::LEAD_MAX_S;
use crate::input::stream::{DELAY_MAX_S, StreamSettings};

/// The keys of one stream.
struct StreamKeys {
    delay_s: &'static str,
    predict_s: &'static str,
    filter: FilterKeys,
}

/// The keys of one filter.
struct FilterKeys {
    min_cutoff_hz: &'static str,
    beta: &'static str,
}

const BOTH: FilterKeys = FilterKeys {
    min_cutoff_hz: "min_cutoff_hz",
    beta: "beta",
};
const GLOVE: StreamKeys = StreamKeys {
    delay_s: "glove_delay_s",
    predict_s: "glove_predict_s",
    filter: FilterKeys {
        min_cutoff_hz: "glove_min_cutoff_hz",
        beta: "glove_beta",
    },
};
const TRACKER: StreamKeys = StreamKeys {
    delay_s: "tracker_delay_s",
    predict_s: "tracker_predict_s",
    filter: FilterKeys {
        min_cutoff_hz: "tracker_min_cutoff_hz",
        beta: "tracker_beta",
    },
};

/// How the streams of a `[[hand]]` are filtered, predicted and joined.
pub(super) fn read(keys: &mut Keys<'_>, sheet: &mut Sheet<'_>) -> FusionSettings {
    let both = filter(keys, sheet, &BOTH, None);
    let between = match keys.choice(sheet, "between", &["interpolate", "hold"]) {
        Some("hold") => Between::Hold,
        _ => Between::Interpolate,
    };
    FusionSettings {
        between,
        wrist: stream(keys, sheet, &TRACKER, both),
        fingers: stream(keys, sheet, &GLOVE, both),
    }
}

fn stream(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    names: &StreamKeys,
    both: Option<OneEuro>,
) -> StreamSettings {
    let delay_s = keys.number(sheet, names.delay_s, Bounds::within(0.0, DELAY_MAX_S, "s"));
    let predict_s = keys.number(sheet, names.predict_s, Bounds::within(0.0, LEAD_MAX_S, "s"));
    StreamSettings {
        delay_s: delay_s.unwrap_or(0.0),
        filter: filter(keys, sheet, &names.filter, both),
        predict_s: predict_s.unwrap_or(0.0),
    }
}

/// A filter, which a cut-off turns on; what is not given is taken from the one of both.
fn filter(
    keys: &mut Keys<'_>,
    sheet: &mut Sheet<'_>,
    names: &FilterKeys,
    both: Option<OneEuro>,
) -> Option<OneEuro> {
    let own = Bounds::above(0.0, 1000.0, "Hz");
    let min_cutoff_hz = keys.number(sheet, names.min_cutoff_hz, own);
    let beta = keys.number(sheet, names.beta, Bounds::within(0.0, 1000.0, ""));
    if beta.is_some() && both.is_none() && !keys.has(names.min_cutoff_hz) {
        let message = format!("does nothing without {}", names.min_cutoff_hz);
        keys.fault(sheet, names.beta, message);
    }
    let min_cutoff_hz = min_cutoff_hz.or_else(|| both.map(|both| both.min_cutoff_hz))?;
    Some(OneEuro {
        min_cutoff_hz,
        beta: beta.or_else(|| both.map(|both| both.beta)).unwrap_or(0.0),
        derivative_cutoff_hz: DERIVATIVE_CUTOFF_HZ,
    })
}
