//! Scale factors: what is varied, estimated and doubted.

use super::check::{Field, index, positive};

/// A multiplier on one property of one group of plies, or on an exposure.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Factor {
    /// A name that no other factor has: letters, digits, `_` and `-`.
    pub name: String,
    /// The group, the one ply or the sensor whose property it scales; empty where the property has no ply, or it scales all.
    pub group: String,
    /// What it multiplies.
    pub property: Property,
    /// The one state of the plies whose conductivity it scales, `virgin` or a residue by its name; all of them where there is none.
    pub state: Option<String>,
    /// Its value in the nominal member, within the small side constraints.
    pub nominal: f64,
    /// Small side constraints, low and high: the default of every study.
    pub small: (f64, f64),
    /// Large side constraints.
    pub large: (f64, f64),
}

/// What a factor multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Property {
    /// The whole conductivity.
    Conductivity,
    /// The solid part of a three-part conductivity.
    ConductivitySolid,
    /// The gas part of a three-part conductivity.
    ConductivityGas,
    /// The radiative part of a three-part conductivity.
    ConductivityRadiative,
    /// Of the plies of the group.
    HeatCapacity,
    /// Of the plies of the group.
    Density,
    /// Of a face, hot or back, whose ply is in the group.
    Emissivity,
    /// Of each ply of the group.
    Thickness,
    /// The rates of all reactions.
    Kinetics,
    /// The activation energies of all reactions.
    ActivationEnergy,
    /// The heats of all reactions, where they are written of them.
    PyrolysisHeat,
    /// What is left as a share of the virgin mass; the losses share what is gone as before.
    CharYield,
    /// Of the virgin substance and of every residue.
    Permeability,
    /// Heat flux and radiant flux on the hot face; its film too where the face is convective.
    Heating,
    /// Contact conductance of the interfaces under the plies of the group, of every interface where there is none.
    Contact,
    /// Film and radiation of the back face.
    Loss,
    /// Conductance to the holder.
    Holder,
    /// Of the sensor of the group's name, below the hot face.
    Depth,
}

/// Every property, its word in a case file, and what it is called in a sentence.
const PROPERTIES: [(Property, &str, &str); 18] = [
    (Property::Conductivity, "conductivity", "conductivity"),
    (Property::ConductivitySolid, "conductivity.solid", "solid part of the conductivity"),
    (Property::ConductivityGas, "conductivity.gas", "gas part of the conductivity"),
    (Property::ConductivityRadiative, "conductivity.radiative", "radiative part of the conductivity"),
    (Property::HeatCapacity, "heat_capacity", "heat capacity"),
    (Property::Density, "density", "density"),
    (Property::Emissivity, "emissivity", "emissivity"),
    (Property::Thickness, "thickness", "thickness"),
    (Property::Kinetics, "kinetics", "rates of reaction"),
    (Property::ActivationEnergy, "activation_energy", "activation energies"),
    (Property::PyrolysisHeat, "pyrolysis_heat", "heat of pyrolysis"),
    (Property::CharYield, "char_yield", "char yield"),
    (Property::Permeability, "permeability", "permeability"),
    (Property::Heating, "heating", "heating of the hot face"),
    (Property::Contact, "contact", "contact conductance"),
    (Property::Loss, "loss", "losses from the back face"),
    (Property::Holder, "holder", "losses to the holder"),
    (Property::Depth, "depth", "depth"),
];

impl Property {
    /// Its word in a case file: `heat_capacity`.
    pub fn key(self) -> &'static str {
        self.row().1
    }

    /// What it is called in a sentence: `heat capacity`.
    pub fn words(self) -> &'static str {
        self.row().2
    }

    /// The words of all properties in a case file.
    pub fn keys() -> impl Iterator<Item = &'static str> {
        PROPERTIES.iter().map(|(_, key, _)| *key)
    }

    /// The property of a word of a case file, if there is one.
    pub fn named(key: &str) -> Option<Self> {
        PROPERTIES.iter().find(|(_, known, _)| *known == key).map(|(property, ..)| *property)
    }

    fn row(self) -> &'static (Self, &'static str, &'static str) {
        // The test below finds each property in its own row.
        &PROPERTIES[self as usize]
    }

    /// Whether it belongs to plies or to a sensor, which a factor names by its group.
    pub(super) fn has_group(self) -> bool {
        !matches!(self, Self::Heating | Self::Loss | Self::Holder)
    }

    /// Whether it scales all where a factor names no group.
    pub(super) fn needs_group(self) -> bool {
        self.has_group() && self != Self::Contact
    }

    /// Whether it is a conductivity or a part of one, which the states of a ply have each of their own.
    pub fn is_conductivity(self) -> bool {
        self == Self::Conductivity || self.is_part()
    }

    /// Whether it is a part of a conductivity.
    pub fn is_part(self) -> bool {
        matches!(self, Self::ConductivitySolid | Self::ConductivityGas | Self::ConductivityRadiative)
    }
}

