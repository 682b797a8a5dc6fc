//! The bridge: a case flattened for marching. It cannot fail, because a case holds.

/// All that a backend reads.
pub struct Plan {
    /// Times at which the sensors are read, s; the first is zero.
    pub instants_s: Vec<f64>,
}
