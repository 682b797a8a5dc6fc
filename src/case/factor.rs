//! Scale factors: what is varied, estimated and doubted.

/// A multiplier on one property of one group of plies, or on an exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    pub name: String,
    /// The group, the one ply or the sensor whose property it scales; empty where the property has no ply, or it scales all.
    pub group: String,
    pub property: Property,
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
