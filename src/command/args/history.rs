//! Options of `history`.

use clap::Args;

/// The quantity to estimate over time, and its regularisation.
#[derive(Debug, Args)]
pub struct HistoryArgs {
    /// Quantity to estimate: flux, radiant-flux or gas (gas temperature) [default: the only one that the case has]
    #[arg(long)]
    pub quantity: Option<String>,
    /// Number of knots, in addition to the corners of the case's own schedule; the quantity is linear between knots
    /// [default: half as many as the samples of a sensor, at most 40]
    #[arg(long)]
    pub knots: Option<usize>,
    /// Tikhonov regularisation weight [default: least expected error, by restricted likelihood]
    #[arg(long)]
    pub smoothing: Option<String>,
}
