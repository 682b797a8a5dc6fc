//! The studies of a case: one module each, with one entry function and the struct of its results.

pub mod answers;
#[cfg(feature = "serde")]
pub(crate) mod checksum;
pub mod coverage_study;
pub mod estimate;
pub mod flux_inversion;
#[cfg(feature = "serde")]
pub(crate) mod kept_rows;
pub mod model_comparison;
pub mod nominal;
pub mod posterior;
pub mod proportion;
#[cfg(feature = "serde")]
pub(crate) mod row_journal;
pub mod run_record;
pub mod sensitivity;
pub mod simultaneous_band;
pub mod size;
pub mod statistics;
#[cfg(feature = "serde")]
pub mod sweep_piece;
pub mod thermocouple_residuals;
pub mod timing;
pub mod twin;
pub mod uncertainty;
pub(crate) mod work_log;
