//! bondline
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod case;
pub mod ensemble;
pub mod fit;
pub mod march;
pub mod physics;
pub mod plan;
pub mod report;
pub mod study;
pub mod traces;
pub mod verify;
