//! Runs that come and go.

use std::path::Path;
use std::sync::Arc;

use super::desk::CalibrationDesk;
use super::taps::Taps;
use crate::settings;
use crate::settings::overrides::Overrides;

/// A desk with one glove, which nobody plugs in.
fn desk() -> Arc<CalibrationDesk> {
    let text = "[[device]]\nname = \"glove\"\nkind = \"cyberglove\"\nport = \"/dev/none\"\n";
    let settings =
        settings::parse("test.toml", text, Path::new(""), &Overrides::default()).unwrap();
    let taps = Taps::default();
    taps.add(&settings.devices[0]);
    Arc::new(CalibrationDesk::new(taps))
}

#[tokio::test]
async fn runs_that_are_begun_and_given_up_again_and_again_leave_nothing() {
    let desk = desk();
    for _ in 0..1000 {
        let begun = desk.begin("glove", "alice", None).unwrap();
        desk.cancel(begun.run).unwrap();
        tokio::task::yield_now().await;
    }
    tokio::task::yield_now().await;
    let n_tasks = tokio::runtime::Handle::current()
        .metrics()
        .num_alive_tasks();
    assert!(n_tasks < 10, "{n_tasks} tasks are left");
    assert!(!desk.is_running("glove"));
}
