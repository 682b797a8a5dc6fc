//! The studies of a case: one module each, with one entry function and the struct of its results.

pub mod answers;
pub mod beside;
pub mod estimate;
pub mod history;
pub mod nominal;
pub mod posterior;
pub mod proportion;
pub mod recovery;
pub mod seconds;
pub mod sensitivity;
pub mod size;
pub mod statistics;
#[cfg(feature = "serde")]
pub mod sweep_piece;
pub mod thermocouples;
pub mod twin;
pub mod uncertainty;
pub mod whole_traces;
