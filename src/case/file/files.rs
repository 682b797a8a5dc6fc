//! The files that a case names, on disk or in memory.

use crate::case::input_files::InputFiles;
use crate::limits::{TABLE_FILE_MIB, read_file};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::PathBuf;

/// A source of the files that a case names, by paths relative to the case file: `flux.csv`, `materials/felt.toml`.
///
/// A [`Folder`] reads from disk, a map from paths to texts or bytes from memory:
///
/// ```
/// use bondline::Case;
/// use std::collections::BTreeMap;
///
/// let text = r#"
/// duration = "60 s"
/// initial_temperature = "300 K"
/// [[ply]]
/// name = "FELT"
/// material = "saffil_96"
/// thickness = "10 mm"
/// [[sensor]]
/// name = "BACK"
/// depth = "10 mm"
/// [hot_face]
/// kind = "held"
/// temperature = { file = "face.csv", outside = "hold" }
/// "#;
/// let face = "time_s,face_K\n0,300\n10,1200\n".to_owned();
/// let files = BTreeMap::from([("face.csv".to_owned(), face)]);
/// assert_eq!(Case::from_toml(text, "felt", &files)?.sensors().len(), 1);
/// let none = BTreeMap::<String, String>::new();
/// let error = Case::from_toml(text, "felt", &none).expect_err("a missing file");
/// assert!(error.to_string().contains("no such file: face.csv"));
/// # Ok::<(), bondline::case::CaseError>(())
/// ```
pub trait FileSource {
    /// The bytes of a file: UTF-8, or UTF-16 with a byte-order mark.
    ///
    /// # Errors
    /// The file cannot be read; [`ErrorKind::NotFound`] if there is none.
    fn read(&self, path: &str) -> io::Result<Vec<u8>>;

    /// Whether the file exists.
    fn contains(&self, path: &str) -> bool;

    /// The names of the files in a folder; none if there is no such folder.
    ///
    /// # Errors
    /// The folder cannot be read.
    fn list(&self, folder: &str) -> io::Result<Vec<String>>;

    /// The name of a file in messages.
    fn label(&self, path: &str) -> String {
        path.to_owned()
    }
}

/// The files of a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder(PathBuf);

impl Folder {
    /// The folder at a path; an empty path is the working directory.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self(path.into())
    }
}

impl FileSource for Folder {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        // A table is the largest kind of file; the reader of a smaller kind has its own limit.
        read_file(&self.0.join(path), &TABLE_FILE_MIB)
    }

    fn contains(&self, path: &str) -> bool {
        self.0.join(path).exists()
    }

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        let entries = match std::fs::read_dir(self.0.join(folder)) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries?,
        };
        // A name that is no text cannot be written in a case file.
        let names = entries.map(|entry| Ok(entry?.file_name().into_string().ok()));
        names.filter_map(io::Result::transpose).collect()
    }

    fn label(&self, path: &str) -> String {
        self.0.join(path).display().to_string()
    }
}

impl<T: AsRef<[u8]>> FileSource for BTreeMap<String, T> {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        let content = self.get(path).ok_or_else(|| io::Error::from(ErrorKind::NotFound))?;
        Ok(content.as_ref().to_vec())
    }

    fn contains(&self, path: &str) -> bool {
        self.contains_key(path)
    }

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        let names = self.keys().filter_map(|path| path.strip_prefix(folder)?.strip_prefix('/'));
        Ok(names.filter(|name| !name.contains('/')).map(str::to_owned).collect())
    }
}

/// A source that remembers the files that were read from it.
pub(super) struct RecordedFiles<'a> {
    files: &'a dyn FileSource,
    read: RefCell<InputFiles>,
}

impl<'a> RecordedFiles<'a> {
    /// `read` are files that were read before.
    pub(super) fn new(files: &'a dyn FileSource, read: InputFiles) -> Self {
        Self { files, read: RefCell::new(read) }
    }

    /// The bytes of a file that is no input of the case.
    pub(super) fn read_unrecorded(&self, path: &str) -> io::Result<Vec<u8>> {
        self.files.read(path)
    }

    pub(super) fn into_read(self) -> InputFiles {
        self.read.into_inner()
    }
}

impl FileSource for RecordedFiles<'_> {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        let bytes = self.files.read(path)?;
        self.read.borrow_mut().add(self.files.label(path), &bytes);
        Ok(bytes)
    }

    fn contains(&self, path: &str) -> bool {
        self.files.contains(path)
    }

    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        self.files.list(folder)
    }

    fn label(&self, path: &str) -> String {
        self.files.label(path)
    }
}
