//! Scale factors: the parameters that are varied, estimated and uncertain.

use super::validation::{FieldPath, checked_index, checked_name, positive};

/// A multiplier of one property of a group of plies, of the exposure or of a sensor depth.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Factor {
    /// Unique name: letters, digits, `_` and `-`.
    pub name: String,
    /// The group, ply or sensor to scale; empty if the property belongs to no ply, or for all plies.
    pub group: String,
    /// The property to scale.
    pub property: Property,
    /// The state whose conductivity is scaled, `virgin` or the name of a residue; `None` for all states.
    pub state: Option<String>,
    /// Value in the nominal member, within the small side constraints.
    pub nominal: f64,
    /// Small side constraints, low and high: the default of all studies.
    pub small: (f64, f64),
    /// Large side constraints.
    pub large: (f64, f64),
}

/// The property that a factor scales.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
pub enum Property {
    /// The whole conductivity.
    Conductivity,
    /// The solid part of a three-part conductivity.
    ConductivitySolid,
    /// The gas part of a three-part conductivity.
    ConductivityGas,
    /// The radiative part of a three-part conductivity.
    ConductivityRadiative,
    /// Heat capacity of the plies of the group.
    HeatCapacity,
    /// Density of the plies of the group.
    Density,
    /// Emissivity of a hot or back face whose ply is in the group.
    Emissivity,
    /// Thickness of each ply of the group.
    Thickness,
    /// Pre-exponential factors of all reactions.
    PreExponential,
    /// Activation energies of all reactions.
    ActivationEnergy,
    /// Heats of all reactions; not available with absolute enthalpies.
    PyrolysisHeat,
    /// Char mass per virgin mass; the mass losses of the reactions keep their ratios.
    CharYield,
    /// Permeability of the virgin material and of all residues.
    Permeability,
    /// Heat flux and radiant flux of the hot face; also its film if the face is convective.
    Heating,
    /// Contact conductance of the interfaces below the plies of the group; of all interfaces without a group.
    ContactConductance,
    /// Convection and radiation of the back face.
    BackFaceLoss,
    /// Conductance to the holder.
    HolderLoss,
    /// Depth of the sensor that `group` names.
    SensorDepth,
}

/// All properties in the order of the enum: property, key in a case file, name in a sentence.
const PROPERTIES: [(Property, &str, &str); 18] = [
    (Property::Conductivity, "conductivity", "conductivity"),
    (Property::ConductivitySolid, "conductivity.solid", "solid part of the conductivity"),
    (Property::ConductivityGas, "conductivity.gas", "gas part of the conductivity"),
    (Property::ConductivityRadiative, "conductivity.radiative", "radiative part of the conductivity"),
    (Property::HeatCapacity, "heat_capacity", "heat capacity"),
    (Property::Density, "density", "density"),
    (Property::Emissivity, "emissivity", "emissivity"),
    (Property::Thickness, "thickness", "thickness"),
    (Property::PreExponential, "pre_exponential", "rates of reaction"),
    (Property::ActivationEnergy, "activation_energy", "activation energies"),
    (Property::PyrolysisHeat, "pyrolysis_heat", "heat of pyrolysis"),
    (Property::CharYield, "char_yield", "char yield"),
    (Property::Permeability, "permeability", "permeability"),
    (Property::Heating, "heating", "heating of the hot face"),
    (Property::ContactConductance, "contact_conductance", "contact conductance"),
    (Property::BackFaceLoss, "back_face_loss", "losses from the back face"),
    (Property::HolderLoss, "holder_loss", "losses to the holder"),
    (Property::SensorDepth, "sensor_depth", "depth"),
];

