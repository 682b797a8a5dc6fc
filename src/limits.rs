//! Limits of input, in one table: what exceeds one is refused with the number found and the limit.
//!
//! They are far above the needs of a thermal analysis. A request beyond them is a mistake, such as a wrong unit, or a
//! damaged file. `tests/cli/limits.rs` runs commands at those that govern memory, in 2 GiB.

use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read as _};
use std::path::Path;

/// A limit of input.
#[derive(Debug, PartialEq, Eq)]
pub struct Limit {
    /// The quantity that is limited, as a plural: `time steps of a march`.
    pub quantity: &'static str,
    /// The largest number that is accepted.
    pub max: u64,
}

/// All limits, in the order of the documentation.
pub const LIMITS: [&Limit; 37] = [
    &TEXT_FILE_MIB,
    &TABLE_FILE_MIB,
    &UNPACKED_MIB,
    &SHARED_TEXTS_MIB,
    &WORKBOOK_PART_MIB,
    &TABLE_CELLS,
    &PIECE_FILE_MIB,
    &CACHE_FILE_MIB,
    &PLAN_FILE_MIB,
    &KEPT_PLANS,
    &KEYS,
    &LIST_ITEMS,
    &NAME_BYTES,
    &COLUMNS,
    &LISTED_ERRORS,
    &PLIES,
    &SENSORS,
    &FACTORS,
    &REACTIONS,
    &PROPERTY_DECADES,
    &LAYUP_TEMPERATURE_K,
    &THICKNESS_RATIO,
    &CELLS,
    &DURATION_S,
    &OUTPUT_INTERVALS,
    &PROFILE_INSTANTS,
    &TEMPERATURES,
    &STEPS,
    &CELL_STEPS,
    &MEMBERS,
    &STATISTICS_MIB,
    &LAYUPS,
    &DATA_SETS,
    &STARTS,
    &KNOTS,
    &POSITIONS,
    &THREADS,
];

/// Case, material and gas files: a schedule of 100,000 rows inside a case file needs 3 MiB.
pub const TEXT_FILE_MIB: Limit = Limit { quantity: "MiB of a case, material or gas file", max: 4 };
/// Table files: twice the size of two million rows of a time and three values.
pub const TABLE_FILE_MIB: Limit = Limit { quantity: "MiB of a table file", max: 64 };
/// A full sheet has a million rows of ten numbers, each in 40 bytes.
pub const UNPACKED_MIB: Limit = Limit { quantity: "MiB of an unpacked workbook", max: 512 };
/// The shared strings of a workbook, which are held in memory.
pub const SHARED_TEXTS_MIB: Limit = Limit { quantity: "MiB of the texts of a workbook", max: 64 };
/// Styles and lists of sheets, which are held in memory too.
pub const WORKBOOK_PART_MIB: Limit = Limit { quantity: "MiB of a part of a workbook that is no sheet", max: 8 };
/// So many numbers take 160 MB.
pub const TABLE_CELLS: Limit = Limit { quantity: "cells of a table (rows times columns)", max: 20_000_000 };
/// Files of `uncertainty --members`: twice the largest statistics, whose numbers are longer as text.
pub const PIECE_FILE_MIB: Limit = Limit { quantity: "MiB of a file to merge", max: 512 };
/// Compiled kernels of one device.
pub const CACHE_FILE_MIB: Limit = Limit { quantity: "MiB of a pipeline cache", max: 64 };
/// A kept plan: some numbers for each ply and each segment of time.
pub const PLAN_FILE_MIB: Limit = Limit { quantity: "MiB of a kept plan", max: 1 };
/// Beyond this number the oldest plan is removed; most plans take 2 KiB.
pub const KEPT_PLANS: Limit = Limit { quantity: "plans kept in the user's cache", max: 500 };
/// Keys are chosen by name.
pub const KEYS: Limit = Limit { quantity: "keys of one table of a case, material or gas file", max: 1000 };
/// Rows of a schedule; longer ones belong in a table file.
pub const LIST_ITEMS: Limit = Limit { quantity: "items of one list of a case, material or gas file", max: 100_000 };
/// Names of files contain two such names, and file systems allow 255 bytes.
pub const NAME_BYTES: Limit = Limit { quantity: "bytes of a name that a case chooses", max: 100 };
/// Thermocouples of a test, several times over.
pub const COLUMNS: Limit = Limit { quantity: "columns of a table file", max: 1000 };
/// Further errors are counted, not listed.
pub const LISTED_ERRORS: Limit = Limit { quantity: "errors listed", max: 1000 };
/// Plies of four cells each fill the grid of [`CELLS`].
pub const PLIES: Limit = Limit { quantity: "plies", max: 256 };
/// Each sensor is a face between cells.
pub const SENSORS: Limit = Limit { quantity: "sensors", max: 128 };
/// A statistic has at most 512 polynomials of the factors: of more than 31 factors, no pairs.
pub const FACTORS: Limit = Limit { quantity: "factors", max: 128 };
/// Each reaction is a loop iteration of every cell.
pub const REACTIONS: Limit = Limit { quantity: "reactions of a material", max: 64 };
/// Larger or smaller properties have products outside the range of single precision.
pub const PROPERTY_DECADES: Limit = Limit { quantity: "powers of ten between a property and its SI unit", max: 15 };
/// Least distance of two temperatures of a property that are not a jump, K. Beyond it directories of rows would exceed
/// 10 MB.
pub const TABLE_TEMPERATURE_DISTANCE_K: f64 = 0.005;
/// The end of all tables: a member that is hotter has diverged. Data loggers write 9.9e37 for an open thermocouple.
pub const LAYUP_TEMPERATURE_K: Limit =
    Limit { quantity: "K of a temperature of the layup, stated or measured", max: 4000 };
