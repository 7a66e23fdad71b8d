//! What can go wrong on the line, to be asked of an emulator by a test.

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