/// Which factors go together: the correlations of their normal scores, which a Gaussian copula makes of them. None at all
/// where each is drawn by itself.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Correlation {
    pairs: Vec<(usize, usize, f64)>,
    /// Lower triangular factor of the matrix, row after row, each up to its diagonal.
    rows: Vec<Vec<f64>>,
}

impl Correlation {
    /// Of so many factors, from pairs of them and their correlation; all others go together by nothing.
    ///
    /// # Errors
    /// A message, where a pair names a factor that there is not, one factor twice or a pair before it, where a correlation
    /// does not lie above −1 and below 1, or where no factors can go together so.
    pub fn new(factors: usize, pairs: &[(usize, usize, f64)]) -> Result<Self, String> {
        if pairs.is_empty() {
            return Ok(Self::default());
        }
        for (place, &(one, other, value)) in pairs.iter().enumerate() {
            Self::checked_pair(index(one, factors, "factor")?, index(other, factors, "factor")?, &pairs[..place])?;
            Self::checked_value(value)?;
        }
        let between = |a: usize, b: usize| {
            let pair = pairs.iter().find(|&&(one, other, _)| (one, other) == (a, b) || (one, other) == (b, a));
            if a == b { 1.0 } else { pair.map_or(0.0, |&(_, _, value)| value) }
        };
        // Cholesky's factorisation; a pivot below this is rounding of a matrix that is singular.
        const PIVOT: f64 = 1e-9;
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(factors);
        for a in 0..factors {
            let mut row: Vec<f64> = Vec::with_capacity(a + 1);
            for (b, above) in rows.iter().enumerate() {
                let known: f64 = row.iter().zip(above).map(|(one, other)| one * other).sum();
                row.push((between(a, b) - known) / above[b]);
            }
            let pivot = 1.0 - row.iter().map(|weight| weight * weight).sum::<f64>();
            if pivot.is_nan() || pivot <= PIVOT {
                return Err(
                    "no factors can go together as these correlations say: their matrix is not positive definite"
                        .to_owned(),
                );
            }
            row.push(pivot.sqrt());
            rows.push(row);
        }
        Ok(Self { pairs: pairs.to_vec(), rows })
    }

    /// Two factors, which differ and are no pair of those before.
    pub(super) fn checked_pair(
        one: usize,
        other: usize,
        before: &[(usize, usize, f64)],
    ) -> Result<(usize, usize), String> {
        if one == other {
            return Err("a factor goes with itself: expected two factors".to_owned());
        }
        if before.iter().any(|&(a, b, _)| (a, b) == (one, other) || (a, b) == (other, one)) {
            return Err("the correlation of these two factors is given already".to_owned());
        }
        Ok((one, other))
    }

    /// A correlation of two factors.
    pub(super) fn checked_value(value: f64) -> Result<f64, String> {
        if value.abs() < 1.0 {
            return Ok(value);
        }
        Err(format!("expected a correlation above -1 and below 1, found {value}"))
    }

    /// Record that the matrix is of other factors than so many.
    pub(super) fn check(&self, at: &Field<'_>, factors: usize) {
        if !self.is_none() && self.rows.len() != factors {
            at.fault(format!("correlations of {} factors: the case has {factors}", self.rows.len()));
        }
    }

    /// Whether each factor is drawn by itself.
    pub fn is_none(&self) -> bool {
        self.rows.is_empty()
    }

    /// Pairs of factors, and the correlation of their normal scores.
    pub fn pairs(&self) -> &[(usize, usize, f64)] {
        &self.pairs
    }

    /// The lower triangular factor of the correlation matrix, row after row, each up to its diagonal; none where each
    /// factor is drawn by itself.
    pub fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }
}

