//! Options of `history`.

use clap::Args;

/// The quantity to estimate over time, and its regularisation.
#[derive(Debug, Args)]
pub struct HistoryArgs {
    /// Quantity to estimate: flux, radiant-flux or gas (gas temperature) [default: the only one that the case has]
    #[arg(long)]
    pub quantity: Option<String>,
    /// Number of knots, in addition to the corners of the case's own schedule; the quantity is linear between knots
    #[arg(long, default_value_t = 20)]
    pub knots: usize,
    /// Choice of the Tikhonov regularisation weight: discrepancy (principle), l-curve (corner), or the weight itself
    #[arg(long, default_value = "discrepancy")]
    pub smoothing: String,
}
