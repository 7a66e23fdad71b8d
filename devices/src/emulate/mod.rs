//! The other end of the line: devices as state machines that speak the exact bytes, and a pseudo-terminal to
//! plug them into. They follow the manuals as cited by open drivers; **no real unit has been compared with them.**

pub mod cyberglove;
pub mod delimited;
pub mod fastrak;
pub mod fivedt;
pub mod flock;
pub mod isotrak;
pub mod liberty;
pub mod line_fault;
pub mod lucidglove;
pub mod opencyberglove;
pub mod pty;
pub mod source;
pub mod udp;

mod beat;
mod deaf;
mod fastrak_record;
mod flock_record;
mod glove_command;
mod glove_record;
mod liberty_frame;
mod lucidglove_line;
mod polhemus_command;
mod receiver;
mod rokoko;
mod udcap;
mod vmc;

/// A device as a state machine: commands in, bytes out, time as an argument (monotonic ns).
pub trait Emulator {
    /// Takes bytes that the host sent.
    fn push(&mut self, now_ns: u64, bytes: &[u8]);

    /// What the device sends up to `now_ns`.
    fn poll(&mut self, now_ns: u64) -> Vec<u8>;

    /// When [`Emulator::poll`] has something next, ns; `None` while only a command can change that.
    fn deadline(&self) -> Option<u64>;
}

/// The deadline of a device: at once while `output` waits, otherwise the first of `times`, ns.
fn soonest_ns(output: &[u8], times: [Option<u64>; 2]) -> Option<u64> {
    if output.is_empty() {
        times.into_iter().flatten().min()
    } else {
        Some(0)
    }
}
