//! A serial port on a thread of its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};
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
        self.change(|waiting| waiting.feedback = Some(feedback.after(waiting.feedback)));
    }

    /// The same for a caller that must not wait, not even for another thread's few instructions: false when it was not
    /// told, and has to be told again.
    #[must_use]
    pub fn try_set_feedback(&self, feedback: Feedback) -> bool {
        let mut waiting = match self.0.try_lock() {
            Ok(waiting) => waiting,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return false,
        };
        waiting.feedback = Some(feedback.after(waiting.feedback));
        true
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
        Self::start("serial port", move |outside, stop| {
            let (mut session, mut deliver) = (session, deliver);
            run_port(
                &settings,
                session.as_mut(),
                outside,
                stop,
                clock,
                &mut deliver,
            );
        })
    }

    /// Starts a thread that serves a session until it is told to stop.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub(crate) fn start<R>(name: &str, run: R) -> std::io::Result<Self>
    where
        R: FnOnce(&SessionHandle, &AtomicBool) + Send + 'static,
    {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let handle = SessionHandle::default();
        let outside = handle.clone();
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || run(&outside, &stopped))?;
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

    /// The same for many, which end side by side.
    pub fn stop_all(threads: Vec<Self>) {
        threads
            .iter()
            .for_each(|thread| thread.stop.store(true, Ordering::Release));
        threads.into_iter().for_each(Self::stop);
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

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn many_threads_end_side_by_side() {
        const LAST_WORDS: Duration = Duration::from_millis(200);
        let thread = |_| {
            PortThread::start("test", |_, stop| {
                while !stop.load(Ordering::Acquire) {
                    std::thread::park_timeout(Duration::from_millis(5));
                }
                let end = Instant::now() + LAST_WORDS;
                while Instant::now() < end {
                    std::thread::park_timeout(end.saturating_duration_since(Instant::now()));
                }
            })
        };
        let threads: Vec<PortThread> = (0..32).map(|n| thread(n).unwrap()).collect();
        let start = Instant::now();
        PortThread::stop_all(threads);
        assert!(
            start.elapsed() < 16 * LAST_WORDS,
            "one after the other takes twice as long: {:?}",
            start.elapsed()
        );
    }
}