impl Property {
    /// Key in a case file: `heat_capacity`.
    pub fn key(self) -> &'static str {
        self.entry().1
    }

    /// Name in a sentence: `heat capacity`.
    pub fn label(self) -> &'static str {
        self.entry().2
    }

    /// The keys of all properties.
    pub fn keys() -> impl Iterator<Item = &'static str> {
        PROPERTIES.iter().map(|(_, key, _)| *key)
    }

    /// The property with this key.
    pub fn named(key: &str) -> Option<Self> {
        PROPERTIES.iter().find(|(_, known, _)| *known == key).map(|(property, ..)| *property)
    }

    fn entry(self) -> &'static (Self, &'static str, &'static str) {
        // A test below checks that the order is the order of the enum.
        &PROPERTIES[self as usize]
    }

    /// Whether a factor on it may have a group: of plies, or a sensor.
    pub(super) fn allows_group(self) -> bool {
        !matches!(self, Self::Heating | Self::BackFaceLoss | Self::HolderLoss)
    }

    /// Whether a factor on it must have a group.
    pub(super) fn needs_group(self) -> bool {
        self.allows_group() && self != Self::ContactConductance
    }

    /// Whether it is a conductivity or a part of one, which can be scaled in one state only.
    pub fn is_conductivity(self) -> bool {
        self == Self::Conductivity || self.is_conductivity_part()
    }

    /// Whether it is a part of a conductivity.
    pub fn is_conductivity_part(self) -> bool {
        matches!(self, Self::ConductivitySolid | Self::ConductivityGas | Self::ConductivityRadiative)
    }
}

/// Correlation of the factors when members are sampled: the correlation matrix of a Gaussian copula. Empty for
/// independent factors.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Correlation {
    pairs: Vec<(usize, usize, f64)>,
    /// Cholesky factor of the correlation matrix: rows of the lower triangle.
    cholesky_rows: Vec<Vec<f64>>,
}

impl Correlation {
    /// The matrix of `factors` factors from pairs of indices with their correlation; all other correlations are zero.
    ///
    /// # Errors
    /// A message, if an index is out of range, a pair has one factor twice or is listed twice, a correlation is not
    /// between −1 and 1, or the matrix is not positive definite.
    pub fn new(factors: usize, pairs: &[(usize, usize, f64)]) -> Result<Self, String> {
        if pairs.is_empty() {
            return Ok(Self::default());
        }
        for (position, &(one, other, value)) in pairs.iter().enumerate() {
            Self::checked_pair(
                checked_index(one, factors, "factor")?,
                checked_index(other, factors, "factor")?,
                &pairs[..position],
            )?;
            Self::checked_value(value)?;
        }
        let correlation = |a: usize, b: usize| {
            let pair = pairs.iter().find(|&&(one, other, _)| (one, other) == (a, b) || (one, other) == (b, a));
            if a == b { 1.0 } else { pair.map_or(0.0, |&(_, _, value)| value) }
        };
        // Cholesky factorisation; a pivot below this is the rounding error of a singular matrix.
        const PIVOT: f64 = 1e-9;
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(factors);
        for a in 0..factors {
            let mut row: Vec<f64> = Vec::with_capacity(a + 1);
            for (b, above) in rows.iter().enumerate() {
                let known: f64 = row.iter().zip(above).map(|(one, other)| one * other).sum();
                row.push((correlation(a, b) - known) / above[b]);
            }
            let pivot = 1.0 - row.iter().map(|weight| weight * weight).sum::<f64>();
            if pivot.is_nan() || pivot <= PIVOT {
                return Err("these correlations exclude each other: their matrix is not positive definite".to_owned());
            }
            row.push(pivot.sqrt());
            rows.push(row);
        }
        Ok(Self { pairs: pairs.to_vec(), cholesky_rows: rows })
    }

    /// A pair of different factors that is not among the previous pairs.
    pub(super) fn checked_pair(
        one: usize,
        other: usize,
        before: &[(usize, usize, f64)],
    ) -> Result<(usize, usize), String> {
        if one == other {
            return Err("a factor is paired with itself: expected two different factors".to_owned());
        }
        if before.iter().any(|&(a, b, _)| (a, b) == (one, other) || (a, b) == (other, one)) {
            return Err("the correlation of these two factors is stated twice".to_owned());
        }
        Ok((one, other))
    }

    /// A correlation between −1 and 1.
    pub(super) fn checked_value(value: f64) -> Result<f64, String> {
        if value.abs() < 1.0 {
            return Ok(value);
        }
        Err(format!("expected a correlation above -1 and below 1, found {value}"))
    }

    /// Record an error if the size of the matrix is not the number of factors.
    pub(super) fn check(&self, at: &FieldPath<'_>, factors: usize) {
        if !self.is_empty() && self.cholesky_rows.len() != factors {
            at.error(format!("expected correlations of {factors} factors, found {}", self.cholesky_rows.len()));
        }
    }

