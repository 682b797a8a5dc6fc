//! The files that a case was read from.

use sha2::{Digest, Sha256};

/// A file that was read for a case.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct InputFile {
    /// Path of the file as it was opened; the id of a case that was read from text in memory.
    pub path: String,
    /// SHA-256 of the bytes of the file, in hexadecimal.
    pub sha256: String,
}

impl InputFile {
    /// A file with these bytes.
    pub fn new(path: String, bytes: &[u8]) -> Self {
        Self { path, sha256: Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect() }
    }
}

/// The files of a case, in the order of reading. They are not part of its content: cases with the same content are
/// equal wherever they were read from.
#[derive(Clone, Debug, Default)]
pub(crate) struct InputFiles {
    pub(crate) files: Vec<InputFile>,
    /// Values that replace those of the files, by factor or key.
    pub(crate) overrides: Vec<(String, String)>,
}

impl PartialEq for InputFiles {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl InputFiles {
    /// Add a file that was read.
    pub(super) fn add(&mut self, path: String, bytes: &[u8]) {
        if self.files.iter().all(|file| file.path != path) {
            self.files.push(InputFile::new(path, bytes));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_added_once_with_the_sha_256_of_its_bytes() {
        let mut files = InputFiles::default();
        files.add("abc.txt".to_owned(), b"abc");
        files.add("abc.txt".to_owned(), b"abc");
        let sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad".to_owned();
        assert_eq!(files.files, [InputFile { path: "abc.txt".to_owned(), sha256 }]);
    }
}
