//! Initial temperature and boundary conditions of a layup.

use super::air::cold_wall_enthalpy_j_kg;
use super::table::{Schedule, checked_increasing};
use super::unit::Dimension;
use super::validation::{FieldPath, checked_layup_temperature_k, positive};
use crate::limits::DURATION_S;

/// Temperature at which the enthalpy of air is zero, K.
const AIR_ENTHALPY_ZERO_K: f64 = 298.0;

/// Initial and boundary conditions of a layup.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Exposure {
    /// Duration, above zero, s.
    pub duration_s: f64,
    /// Initial temperature over depth below the hot face (m, K): piecewise linear, constant outside the points.
    pub initial_k: Vec<(f64, f64)>,
    /// Gas pressure at the hot face, Pa. Without Darcy flow it is the pressure of the whole layup, used in k(T, p).
    pub pressure_pa: Schedule,
    /// Gas pressure at a permeable back face, Pa; `None` for a sealed one.
    pub back_pressure_pa: Option<Schedule>,
    /// Lateral heat loss.
    pub holder: Option<Holder>,
    /// The heated face.
    pub hot_face: Face,
    /// The face at the bondline.
    pub back_face: Face,
}

/// One face of the layup. Heat flux is positive into the layup at either face.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[expect(clippy::large_enum_variant, reason = "a case has two faces; a box would be in every literal of an open one")]
pub enum Face {
    /// Heat flux condition: imposed flux, convection and radiation.
    Open(OpenFace),
    /// Prescribed temperature, K, such as the measured trace of a thermocouple driver.
    Held(Schedule),
}

/// A face with an imposed flux, convection and radiation; any term may be zero.
///
/// `q = flux (h_r − h_w(T))/(h_r − h_w(T_cw)) + ε radiant + film (gas − T) + ε σ (surroundings⁴ − T⁴)`, where
/// `enthalpy film (h_r − h_w(T))` may take the place of the first term.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct OpenFace {
    /// Cold-wall heat flux, W/m².
    pub flux_w_m2: Schedule,
    /// Recovery enthalpy relative to air at 298 K, J/kg: of the hot-wall correction, then above that of air at the cold
    /// wall, or of the enthalpy film. `None` leaves the flux as given.
    pub recovery_enthalpy_j_kg: Option<Schedule>,
    /// Film coefficient ρuC_H of the difference of recovery enthalpy and enthalpy of air at the wall, kg/m²/s. It takes
    /// the place of the flux, which is then zero.
    pub enthalpy_film_kg_m2_s: Option<Schedule>,
    /// Incident radiant flux, W/m²; the absorptivity equals the emissivity (grey surface).
    pub radiant_w_m2: Schedule,
    /// Film coefficient, W/m²/K.
    pub film_w_m2_k: Schedule,
    /// Whether a heating factor scales the film: yes if convection heats the face, no if it cools it.
    pub heating_scales_film: bool,
    /// Gas temperature of the film, K.
    pub gas_k: Schedule,
    /// Emissivity and absorptivity.
    pub emissivity: Emissivity,
    /// Temperature of the radiative surroundings, 0 for space, K.
    pub surroundings_k: Schedule,
    /// λ of the blowing correction: 0.5 for a laminar and 0.4 for a turbulent boundary layer, 0 for none. It needs a
    /// recovery enthalpy, from which the film coefficient follows.
    pub blowing: Schedule,
}

/// A specimen holder around the layup, coupled to every cell.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Holder {
    /// Conductance to the holder per volume of layup, W/m³/K.
    pub conductance_w_m3_k: f64,
    /// Temperature of the holder, K.
    pub temperature_k: Schedule,
}

/// Emissivity of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub enum Emissivity {
    /// The emissivity of the ply's material, over temperature.
    Material,
    /// A constant, 0 to 1.
    Constant(f64),
}

impl Emissivity {
    /// A constant emissivity, 0 to 1.
    pub(super) fn checked_constant(constant: f64) -> Result<Self, String> {
        if (0.0..=1.0).contains(&constant) {
            return Ok(Self::Constant(constant));
        }
        Err(format!("emissivity {constant} lies outside 0 to 1"))
    }
}

impl Face {
    fn schedules(&self) -> Vec<&Schedule> {
        match self {
            Self::Held(temperature_k) => vec![temperature_k],
            Self::Open(open) => {
                let always = [
                    &open.flux_w_m2,
                    &open.radiant_w_m2,
                    &open.film_w_m2_k,
                    &open.gas_k,
                    &open.surroundings_k,
                    &open.blowing,
                ];
                always.into_iter().chain(&open.recovery_enthalpy_j_kg).chain(&open.enthalpy_film_kg_m2_s).collect()
            }
        }
    }

    fn check(&self, at: &FieldPath<'_>) {
        match self {
            Self::Held(temperature_k) => temperature_k.check(at, Dimension::LayupTemperature),
            Self::Open(open) => open.check(at),
        }
    }
}

