//! Parquet files of members and traces, written during the study: memory holds one row group, whatever the number of
//! members. Columns are not compressed, so that any reader can open them.

use super::super::ReportError;
use super::temporary::TemporaryPath;
use super::{contents, io_error};
use crate::kept_work::checksum::Checksum;
use crate::kept_work::row_journal::RowJournal;
use crate::study::nominal::Peak;
use crate::traces::{MemberStatus, Traces};
use parquet::basic::{Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows per row group; twenty columns of it take about ten megabytes.
const ROW_GROUP_SIZE: usize = 65_536;

/// A member with its factors and peaks.
#[derive(Clone, Copy, Debug)]
pub struct MemberRow<'a> {
    /// Index of the member in the ensemble.
    pub member: usize,
    /// Whether it completed; the peaks of a failed member are written as NaN.
    pub completed: bool,
    /// One value per factor.
    pub factors: &'a [f64],
    /// One peak per sensor.
    pub peaks: &'a [Peak],
}

/// `members.parquet`: `member` (int64), `status` (int32: 0 completed, 1 failed), one double per factor under its name,
/// then `TC1_peak_k`, `TC1_peak_time_s` … per sensor.
///
/// Both files have key-value metadata: the version of bondline, the origin that the caller states, and the checksum of
/// the rows, each number as a double with its least significant byte first.
pub struct MembersFile {
    columns: ParquetColumns,
    sensors: usize,
}

/// `traces.parquet`: `member` (int64), `time_s`, then `TC1_k` … (double), one row per member and instant; failed
/// members are omitted.
pub struct TracesFile {
    columns: ParquetColumns,
    instants_s: Vec<f64>,
}

impl MembersFile {
    /// Create the file under a temporary name; [`Self::close`] renames it.
    ///
    /// # Errors
    /// When the file cannot be created or two columns have the same name.
    pub fn create<S: AsRef<str>>(path: &Path, factors: &[S], sensors: &[S]) -> Result<Self, ReportError> {
        let mut names = vec![contents::MEMBER.to_owned(), contents::STATUS.to_owned()];
        names.extend(factors.iter().map(|factor| factor.as_ref().to_owned()));
        for sensor in sensors {
            names.extend([contents::PEAK, contents::PEAK_TIME].map(|name| name.replace("<sensor>", sensor.as_ref())));
        }
        let whole = |name: &str| match name {
            contents::MEMBER => Physical::INT64,
            contents::STATUS => Physical::INT32,
            _ => Physical::DOUBLE,
        };
        Ok(Self { columns: ParquetColumns::create(path, &names, whole)?, sensors: sensors.len() })
    }

    /// Keep the rows in a journal at `path` too, so that a later run can go on. The rows that it already has of members
    /// below `end` are added first; their number is returned.
    ///
    /// # Errors
    /// When the journal cannot be read or written.
    pub fn keep_in(&mut self, path: &Path, end: usize) -> Result<usize, ReportError> {
        self.columns.keep_in(path, end)
    }

    /// Write the members since the last batch to the journal, if there is one.
    ///
    /// # Errors
    /// When the journal cannot be written.
    pub fn end_batch(&mut self) -> Result<(), ReportError> {
        self.columns.end_batch()
    }

    /// Append a member.
    ///
    /// # Errors
    /// When a row group cannot be written.
    pub fn append(&mut self, row: &MemberRow) -> Result<(), ReportError> {
        let known = |value: f64| if row.completed { value } else { f64::NAN };
        let peaks = (0..self.sensors).flat_map(|sensor| {
            let peak = row.peaks.get(sensor).copied().unwrap_or(Peak { temperature_k: f64::NAN, time_s: f64::NAN });
            [known(peak.temperature_k), known(peak.time_s)]
        });
        let status = if row.completed { 0.0 } else { 1.0 };
        let leading = [row.member as f64, status];
        self.columns.row(leading.into_iter().chain(row.factors.iter().copied()).chain(peaks))
    }

