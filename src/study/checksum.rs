//! Checksums of files: XXH3 of 128 bits. They detect damage, not tampering.

use std::io;
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

impl io::Write for Checksum {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.add(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checksum_is_xxh3_of_the_bytes_however_they_are_cut() {
        assert_eq!(Checksum::of(b""), "99aa06d3014798d86001c324468d497f");
        let mut cut = Checksum::default();
        [&b"spam"[..], b" and", b" eggs"].iter().for_each(|bytes| cut.add(bytes));
        assert_eq!(cut.to_hex(), Checksum::of(b"spam and eggs"));
        assert_ne!(cut.to_hex(), Checksum::of(b"spam and egg"));
    }
}