impl OpenFace {
    /// λ of the blowing correction, which needs a recovery enthalpy.
    pub(super) fn checked_blowing(lambda: Schedule, has_recovery: bool) -> Result<Schedule, String> {
        if let Some(lambda) = lambda.values.iter().find(|lambda| !(0.0..=1.0).contains(*lambda)) {
            return Err(format!("expected blowing from 0 to 1 (0.5 laminar, 0.4 turbulent), found {lambda}"));
        }
        if lambda.acts() && !has_recovery {
            return Err("blowing needs a flux with a recovery enthalpy: found none".to_owned());
        }
        Ok(lambda)
    }

    /// The recovery enthalpy of a hot-wall correction, which divides by its excess over that at the cold wall.
    pub(super) fn checked_hot_wall(enthalpy_j_kg: Schedule) -> Result<Schedule, String> {
        let (lowest_j_kg, cold_wall_j_kg) = (enthalpy_j_kg.lowest(), cold_wall_enthalpy_j_kg());
        if lowest_j_kg > cold_wall_j_kg {
            return Ok(enthalpy_j_kg);
        }
        Err(format!(
            "expected a recovery enthalpy above that of air at the cold wall, {cold_wall_j_kg} J/kg, found \
             {lowest_j_kg} J/kg: with `enthalpy_film_coefficient` in place of `flux` it may be lower"
        ))
    }

    /// Whether gas that leaves reduces the flux at some time.
    pub fn is_blown(&self) -> bool {
        self.blowing.acts()
    }

    fn check(&self, at: &FieldPath<'_>) {
        match (&self.recovery_enthalpy_j_kg, &self.enthalpy_film_kg_m2_s) {
            (Some(recovery_j_kg), None) => {
                at.child("recovery_enthalpy_j_kg").require(Self::checked_hot_wall(recovery_j_kg.clone()));
            }
            (None, Some(_)) => {
                at.child("enthalpy_film_kg_m2_s").error("an enthalpy film needs a recovery enthalpy: found none");
            }
            _ => {}
        }
        if let Some(film) = &self.enthalpy_film_kg_m2_s {
            at.child("enthalpy_film_kg_m2_s").require(film.check_not_negative());
            if self.flux_w_m2.acts() {
                at.child("flux_w_m2").error("expected a flux of zero beside an enthalpy film");
            }
        }
        at.child("film_w_m2_k").require(self.film_w_m2_k.check_not_negative());
        self.gas_k.check(&at.child("gas_k"), Dimension::Temperature);
        if let Emissivity::Constant(constant) = self.emissivity {
            at.child("emissivity").require(Emissivity::checked_constant(constant));
        }
        self.surroundings_k.check(&at.child("surroundings_k"), Dimension::Surroundings);
        let has_recovery = self.recovery_enthalpy_j_kg.is_some();
        at.child("blowing").require(Self::checked_blowing(self.blowing.clone(), has_recovery));
    }

    /// An adiabatic face.
    pub fn insulated() -> Self {
        Self {
            flux_w_m2: Schedule::constant(0.0),
            recovery_enthalpy_j_kg: None,
            enthalpy_film_kg_m2_s: None,
            radiant_w_m2: Schedule::constant(0.0),
            film_w_m2_k: Schedule::constant(0.0),
            heating_scales_film: false,
            gas_k: Schedule::constant(300.0),
            emissivity: Emissivity::Constant(0.0),
            surroundings_k: Schedule::constant(300.0),
            blowing: Schedule::constant(0.0),
        }
    }

    /// Whether the face is adiabatic at all times.
    pub fn is_insulated(&self) -> bool {
        let flows = [&self.flux_w_m2, &self.radiant_w_m2, &self.film_w_m2_k];
        !flows.into_iter().chain(&self.enthalpy_film_kg_m2_s).any(Schedule::acts)
            && self.emissivity == Emissivity::Constant(0.0)
    }
}

impl Exposure {
    /// A duration above zero, s.
    pub(super) fn checked_duration_s(duration_s: f64) -> Result<f64, String> {
        DURATION_S.check(positive(duration_s, duration_s)?).map(|()| duration_s)
    }

