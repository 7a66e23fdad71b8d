//! The other end of the line: devices as state machines that speak the exact bytes, and a pseudo-terminal to
//! plug them into. They follow the manuals as cited by open drivers; **no real unit has been compared with them.**

pub mod cyberglove;
pub mod fastrak;
pub mod line_fault;
pub mod lucidglove;
pub mod pty;

mod fastrak_record;
mod glove_command;
mod glove_record;
mod lucidglove_line;

/// A device as a state machine: commands in, bytes out, time as an argument (monotonic ns).
pub trait Emulator {
    /// Takes bytes that the host sent.
    fn push(&mut self, now_ns: u64, bytes: &[u8]);

    /// What the device sends up to `now_ns`.
    fn poll(&mut self, now_ns: u64) -> Vec<u8>;

    /// When [`Emulator::poll`] has something next, ns; `None` while only a command can change that.
    fn deadline(&self) -> Option<u64>;
}
