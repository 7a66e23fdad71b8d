//! Finds the answer to one question among whatever else arrives.

use crate::glove::cyberglove::protocol::{ERROR, ERROR_CODES, TERMINATOR};

/// What the buffer holds of an awaited answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Reply {
    /// The answer's data; the first `n_bytes` of the buffer are done with.
    Data { data: Vec<u8>, n_bytes: usize },
    /// The device refused with this code; the first `n_bytes` of the buffer are done with.
    Refused { code: u8, n_bytes: usize },
    /// Nothing yet; the first `n_bytes` of the buffer can be no part of an answer.
    Missing { n_bytes: usize },
}

/// Looks for `echo`, `n_data` bytes and NUL. The length decides, not the first NUL: data contain NUL.
pub(super) fn find_reply(bytes: &[u8], echo: &[u8], n_data: usize) -> Reply {
    for start in 0..bytes.len() {
        let rest = &bytes[start..];
        let shown = rest.len().min(echo.len());
        if rest[..shown] == echo[..shown] {
            let end = echo.len() + n_data;
            match rest.get(end) {
                None => return Reply::Missing { n_bytes: start },
                Some(&TERMINATOR) => {
                    return Reply::Data {
                        data: rest[echo.len()..end].to_vec(),
                        n_bytes: start + end + 1,
                    };
                }
                Some(_) => {}
            }
        }
        match rest {
            [ERROR, code, TERMINATOR, ..] if ERROR_CODES.contains(code) => {
                return Reply::Refused {
                    code: *code,
                    n_bytes: start + 3,
                };
            }
            [ERROR] => return Reply::Missing { n_bytes: start },
            [ERROR, code] if ERROR_CODES.contains(code) => {
                return Reply::Missing { n_bytes: start };
            }
            _ => {}
        }
    }
    Reply::Missing {
        n_bytes: bytes.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Reply, find_reply};

    #[test]
    fn answers_are_cut_by_length() {
        let data = |data: &[u8], n_bytes| Reply::Data {
            data: data.to_vec(),
            n_bytes,
        };
        let cases: [(&[u8], &[u8], usize, Reply); 9] = [
            // The worked queries C6.
            (b"?G\x03\0", b"?G", 1, data(&[3], 4)),
            (b"?S\x16\0", b"?S", 1, data(&[22], 4)),
            (b"?K\x3F\xBB\x7B\0", b"?K", 3, data(&[0x3F, 0xBB, 0x7B], 6)),
            (b"?T\x04\x80\0\x01\0", b"?T", 4, data(&[4, 0x80, 0, 1], 7)),
            (b"?B\0\0", b"?B", 1, data(&[0], 4)),
            (b"T\0", b"T", 0, data(&[], 2)),
            // Stale bytes before, an incomplete answer, a refusal.
            (b"\x12\x34\0?G\x03\0S", b"?G", 1, data(&[3], 7)),
            (b"\x12?G\x03", b"?G", 1, Reply::Missing { n_bytes: 1 }),
            (
                b"\x03\0e?\0",
                b"U",
                0,
                Reply::Refused {
                    code: b'?',
                    n_bytes: 5,
                },
            ),
        ];
        for (bytes, echo, n_data, expected) in cases {
            assert_eq!(find_reply(bytes, echo, n_data), expected, "{bytes:02X?}");
        }
    }
}
