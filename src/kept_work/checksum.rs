//! Checksums of files: XXH3 of 128 bits. They detect damage, not tampering.

use serde::Serialize;
use std::io::{self, BufWriter, Cursor, Seek, SeekFrom, Write};
use twox_hash::xxhash3_128::Hasher;

/// A checksum of bytes that are added piece by piece.
#[derive(Clone, Default)]
pub(crate) struct Checksum(Hasher);

impl Checksum {
    pub(crate) fn of(bytes: &[u8]) -> String {
        let mut checksum = Self::default();
        checksum.add(bytes);
        checksum.to_hex()
    }

    pub(crate) fn add(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
    }

    /// As 32 hexadecimal digits.
    pub(crate) fn to_hex(&self) -> String {
        format!("{:032x}", self.0.finish_128())
    }
}

impl Write for Checksum {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.add(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The parts of a file around the checksum and the content.
const CHECKSUM: &str = "{\"checksum\":\"";
const CONTENT: &str = "\",\"content\":";
const END: &str = "}\n";

/// Adds what it writes to a checksum.
struct Summing<W> {
    writer: W,
    checksum: Checksum,
}

impl<W: Write> Write for Summing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.writer.write(bytes)?;
        self.checksum.add(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Write a JSON object of the checksum of a content, and the content. The checksum goes to its place afterwards, so
/// that the text is not in memory.
///
/// # Errors
/// When it cannot be written.
pub(crate) fn write_sealed(file: impl Write + Seek, content: &impl Serialize) -> io::Result<()> {
    let mut writer = BufWriter::new(file);
    write!(writer, "{CHECKSUM}{:032}{CONTENT}", 0)?;
    let mut summing = Summing { writer: &mut writer, checksum: Checksum::default() };
    serde_json::to_writer(&mut summing, content)?;
    let checksum = summing.checksum.to_hex();
    writer.write_all(END.as_bytes())?;
    writer.seek(SeekFrom::Start(CHECKSUM.len() as u64))?;
    writer.write_all(checksum.as_bytes())?;
    writer.flush()
}

/// The text of [`write_sealed`].
pub(crate) fn sealed(content: &impl Serialize) -> String {
    let mut text = Vec::new();
    write_sealed(Cursor::new(&mut text), content).expect("numbers, texts and maps of whole numbers can be written");
    String::from_utf8(text).expect("JSON is UTF-8")
}

/// The content of a [sealed] text.
///
/// # Errors
/// When the text has another form, or its content another checksum.
pub(crate) fn unsealed(text: &str) -> Result<&str, String> {
    let inner = text.strip_prefix(CHECKSUM).and_then(|text| text.strip_suffix(END)?.split_once(CONTENT));
    let (checksum, content) =
        inner.ok_or_else(|| format!("expected {CHECKSUM:?} at its start and {END:?} at its end"))?;
    let found = Checksum::of(content.as_bytes());
    if found == checksum {
        return Ok(content);
    }
    Err(format!("damaged: the checksum of its content is {found}, expected {checksum}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_content_or_checksum_is_noticed() {
        let text = sealed(&[12, 3]);
        assert_eq!(unsealed(&text), Ok("[12,3]"));
        assert!(unsealed(&text.replace(",3]", ",4]")).is_err_and(|error| error.starts_with("damaged: the checksum")));
        assert!(unsealed(&text[1..]).is_err() && unsealed(&text[..text.len() - 1]).is_err());
    }

    #[test]
    fn a_checksum_is_xxh3_of_the_bytes_however_they_are_cut() {
        assert_eq!(Checksum::of(b""), "99aa06d3014798d86001c324468d497f");
        let mut cut = Checksum::default();
        [&b"spam"[..], b" and", b" eggs"].iter().for_each(|bytes| cut.add(bytes));
        assert_eq!(cut.to_hex(), Checksum::of(b"spam and eggs"));
        assert_ne!(cut.to_hex(), Checksum::of(b"spam and egg"));
    }
}
