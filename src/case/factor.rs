//! Scale factors: what is varied, estimated and doubted.

/// A multiplier on one property of one group of plies, or on an exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    pub name: String,
    /// The group, the one ply or the sensor whose property it scales; empty where the property has no ply, or it scales all.
    pub group: String,
    pub property: Property,
    /// The one state of the plies whose conductivity it scales, `virgin` or a residue by its name; all of them where there is none.
    pub state: Option<String>,
    pub nominal: f64,
    /// Small side constraints, low and high: the default of every study.
    pub small: (f64, f64),
    /// Large side constraints.
    pub large: (f64, f64),
}

/// What a factor multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Property {
    /// The whole conductivity.
    Conductivity,
    /// The solid part of a three-part conductivity.
    ConductivitySolid,
    /// The gas part of a three-part conductivity.
    ConductivityGas,
    /// The radiative part of a three-part conductivity.
    ConductivityRadiative,
    HeatCapacity,
    Density,
    /// Of a face, hot or back, whose ply is in the group.
    Emissivity,
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

impl Property {
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
pub struct Correlation {
    pairs: Vec<(usize, usize, f64)>,
    /// Lower triangular factor of the matrix, row after row, each up to its diagonal.
    rows: Vec<Vec<f64>>,
}

impl Correlation {
    /// Of so many factors, from pairs of them and their correlation; all others go together by nothing. `None` where
    /// no factors can go together so: the matrix is not positive definite.
    ///
    /// # Panics
    /// When a pair names a factor that there is not.
    pub fn of(factors: usize, pairs: &[(usize, usize, f64)]) -> Option<Self> {
        if pairs.is_empty() {
            return Some(Self::default());
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
                return None;
            }
            row.push(pivot.sqrt());
            rows.push(row);
        }
        Some(Self { pairs: pairs.to_vec(), rows })
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
pub enum Bounds {
    #[default]
    Small,
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
