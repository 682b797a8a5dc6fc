//! What happens at the two faces through time.

use super::check::{Field, positive};
use super::table::{Schedule, rising};
use super::unit::Dimension;

/// The surroundings of a layup through the march.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Exposure {
    /// From the start to the end of the march, above zero, s.
    pub duration_s: f64,
    /// Temperature at the start over depth below the hot face (m, K): straight lines between points,
    /// held beyond them; one point is a uniform start.
    pub initial_k: Vec<(f64, f64)>,
    /// Gas pressure at the hot face, Pa; throughout the layup where no gas flows by Darcy's law. It enters through
    /// k(T, P).
    pub pressure_pa: Schedule,
    /// Gas pressure at a back face that lets gas through, Pa; `None` is sealed.
    pub back_pressure_pa: Option<Schedule>,
    /// What the layup loses sideways.
    pub holder: Option<Holder>,
    /// The face that is heated.
    pub hot_face: Face,
    /// The face at the bondline.
    pub back_face: Face,
}

/// One face of the layup. Heat flux is positive into the layup at either face.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Face {
    /// One that takes up and gives off heat.
    Open(OpenFace),
    /// Temperature prescribed through time, K. A measured trace here is the thermocouple driver.
    Held(Schedule),
}

/// A face that takes up and gives off heat: any of the terms may be zero.
///
/// `q = flux (h_r − h_w(T))/(h_r − h_w(T_cw)) + ε radiant + film (gas − T) + ε σ (surroundings⁴ − T⁴)`
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct OpenFace {
    /// Cold-wall heat flux, W/m².
    pub flux_w_m2: Schedule,
    /// Recovery enthalpy of the hot-wall correction, J/kg; `None` leaves the flux as given.
    pub recovery_enthalpy_j_kg: Option<f64>,
    /// Incident radiant flux, absorbed with the emissivity (grey surface), W/m².
    pub radiant_w_m2: Schedule,
    /// Film coefficient, W/m²/K.
    pub film_w_m2_k: f64,
    /// Whether the heating factor scales the film: so on a convective hot face, not on a lossy one.
    pub film_heats: bool,
    /// Temperature of the gas of the film, K.
    pub gas_k: Schedule,
    /// What it radiates and absorbs with.
    pub emissivity: Emissivity,
    /// Temperature that it radiates to, zero for space, K.
    pub surroundings_k: Schedule,
    /// λ of the blowing correction: 0.5 for a laminar and 0.4 for a turbulent boundary layer, zero for none. It reduces
    /// a flux that has a recovery enthalpy, whose film coefficient is known.
    pub blowing: f64,
}

/// A holder around the layup, a heat sink that every cell feels.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Holder {
    /// Conductance to the holder in a volume of layup, W/m³/K.
    pub conductance_w_m3_k: f64,
    /// Of the holder, K.
    pub temperature_k: Schedule,
}

/// Emissivity of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Emissivity {
    /// That of the ply's material, over temperature.
    Material,
    /// A constant given by the case; zero neither radiates nor absorbs.
    Constant(f64),
}

impl Emissivity {
    /// The constant that a case gives, 0 to 1.
    pub(super) fn checked(constant: f64) -> Result<Self, String> {
        if (0.0..=1.0).contains(&constant) {
            return Ok(Self::Constant(constant));
        }
        Err(format!("emissivity {constant} lies outside 0 to 1"))
    }
}

impl Face {
    fn check(&self, at: &Field<'_>) {
        match self {
            Self::Held(temperature_k) => temperature_k.check(at, Dimension::Temperature),
            Self::Open(open) => open.check(at),
        }
    }
}

impl OpenFace {
    /// λ of the blowing correction; it needs a film coefficient, which a flux has by its recovery enthalpy.
    pub(super) fn checked_blowing(lambda: f64, has_recovery: bool) -> Result<f64, String> {
        if !(0.0..=1.0).contains(&lambda) {
            return Err(format!("blowing {lambda} lies outside 0 to 1: 0.5 laminar, 0.4 turbulent"));
        }
        if lambda > 0.0 && !has_recovery {
            return Err("blowing reduces a `flux` with a `recovery_enthalpy`, and there is none".to_owned());
        }
        Ok(lambda)
    }

    fn check(&self, at: &Field<'_>) {
        if let Some(recovery_j_kg) = self.recovery_enthalpy_j_kg {
            at.positive("recovery_enthalpy_j_kg", recovery_j_kg);
        }
        at.not_negative("film_w_m2_k", self.film_w_m2_k);
        self.gas_k.check(&at.field("gas_k"), Dimension::Temperature);
        if let Emissivity::Constant(constant) = self.emissivity {
            at.field("emissivity").require(Emissivity::checked(constant));
        }
        self.surroundings_k.check(&at.field("surroundings_k"), Dimension::Surroundings);
        at.field("blowing").require(Self::checked_blowing(self.blowing, self.recovery_enthalpy_j_kg.is_some()));
    }

    /// A face through which nothing passes.
    pub fn insulated() -> Self {
        Self {
            flux_w_m2: Schedule::constant(0.0),
            recovery_enthalpy_j_kg: None,
            radiant_w_m2: Schedule::constant(0.0),
            film_w_m2_k: 0.0,
            film_heats: false,
            gas_k: Schedule::constant(300.0),
            emissivity: Emissivity::Constant(0.0),
            surroundings_k: Schedule::constant(300.0),
            blowing: 0.0,
        }
    }

    /// Whether nothing passes, at no instant.
    pub fn is_insulated(&self) -> bool {
        let is_never = |flux: &Schedule| flux.values.iter().all(|&w_m2| w_m2 == 0.0);
        is_never(&self.flux_w_m2)
            && is_never(&self.radiant_w_m2)
            && self.film_w_m2_k == 0.0
            && self.emissivity == Emissivity::Constant(0.0)
    }
}

