//! The heating quantity at the hot face that the inversion estimates.

use super::InversionError;
use crate::case::{Case, Emissivity, Exposure, Face, OpenFace, Schedule};

/// The time-dependent quantity that heats the hot face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum HeatingQuantity {
    /// Cold-wall heat flux, W/m².
    Flux,
    /// Incident radiant flux, W/m².
    RadiantFlux,
    /// Temperature of the gas coupled to the face by a film coefficient, K.
    Gas,
}

impl HeatingQuantity {
    /// Every quantity that can be estimated.
    pub const ALL: [Self; 3] = [Self::Flux, Self::RadiantFlux, Self::Gas];

    /// The value of `--quantity`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flux => "flux",
            Self::RadiantFlux => "radiant-flux",
            Self::Gas => "gas",
        }
    }

    /// The value without heating; `None` for a gas temperature.
    pub(super) fn unheated_value(self) -> Option<f64> {
        match self {
            Self::Flux | Self::RadiantFlux => Some(0.0),
            Self::Gas => None,
        }
    }

    /// Least value of a variable: a flux may cool the face where the case's own flux does. Incident radiation is never
    /// negative, nor is a temperature.
    pub(super) fn least_value(self, own: &Schedule) -> f64 {
        if self == Self::Flux && own.lowest() < 0.0 { f64::NEG_INFINITY } else { 0.0 }
    }

    /// Scale of a variable where the case's own schedule is zero throughout, W/m² or K.
    pub(super) fn default_scale(self) -> f64 {
        match self {
            Self::Flux | Self::RadiantFlux => 1e5,
            Self::Gas => 1e3,
        }
    }

    /// The requested quantity, or the only one that heats the hot face of the case. Without heating it is the gas
    /// temperature where there is a film, else the flux.
    ///
    /// # Errors
    /// When the hot face is held, lacks the requested quantity, or has several and none is requested.
    pub(super) fn for_case(case: &Case, requested: Option<Self>) -> Result<Self, InversionError> {
        let Face::Open(open) = &case.exposure.hot_face else {
            return Err(InversionError::HeldFace { case: case.id.clone() });
        };
        if let Some(requested) = requested {
            return match requested.unavailable_reason(open) {
                None => Ok(requested),
                Some(reason) => {
                    Err(InversionError::QuantityMissing { case: case.id.clone(), quantity: requested.name(), reason })
                }
            };
        }
        let heats = |quantity: &Self| match quantity {
            Self::Flux => open.flux_w_m2.acts(),
            Self::RadiantFlux => open.radiant_w_m2.acts() && open.emissivity != Emissivity::Constant(0.0),
            Self::Gas => open.heating_scales_film,
        };
        match Self::ALL.into_iter().filter(heats).collect::<Vec<_>>()[..] {
            [one] => Ok(one),
            [] if open.film_w_m2_k.acts() => Ok(Self::Gas),
            [] => match Self::Flux.unavailable_reason(open) {
                None => Ok(Self::Flux),
                Some(reason) => {
                    let quantity = Self::Flux.name();
                    Err(InversionError::QuantityMissing { case: case.id.clone(), quantity, reason })
                }
            },
            [first, second, ..] => {
                let (first, second) = (first.name(), second.name());
                Err(InversionError::AmbiguousQuantity { case: case.id.clone(), first, second })
            }
        }
    }

    /// Why a face lacks this quantity.
    fn unavailable_reason(self, open: &OpenFace) -> Option<&'static str> {
        match self {
            Self::Flux | Self::RadiantFlux if open.heating_scales_film => {
                Some("the hot face is convective: kind = \"heated\" has fluxes, this one takes `gas`")
            }
            Self::Flux if open.enthalpy_film_kg_m2_s.is_some() => {
                Some("the hot face has an `enthalpy_film_coefficient` in place of a `flux`")
            }
            Self::RadiantFlux if open.emissivity == Emissivity::Constant(0.0) => {
                Some("the emissivity of the hot face is zero, so it absorbs no radiation")
            }
            Self::Gas if !open.film_w_m2_k.acts() => {
                Some("the hot face has no film: give it a `heat_transfer_coefficient` and a `gas`")
            }
            _ => None,
        }
    }

    /// Whether blowing reduces the quantity.
    pub(super) fn is_reduced_by_blowing(self, exposure: &Exposure) -> bool {
        self == Self::Flux && matches!(&exposure.hot_face, Face::Open(open) if open.is_blown())
    }

    /// The schedule of an open face.
    pub(super) fn schedule(self, face: &Face) -> Option<&Schedule> {
        let Face::Open(open) = face else { return None };
        Some(match self {
            Self::Flux => &open.flux_w_m2,
            Self::RadiantFlux => &open.radiant_w_m2,
            Self::Gas => &open.gas_k,
        })
    }

    /// The exposure with another schedule of this quantity; unchanged where the hot face is held.
    pub(super) fn with_schedule(self, exposure: &Exposure, schedule: Schedule) -> Exposure {
        let mut exposure = exposure.clone();
        if let Face::Open(open) = &mut exposure.hot_face {
            match self {
                Self::Flux => open.flux_w_m2 = schedule,
                Self::RadiantFlux => open.radiant_w_m2 = schedule,
                Self::Gas => open.gas_k = schedule,
            }
        }
        exposure
    }
}
