//! What does each factor do to each thermocouple, and which can be estimated together?

/// Derivatives of every temperature by every factor, and what they say of estimation.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// `difference` (the paper's Eq. 14).
    pub method: &'static str,
    /// Relative step of the difference.
    pub step: f64,
    pub instants_s: Vec<f64>,
    /// Factor × sensor × instant, K per unit of the factor.
    pub derivatives_k: Vec<Vec<Vec<f64>>>,
    /// What the observations of the trusted sensors and window, or where there are none every instant of
    /// every sensor at 2 K, say of all factors taken together.
    pub all: Identifiability,
    /// The set proposed for estimation.
    pub proposed: Identifiability,
    /// How the set was found: one line a factor left out, in the order they went.
    pub reduction: Vec<String>,
}

/// How well a set of factors is determined by the data.
#[derive(Clone, Debug)]
pub struct Identifiability {
    /// Indices into the case's factors.
    pub factors: Vec<usize>,
    /// Root mean square of the scaled sensitivity P ∂T/∂P over the data, K.
    pub magnitude_k: Vec<f64>,
    /// Standard error each factor would have; infinite where it is not determined.
    pub standard_errors: Vec<f64>,
    /// Correlation of the estimates.
    pub correlation: Vec<Vec<f64>>,
    /// Correlation (cosine) of the sensitivity curves themselves.
    pub alignment: Vec<Vec<f64>>,
    /// Of the Jacobian weighted by the data, its columns at unit length.
    pub condition_number: f64,
    pub rank: usize,
    /// The direction in which the data say least, in words.
    pub weakest: String,
}
