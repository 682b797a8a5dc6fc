//! Decoding of text files.

use super::spanned_toml::SpannedValue;
use crate::case::error::{Diagnostics, ReadResult, SourceLocation, unreadable_file_message};
use crate::limits::{Limit, TEXT_FILE_MIB};
use std::io;

/// Parse a TOML file; `label` is its name in messages.
pub(super) fn parse_toml_file(
    bytes: io::Result<Vec<u8>>,
    label: &str,
    diagnostics: &Diagnostics,
) -> ReadResult<SpannedValue> {
    parse_toml(&decode_text_file(bytes, label, &TEXT_FILE_MIB, diagnostics)?, label, diagnostics)
}

/// Parse the text of a TOML file.
pub(super) fn parse_toml(text: &str, label: &str, diagnostics: &Diagnostics) -> ReadResult<SpannedValue> {
    SpannedValue::parse_document(text, label, diagnostics)
}

/// The text of a table: in Windows-1252, which has the letters of Latin-1, if it is not in UTF-8. A note says so.
pub(super) fn decode_table(
    bytes: io::Result<Vec<u8>>,
    label: &str,
    limit: &Limit,
    diagnostics: &Diagnostics,
) -> ReadResult<String> {
    let is_utf_16 = |bytes: &[u8]| bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    let bytes = bytes.map(|bytes| match str::from_utf8(&bytes) {
        Err(error) if !is_utf_16(&bytes) => {
            let message = format!("read as Windows-1252 (Latin-1): byte {} is not UTF-8", error.valid_up_to());
            diagnostics.record_note(&SourceLocation::without_line(label), message);
            bytes.into_iter().map(windows_1252).collect::<String>().into_bytes()
        }
        _ => bytes,
    });
    decode_text_file(bytes, label, limit, diagnostics)
}

/// A character of Windows-1252, as the WHATWG Encoding Standard has it.
fn windows_1252(byte: u8) -> char {
    const FROM_0X80: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    FROM_0X80.get(usize::from(byte).wrapping_sub(0x80)).copied().unwrap_or(char::from(byte))
}

/// The text of a file in UTF-8, or in UTF-16 with a byte-order mark; the mark is removed. `limit` is in MiB.
pub(super) fn decode_text_file(
    bytes: io::Result<Vec<u8>>,
    label: &str,
    limit: &Limit,
    diagnostics: &Diagnostics,
) -> ReadResult<String> {
    let place = SourceLocation::without_line(label);
    let bytes = bytes.map_err(|error| diagnostics.record(&place, unreadable_file_message(&error)))?;
    limit.check(bytes.len().div_ceil(1 << 20) as f64).map_err(|message| diagnostics.record(&place, message))?;
    let text =
        decode_bytes(bytes).map_err(|message| diagnostics.record(&place, format!("not a text file: {message}")))?;
    // A zero byte is valid UTF-8, but a text file has none.
    if let Some(at) = text.find('\0') {
        return Err(diagnostics.record(&place, format!("not a text file: byte {at} is zero")));
    }
    if text.trim_start().is_empty() {
        return Err(diagnostics.record(&place, "the file is empty"));
    }
    Ok(text)
}

/// Decode bytes, without the byte-order mark.
///
/// # Errors
/// The position of the first invalid byte or character.
fn decode_bytes(bytes: Vec<u8>) -> Result<String, String> {
    let unit: fn([u8; 2]) -> u16 = match bytes.as_slice() {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ => {
            let text = String::from_utf8(bytes);
            let mut text = text
                .map_err(|error| format!("byte {} is not UTF-8: save it as UTF-8", error.utf8_error().valid_up_to()))?;
            if text.starts_with('\u{feff}') {
                text.remove(0);
            }
            return Ok(text);
        }
    };
    if bytes.len() % 2 == 1 {
        return Err(format!("expected an even number of bytes in UTF-16, found {}", bytes.len()));
    }
    let units = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units)
        .enumerate()
        .map(|(at, unit)| unit.map_err(|_| format!("character {at} is an unpaired UTF-16 surrogate")))
        .collect()
}
