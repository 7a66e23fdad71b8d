//! A serial port on a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use crate::clock::Clock;
use crate::port::{PortEvent, PortSettings, run_port};
use crate::session::Session;

/// A port's thread; it ends when this is stopped or dropped.
#[derive(Debug)]
pub struct PortThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PortThread {
    /// Starts a thread that runs [`run_port`].
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn spawn<S, F>(
        settings: PortSettings,
        session: S,
        clock: Clock,
        deliver: F,
    ) -> std::io::Result<Self>
    where
        S: Session + Send + 'static,
        F: FnMut(PortEvent<'_>) + Send + 'static,
    {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::Builder::new()
            .name("serial port".to_owned())
            .spawn(move || {
                let (mut session, mut deliver) = (session, deliver);
                run_port(&settings, &mut session, &stopped, clock, &mut deliver);
            })?;
        Ok(Self {
            stop,
            thread: Some(thread),
        })
    }

    /// Makes the device quiet, closes the port and waits for the thread; within about 0.3 s.
    pub fn stop(mut self) {
        self.end();
    }

    fn end(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic in the caller's own `deliver` has been reported by the thread already.
            let _ = thread.join();
        }
    }
}

impl Drop for PortThread {
    fn drop(&mut self) {
        self.end();
    }
}
