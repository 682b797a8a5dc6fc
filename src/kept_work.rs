//! Work that is kept: finished work of a study that may be interrupted, parts of a study for other processes, and the
//! checksums of both.

mod checkpoint;
pub(crate) mod checksum;
pub(crate) mod kept_rows;
pub(crate) mod log_part;
pub(crate) mod row_journal;
pub(crate) mod sweep_piece;
pub mod work_log;

pub use checkpoint::{Checkpoint, KeptWork};
pub(crate) use checkpoint::{FITS, ITERATIONS, MARCHES, RowFiles, RowKeeper, SweepKeeper};