impl Exposure {
    /// Record what is wrong with each field.
    pub(super) fn check(&self, at: &Field<'_>) {
        at.positive("duration_s", self.duration_s);
        let initial = at.field("initial_k");
        if self.initial_k.is_empty() {
            initial.fault("no temperature at the start: expected one point at least");
        }
        let mut last_m = f64::NEG_INFINITY;
        initial.require_each(&self.initial_k, |&(depth_m, temperature_k)| {
            last_m = rising("depth", last_m, depth_m, false)?;
            positive(temperature_k, format_args!("temperature {temperature_k} K"))
        });
        at.field("pressure_pa").require(self.pressure_pa.check_pressure());
        at.field("back_pressure_pa").require(self.back_pressure_pa.as_ref().map_or(Ok(()), Schedule::check_pressure));
        if let Some(holder) = &self.holder {
            let at = at.field("holder");
            at.positive("conductance_w_m3_k", holder.conductance_w_m3_k);
            holder.temperature_k.check(&at.field("temperature_k"), Dimension::Temperature);
        }
        self.hot_face.check(&at.field("hot_face"));
        self.back_face.check(&at.field("back_face"));
    }

    /// The coldest of what the layup starts at and of all that it gives heat to, K. No temperature of it falls below, but for what
    /// reactions take up; nothing but zero is known where a flux draws heat off.
    pub fn coldest_k(&self) -> f64 {
        let least = |schedule: &Schedule| schedule.values.iter().copied().fold(f64::INFINITY, f64::min);
        let of_face = |face: &Face| match face {
            Face::Held(temperature_k) => least(temperature_k),
            Face::Open(open) if least(&open.flux_w_m2) < 0.0 || least(&open.radiant_w_m2) < 0.0 => 0.0,
            Face::Open(open) => {
                let gas_k = if open.film_w_m2_k > 0.0 { least(&open.gas_k) } else { f64::INFINITY };
                let radiates = open.emissivity != Emissivity::Constant(0.0);
                let surroundings_k = if radiates { least(&open.surroundings_k) } else { f64::INFINITY };
                gas_k.min(surroundings_k)
            }
        };
        let start_k = self.initial_k.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
        let holder_k = self.holder.as_ref().map_or(f64::INFINITY, |holder| least(&holder.temperature_k));
        start_k.min(holder_k).min(of_face(&self.hot_face)).min(of_face(&self.back_face))
    }

    /// Temperature at the start at a depth below the hot face, K.
    pub fn initial_at(&self, depth_m: f64) -> f64 {
        let points = &self.initial_k;
        let next = points.partition_point(|&(depth, _)| depth <= depth_m);
        if next == 0 {
            points[0].1
        } else if next == points.len() {
            points[next - 1].1
        } else {
            let ((d0, t0), (d1, t1)) = (points[next - 1], points[next]);
            t0 + (t1 - t0) * (depth_m - d0) / (d1 - d0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_gets_colder_than_its_start_and_what_it_gives_heat_to_unless_a_flux_draws_it_off() {
        let mut open = OpenFace { film_w_m2_k: 10.0, gas_k: Schedule::constant(280.0), ..OpenFace::insulated() };
        let of = |initial_k: f64, open: &OpenFace, holder: Option<Holder>| {
            let exposure = Exposure {
                duration_s: 1.0,
                initial_k: vec![(0.0, 400.0), (1.0, initial_k)],
                pressure_pa: Schedule::constant(1e5),
                back_pressure_pa: None,
                holder,
                hot_face: Face::Open(open.clone()),
                back_face: Face::Held(Schedule { times_s: vec![0.0, 1.0], values: vec![500.0, 275.0] }),
            };
            exposure.coldest_k()
        };
        assert_eq!([of(270.0, &open, None), of(300.0, &open, None)], [270.0, 275.0]);
        open.gas_k = Schedule::constant(250.0);
        assert_eq!(of(300.0, &open, None), 250.0);
        let cold = Schedule::constant(200.0);
        assert_eq!(of(300.0, &open, Some(Holder { conductance_w_m3_k: 1.0, temperature_k: cold.clone() })), 200.0);
        // What it neither touches nor sees may be as cold as it likes.
        open = OpenFace { surroundings_k: cold, ..OpenFace::insulated() };
        assert_eq!(of(300.0, &open, None), 275.0);
        open.emissivity = Emissivity::Material;
        assert_eq!(of(300.0, &open, None), 200.0);
        open.flux_w_m2 = Schedule::constant(-1.0);
        assert_eq!(of(300.0, &open, None), 0.0);
    }

    #[test]
    fn a_face_is_insulated_only_where_nothing_passes_at_any_instant() {
        let insulated = OpenFace::insulated();
        assert!(insulated.is_insulated());
        // What would pass does not matter where nothing takes it up.
        assert!(OpenFace { surroundings_k: Schedule::constant(900.0), ..insulated.clone() }.is_insulated());
        let late = || Schedule { times_s: vec![0.0, 1.0], values: vec![0.0, -1.0] };
        for passes in [
            OpenFace { flux_w_m2: late(), ..insulated.clone() },
            OpenFace { radiant_w_m2: late(), ..insulated.clone() },
            OpenFace { film_w_m2_k: 1e-6, ..insulated.clone() },
            OpenFace { emissivity: Emissivity::Material, ..insulated.clone() },
            OpenFace { emissivity: Emissivity::Constant(0.1), ..insulated.clone() },
        ] {
            assert!(!passes.is_insulated(), "{passes:?}");
        }
    }
}