    /// Write the last row group and the origin of the rows, as pairs of key and value, and rename the file.
    ///
    /// # Errors
    /// When it cannot be written or renamed.
    pub fn close(self, origin: &[(&str, String)]) -> Result<PathBuf, ReportError> {
        self.columns.close(origin)
    }
}

impl TracesFile {
    /// Create the file under a temporary name; [`Self::close`] renames it.
    ///
    /// # Errors
    /// When the file cannot be created or two columns have the same name.
    pub fn create<S: AsRef<str>>(path: &Path, sensors: &[S], instants_s: &[f64]) -> Result<Self, ReportError> {
        let mut names = vec![contents::MEMBER.to_owned(), contents::TIME.to_owned()];
        names.extend(sensors.iter().map(|sensor| contents::TEMPERATURE.replace("<sensor>", sensor.as_ref())));
        let whole = |name: &str| if name == contents::MEMBER { Physical::INT64 } else { Physical::DOUBLE };
        Ok(Self { columns: ParquetColumns::create(path, &names, whole)?, instants_s: instants_s.to_vec() })
    }

    /// Keep the rows in a journal at `path` too, so that a later run can go on. The rows that it already has of members
    /// below `end` are added first; their number is returned.
    ///
    /// # Errors
    /// When the journal cannot be read or written.
    pub fn keep_in(&mut self, path: &Path, end: usize) -> Result<usize, ReportError> {
        self.columns.keep_in(path, end)
    }

    /// Append the completed members of a batch.
    ///
    /// # Errors
    /// When a row group cannot be written.
    pub fn append(&mut self, traces: &Traces) -> Result<(), ReportError> {
        for member in (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed) {
            for (instant, &time_s) in self.instants_s.iter().enumerate() {
                let leading = [(traces.first + member) as f64, time_s];
                let sensors = (0..traces.sensors).map(|sensor| traces.trace(member, sensor)[instant]);
                self.columns.row(leading.into_iter().chain(sensors))?;
            }
        }
        self.columns.end_batch()
    }

    /// Write the last row group and the origin of the rows, as pairs of key and value, and rename the file.
    ///
    /// # Errors
    /// When it cannot be written or renamed.
    pub fn close(self, origin: &[(&str, String)]) -> Result<PathBuf, ReportError> {
        self.columns.close(origin)
    }
}

/// Columns buffered into row groups. Integers are buffered as doubles, exact to 2⁵³.
struct ParquetColumns {
    path: PathBuf,
    /// The file until it is complete.
    partial: TemporaryPath,
    writer: SerializedFileWriter<File>,
    buffer: Vec<Vec<f64>>,
    checksum: Checksum,
    journal: Option<RowJournal>,
}

impl ParquetColumns {
    fn create(path: &Path, names: &[String], kind: impl Fn(&str) -> Physical) -> Result<Self, ReportError> {
        let fault = |message: String| ReportError::Parquet { path: path.to_owned(), message };
        if let Some(twice) = names.iter().enumerate().find(|(index, name)| names[..*index].contains(name)) {
            return Err(fault(format!("two columns are named {:?}", twice.1)));
        }
        let mut fields = Vec::with_capacity(names.len());
        for name in names {
            let field = Type::primitive_type_builder(name, kind(name)).with_repetition(Repetition::REQUIRED).build();
            fields.push(Arc::new(field.map_err(|error| fault(error.to_string()))?));
        }
        let schema = Type::group_type_builder("members").with_fields(fields).build();
        let schema = Arc::new(schema.map_err(|error| fault(error.to_string()))?);
        let partial = TemporaryPath::new_in(path.parent().unwrap_or(Path::new("")));
        let file = File::create(partial.path()).map_err(|error| fault(error.to_string()))?;
        let properties = Arc::new(WriterProperties::builder().build());
        let writer = SerializedFileWriter::new(file, schema, properties).map_err(|error| fault(error.to_string()))?;
        Ok(Self {
            path: path.to_owned(),
            partial,
            writer,
            buffer: vec![Vec::new(); names.len()],
            journal: None,
            checksum: Checksum::default(),
        })
    }