    /// Record all errors of the fields.
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        at.child("duration_s").require(Self::checked_duration_s(self.duration_s));
        let initial = at.child("initial_k");
        if self.initial_k.is_empty() {
            initial.error("no initial temperature: expected at least one point");
        }
        let mut last_m = f64::NEG_INFINITY;
        initial.require_each(&self.initial_k, |&(depth_m, temperature_k)| {
            last_m = checked_increasing("depth", last_m, depth_m, false)?;
            checked_layup_temperature_k(temperature_k)
        });
        at.child("pressure_pa").require(self.pressure_pa.check_pressure());
        at.child("back_pressure_pa").require(self.back_pressure_pa.as_ref().map_or(Ok(()), Schedule::check_pressure));
        if let Some(holder) = &self.holder {
            let at = at.child("holder");
            at.positive("conductance_w_m3_k", holder.conductance_w_m3_k);
            holder.temperature_k.check(&at.child("temperature_k"), Dimension::Temperature);
        }
        self.hot_face.check(&at.child("hot_face"));
        self.back_face.check(&at.child("back_face"));
    }

    /// All schedules.
    pub(crate) fn schedules(&self) -> impl Iterator<Item = &Schedule> {
        let faces = [&self.hot_face, &self.back_face].into_iter().flat_map(Face::schedules);
        let holder = self.holder.as_ref().map(|holder| &holder.temperature_k);
        faces.chain([&self.pressure_pa]).chain(&self.back_pressure_pa).chain(holder)
    }

    /// Lower bound of all temperatures without endothermic reactions, K: the lowest of the initial, gas, surroundings
    /// and holder temperatures, or 0 if an imposed flux or a recovery enthalpy below that at 298 K can cool.
    pub fn lower_temperature_bound_k(&self) -> f64 {
        let of_face = |face: &Face| match face {
            Face::Held(temperature_k) => temperature_k.lowest(),
            Face::Open(open) if open.flux_w_m2.lowest() < 0.0 || open.radiant_w_m2.lowest() < 0.0 => 0.0,
            Face::Open(open) => {
                let enthalpy_j_kg = open.enthalpy_film_kg_m2_s.as_ref().and(open.recovery_enthalpy_j_kg.as_ref());
                let recovered_k = enthalpy_j_kg.map_or(f64::INFINITY, |enthalpy_j_kg| {
                    if enthalpy_j_kg.lowest() < 0.0 { 0.0 } else { AIR_ENTHALPY_ZERO_K }
                });
                let gas_k = if open.film_w_m2_k.acts() { open.gas_k.lowest() } else { f64::INFINITY };
                let radiates = open.emissivity != Emissivity::Constant(0.0);
                let surroundings_k = if radiates { open.surroundings_k.lowest() } else { f64::INFINITY };
                gas_k.min(surroundings_k).min(recovered_k)
            }
        };
        let start_k = self.initial_k.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
        let holder_k = self.holder.as_ref().map_or(f64::INFINITY, |holder| holder.temperature_k.lowest());
        start_k.min(holder_k).min(of_face(&self.hot_face)).min(of_face(&self.back_face))
    }

    /// Initial temperature at a depth below the hot face, K.
    pub fn initial_temperature_k(&self, depth_m: f64) -> f64 {
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
    fn the_lower_temperature_bound_is_the_coldest_heat_sink_or_zero_with_a_cooling_flux() {
        let mut open = OpenFace {
            film_w_m2_k: Schedule::constant(10.0),
            gas_k: Schedule::constant(280.0),
            ..OpenFace::insulated()
        };
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
            exposure.lower_temperature_bound_k()
        };
        assert_eq!([of(270.0, &open, None), of(300.0, &open, None)], [270.0, 275.0]);
        open.gas_k = Schedule::constant(250.0);
        assert_eq!(of(300.0, &open, None), 250.0);
        let cold = Schedule::constant(200.0);
        assert_eq!(of(300.0, &open, Some(Holder { conductance_w_m3_k: 1.0, temperature_k: cold.clone() })), 200.0);
        // Without emissivity the surroundings do not count.
        open = OpenFace { surroundings_k: cold, ..OpenFace::insulated() };
        assert_eq!(of(300.0, &open, None), 275.0);
        open.emissivity = Emissivity::Material;
        assert_eq!(of(300.0, &open, None), 200.0);
        // Recovery at 298 K heats the hot face; below it cools.
        open = OpenFace { enthalpy_film_kg_m2_s: Some(Schedule::constant(0.1)), ..OpenFace::insulated() };
        for (enthalpy_j_kg, expected_k) in [(0.0, 275.0), (-1e3, 0.0)] {
            open.recovery_enthalpy_j_kg = Some(Schedule::constant(enthalpy_j_kg));
            assert_eq!(of(300.0, &open, None), expected_k);
        }
        open = OpenFace { flux_w_m2: Schedule::constant(-1.0), ..OpenFace::insulated() };
        assert_eq!(of(300.0, &open, None), 0.0);
    }

    #[test]
    fn a_face_is_insulated_only_if_every_flux_is_zero_at_all_times() {
        let insulated = OpenFace::insulated();
        assert!(insulated.is_insulated());
        // Without emissivity the surroundings do not count.
        assert!(OpenFace { surroundings_k: Schedule::constant(900.0), ..insulated.clone() }.is_insulated());
        let late = || Schedule { times_s: vec![0.0, 1.0], values: vec![0.0, -1.0] };
        for passes in [
            OpenFace { flux_w_m2: late(), ..insulated.clone() },
            OpenFace { radiant_w_m2: late(), ..insulated.clone() },
            OpenFace { film_w_m2_k: late(), ..insulated.clone() },
            OpenFace { enthalpy_film_kg_m2_s: Some(late()), ..insulated.clone() },
            OpenFace { emissivity: Emissivity::Material, ..insulated.clone() },
            OpenFace { emissivity: Emissivity::Constant(0.1), ..insulated.clone() },
        ] {
            assert!(!passes.is_insulated(), "{passes:?}");
        }
    }
}