/// Depths within a millionth of the layup are equal on the grid.
pub const THICKNESS_RATIO: Limit = Limit { quantity: "times the thickness of a ply for the layup", max: 1_000_000 };
/// More cells do not resolve anything that the material properties support.
pub const CELLS: Limit = Limit { quantity: "cells", max: 1024 };
/// Three centuries.
pub const DURATION_S: Limit = Limit { quantity: "s of a run", max: 10_000_000_000 };
/// `duration` over `resolution.output_interval`.
pub const OUTPUT_INTERVALS: Limit = Limit { quantity: "output intervals of a case", max: 100_000 };
/// A slider over more instants cannot be set.
pub const PROFILE_INSTANTS: Limit = Limit { quantity: "instants of profiles through the thickness", max: 200 };
/// Instants are output instants and the times of observations: 8 MB per member.
pub const TEMPERATURES: Limit = Limit { quantity: "temperatures of a member (sensors times instants)", max: 1_000_000 };
/// 530 MB of schedules, with those of the coarse plan.
pub const STEPS: Limit = Limit { quantity: "time steps of a march", max: 1_000_000 };
/// The march of one member then takes a few seconds.
pub const CELL_STEPS: Limit = Limit { quantity: "cells times time steps of a march", max: 200_000_000 };
/// Sums of squares of so many members stay in the range of the accumulators.
pub const MEMBERS: Limit = Limit { quantity: "members of a sweep", max: 1 << 26 };
/// About 25 kB for each temperature and seven factors.
pub const STATISTICS_MIB: Limit = Limit { quantity: "MiB of statistics of a sweep", max: 256 };
/// The page of a trade study has a row for each layup, and one layup takes seconds.
pub const LAYUPS: Limit = Limit { quantity: "layups of a trade study", max: 1000 };
/// All data sets are fitted together.
pub const DATA_SETS: Limit = Limit { quantity: "data sets of a coverage study", max: 10_000 };
/// All minimisations run together.
pub const STARTS: Limit = Limit { quantity: "minimisations of an estimate", max: 10_000 };
/// The equations of an inversion are a dense matrix.
pub const KNOTS: Limit = Limit { quantity: "knots of a heating history", max: 1000 };
/// All positions are stored: 80 MB per factor.
pub const POSITIONS: Limit = Limit { quantity: "positions of a posterior (chains times iterations)", max: 10_000_000 };
/// More threads than any machine has cores.
pub const THREADS: Limit = Limit { quantity: "threads", max: 1024 };

