//! What subscribers count, and how a window of time is measured.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use crate::process::Server;
use crate::{MEASURING, Outcome, RATE_HZ, SETTLING};

/// What all subscribers of a load have got.
#[derive(Debug, Default)]
pub(crate) struct Count {
    frames: AtomicU64,
    bytes: AtomicU64,
    /// Subscribers that have had a frame.
    joined: AtomicU64,
}

impl Count {
    /// One frame of so many bytes.
    pub(crate) fn add(&self, n_bytes: usize) {
        self.frames.fetch_add(1, Ordering::Relaxed);
        self.bytes.fetch_add(n_bytes as u64, Ordering::Relaxed);
    }

    /// One subscriber's first frame.
    pub(crate) fn join(&self) {
        self.joined.fetch_add(1, Ordering::Relaxed);
    }

    fn now(&self) -> (u64, u64) {
        (
            self.frames.load(Ordering::Relaxed),
            self.bytes.load(Ordering::Relaxed),
        )
    }

    /// Lets all settle, then measures. Frames that should have come are those of the nominal rate.
    pub(crate) async fn measure(
        &self,
        server: &Server,
        n_subscribers: usize,
    ) -> anyhow::Result<Outcome> {
        tokio::time::sleep(SETTLING).await;
        let joined = self.joined.load(Ordering::Relaxed);
        anyhow::ensure!(
            joined == n_subscribers as u64,
            "only {joined} of {n_subscribers} subscribers have joined"
        );
        let (start, cpu, before) = (Instant::now(), server.cpu_s()?, self.now());
        tokio::time::sleep(MEASURING).await;
        let (time_s, cpu_s, after) = (
            start.elapsed().as_secs_f64(),
            server.cpu_s()? - cpu,
            self.now(),
        );
        let (frames, bytes) = ((after.0 - before.0) as f64, (after.1 - before.1) as f64);
        Ok(Outcome {
            frames_per_cpu_s: frames / cpu_s,
            cpu_share: cpu_s / time_s,
            delivered: frames / (n_subscribers as f64 * RATE_HZ * time_s),
            message_bytes: bytes / frames,
        })
    }
}
