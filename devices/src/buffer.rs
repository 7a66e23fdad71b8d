//! Bytes not yet decoded, each with the time at which it was read.

use std::collections::VecDeque;

/// More than any record or reply, with room for one large read.
pub(crate) const CAPACITY: usize = 2048;

/// Bounded: when it is full the oldest bytes go, so a device that never makes sense cannot make it grow.
#[derive(Debug, Default)]
pub(crate) struct StampedBuffer {
    bytes: Vec<u8>,
    /// Bytes at the front of `bytes` that are already consumed.
    start: usize,
    /// Position in the whole stream of `bytes[start]`.
    position: u64,
    /// End of each push in the whole stream, with its stamp.
    marks: VecDeque<(u64, u64)>,
}

impl StampedBuffer {
    pub(crate) fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.bytes.drain(..self.start);
        self.start = 0;
        let kept = &bytes[bytes.len().saturating_sub(CAPACITY)..];
        let overflow = (self.bytes.len() + kept.len()).saturating_sub(CAPACITY);
        self.consume(overflow);
        self.bytes.extend_from_slice(kept);
        let end = self.position + self.as_slice().len() as u64;
        self.marks.push_back((end, stamp_ns));
    }

    pub(crate) fn as_slice(&self) -> &[u8] {
        &self.bytes[self.start..]
    }

    pub(crate) fn consume(&mut self, n_bytes: usize) {
        let n_bytes = n_bytes.min(self.bytes.len() - self.start);
        self.start += n_bytes;
        self.position += n_bytes as u64;
        while self
            .marks
            .front()
            .is_some_and(|(end, _)| *end <= self.position)
        {
            self.marks.pop_front();
        }
    }

    pub(crate) fn clear(&mut self) {
        self.consume(self.bytes.len() - self.start);
    }

    /// When the byte at `index` was read, ns; 0 if there is no such byte.
    pub(crate) fn stamp_ns(&self, index: usize) -> u64 {
        let position = self.position + index as u64;
        self.marks
            .iter()
            .find(|(end, _)| *end > position)
            .map_or(0, |(_, stamp_ns)| *stamp_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::{CAPACITY, StampedBuffer};

    #[test]
    fn each_byte_keeps_the_stamp_of_its_push() {
        let mut buffer = StampedBuffer::default();
        buffer.push(10, b"ab");
        buffer.push(20, b"cd");
        assert_eq!(buffer.stamp_ns(1), 10);
        assert_eq!(buffer.stamp_ns(2), 20);
        buffer.consume(2);
        assert_eq!(buffer.as_slice(), b"cd");
        assert_eq!(buffer.stamp_ns(0), 20);
        buffer.push(30, b"e");
        buffer.consume(1);
        assert_eq!(buffer.stamp_ns(0), 20);
        assert_eq!(buffer.stamp_ns(1), 30);
    }

    #[test]
    fn the_oldest_bytes_go_when_it_is_full() {
        let mut buffer = StampedBuffer::default();
        for round in 0..100 {
            buffer.push(round, &[round as u8; 300]);
            assert!(buffer.as_slice().len() <= CAPACITY);
        }
        assert_eq!(buffer.as_slice().last(), Some(&99));
        assert_eq!(buffer.stamp_ns(CAPACITY - 1), 99);
        buffer.push(100, &[7; 3 * CAPACITY]);
        assert_eq!(buffer.as_slice(), [7; CAPACITY]);
        assert_eq!(buffer.stamp_ns(0), 100);
    }
}
