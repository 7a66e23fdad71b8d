//! Numbers on lines that keep bit 7 of a byte for the beginning of a record: Isotrak, Flock of Birds, and the packed
//! items of old Fastraks.

/// Bit 7, set on the first byte of a record (or of its data) and nowhere else.
pub const PHASE: u8 = 0x80;
/// Bytes that share one byte of top bits in [`pack_sevens`].
const GROUP: usize = 7;

/// The number of two bytes with 7 bits each, low part first. Its two lowest bits are always 0; bit 7 of both is ignored.
#[must_use]
pub const fn number_from_pair(low: u8, high: u8) -> i16 {
    let bits = ((low & 0x7F) as u16) << 2 | ((high & 0x7F) as u16) << 9;
    bits.cast_signed()
}

/// The two bytes of a number, of which the two lowest bits are lost.
#[must_use]
pub const fn pair_from_number(number: i16) -> [u8; 2] {
    let bits = number.cast_unsigned();
    [((bits >> 2) & 0x7F) as u8, ((bits >> 9) & 0x7F) as u8]
}

/// Length on the line of so many bytes packed by [`pack_sevens`].
#[must_use]
pub const fn packed_length(n_bytes: usize) -> usize {
    n_bytes + n_bytes.div_ceil(GROUP)
}

/// Whether bytes begin with a phase byte and hold no other.
#[must_use]
pub fn is_one_phase(bytes: &[u8]) -> bool {
    bytes
        .iter()
        .enumerate()
        .all(|(index, byte)| (byte & PHASE != 0) == (index == 0))
}

/// Bytes for the line: up to seven without their top bits, then a byte of these bits (bit 0 is the first byte's), and
/// so on; the very first byte carries [`PHASE`].
#[must_use]
pub fn pack_sevens(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(packed_length(bytes.len()));
    for group in bytes.chunks(GROUP) {
        packed.extend(group.iter().map(|byte| byte & 0x7F));
        let tops = group
            .iter()
            .rev()
            .fold(0, |tops, byte| tops << 1 | byte >> 7);
        packed.push(tops);
    }
    if let Some(first) = packed.first_mut() {
        *first |= PHASE;
    }
    packed
}

/// The inverse of [`pack_sevens`]; `None` when the length, the phase or a spare bit is wrong.
#[must_use]
pub fn unpack_sevens<const N: usize>(packed: &[u8]) -> Option<[u8; N]> {
    if packed.len() != packed_length(N) || !is_one_phase(packed) {
        return None;
    }
    let mut bytes = [0; N];
    for (group, wire) in bytes.chunks_mut(GROUP).zip(packed.chunks(GROUP + 1)) {
        let (&tops, lows) = wire.split_last()?;
        if u16::from(tops) >> group.len() != 0 {
            return None;
        }
        for (index, (byte, low)) in group.iter_mut().zip(lows).enumerate() {
            *byte = (low & 0x7F) | ((tops >> index) & 1) << 7;
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::{
        PHASE, number_from_pair, pack_sevens, packed_length, pair_from_number, unpack_sevens,
    };

    #[test]
    fn pairs_keep_fourteen_bits() {
        assert_eq!(number_from_pair(0x80, 0x40), -32768);
        assert_eq!(number_from_pair(0xFF, 0x3F), 32764);
        for number in [-32768, -5464, -4, 0, 4, 3640, 32764] {
            let [low, high] = pair_from_number(number);
            assert_eq!(number_from_pair(low, high), number);
            assert_eq!((low | high) & PHASE, 0);
        }
    }

    #[test]
    fn sevens_come_back() {
        let bytes: [u8; 17] = std::array::from_fn(|index| (index * 37 + 90) as u8);
        let packed = pack_sevens(&bytes);
        assert_eq!(packed.len(), packed_length(17));
        assert_eq!(unpack_sevens(&packed), Some(bytes));
        for (index, bit) in [(0, 0x80), (5, 0x80), (7, 0x80), (19, 0x08)] {
            let mut bad = packed.clone();
            bad[index] ^= bit;
            assert_eq!(unpack_sevens::<17>(&bad), None, "{index}");
        }
        assert_eq!(unpack_sevens::<17>(&packed[..19]), None);
    }
}
