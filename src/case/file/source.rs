//! The text of a file's bytes, or why they are none.

use super::files::LARGEST_BYTES;
use super::written::Node;
use crate::case::error::{Faults, Place, Read, unreadable};
use std::io;

/// The document of a TOML file, which messages call `label`.
pub(super) fn document(bytes: io::Result<Vec<u8>>, label: &str, faults: &Faults) -> Read<Node> {
    Node::document(&text(bytes, label, faults)?, label, faults)
}

/// The text of a file, without a byte-order mark: UTF-8, or UTF-16 where the mark says so.
pub(super) fn text(bytes: io::Result<Vec<u8>>, label: &str, faults: &Faults) -> Read<String> {
    let place = Place::whole(label);
    let bytes = bytes.map_err(|error| faults.record(&place, unreadable(&error)))?;
    if bytes.len() as u64 > LARGEST_BYTES {
        return Err(faults.record(&place, format!("too large: more than {} MiB", LARGEST_BYTES >> 20)));
    }
    let text = decoded(bytes).map_err(|message| faults.record(&place, format!("not a text file: {message}")))?;
    // A zero byte is valid UTF-8 and never text.
    if let Some(at) = text.find('\0') {
        return Err(faults.record(&place, format!("not a text file: byte {at} is zero")));
    }
    if text.trim_start().is_empty() {
        return Err(faults.record(&place, "the file is empty"));
    }
    Ok(text)
}

/// The text of bytes, without a byte-order mark.
///
/// # Errors
/// Which byte is not of the encoding.
fn decoded(bytes: Vec<u8>) -> Result<String, String> {
    let unit: fn([u8; 2]) -> u16 = match bytes.as_slice() {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ => {
            let text = String::from_utf8(bytes);
            let mut text = text.map_err(|error| format!("byte {} is not UTF-8", error.utf8_error().valid_up_to()))?;
            if text.starts_with('\u{feff}') {
                text.remove(0);
            }
            return Ok(text);
        }
    };
    if bytes.len() % 2 == 1 {
        return Err(format!("its mark says UTF-16, and {} bytes are an odd number", bytes.len()));
    }
    let units = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units)
        .enumerate()
        .map(|(at, unit)| unit.map_err(|_| format!("character {at} is half a pair of UTF-16")))
        .collect()
}
