//! What can go wrong on the line, to be asked of an emulator by a test or by `tsukamud emulate`.

/// Faults to come, each happening once except for the freeze.
#[derive(Debug, Clone, Default)]
pub struct LineFaults {
    drop_bytes: u32,
    cut: bool,
    frozen: bool,
}

impl LineFaults {
    /// A line without faults.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            drop_bytes: 0,
            cut: false,
            frozen: false,
        }
    }

    /// Drops one byte in the middle of each of the next `n_records` records or replies.
    pub fn drop_bytes(&mut self, n_records: u32) {
        self.drop_bytes += n_records;
    }

    /// Stops in the middle of the next record, and says nothing more until [`LineFaults::thaw`].
    pub fn stop_mid_record(&mut self) {
        self.cut = true;
    }

    /// Says and hears nothing until [`LineFaults::thaw`].
    pub fn freeze(&mut self) {
        self.frozen = true;
    }

    /// Ends a freeze.
    pub fn thaw(&mut self) {
        self.frozen = false;
    }

    /// Whether the device neither speaks nor hears.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// What of one record or reply gets onto the line.
    pub(crate) fn apply(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        if self.frozen {
            return Vec::new();
        }
        if self.drop_bytes > 0 && bytes.len() > 2 {
            self.drop_bytes -= 1;
            bytes.remove(bytes.len() / 2);
        }
        if self.cut && bytes.len() > 2 {
            self.cut = false;
            self.frozen = true;
            bytes.truncate(bytes.len() / 2);
        }
        bytes
    }
}

/// Noise on a line: each byte is replaced by another with a fixed probability, the same ones at each run.
#[derive(Debug, Clone)]
pub struct Noise {
    /// A byte is replaced when a random number of 32 bits is below this.
    threshold: u64,
    seed: u64,
}

impl Noise {
    /// Replaces this share of the bytes: 0 is none, 1 is all. What is beyond is taken as the nearer of them, and what
    /// is not a number as 0.
    #[must_use]
    pub fn new(share: f64) -> Self {
        // A float to integer cast saturates and makes 0 of what is not a number.
        let threshold = (share.clamp(0.0, 1.0) * 4_294_967_296.0) as u64;
        Self {
            threshold,
            seed: 0x9E37_79B9_7F4A_7C15,
        }
    }

    /// What becomes of these bytes.
    pub fn spoil(&mut self, bytes: &mut [u8]) {
        if self.threshold == 0 {
            return;
        }
        for byte in bytes {
            // xorshift64* (Vigna 2016).
            self.seed ^= self.seed >> 12;
            self.seed ^= self.seed << 25;
            self.seed ^= self.seed >> 27;
            let random = self.seed.wrapping_mul(0x2545_F491_4F6C_DD1D);
            if random >> 32 < self.threshold {
                // Any change but none.
                *byte ^= (random as u8).max(1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Noise;

    #[test]
    fn noise_changes_its_share_of_the_bytes() {
        for (share, least, greatest) in [
            (0.0, 0, 0),
            (0.01, 800, 1200),
            (1.0, 100_000, 100_000),
            (7.0, 100_000, 100_000),
            (-1.0, 0, 0),
            (f64::NAN, 0, 0),
        ] {
            let mut bytes = vec![0x55; 100_000];
            Noise::new(share).spoil(&mut bytes);
            let n_changed = bytes.iter().filter(|byte| **byte != 0x55).count();
            assert!(
                (least..=greatest).contains(&n_changed),
                "{share}: {n_changed}"
            );
        }
    }
}