    fn row(&mut self, values: impl Iterator<Item = f64>) -> Result<(), ReportError> {
        let mut filled = 0;
        for (column, value) in self.buffer.iter_mut().zip(values) {
            column.push(value);
            self.checksum.add(&value.to_le_bytes());
            self.journal.iter_mut().for_each(|journal| journal.add(value));
            filled += 1;
        }
        if filled != self.buffer.len() {
            let message = format!("a row has {filled} values for {} columns", self.buffer.len());
            return Err(ReportError::Parquet { path: self.path.clone(), message });
        }
        if self.buffer[0].len() == ROW_GROUP_SIZE { self.flush() } else { Ok(()) }
    }

    /// Keep the rows in a journal too, after those that it has of members below `end`. Returns their number.
    fn keep_in(&mut self, path: &Path, end: usize) -> Result<usize, ReportError> {
        let mut rows = 0;
        let journal = RowJournal::open(path, self.buffer.len(), end, |row| {
            rows += 1;
            self.row(row.iter().copied()).map_err(JournalError::Report)
        });
        self.journal = Some(journal.map_err(|error| match error {
            JournalError::Report(error) => error,
            JournalError::Io(error) => io_error("reading", path)(error),
        })?);
        Ok(rows)
    }

    /// Write the rows since the last batch to the journal.
    fn end_batch(&mut self) -> Result<(), ReportError> {
        let Some(journal) = &mut self.journal else { return Ok(()) };
        journal.commit().map_err(io_error("writing", &self.path))
    }

    fn flush(&mut self) -> Result<(), ReportError> {
        let fault = |error: parquet::errors::ParquetError| ReportError::Parquet {
            path: self.path.clone(),
            message: error.to_string(),
        };
        let mut group = self.writer.next_row_group().map_err(fault)?;
        for values in &mut self.buffer {
            let mut column = group.next_column().map_err(fault)?.expect("a column for each name");
            match column.untyped() {
                ColumnWriter::Int64ColumnWriter(typed) => {
                    let whole: Vec<i64> = values.iter().map(|value| *value as i64).collect();
                    typed.write_batch(&whole, None, None).map_err(fault)?;
                }
                ColumnWriter::Int32ColumnWriter(typed) => {
                    let whole: Vec<i32> = values.iter().map(|value| *value as i32).collect();
                    typed.write_batch(&whole, None, None).map_err(fault)?;
                }
                ColumnWriter::DoubleColumnWriter(typed) => {
                    typed.write_batch(values, None, None).map_err(fault)?;
                }
                _ => unreachable!("the schema has whole numbers and doubles only"),
            }
            column.close().map_err(fault)?;
            values.clear();
        }
        group.close().map(|_| ()).map_err(fault)
    }

    fn close(mut self, origin: &[(&str, String)]) -> Result<PathBuf, ReportError> {
        if !self.buffer[0].is_empty() {
            self.flush()?;
        }
        let fault = |message: String| ReportError::Parquet { path: self.path.clone(), message };
        let own = [("version", env!("CARGO_PKG_VERSION").to_owned()), ("checksum", self.checksum.to_hex())];
        for (key, value) in origin.iter().cloned().chain(own) {
            self.writer.append_key_value_metadata(KeyValue::new(format!("bondline.{key}"), value));
        }
        let file = self.writer.into_inner().map_err(|error| fault(error.to_string()))?;
        file.sync_all().map_err(|error| fault(error.to_string()))?;
        fs::rename(self.partial.path(), &self.path).map_err(|error| fault(error.to_string()))?;
        Ok(self.path)
    }
}

/// An error of the journal, or of the rows that are read from it.
enum JournalError {
    Io(std::io::Error),
    Report(ReportError),
}