/// Which of a factor's two side constraints hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "kebab-case"))]
pub enum Bounds {
    /// Those of every study by default.
    #[default]
    Small,
    /// The wider ones.
    Large,
}

impl Bounds {
    /// `small` or `large`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Small => "small",
            Self::Large => "large",
        }
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Small, Self::Large].into_iter().find(|bounds| bounds.name() == name)
    }
}

impl Factor {
    /// A name that can stand in `--set NAME=VALUE` and `--start NAME=VALUE,…`.
    pub(super) fn checked_name(name: &str) -> Result<&str, String> {
        if !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
            return Ok(name);
        }
        Err(format!("{name:?} cannot name a factor: expected letters, digits, `_` and `-`, such as \"f_k_INS\""))
    }

    /// Side constraints, low and high, above zero.
    pub(super) fn checked_bounds((low, high): (f64, f64)) -> Result<(f64, f64), String> {
        if !(positive(low, low).is_ok() && positive(high, high).is_ok()) {
            return Err(format!("bounds {low} to {high} are not positive"));
        }
        if low >= high {
            return Err(format!("bounds reversed: {low} is not below {high}"));
        }
        Ok((low, high))
    }

    /// Large side constraints, which hold the small ones.
    pub(super) fn checked_large(large: (f64, f64), small: (f64, f64)) -> Result<(f64, f64), String> {
        if large.0 > small.0 || large.1 < small.1 {
            return Err(format!(
                "large bounds {} to {} do not hold the small {} to {}",
                large.0, large.1, small.0, small.1
            ));
        }
        Ok(large)
    }

    /// The nominal value, which lies within the small side constraints.
    pub(super) fn checked_nominal(nominal: f64, small: (f64, f64)) -> Result<f64, String> {
        if !(small.0..=small.1).contains(&nominal) {
            return Err(format!("nominal {nominal} lies outside the small bounds {} to {}", small.0, small.1));
        }
        Ok(nominal)
    }

    /// Record what is wrong with the name and the numbers.
    pub(super) fn check(&self, at: &Field<'_>) {
        at.field("name").require(Self::checked_name(&self.name));
        let small = at.field("small").require(Self::checked_bounds(self.small));
        let large = at.field("large").require(Self::checked_bounds(self.large));
        if let Some((small, large)) = small.zip(large) {
            at.field("large").require(Self::checked_large(large, small));
        }
        if let Some(small) = small {
            at.field("nominal").require(Self::checked_nominal(self.nominal, small));
        }
    }

    /// The side constraints, low and high.
    pub fn bounds(&self, bounds: Bounds) -> (f64, f64) {
        match bounds {
            Bounds::Small => self.small,
            Bounds::Large => self.large,
        }
    }

    /// One standard deviation of what is known of it: its side constraints lie two from their middle, as the paper has it.
    pub fn deviation(&self, bounds: Bounds) -> f64 {
        let (low, high) = self.bounds(bounds);
        (high - low) / 4.0
    }

    /// The least and the largest value that either side constraint allows.
    pub fn widest(&self) -> (f64, f64) {
        (self.small.0.min(self.large.0), self.small.1.max(self.large.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_property_is_found_in_its_own_row_and_by_its_key() {
        for (row, (property, key, _)) in PROPERTIES.iter().enumerate() {
            assert_eq!((*property as usize, Property::named(key)), (row, Some(*property)));
        }
        assert_eq!(Property::named("conductance"), None);
    }

    #[test]
    fn correlations_that_no_factors_can_have_are_refused() {
        let of = |pairs: &[(usize, usize, f64)]| Correlation::new(3, pairs).map(|_| ());
        assert_eq!(of(&[(0, 1, 0.6), (1, 2, 0.6)]), Ok(()));
        for (pairs, message) in [
            (&[(0, 3, 0.5)][..], "no factor 3: expected an index below 3"),
            (&[(1, 1, 0.5)], "a factor goes with itself"),
            (&[(0, 1, 0.5), (1, 0, 0.5)], "the correlation of these two factors is given already"),
            (&[(0, 1, f64::NAN)], "expected a correlation above -1 and below 1, found NaN"),
            (&[(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)], "their matrix is not positive definite"),
        ] {
            assert!(of(pairs).is_err_and(|said| said.contains(message)), "{pairs:?}");
        }
    }
}
