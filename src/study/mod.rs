//! Questions about a case, and their answers: one function a question, in the file of its answer.

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