impl From<std::io::Error> for JournalError {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    fn scratch(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("bondline-{name}-{}.parquet", std::process::id()))
    }

    #[test]
    fn members_are_read_back_across_row_groups_and_failures_are_marked() {
        let path = scratch("members");
        let mut file = MembersFile::create(&path, &["f_k"], &["TC4"]).expect("a new file");
        let members = ROW_GROUP_SIZE + 10;
        for member in 0..members {
            let peaks = [Peak { temperature_k: 600.0 + member as f64, time_s: 78.0 }];
            let factors = [1.0 + 1e-6 * member as f64];
            let row = MemberRow { member, completed: member != 3, factors: &factors, peaks: &peaks };
            file.append(&row).expect("it takes a row");
        }
        assert!(!path.exists(), "the file has its name before it is complete");
        file.close(&[("case", "slab".to_owned())]).expect("it closes");
        let reader = SerializedFileReader::new(File::open(&path).expect("it opens")).expect("it is Parquet");
        assert_eq!(reader.metadata().num_row_groups(), 2);
        let rows: Vec<_> = reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect();
        fs::remove_file(&path).expect("it can be removed");
        assert_eq!(rows.len(), members);
        let metadata = reader.metadata().file_metadata().key_value_metadata().expect("metadata");
        let value = |key: &str| metadata.iter().find(|entry| entry.key == key).and_then(|entry| entry.value.clone());
        assert_eq!(value("bondline.case").as_deref(), Some("slab"));
        assert_eq!(value("bondline.version").as_deref(), Some(env!("CARGO_PKG_VERSION")));
        let mut checksum = Checksum::default();
        for row in &rows {
            let leading = [row.get_long(0).expect("member") as f64, f64::from(row.get_int(1).expect("status"))];
            let doubles = (2..5).map(|column| row.get_double(column).expect("a double"));
            leading.into_iter().chain(doubles).for_each(|value| checksum.add(&value.to_le_bytes()));
        }
        assert_eq!(value("bondline.checksum"), Some(checksum.to_hex()));
        assert_eq!(rows[7].get_long(0).expect("member"), 7);
        assert_eq!(rows[7].get_double(2).expect("factor"), 1.0 + 7e-6);
        assert_eq!(rows[members - 1].get_double(3).expect("peak"), 600.0 + (members - 1) as f64);
        assert_eq!(rows[3].get_int(1).expect("status"), 1);
        assert!(rows[3].get_double(3).expect("peak").is_nan());
    }

    #[test]
    fn traces_omit_failed_members() {
        let path = scratch("traces");
        let mut file = TracesFile::create(&path, &["TC1", "TC2"], &[0.0, 1.0, 2.0]).expect("a new file");
        let traces = Traces {
            temperatures_k: (0..12).map(|n| 300.0 + f64::from(n)).collect(),
            statuses: vec![MemberStatus::Diverged { time_s: 1.0 }, MemberStatus::Completed],
            ..Traces::empty(40, 2, 3)
        };
        file.append(&traces).expect("it takes a run");
        file.close(&[]).expect("it closes");
        let reader = SerializedFileReader::new(File::open(&path).expect("it opens")).expect("it is Parquet");
        let rows: Vec<_> = reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect();
        fs::remove_file(&path).expect("it can be removed");
        assert_eq!(rows.len(), 3);
        assert_eq!(rows[2].get_long(0).expect("member"), 41);
        assert_eq!(rows[2].get_double(1).expect("time"), 2.0);
        assert_eq!(rows[2].get_double(3).expect("TC2"), 311.0);
    }

    #[test]
    fn a_study_that_fails_midway_leaves_no_file() {
        let path = scratch("abandoned");
        let file = MembersFile::create(&path, &["f_k"], &["TC4"]).expect("a new file");
        let partial = file.columns.partial.path().to_owned();
        assert!(partial.exists());
        drop(file);
        assert!(!path.exists() && !partial.exists());
    }

    #[test]
    fn two_columns_of_one_name_are_refused() {
        let refusal = MembersFile::create(&scratch("twice"), &["status"], &["TC4"]).err().expect("a name twice");
        assert!(refusal.to_string().contains("status"), "{refusal}");
    }
}