/// The variable that sets the threads of a process, and its old name, which rayon still reads.
const THREADS_VARIABLE: &str = "RAYON_NUM_THREADS";
const OLD_THREADS_VARIABLE: &str = "RAYON_RS_NUM_CPUS";

/// Check the threads that the environment asks for: a number that is not understood would be ignored, and one without
/// bound would be taken.
///
/// # Errors
/// The variable is set, and is no number from 0, for as many threads as cores, to the limit; or its old name is set.
pub(crate) fn check_thread_variable() -> Result<(), String> {
    if std::env::var_os(OLD_THREADS_VARIABLE).is_some() {
        return Err(format!("{OLD_THREADS_VARIABLE} is the old name of {THREADS_VARIABLE}: set that in its place"));
    }
    let Some(set) = std::env::var_os(THREADS_VARIABLE) else { return Ok(()) };
    let set = set.to_string_lossy();
    let fault = |message: String| format!("{THREADS_VARIABLE}={set}: {message}");
    let threads: f64 = match set.parse::<u128>() {
        Ok(threads) => threads as f64,
        Err(_) => return Err(fault("expected a number of threads".to_owned())),
    };
    THREADS.check(threads).map_err(fault)
}

impl Limit {
    /// Accept a number up to the limit.
    ///
    /// # Errors
    /// The message, with the limit and the number found.
    pub fn check(&self, found: f64) -> Result<(), String> {
        if found <= self.max as f64 {
            return Ok(());
        }
        Err(format!("expected at most {self}, found {}", shown(found)))
    }

    /// The bytes of a limit in MiB.
    pub(crate) const fn bytes(&self) -> u64 {
        self.max << 20
    }
}

impl fmt::Display for Limit {
    /// `1,000,000 time steps of a march`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", grouped(self.max), self.quantity)
    }
}

/// A whole number as an analyst reads it: `1,000,000`, or `2.0e11` for a large one.
fn shown(number: f64) -> String {
    const LARGEST_IN_FULL: f64 = 1e10;
    if number < LARGEST_IN_FULL { grouped(number.ceil() as u64) } else { format!("{number:.1e}") }
}

/// Digits in groups of three.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// The bytes of a regular file up to a limit in MiB. A pipe or a device is refused, as its end is not known.
pub(crate) fn read_file(path: &Path, limit: &Limit) -> io::Result<Vec<u8>> {
    let found = path.metadata()?;
    if found.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if !found.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "expected a regular file, found a pipe, socket or device"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(limit.bytes() + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit.bytes() {
        return Err(io::Error::new(ErrorKind::FileTooLarge, format!("expected at most {limit}")));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_itself_is_accepted_and_the_message_names_both_numbers() {
        assert_eq!(STEPS.check(1e6), Ok(()));
        let refusal = |found| STEPS.check(found).expect_err("above the limit");
        assert_eq!(refusal(1_000_000.5), "expected at most 1,000,000 time steps of a march, found 1,000,001");
        assert_eq!(refusal(2e11), "expected at most 1,000,000 time steps of a march, found 2.0e11");
        assert!(STEPS.check(f64::NAN).is_err() && STEPS.check(f64::INFINITY).is_err());
    }

    #[test]
    fn digits_are_grouped_from_the_right() {
        assert_eq!([0, 12, 123, 1234, 12_345_678].map(grouped), ["0", "12", "123", "1,234", "12,345,678"]);
    }
}
