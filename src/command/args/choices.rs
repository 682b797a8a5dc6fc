//! Options with a fixed list of values.

use clap::ValueEnum;

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
