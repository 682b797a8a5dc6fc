//! bondline
pub mod case;
pub mod ensemble;
pub mod march;
pub mod plan;
pub mod report;
pub mod study;
pub mod traces;
