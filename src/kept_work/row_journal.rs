//! A journal of rows of numbers, such as those of a file that is complete only at its end. After a kill the rows are
//! read from it, and the work goes on after them, bit for bit.
//!
//! The journal is a sequence of batches: the number of rows (8 bytes), their checksum (32 hexadecimal digits), and
//! their numbers as doubles, least significant byte first. A batch that was not written to its end is dropped.

use super::checksum::Checksum;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;

/// The extension of the files.
pub(crate) const EXTENSION: &str = "rows";

const CHECKSUM_BYTES: usize = 32;

/// Most rows that a batch can have, so that a damaged number cannot ask for all memory.
const MAX_ROWS: u64 = 1 << 32;

/// An open journal. Rows are collected until [`commit`](Self::commit) writes them as a batch.
pub(crate) struct RowJournal {
    file: File,
    batch: Vec<u8>,
    columns: usize,
}

impl RowJournal {
    /// Open or make a journal. `take` receives the rows of every whole batch whose first number is below `end`: members
    /// are in ascending order, and those from `end` on will be written again.
    ///
    /// # Errors
    /// When the file is not a regular one, or cannot be read or written, or `take` fails.
    pub(crate) fn open<E: From<io::Error>>(
        path: &Path,
        columns: usize,
        end: usize,
        mut take: impl FnMut(&[f64]) -> Result<(), E>,
    ) -> Result<Self, E> {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        if !file.metadata()?.is_file() {
            return Err(io::Error::other("expected a regular file").into());
        }
        let mut whole = 0;
        let mut reader = BufReader::new(&file);
        while let Some(batch) = read_batch(&mut reader, columns)? {
            if batch[0] >= end as f64 {
                break;
            }
            whole += (8 + CHECKSUM_BYTES + 8 * batch.len()) as u64;
            batch.chunks_exact(columns).try_for_each(&mut take)?;
        }
        file.set_len(whole)?;
        file.seek(io::SeekFrom::End(0))?;
        Ok(Self { file, batch: Vec::new(), columns })
    }

    /// Add a number of a row.
    pub(crate) fn add(&mut self, value: f64) {
        self.batch.extend(value.to_le_bytes());
    }

    /// Write the rows since the last batch.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn commit(&mut self) -> io::Result<()> {
        if self.batch.is_empty() {
            return Ok(());
        }
        let rows = (self.batch.len() / (8 * self.columns)) as u64;
        self.file.write_all(&rows.to_le_bytes())?;
        self.file.write_all(Checksum::of(&self.batch).as_bytes())?;
        self.file.write_all(&self.batch)?;
        self.batch.clear();
        Ok(())
    }
}

/// The numbers of the next batch; `None` at the end and at a batch that is not whole.
fn read_batch(reader: &mut impl Read, columns: usize) -> io::Result<Option<Vec<f64>>> {
    let mut head = [0; 8 + CHECKSUM_BYTES];
    if !is_filled(reader, &mut head)? {
        return Ok(None);
    }
    let (rows, checksum) = head.split_at(8);
    let rows = u64::from_le_bytes(rows.try_into().expect("eight bytes"));
    if rows == 0 || rows > MAX_ROWS {
        return Ok(None);
    }
    let length = rows * 8 * columns as u64;
    let mut bytes = Vec::new();
    reader.take(length).read_to_end(&mut bytes)?;
    if bytes.len() as u64 != length || Checksum::of(&bytes).as_bytes() != checksum {
        return Ok(None);
    }
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
    Ok(Some(bytes.chunks_exact(8).map(number).collect()))
}

fn is_filled(reader: &mut impl Read, bytes: &mut [u8]) -> io::Result<bool> {
    match reader.read_exact(bytes) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        other => other.map(|()| true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn read(path: &Path, end: usize) -> (RowJournal, Vec<f64>) {
        let mut found = Vec::new();
        let take = |row: &[f64]| -> io::Result<()> {
            found.extend(row);
            Ok(())
        };
        let journal = RowJournal::open(path, 2, end, take).expect("a journal");
        (journal, found)
    }

    #[cfg(unix)]
    #[test]
    fn a_device_in_place_of_the_file_is_refused_and_not_read_without_end() {
        let opened = RowJournal::open(Path::new("/dev/zero"), 2, 9, |_| -> io::Result<()> { Ok(()) });
        assert_eq!(opened.err().map(|error| error.to_string()).as_deref(), Some("expected a regular file"));
    }

    #[test]
    fn whole_batches_before_the_end_are_read_and_the_rest_is_written_again() {
        let path = std::env::temp_dir().join(format!("bondline-journal-{}", std::process::id()));
        let _ = fs::remove_file(&path);
        let (mut journal, none) = read(&path, 9);
        assert!(none.is_empty());
        for batch in [&[0.0, 0.5, 1.0, f64::NAN][..], &[2.0, 2.5], &[3.0, 3.5]] {
            batch.iter().for_each(|value| journal.add(*value));
            journal.commit().expect("it takes a batch");
        }
        drop(journal);
        let whole = fs::read(&path).expect("a journal");
        // Member 3 was in no checkpoint.
        let (mut journal, found) = read(&path, 3);
        assert_eq!((found.len(), found[4], found[3].is_nan()), (6, 2.0, true));
        [3.0, 3.5].iter().for_each(|value| journal.add(*value));
        journal.commit().expect("it takes a batch");
        assert_eq!(fs::read(&path).expect("a journal"), whole);
        for damaged in [whole[..whole.len() - 3].to_vec(), [&whole[..whole.len() - 1], &[7]].concat()] {
            fs::write(&path, damaged).expect("a file");
            assert_eq!(read(&path, 9).1.len(), 6, "a damaged batch was read");
        }
        fs::remove_file(&path).expect("a file of this test");
    }
}
