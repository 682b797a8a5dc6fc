//! bondline
pub mod case;
pub mod ensemble;
pub mod fit;
pub mod march;
pub mod plan;
pub mod study;
pub mod traces;
