//! Numbers by chance, and what becomes of a transcript by them.

/// Longest piece that is pushed at once, bytes.
const PIECE_MAX: usize = 4096;

/// splitmix64 (Steele, Lea and Flood 2014): the same numbers for the same seed, everywhere.
#[derive(Clone, Debug)]
pub(crate) struct Chance(u64);

impl Chance {
    /// The numbers of one case of one subject.
    pub(crate) fn new(seed: u64, subject: &str, case: u64) -> Self {
        // FNV-1a keeps subjects apart.
        let name = subject
            .bytes()
            .fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
            });
        let mut chance =
            Self(seed ^ name.rotate_left(17) ^ case.wrapping_mul(0xD134_2543_DE82_EF95));
        chance.next();
        chance
    }

    pub(crate) const fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// From 0 to one below `n`; 0 for none.
    pub(crate) const fn below(&mut self, n: usize) -> usize {
        let number = self.next();
        if n == 0 {
            0
        } else {
            (number % n as u64) as usize
        }
    }

    /// True once in `n` times.
    pub(crate) const fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    pub(crate) fn bytes(&mut self, n_bytes: usize) -> Vec<u8> {
        (0..n_bytes).map(|_| self.next() as u8).collect()
    }

    pub(crate) fn pick<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        of.get(self.below(of.len()))
    }
}

/// What was said in good conversations: by the device itself, and by those of other kinds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transcripts<'a> {
    pub(crate) own: &'a [Vec<u8>],
    pub(crate) others: &'a [&'a [Vec<u8>]],
}

/// Texts that readers of numbers have fallen over.
const NUMBERS: [&str; 12] = [
    "99999999999999999999",
    "-1",
    "nan",
    "inf",
    "1e999",
    "-",
    "+",
    ".",
    "0x1F",
    "65536",
    "4294967296",
    "\u{b2}",
];

/// A piece of garbage, often nearly good.
pub(crate) fn piece(chance: &mut Chance, from: Transcripts<'_>) -> Vec<u8> {
    let nothing = Vec::new();
    let own = chance.pick(from.own).unwrap_or(&nothing).clone();
    let other = chance.pick(from.own).unwrap_or(&nothing).clone();
    let mut piece = match chance.below(12) {
        0 => {
            let n_bytes = if chance.one_in(16) { PIECE_MAX } else { 64 };
            let n_bytes = chance.below(n_bytes + 1);
            chance.bytes(n_bytes)
        }
        1 => flipped(chance, own),
        2 => without_some(chance, own),
        3 => [own.clone(), own].concat(),
        4 => spliced(chance, &own, &other),
        5 => part(chance, &own),
        6 => {
            let stranger = chance.pick(from.others).copied().unwrap_or_default();
            let chunk = chance.pick(stranger).unwrap_or(&nothing).clone();
            if chance.one_in(2) {
                part(chance, &chunk)
            } else {
                chunk
            }
        }
        7 => {
            let n_bytes = 1 + chance.below(4);
            let pattern = chance.bytes(n_bytes);
            pattern.repeat(1 + chance.below(300))
        }
        8 => {
            let n_bytes = chance.below(16);
            let junk = chance.bytes(n_bytes);
            let at = chance.below(own.len() + 1);
            [&own[..at], &junk, &own[at..]].concat()
        }
        9 => {
            let begin = chance.below(from.own.len());
            let end = (begin + 1 + chance.below(40)).min(from.own.len());
            from.own.get(begin..end).unwrap_or_default().concat()
        }
        10 => renumbered(chance, &own),
        _ => own,
    };
    if chance.one_in(4) {
        piece = flipped(chance, piece);
    }
    piece.truncate(PIECE_MAX);
    piece
}

fn flipped(chance: &mut Chance, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..=chance.below(4) {
        let at = chance.below(bytes.len());
        let bit = chance.below(8);
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= 1 << bit;
        }
    }
    bytes
}

fn without_some(chance: &mut Chance, mut bytes: Vec<u8>) -> Vec<u8> {
    let begin = chance.below(bytes.len() + 1);
    let end = (begin + 1 + chance.below(8)).min(bytes.len());
    bytes.drain(begin.min(end)..end);
    bytes
}

fn spliced(chance: &mut Chance, first: &[u8], second: &[u8]) -> Vec<u8> {
    let head = chance.below(first.len() + 1);
    let tail = chance.below(second.len() + 1);
    [&first[..head], &second[tail..]].concat()
}

fn part(chance: &mut Chance, bytes: &[u8]) -> Vec<u8> {
    let begin = if chance.one_in(2) {
        0
    } else {
        chance.below(bytes.len() + 1)
    };
    let end = begin + chance.below(bytes.len() - begin + 1);
    bytes[begin..end].to_vec()
}

/// One run of digits becomes another text.
fn renumbered(chance: &mut Chance, bytes: &[u8]) -> Vec<u8> {
    let digits: Vec<usize> = (0..bytes.len())
        .filter(|at| bytes[*at].is_ascii_digit())
        .collect();
    let Some(begin) = chance.pick(&digits).copied() else {
        return bytes.to_vec();
    };
    let n_digits = bytes[begin..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    let text = NUMBERS[chance.below(NUMBERS.len())];
    [&bytes[..begin], text.as_bytes(), &bytes[begin + n_digits..]].concat()
}
