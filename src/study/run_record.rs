//! Record of the run of a question: when, by which command and from which files.

use crate::case::{Case, InputFile};
use crate::march::Backend;
use std::time::{SystemTime, UNIX_EPOCH};

/// The provenance of an answer.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct RunRecord {
    /// Start of the question, UTC: `2026-11-24T14:20:12Z`.
    pub date: String,
    /// The command with its arguments; `None` if the library was called.
    pub command_line: Option<Vec<String>>,
    /// The files that the cases were read from. Built-in materials and gases belong to the version.
    pub input_files: Vec<InputFile>,
    /// The version of bondline.
    pub version: String,
    /// The commit that bondline was built from, if it is known.
    pub commit: Option<String>,
    /// The driver of the device and its version; `None` for the CPU.
    pub driver: Option<String>,
    /// Threads of the processor.
    pub threads: usize,
    /// Deviations from the planned run: a device that was given up, members that could not be kept.
    pub remarks: Vec<String>,
}

impl RunRecord {
    pub(crate) fn new(command_line: Option<Vec<String>>, backend: &Backend, threads: usize) -> Self {
        Self {
            date: utc_text(SystemTime::now()),
            command_line,
            input_files: Vec::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: option_env!("BONDLINE_COMMIT").map(str::to_owned),
            driver: backend.driver.clone(),
            threads,
            remarks: Vec::new(),
        }
    }

    /// Add the files of a case.
    pub(crate) fn add_files(&mut self, case: &Case) {
        for file in case.input_files() {
            if !self.input_files.contains(file) {
                self.input_files.push(file.clone());
            }
        }
    }
}

/// Today in UTC, as `2026-11-24`.
pub fn utc_date() -> String {
    utc_text(SystemTime::now()).split('T').next().unwrap_or_default().to_owned()
}

/// A time as `2026-11-24T14:20:12Z`; a time before 1970 is its beginning.
pub(crate) fn utc_text(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = civil_date(days);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", second / 3600, second / 60 % 60, second % 60)
}

/// Year, month and day of a day after 1970-01-01, by Hinnant's algorithm for the Gregorian calendar: years begin in
/// March, and 400 years have 146,097 days.
fn civil_date(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let months_since_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * months_since_march + 2) / 5 + 1;
    let month = if months_since_march < 10 { months_since_march + 3 } else { months_since_march - 9 };
    (400 * era + year_of_era + u64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn times_are_written_as_dates_of_the_gregorian_calendar() {
        let text = |seconds| utc_text(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(text(0), "1970-01-01T00:00:00Z");
        assert_eq!(text(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(text(4_107_542_399), "2100-02-28T23:59:59Z");
        assert_eq!(text(4_107_542_400), "2100-03-01T00:00:00Z");
        assert_eq!(text(1_795_530_012), "2026-11-24T14:20:12Z");
    }
}
