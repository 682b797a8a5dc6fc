//! Which quantity of the hot face is sought through time.

use super::HistoryError;
use crate::case::{Case, Emissivity, Exposure, Face, OpenFace, Schedule};

/// What heats the hot face through time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Sought {
    /// Cold-wall heat flux, W/m².
    Flux,
    /// Incident radiant flux, W/m².
    RadiantFlux,
    /// Temperature of the gas that a film couples to the face, K.
    Gas,
}

impl Sought {
    /// Every quantity that can be sought.
    pub const ALL: [Self; 3] = [Self::Flux, Self::RadiantFlux, Self::Gas];

    /// As `--seek` has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flux => "flux",
            Self::RadiantFlux => "radiant-flux",
            Self::Gas => "gas",
        }
    }

    /// A value at which nothing heats.
    pub(super) fn rest(self) -> Option<f64> {
        match self {
            Self::Flux | Self::RadiantFlux => Some(0.0),
            Self::Gas => None,
        }
    }

    /// What a variable of one means where the case's own schedule is zero throughout, W/m² or K.
    pub(super) fn scale(self) -> f64 {
        match self {
            Self::Flux | Self::RadiantFlux => 1e5,
            Self::Gas => 1e3,
        }
    }

    /// That of a case: the one that is asked for, or the only one that heats its hot face. A face that nothing heats is sought a flux
    /// for, unless a film couples it to a gas.
    ///
    /// # Errors
    /// When the hot face is held, has not what is asked for, or has several and none is asked for.
    pub(super) fn of(case: &Case, asked: Option<Self>) -> Result<Self, HistoryError> {
        let Face::Open(open) = &case.exposure.hot_face else {
            return Err(HistoryError::Held { case: case.id.clone() });
        };
        if let Some(asked) = asked {
            return match asked.lacks(open) {
                None => Ok(asked),
                Some(reason) => Err(HistoryError::Absent { case: case.id.clone(), sought: asked.name(), reason }),
            };
        }
        let is_heated = |schedule: &Schedule| schedule.values.iter().any(|value| *value != 0.0);
        let heats = |sought: &Self| match sought {
            Self::Flux => is_heated(&open.flux_w_m2),
            Self::RadiantFlux => is_heated(&open.radiant_w_m2) && open.emissivity != Emissivity::Constant(0.0),
            Self::Gas => open.film_heats,
        };
        match Self::ALL.into_iter().filter(heats).collect::<Vec<_>>()[..] {
            [one] => Ok(one),
            [] if open.film_w_m2_k > 0.0 => Ok(Self::Gas),
            [] => Ok(Self::Flux),
            [first, second, ..] => {
                let (first, second) = (first.name(), second.name());
                Err(HistoryError::Several { case: case.id.clone(), first, second })
            }
        }
    }

    /// Why a face cannot be sought this for.
    fn lacks(self, open: &OpenFace) -> Option<&'static str> {
        match self {
            Self::Flux | Self::RadiantFlux if open.film_heats => {
                Some("the hot face is convective: kind = \"heated\" has fluxes, this one takes `gas`")
            }
            Self::RadiantFlux if open.emissivity == Emissivity::Constant(0.0) => {
                Some("the emissivity of the hot face is zero, so that it absorbs nothing")
            }
            Self::Gas if open.film_w_m2_k <= 0.0 => {
                Some("the hot face has no film: give it a `coefficient` and a `gas`")
            }
            _ => None,
        }
    }

    /// Whether gas that leaves the face reduces it.
    pub(super) fn is_blown(self, exposure: &Exposure) -> bool {
        self == Self::Flux && matches!(&exposure.hot_face, Face::Open(open) if open.blowing > 0.0)
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

    /// An exposure with another schedule of it; one whose hot face is held has none.
    pub(super) fn driven(self, exposure: &Exposure, schedule: Schedule) -> Exposure {
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
