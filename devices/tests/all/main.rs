//! What the drivers promise: the manuals' examples, garbage, start-up and recovery, and the whole serial path.

#![expect(
    clippy::unwrap_used,
    reason = "the helpers of these tests fail as tests do"
)]

mod calibration;
mod cybertouch;
mod delimited;
mod emulators;
mod fivedt;
mod fivedt_session;
mod flock;
mod garbage;
mod glove_examples;
mod glove_session;
mod guided;
mod isotrak;
mod liberty;
mod lucidglove;
mod lucidglove_feedback;
mod lucidglove_garbage;
mod lucidglove_session;
mod lucidglove_wifi;
mod network;
mod opencyberglove;
mod pty;
mod rokoko;
mod source_garbage;
mod support;
mod timing;
mod timing_backlog;
mod tracker_examples;
mod tracker_promises;
mod tracker_session;
mod udcap;
mod vmc;
mod vmc_session;
mod vrpn_examples;
mod vrpn_garbage;
mod vrpn_glove;
mod vrpn_link;
mod vrpn_session;
