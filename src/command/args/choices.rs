//! Options with a fixed list of values.

use clap::ValueEnum;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendArg {
    /// A hardware GPU if there is one and the run is long enough to pay for opening it, otherwise the CPU
    Auto,
    /// The CPU
    Cpu,
    /// Any Vulkan device, including software
    Gpu,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PrecisionArg {
    /// Single precision
    F32,
    /// Double precision
    F64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SamplingArg {
    /// Normal, with two standard deviations at each bound, truncated there
    Normal,
    /// Uniform between the bounds
    Uniform,
    /// Latin hypercube
    Lhs,
    /// Scrambled Sobol sequence
    Sobol,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CriterionArg {
    /// Determinant of the covariance of the factors: the volume of their confidence region
    D,
    /// Sum of the variances of the factors, in units of their priors
    A,
    /// Variance of the predicted peak of the target (c-optimality)
    C,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BoundsArg {
    /// The key `small` of each factor
    Small,
    /// The key `large` of each factor
    Large,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PriorArg {
    /// No prior
    None,
    /// Two standard deviations at the small bounds
    Small,
    /// Two standard deviations at the large bounds
    Large,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MinimiserArg {
    /// Steps within a trust region, whose radius follows the ratio of actual to predicted reduction
    TrustRegion,
    /// Damping times ten after a failed step and divided by ten after a successful one, as in the paper
    Paper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DerivativeArg {
    /// Exact derivatives (forward-mode automatic differentiation)
    Tangent,
    /// Central differences, as in the paper
    Difference,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KeepArg {
    /// Factors, status and peak temperatures
    Members,
    /// These, and the temperatures over time in a second file
    Traces,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TemplateArg {
    /// Cloth, insulation and gas barrier under a square heat pulse
    Layup,
    /// Felt whose hot face is held at the readings of a thermocouple
    HeldFace,
    /// An insulator that decomposes, with gas flow
    Decomposition,
    /// A test with thermocouple readings, from which factors are estimated
    Estimate,
}

impl TemplateArg {
    /// Names and descriptions of all templates.
    pub fn all() -> impl Iterator<Item = (String, String)> {
        let values = Self::value_variants().iter().filter_map(Self::to_possible_value);
        values.map(|value| {
            let description = value.get_help().map(ToString::to_string).unwrap_or_default();
            (value.get_name().to_owned(), description)
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OutsideArg {
    /// The end value
    Clamp,
    /// The line of the last two rows, continued
    Extrapolate,
    /// A member that leaves the table fails
    Error,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PatoHeatArg {
    /// Enthalpies of virgin and char with the heat of formation, as PATO by default
    Absolute,
    /// Heats h of the reactions
    OfReaction,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DirectionArg {
    /// First direction
    I,
    /// Second direction
    J,
    /// Third direction
    K,
}
