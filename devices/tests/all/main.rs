//! What the drivers promise: the manuals' examples, garbage, start-up and recovery, and the whole serial path.

#![expect(
    clippy::unwrap_used,
    reason = "the helpers of these tests fail as tests do"
)]

mod calibration;
mod emulators;
mod garbage;
mod glove_examples;
mod guided;
mod glove_session;
mod lucidglove;
mod lucidglove_feedback;
mod lucidglove_garbage;
mod lucidglove_session;
mod pty;
mod support;
mod timing;
mod tracker_examples;
mod tracker_session;
mod vrpn_examples;
mod vrpn_garbage;
mod vrpn_session;
