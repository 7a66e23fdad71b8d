//! Which checksum a glove sends, found by watching it.
//!
//! No source gives the rule of the byte at the end of a 5DT record, and open drivers ignore it. So records are first
//! believed by what follows them; once one of a few rules has held for several records that differ, it has to hold.

/// Different records in a row for which a rule has to hold before it is believed. By chance one in 256 holds.
const HITS_TO_LEARN: u32 = 8;
/// Records in a row that break a rule before it is given up. More than a line that still works garbles in a row.
const MISSES_TO_UNLEARN: u32 = 64;

/// How the byte may be made of those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The low byte of the sum of all bytes, header included.
    Sum,
    /// The low byte of the sum of the bytes after the header.
    SumOfBody,
    /// The exclusive or of all bytes, header included.
    Xor,
    /// The exclusive or of the bytes after the header.
    XorOfBody,
}

impl Rule {
    const ALL: [Self; 4] = [Self::Sum, Self::SumOfBody, Self::Xor, Self::XorOfBody];

    /// The byte by this rule.
    #[must_use]
    pub fn of(self, header: &[u8], body: &[u8]) -> u8 {
        let sum = |bytes: &[u8]| bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        let xor = |bytes: &[u8]| bytes.iter().fold(0_u8, |sum, byte| sum ^ byte);
        match self {
            Self::Sum => sum(header).wrapping_add(sum(body)),
            Self::SumOfBody => sum(body),
            Self::Xor => xor(header) ^ xor(body),
            Self::XorOfBody => xor(body),
        }
    }
}

/// A record cut in its parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts<'a> {
    /// The bytes by which it is known.
    pub header: &'a [u8],
    /// What it carries.
    pub body: &'a [u8],
    /// The byte that may be a checksum.
    pub check: u8,
}

/// What is known of a glove's checksum so far.
#[derive(Debug, Clone, Default)]
pub struct Checksum {
    known: Option<Rule>,
    hits: [u32; Rule::ALL.len()],
    misses: u32,
    last_body: Vec<u8>,
}

impl Checksum {
    /// Nothing is known yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            known: None,
            hits: [0; Rule::ALL.len()],
            misses: 0,
            last_body: Vec::new(),
        }
    }

    /// The rule, once it is known.
    #[must_use]
    pub const fn rule(&self) -> Option<Rule> {
        self.known
    }

    /// Whether a record keeps the rule; `None` while none is known.
    pub fn holds(&mut self, parts: Parts<'_>) -> Option<bool> {
        let rule = self.known?;
        let holds = rule.of(parts.header, parts.body) == parts.check;
        if holds {
            self.misses = 0;
        } else {
            self.misses += 1;
            if self.misses >= MISSES_TO_UNLEARN {
                *self = Self::default();
            }
        }
        Some(holds)
    }

    /// Takes a record that is believed for another reason.
    pub fn learn(&mut self, parts: Parts<'_>) {
        if parts.body == self.last_body {
            return;
        }
        self.last_body.clear();
        self.last_body.extend_from_slice(parts.body);
        for (rule, hits) in Rule::ALL.into_iter().zip(&mut self.hits) {
            let holds = rule.of(parts.header, parts.body) == parts.check;
            *hits = if holds { *hits + 1 } else { 0 };
            if *hits >= HITS_TO_LEARN {
                self.known = Some(rule);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Checksum, Parts, Rule};

    fn parts(body: &[u8], check: u8) -> Parts<'_> {
        Parts {
            header: &[0x80],
            body,
            check,
        }
    }

    #[test]
    fn each_rule_is_learned_from_records_that_differ() {
        for rule in Rule::ALL {
            let mut checksum = Checksum::default();
            for value in 0..40_u8 {
                assert_eq!(checksum.rule().is_some(), value >= 8, "{rule:?} {value}");
                // Each record comes twice, which tells no more than once.
                for _ in 0..2 {
                    let body = [value, 0x33, 3 * value];
                    checksum.learn(parts(&body, rule.of(&[0x80], &body)));
                }
            }
            assert_eq!(checksum.rule(), Some(rule));
            let right = rule.of(&[0x80], &[1, 2, 3]);
            assert_eq!(checksum.holds(parts(&[1, 2, 3], right)), Some(true));
            assert_eq!(checksum.holds(parts(&[1, 2, 3], right ^ 1)), Some(false));
            for _ in 0..64 {
                checksum.holds(parts(&[1, 2, 3], right ^ 1));
            }
            assert_eq!(checksum.rule(), None, "another glove has come");
        }
    }

    #[test]
    fn a_constant_byte_is_no_checksum() {
        let mut checksum = Checksum::default();
        for value in 0..=255 {
            checksum.learn(parts(&[value, 7], 0));
        }
        assert_eq!(checksum.rule(), None);
    }
}
