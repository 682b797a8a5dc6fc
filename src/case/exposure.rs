//! What happens at the two faces through time.

use super::table::Schedule;

/// The surroundings of a layup through the march.
#[derive(Clone, Debug)]
pub struct Exposure {
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
    pub hot_face: Face,
    pub back_face: Face,
}

/// One face of the layup. Heat flux is positive into the layup at either face.
#[derive(Clone, Debug)]
pub enum Face {
    Open(OpenFace),
    /// Temperature prescribed through time, K. A measured trace here is the thermocouple driver.
    Held(Schedule),
}

/// A face that takes up and gives off heat: any of the terms may be zero.
///
/// `q = flux (h_r − h_w(T))/(h_r − h_w(T_cw)) + ε radiant + film (gas − T) + ε σ (surroundings⁴ − T⁴)`
#[derive(Clone, Debug)]
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
    pub gas_k: Schedule,
    pub emissivity: Emissivity,
    pub surroundings_k: Schedule,
    /// λ of the blowing correction: 0.5 for a laminar and 0.4 for a turbulent boundary layer, zero for none. It reduces
    /// a flux that has a recovery enthalpy, whose film coefficient is known.
    pub blowing: f64,
}

/// A holder around the layup, a heat sink that every cell feels.
#[derive(Clone, Debug)]
pub struct Holder {
    /// Conductance to the holder in a volume of layup, W/m³/K.
    pub conductance_w_m3_k: f64,
    pub temperature_k: Schedule,
}

/// Emissivity of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emissivity {
    /// That of the ply's material, over temperature.
    Material,
    /// A constant given by the case; zero neither radiates nor absorbs.
    Constant(f64),
}

impl OpenFace {
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
}

impl Exposure {
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
