//! What is asked of a heating history.

use clap::Args;

/// A history to recover.
#[derive(Debug, Args)]
pub(crate) struct Trace {
    /// What to find: flux, radiant-flux or gas (its temperature) [default: the one that the case has]
    #[arg(long)]
    pub seek: Option<String>,
    /// Knots beside the corners of the case's own schedule, spread over the time in which that is not zero
    #[arg(long, default_value_t = 20)]
    pub knots: usize,
    /// How smooth: as the noise lets it be (discrepancy), by the corner of the L-curve (l-curve), or a weight
    #[arg(long, default_value = "discrepancy")]
    pub smoothing: String,
}
