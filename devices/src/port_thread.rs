//! A serial port on a thread of its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::clock::Clock;
use crate::feedback::Feedback;
use crate::glove::calibrate::GloveCalibration;
use crate::port::{PortEvent, PortSettings, run_port};
use crate::session::Session;

/// What waits to be told to a session from outside; of each kind the newest stands.
#[derive(Debug, Default)]
struct Waiting {
    feedback: Option<Feedback>,
    calibration: Option<GloveCalibration>,
}

/// Tells a session on its own thread something; cheap to clone, never waits.
#[derive(Debug, Clone, Default)]
pub struct SessionHandle(Arc<Mutex<Waiting>>);

impl SessionHandle {
    /// See [`Session::set_feedback`]; it acts within the time in which the device next sends something, 50 ms at most.
    pub fn set_feedback(&self, feedback: Feedback) {
        self.change(|waiting| waiting.feedback = Some(feedback));
    }

    /// See [`Session::set_calibration`].
    pub fn set_calibration(&self, calibration: GloveCalibration) {
        self.change(|waiting| waiting.calibration = Some(calibration));
    }

    /// Hands over what waits; called by the thread that owns the session.
    pub(crate) fn tell(&self, now_ns: u64, session: &mut dyn Session) {
        let waiting = self.change(std::mem::take);
        if let Some(calibration) = waiting.calibration {
            session.set_calibration(calibration);
        }
        if let Some(feedback) = waiting.feedback {
            session.set_feedback(now_ns, feedback);
        }
    }

    /// A panic elsewhere leaves two whole values.
    fn change<T>(&self, change: impl FnOnce(&mut Waiting) -> T) -> T {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A port's thread; it ends when this is stopped or dropped.
#[derive(Debug)]
pub struct PortThread {
    stop: Arc<AtomicBool>,
    session: SessionHandle,
    thread: Option<JoinHandle<()>>,
}

impl PortThread {
    /// Starts a thread that runs [`run_port`].
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn spawn<F>(
        settings: PortSettings,
        session: Box<dyn Session + Send>,
        clock: Clock,
        deliver: F,
    ) -> std::io::Result<Self>
    where
        F: FnMut(PortEvent<'_>) + Send + 'static,
    {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let handle = SessionHandle::default();
        let outside = handle.clone();
        let thread = std::thread::Builder::new()
            .name("serial port".to_owned())
            .spawn(move || {
                let (mut session, mut deliver) = (session, deliver);
                run_port(
                    &settings,
                    session.as_mut(),
                    &outside,
                    &stopped,
                    clock,
                    &mut deliver,
                );
            })?;
        Ok(Self {
            stop,
            session: handle,
            thread: Some(thread),
        })
    }

    /// To tell the session something.
    #[must_use]
    pub fn session(&self) -> SessionHandle {
        self.session.clone()
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
