//! A pyrometer: a sensor of the radiation of the hot face.

use super::exposure::{Emissivity, Face};
use super::material::Material;
use super::validation::FieldPath;
use crate::numerics::planck::Radiance;

/// Wavelengths of pyrometers, m: from the visible to the far infrared.
const WAVELENGTHS_M: (f64, f64) = (0.2e-6, 100e-6);

/// A pyrometer that looks at the hot face and reads a brightness temperature.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Pyrometer {
    /// The wavelengths that it sees.
    pub spectrum: Spectrum,
    /// The emissivity that it is set to, above 0 to 1.
    pub emissivity: f64,
}

/// The wavelengths that a pyrometer sees, m.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub enum Spectrum {
    /// One wavelength.
    Wavelength(f64),
    /// A band from a shorter to a longer wavelength, all of it with the same sensitivity.
    Band(f64, f64),
}

impl Spectrum {
    /// The radiance of a black body in it.
    pub(crate) fn radiance(self) -> Radiance {
        match self {
            Self::Wavelength(wavelength_m) => Radiance::at_wavelength(wavelength_m),
            Self::Band(shorter_m, longer_m) => Radiance::in_band(shorter_m, longer_m),
        }
    }

    /// A wavelength of a pyrometer, m.
    pub(super) fn checked_wavelength_m(wavelength_m: f64) -> Result<f64, String> {
        let (shortest_m, longest_m) = WAVELENGTHS_M;
        if (shortest_m..=longest_m).contains(&wavelength_m) {
            return Ok(wavelength_m);
        }
        let [shortest, longest, found] = [shortest_m, longest_m, wavelength_m].map(rounded_um);
        Err(format!("expected a wavelength from {shortest} µm to {longest} µm, found {found} µm"))
    }

    /// A band of a pyrometer.
    pub(super) fn checked_band(shorter_m: f64, longer_m: f64) -> Result<Self, String> {
        let (shorter_m, longer_m) = (Self::checked_wavelength_m(shorter_m)?, Self::checked_wavelength_m(longer_m)?);
        if shorter_m < longer_m {
            return Ok(Self::Band(shorter_m, longer_m));
        }
        let [shorter, longer] = [shorter_m, longer_m].map(rounded_um);
        Err(format!("expected a band from a shorter to a longer wavelength, found {shorter} µm to {longer} µm"))
    }
}

/// Micrometres for messages.
fn rounded_um(wavelength_m: f64) -> f64 {
    (wavelength_m * 1e10).round() / 1e4
}

impl Pyrometer {
    /// The emissivity that a pyrometer is set to.
    pub(super) fn checked_emissivity(emissivity: f64) -> Result<f64, String> {
        if emissivity > 0.0 && emissivity <= 1.0 {
            return Ok(emissivity);
        }
        Err(format!("expected an emissivity above 0, at most 1, found {emissivity}"))
    }

    /// Require a hot face whose radiation is known from its temperature: one that is not held and has one emissivity
    /// over temperature. That of a ply whose char radiates otherwise depends on its conversion.
    pub(super) fn check_face(face: &Face, ply: &str, material: &Material) -> Result<(), String> {
        let open = match face {
            Face::Held(_) => {
                return Err("a pyrometer needs a hot face that is not held: found kind \"held\"".to_owned());
            }
            Face::Open(open) => open,
        };
        if open.emissivity == Emissivity::Constant(0.0) {
            return Err("a pyrometer needs a hot face that radiates: its emissivity is 0".to_owned());
        }
        let residues = material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let other = residues.map(|residue| &residue.emissivity).find(|emissivity| **emissivity != material.emissivity);
        if open.emissivity == Emissivity::Material && other.is_some() {
            return Err(format!(
                "the emissivity of ply {ply:?} changes as it decomposes: a pyrometer needs an `emissivity` of the hot \
                 face"
            ));
        }
        Ok(())
    }

    /// Record all errors of the fields.
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        at.child("emissivity").require(Self::checked_emissivity(self.emissivity));
        at.child("spectrum").require(match self.spectrum {
            Spectrum::Wavelength(wavelength_m) => Spectrum::checked_wavelength_m(wavelength_m).map(drop),
            Spectrum::Band(shorter_m, longer_m) => Spectrum::checked_band(shorter_m, longer_m).map(drop),
        });
    }
}
