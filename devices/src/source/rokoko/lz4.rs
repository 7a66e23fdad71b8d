//! LZ4 decompression of one datagram: the frame format, version 1, and bare blocks. Checksums are not compared: UDP and
//! the JSON inside have their own ways to fail.

/// What a frame begins with.
const MAGIC: [u8; 4] = [0x04, 0x22, 0x4D, 0x18];
/// Most that a datagram may become; a frame of one actor with a face has about 30 kB.
const MAX_OUTPUT: usize = 1 << 20;
/// Least length of a match.
const MIN_MATCH: usize = 4;

/// Whether the bytes begin as a frame does.
pub(crate) fn is_frame(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// What a frame holds; `None` when it is broken, incomplete, too large or needs a dictionary.
pub(crate) fn frame(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut rest = bytes.strip_prefix(&MAGIC)?;
    let flags = *take(&mut rest, 2)?.first()?;
    let has = |bit: u8| flags & (1 << bit) != 0;
    let (version, block_checksums, has_size, has_dictionary) = (flags >> 6, has(4), has(3), has(0));
    if version != 1 || has_dictionary {
        return None;
    }
    // The size, and the header's own checksum.
    take(&mut rest, if has_size { 8 + 1 } else { 1 })?;
    let mut output = Vec::new();
    loop {
        let size = u32::from_le_bytes(take(&mut rest, 4)?.try_into().ok()?);
        if size == 0 {
            return Some(output);
        }
        let is_plain = size & (1 << 31) != 0;
        let content = take(&mut rest, (size & !(1 << 31)) as usize)?;
        if is_plain {
            push(&mut output, content)?;
        } else {
            // Blocks may refer to those before them, whether the frame says so or not.
            block_onto(content, &mut output)?;
        }
        if block_checksums {
            take(&mut rest, 4)?;
        }
    }
}

/// What a bare block holds.
pub(crate) fn block(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut output = Vec::new();
    block_onto(bytes, &mut output)?;
    Some(output)
}

fn block_onto(mut rest: &[u8], output: &mut Vec<u8>) -> Option<()> {
    loop {
        let token = *take(&mut rest, 1)?.first()?;
        let n_literals = length(token >> 4, &mut rest)?;
        push(output, take(&mut rest, n_literals)?)?;
        if rest.is_empty() {
            // The last sequence has no match.
            return Some(());
        }
        let offset = u16::from_le_bytes(take(&mut rest, 2)?.try_into().ok()?);
        let n_match = length(token & 0x0F, &mut rest)?.checked_add(MIN_MATCH)?;
        let start = output.len().checked_sub(offset.into())?;
        if offset == 0 || n_match > MAX_OUTPUT - output.len() {
            return None;
        }
        for index in start..start + n_match {
            // It may overlap what it makes.
            output.push(output[index]);
        }
    }
}

/// A length of four bits, continued in further bytes when they are all set.
fn length(first: u8, rest: &mut &[u8]) -> Option<usize> {
    let mut length = usize::from(first);
    if first == 15 {
        loop {
            let more = *take(rest, 1)?.first()?;
            length += usize::from(more);
            if more != 255 {
                break;
            }
        }
    }
    Some(length)
}

fn push(output: &mut Vec<u8>, bytes: &[u8]) -> Option<()> {
    (bytes.len() <= MAX_OUTPUT - output.len()).then(|| output.extend_from_slice(bytes))
}

fn take<'a>(bytes: &mut &'a [u8], n_bytes: usize) -> Option<&'a [u8]> {
    let (taken, rest) = bytes.split_at_checked(n_bytes)?;
    *bytes = rest;
    Some(taken)
}
