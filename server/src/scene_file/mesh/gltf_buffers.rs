//! Where a glTF keeps its numbers: in itself, in a data URI, or in a file beside it.

use std::path::{Component, Path};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::Document;
use gltf::buffer::Source;

use super::fault::MeshProblem;
use super::read_bounded;

/// The bytes of every buffer, in order.
pub(super) fn buffers(
    document: &Document,
    blob: Option<&[u8]>,
    folder: &Path,
) -> Result<Vec<Vec<u8>>, MeshProblem> {
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let place = format!("buffer {}", buffer.index());
        let bytes = match buffer.source() {
            Source::Bin => blob
                .map(<[u8]>::to_vec)
                .ok_or_else(|| MeshProblem::syntax(&place, "the file has no binary part"))?,
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => decode(data)
                    .ok_or_else(|| MeshProblem::syntax(&place, "its data URI is not base64"))?,
                None => beside(uri, folder, &place)?,
            },
        };
        if bytes.len() < buffer.length() {
            let fault = format!(
                "it has {} bytes and should have {}",
                bytes.len(),
                buffer.length()
            );
            return Err(MeshProblem::syntax(place, fault));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

fn decode(data: &str) -> Option<Vec<u8>> {
    STANDARD.decode(data.split_once(";base64,")?.1).ok()
}

/// A file in the glTF's own folder or below it; a mesh has no business elsewhere.
fn beside(uri: &str, folder: &Path, place: &str) -> Result<Vec<u8>, MeshProblem> {
    let name = percent_decoded(uri);
    let is_below = Path::new(&name)
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !is_below || name.contains("://") {
        return Err(MeshProblem::syntax(
            place,
            format!("{name:?} is not a file in the mesh's folder"),
        ));
    }
    read_bounded(&folder.join(&name))
        .map_err(|problem| MeshProblem::syntax(place, format!("{name}: {problem}")))
}

/// `%20` and the like as the bytes they stand for; anything else as it is.
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let [first, others @ ..] = rest {
        let code = others
            .get(..2)
            .and_then(|digits| std::str::from_utf8(digits).ok());
        match code
            .and_then(|digits| u8::from_str_radix(digits, 16).ok())
            .filter(|_| *first == b'%')
        {
            Some(byte) => {
                bytes.push(byte);
                rest = &others[2..];
            }
            None => {
                bytes.push(*first);
                rest = others;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
