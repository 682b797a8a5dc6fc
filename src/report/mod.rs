//! Outcomes made visible.

pub mod materials;