    /// Whether the factors are independent.
    pub fn is_empty(&self) -> bool {
        self.cholesky_rows.is_empty()
    }

    /// Pairs of factor indices with their correlation.
    pub fn pairs(&self) -> &[(usize, usize, f64)] {
        &self.pairs
    }

    /// Cholesky factor of the correlation matrix: rows of the lower triangle; empty for independent factors.
    pub fn cholesky_rows(&self) -> &[Vec<f64>] {
        &self.cholesky_rows
    }
}

/// The choice between the two side constraints of a factor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Bounds {
    /// The key `small` of each factor.
    #[default]
    Small,
    /// The key `large` of each factor.
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

    /// The bounds with this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Small, Self::Large].into_iter().find(|bounds| bounds.name() == name)
    }
}

impl Factor {
    /// The name, if `--set NAME=VALUE` and `--start NAME=VALUE,…` can parse it.
    pub(super) fn checked_name(name: &str) -> Result<&str, String> {
        if checked_name(name)?.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
            return Ok(name);
        }
        Err(format!("invalid factor name {name:?}: expected letters, digits, `_` and `-`, such as \"f_k_INS\""))
    }

    /// Side constraints, low and high, if both are above zero and in this order.
    pub(super) fn checked_bounds((low, high): (f64, f64)) -> Result<(f64, f64), String> {
        if !(positive(low, low).is_ok() && positive(high, high).is_ok()) {
            return Err(format!("expected bounds above 0, found {low} to {high}"));
        }
        if low >= high {
            return Err(format!("bounds reversed: {low} is not below {high}"));
        }
        Ok((low, high))
    }

    /// The large side constraints, if they contain the small ones.
    pub(super) fn checked_large(large: (f64, f64), small: (f64, f64)) -> Result<(f64, f64), String> {
        if large.0 > small.0 || large.1 < small.1 {
            return Err(format!(
                "expected large bounds that contain the small bounds {} to {}, found {} to {}",
                small.0, small.1, large.0, large.1
            ));
        }
        Ok(large)
    }

    /// The nominal value, if it lies within the small side constraints.
    pub(super) fn checked_nominal(nominal: f64, small: (f64, f64)) -> Result<f64, String> {
        if !(small.0..=small.1).contains(&nominal) {
            return Err(format!("nominal {nominal} lies outside the small bounds {} to {}", small.0, small.1));
        }
        Ok(nominal)
    }

    /// Record all errors of name, bounds and nominal value.
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        at.child("name").require(Self::checked_name(&self.name));
        let small = at.child("small").require(Self::checked_bounds(self.small));
        let large = at.child("large").require(Self::checked_bounds(self.large));
        if let Some((small, large)) = small.zip(large) {
            at.child("large").require(Self::checked_large(large, small));
        }
        if let Some(small) = small {
            at.child("nominal").require(Self::checked_nominal(self.nominal, small));
        }
    }

    /// The side constraints, low and high.
    pub fn bounds(&self, bounds: Bounds) -> (f64, f64) {
        match bounds {
            Bounds::Small => self.small,
            Bounds::Large => self.large,
        }
    }

    /// Standard deviations of the prior below and above the nominal value: each bound lies two of them away. They are
    /// those of the distribution before it is cut off at the bounds; see
    /// [`prior_standard_deviation`](Self::prior_standard_deviation).
    pub fn prior_deviations(&self, bounds: Bounds) -> [f64; 2] {
        let (low, high) = self.bounds(bounds);
        [(self.nominal - low).max(0.0) / 2.0, (high - self.nominal).max(0.0) / 2.0]
    }

    /// Standard deviation of the prior, a split normal distribution with these two: the width for linear analyses. A
    /// quarter of the width of the bounds where the nominal value is their middle. Sampled members never leave the
    /// bounds; their standard deviation is 0.88 of it between symmetric bounds, 0.83 with the nominal value at a bound.
    pub fn prior_standard_deviation(&self, bounds: Bounds) -> f64 {
        let [below, above] = self.prior_deviations(bounds);
        ((1.0 - std::f64::consts::FRAC_2_PI) * (above - below).powi(2) + above * below).sqrt()
    }

    /// The lowest and the highest value that the small or the large side constraints allow.
    pub fn widest_bounds(&self) -> (f64, f64) {
        (self.small.0.min(self.large.0), self.small.1.max(self.large.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_property_is_found_by_its_index_and_its_key() {
        for (row, (property, key, _)) in PROPERTIES.iter().enumerate() {
            assert_eq!((*property as usize, Property::named(key)), (row, Some(*property)));
        }
        assert_eq!(Property::named("conductance"), None);
    }

    /// A normal variable restricted to one side of its mean has √(1 − 2/π) of its standard deviation.
    #[test]
    fn the_prior_of_an_off_centre_factor_has_a_standard_deviation_on_each_side() {
        let factor = |nominal: f64, small| Factor {
            name: "f".to_owned(),
            group: String::new(),
            property: Property::Heating,
            state: None,
            nominal,
            small,
            large: small,
        };
        let central = factor(1.0, (0.75, 1.25));
        assert_eq!(central.prior_deviations(Bounds::Small), [0.125, 0.125]);
        assert!((central.prior_standard_deviation(Bounds::Small) - 0.125).abs() < 1e-15);
        let one_sided = factor(1.0, (1.0, 1.3));
        let [below, above] = one_sided.prior_deviations(Bounds::Small);
        assert!(below == 0.0 && (above - 0.15).abs() < 1e-15);
        let expected = 0.15 * (1.0 - 2.0 / std::f64::consts::PI).sqrt();
        assert!((one_sided.prior_standard_deviation(Bounds::Small) - expected).abs() < 1e-15);
    }

    /// Variance of a standard normal variable between −2 and 2: 1 − 4φ(2)/(1 − 2Φ(−2)) = 0.7737; between 0 and 2 its
    /// standard deviation is 0.5013, without the cut 0.6028.
    #[test]
    fn the_sampled_standard_deviation_is_that_share_of_the_prior_one_that_the_documentation_states() {
        for ((low, high), share) in [((0.75, 1.25), 0.8796), ((1.0, 1.3), 0.8316), ((0.7, 1.0), 0.8316)] {
            let factor = Factor {
                name: "f".to_owned(),
                group: String::new(),
                property: Property::Heating,
                state: None,
                nominal: 1.0,
                small: (low, high),
                large: (low, high),
            };
            let of_kind = |kind| {
                let marginal = crate::ensemble::Marginal::new(1.0, (low, high), kind);
                let values: Vec<f64> =
                    (0..10_000).map(|node| marginal.quantile((f64::from(node) + 0.5) / 1e4)).collect();
                let mean = values.iter().sum::<f64>() / 1e4;
                (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 1e4).sqrt()
            };
            let prior = factor.prior_standard_deviation(Bounds::Small);
            let found = of_kind(crate::ensemble::SamplingKind::Normal) / prior;
            // The midpoint rule of 10,000 nodes and four digits of the shares.
            assert!((found - share).abs() < 2e-4, "{found}, not {share}, between {low} and {high}");
            // Negative control: a uniform distribution has another share.
            let uniform = of_kind(crate::ensemble::SamplingKind::Uniform) / prior;
            assert!((uniform - share).abs() > 0.1, "{uniform}");
        }
    }

    #[test]
    fn invalid_correlations_are_refused() {
        let of = |pairs: &[(usize, usize, f64)]| Correlation::new(3, pairs).map(|_| ());
        assert_eq!(of(&[(0, 1, 0.6), (1, 2, 0.6)]), Ok(()));
        for (pairs, message) in [
            (&[(0, 3, 0.5)][..], "expected a factor index below 3, found 3"),
            (&[(1, 1, 0.5)], "a factor is paired with itself"),
            (&[(0, 1, 0.5), (1, 0, 0.5)], "the correlation of these two factors is stated twice"),
            (&[(0, 1, f64::NAN)], "expected a correlation above -1 and below 1, found NaN"),
            (&[(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)], "their matrix is not positive definite"),
        ] {
            assert!(of(pairs).is_err_and(|found| found.contains(message)), "{pairs:?}");
        }
    }
}
