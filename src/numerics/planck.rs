//! Brightness temperature by Planck's law.
//!
//! A grey, diffuse face at T emits ε B(T) and reflects (1 − ε) B(T_s) of its surroundings, as in its heat balance. An
//! instrument that is set to an emissivity ε_i and corrects for no reflection reads the T_r with ε_i B(T_r) = ε B(T) +
//! (1 − ε) B(T_s). At one wavelength B ∝ 1/(e^x − 1) with x = c₂/(λT), and T_r has a closed form. In a band from λ₁ to
//! λ₂ B ∝ T⁴ (F(x₂) − F(x₁)), where F(x) = ∫ₓ^∞ u³/(eᵘ − 1) du = Σ e^(−nx) (x³/n + 3x²/n² + 6x/n³ + 6/n⁴), n = 1, 2, …
//! (Chang and Rhee, Int. Comm. Heat Mass Transfer 11, 1984); T_r follows by Newton's method. The radiant flux of a
//! heater that the face reflects is not included: its spectrum is not known.

/// Second radiation constant, m K (CODATA 2018).
const SECOND_RADIATION_CONSTANT_M_K: f64 = 1.438_776_877e-2;

/// Terms of the series of F are left out below this share of the first one.
const LEAST_TERM: f64 = 1e-17;
/// Newton's method ends at a step below this share of 1/T.
const LEAST_STEP: f64 = 1e-15;
/// The method needs about four steps.
const MAX_STEPS: usize = 50;

/// Radiance of a black body in the spectrum of an instrument, as its logarithm up to a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Radiance {
    /// At one wavelength: c₂/λ, K.
    Spectral(f64),
    /// In a band: c₂/λ of its shorter and of its longer wavelength, K.
    Band(f64, f64),
}

/// A reading, and its derivatives by the temperature and by the emissivity of the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Brightness {
    pub(crate) temperature_k: f64,
    pub(crate) by_temperature: f64,
    pub(crate) by_emissivity_k: f64,
}

impl Radiance {
    /// At one wavelength, m.
    pub(crate) fn at_wavelength(wavelength_m: f64) -> Self {
        Self::Spectral(SECOND_RADIATION_CONSTANT_M_K / wavelength_m)
    }

    /// In a band from a shorter to a longer wavelength, m, all of it with the same sensitivity.
    pub(crate) fn in_band(shorter_m: f64, longer_m: f64) -> Self {
        Self::Band(SECOND_RADIATION_CONSTANT_M_K / shorter_m, SECOND_RADIATION_CONSTANT_M_K / longer_m)
    }

    /// Logarithm of the radiance at a temperature, and its derivative by the logarithm of the temperature.
    fn logarithm_and_slope(self, temperature_k: f64) -> (f64, f64) {
        match self {
            Self::Spectral(characteristic_k) => {
                let x = characteristic_k / temperature_k;
                (-x - (-(-x).exp()).ln_1p(), x / -(-x).exp_m1())
            }
            Self::Band(shorter_k, longer_k) => {
                let (x1, x2) = (shorter_k / temperature_k, longer_k / temperature_k);
                // All terms times e^x₂, so that none underflows.
                let between = (x2 - x1).exp();
                let share = scaled_fraction(x2) - between * scaled_fraction(x1);
                let density = |x: f64| x.powi(4) / -(-x).exp_m1();
                let slope = 4.0 + (density(x2) - between * density(x1)) / share;
                (share.ln() - x2 + 4.0 * temperature_k.ln(), slope)
            }
        }
    }

    /// Logarithm of the radiance at a temperature; −∞ at 0 K.
    pub(crate) fn logarithm(self, temperature_k: f64) -> f64 {
        if temperature_k > 0.0 { self.logarithm_and_slope(temperature_k).0 } else { f64::NEG_INFINITY }
    }

    /// The temperature with this logarithm of the radiance, K; the search begins at `start_k`.
    fn temperature_k(self, logarithm: f64, start_k: f64) -> f64 {
        if let Self::Spectral(characteristic_k) = self {
            // x = ln(1 + 1/B)
            let x = if logarithm < 0.0 { logarithm.exp().ln_1p() - logarithm } else { (-logarithm).exp().ln_1p() };
            return characteristic_k / x;
        }
        // The logarithm is nearly linear in 1/T (Wien's law).
        let mut inverse_1_k = 1.0 / start_k;
        for _ in 0..MAX_STEPS {
            let (found, slope) = self.logarithm_and_slope(1.0 / inverse_1_k);
            let step_1_k = (found - logarithm) * inverse_1_k / slope;
            let next_1_k = (inverse_1_k + step_1_k).max(0.5 * inverse_1_k);
            let is_close = (next_1_k - inverse_1_k).abs() <= LEAST_STEP * inverse_1_k;
            inverse_1_k = next_1_k;
            if is_close {
                break;
            }
        }
        1.0 / inverse_1_k
    }

    /// The temperature of a face with this emissivity that an instrument reads as `reading_k`, K: the inverse of
    /// [`brightness`](Self::brightness). `None` if the face would reflect more than is read.
    pub(crate) fn face_temperature_k(
        self,
        setting: f64,
        reading_k: f64,
        emissivity: f64,
        surroundings: f64,
    ) -> Option<f64> {
        let seen = self.logarithm(reading_k) + setting.ln();
        let reflected = ((1.0 - emissivity).ln() + surroundings - seen).exp();
        (reflected < 1.0).then(|| self.temperature_k(seen + (-reflected).ln_1p() - emissivity.ln(), reading_k))
    }

    /// The temperature that an instrument reads from a face with this temperature and emissivity, and its derivatives.
    /// `setting` is the emissivity set at the instrument, `surroundings` the logarithm of the radiance that the face
    /// reflects. NaN unless the temperature is above zero and finite; that of a member that diverged may not be.
    pub(crate) fn brightness(self, setting: f64, temperature_k: f64, emissivity: f64, surroundings: f64) -> Brightness {
        // The series of a band then has no end.
        if !(f64::MIN_POSITIVE..f64::INFINITY).contains(&temperature_k) {
            return Brightness { temperature_k: f64::NAN, by_temperature: f64::NAN, by_emissivity_k: f64::NAN };
        }
        let (own, own_slope) = self.logarithm_and_slope(temperature_k);
        // Radiances relative to the larger one.
        let largest = own.max(surroundings);
        let (emitted, reflected) = ((own - largest).exp(), (surroundings - largest).exp());
        let seen = emissivity * emitted + (1.0 - emissivity) * reflected;
        let reading_k = self.temperature_k(seen.ln() + largest - setting.ln(), temperature_k);
        let slope_1_k = self.logarithm_and_slope(reading_k).1 / reading_k;
        Brightness {
            temperature_k: reading_k,
            by_temperature: emissivity * emitted * own_slope / temperature_k / (seen * slope_1_k),
            by_emissivity_k: (emitted - reflected) / (seen * slope_1_k),
        }
    }
}

/// eˣ F(x), for x above zero; NaN where its cube overflows.
fn scaled_fraction(x: f64) -> f64 {
    let mut sum = 0.0;
    let mut n = 1.0;
    loop {
        let decay = ((1.0 - n) * x).exp();
        let term = decay * (x * x * x / n + 3.0 * x * x / (n * n) + 6.0 * x / (n * n * n) + 6.0 / (n * n * n * n));
        sum += term;
        if term < LEAST_TERM * sum || term.is_nan() {
            return sum;
        }
        n += 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const C2_M_K: f64 = 1.438776877e-2;

    /// Planck's law at a wavelength, up to its constant.
    fn planck(wavelength_m: f64, temperature_k: f64) -> f64 {
        wavelength_m.powi(-5) / (C2_M_K / (wavelength_m * temperature_k)).exp_m1()
    }

    /// Simpson's rule over a band.
    fn band(shorter_m: f64, longer_m: f64, temperature_k: f64) -> f64 {
        const PARTS: usize = 20_000;
        let width_m = (longer_m - shorter_m) / PARTS as f64;
        let weight = |at: usize| {
            if at == 0 || at == PARTS {
                1.0
            } else if at % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let term = |at: usize| weight(at) * planck(shorter_m + width_m * at as f64, temperature_k);
        (0..=PARTS).map(term).sum::<f64>() * width_m / 3.0
    }

    #[test]
    fn a_temperature_that_diverged_has_no_reading() {
        for radiance in [Radiance::in_band(2.2e-6, 3.3e-6), Radiance::in_band(8e-6, 14e-6)] {
            let surroundings = radiance.logarithm(300.0);
            for temperature_k in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -4000.0, 0.0] {
                let read = radiance.brightness(0.9, temperature_k, 0.8, surroundings).temperature_k;
                assert!(!read.is_finite(), "{temperature_k} K reads {read} K");
            }
            assert!(radiance.brightness(0.9, 900.0, 0.8, surroundings).temperature_k.is_finite());
        }
        assert!(scaled_fraction(1e200).is_nan(), "a series that overflows ends");
    }

    #[test]
    fn at_one_wavelength_the_reading_is_the_closed_form_of_planck() {
        for (wavelength_m, temperature_k, emissivity, setting) in [
            (0.65e-6, 1500.0, 0.8, 1.0),
            (0.9e-6, 900.0, 0.6, 0.85),
            (3.9e-6, 600.0, 0.9, 0.7),
            (10e-6, 350.0, 0.5, 0.95),
        ] {
            let radiance = Radiance::at_wavelength(wavelength_m);
            let found = radiance.brightness(setting, temperature_k, emissivity, f64::NEG_INFINITY).temperature_k;
            let x = C2_M_K / (wavelength_m * temperature_k);
            let expected_k = C2_M_K / wavelength_m / (setting / emissivity * x.exp_m1()).ln_1p();
            assert!((found / expected_k - 1.0).abs() < 1e-13, "{found} K, not {expected_k} K");
        }
        // The grey shorthand T (ε/ε_i)^¼ is no approximation: at 0.65 µm it is 59 K off.
        let found = Radiance::at_wavelength(0.65e-6).brightness(1.0, 1500.0, 0.8, f64::NEG_INFINITY);
        assert!((found.temperature_k - 1477.6556).abs() < 1e-3, "{}", found.temperature_k);
    }

    #[test]
    fn in_a_band_radiances_are_the_integral_of_planck_and_the_reading_satisfies_its_definition() {
        for (shorter_m, longer_m) in [(0.7e-6, 1.1e-6), (3.4e-6, 5e-6), (8e-6, 14e-6), (8e-6, 8.001e-6)] {
            let radiance = Radiance::in_band(shorter_m, longer_m);
            let ratio = |hot_k: f64, cold_k: f64| (radiance.logarithm(hot_k) - radiance.logarithm(cold_k)).exp();
            let integral = |temperature_k: f64| band(shorter_m, longer_m, temperature_k);
            let expected = integral(1400.0) / integral(500.0);
            assert!((ratio(1400.0, 500.0) / expected - 1.0).abs() < 1e-9, "{shorter_m}: {expected}");
            let reading_k = radiance.brightness(0.9, 1100.0, 0.7, radiance.logarithm(400.0)).temperature_k;
            let seen = 0.7 * integral(1100.0) + 0.3 * integral(400.0);
            assert!((0.9 * integral(reading_k) / seen - 1.0).abs() < 1e-9, "{shorter_m}: {reading_k} K");
        }
    }

    #[test]
    fn a_reading_gives_back_the_temperature_of_the_face() {
        for radiance in
            [Radiance::at_wavelength(0.9e-6), Radiance::at_wavelength(10e-6), Radiance::in_band(8e-6, 14e-6)]
        {
            for (temperature_k, emissivity, surroundings_k) in
                [(1200.0, 0.7, 450.0), (460.0, 0.9, 450.0), (400.0, 0.4, 0.0), (900.0, 1.0, 300.0)]
            {
                let surroundings = radiance.logarithm(surroundings_k);
                let reading_k = radiance.brightness(0.85, temperature_k, emissivity, surroundings).temperature_k;
                let found_k = radiance.face_temperature_k(0.85, reading_k, emissivity, surroundings);
                assert!(found_k.is_some_and(|found_k| (found_k / temperature_k - 1.0).abs() < 1e-9), "{found_k:?}");
            }
            // A cold reading of a face that reflects hot surroundings is impossible.
            assert_eq!(radiance.face_temperature_k(0.9, 400.0, 0.5, radiance.logarithm(900.0)), None);
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        for radiance in
            [Radiance::at_wavelength(0.9e-6), Radiance::at_wavelength(10e-6), Radiance::in_band(8e-6, 14e-6)]
        {
            let at = |temperature_k, emissivity| {
                radiance.brightness(0.85, temperature_k, emissivity, radiance.logarithm(450.0))
            };
            for (temperature_k, emissivity) in [(1200.0, 0.7), (460.0, 0.9), (400.0, 0.4)] {
                let found = at(temperature_k, emissivity);
                let [above, below] = [1e-3, -1e-3].map(|step_k| at(temperature_k + step_k, emissivity).temperature_k);
                let slope = (above - below) / 2e-3;
                assert!((found.by_temperature / slope - 1.0).abs() < 1e-6, "{radiance:?}: {slope}, {found:?}");
                let [above, below] = [1e-6, -1e-6].map(|step| at(temperature_k, emissivity + step).temperature_k);
                let slope_k = (above - below) / 2e-6;
                assert!((found.by_emissivity_k / slope_k - 1.0).abs() < 1e-5, "{radiance:?}: {slope_k} K, {found:?}");
            }
        }
    }

    #[test]
    fn a_face_in_surroundings_of_its_temperature_is_black_and_a_black_one_is_read_exactly() {
        for radiance in [Radiance::at_wavelength(0.9e-6), Radiance::in_band(8e-6, 14e-6)] {
            let cavity = radiance.brightness(1.0, 800.0, 0.3, radiance.logarithm(800.0)).temperature_k;
            let black = radiance.brightness(1.0, 800.0, 1.0, radiance.logarithm(2000.0)).temperature_k;
            assert!((cavity - 800.0).abs() < 1e-9 && (black - 800.0).abs() < 1e-9, "{cavity} K, {black} K");
            assert_eq!(radiance.logarithm(0.0), f64::NEG_INFINITY);
            // Cold faces are read without underflow.
            let cold = radiance.brightness(0.5, 20.0, 0.9, f64::NEG_INFINITY).temperature_k;
            assert!(cold > 20.0 && cold < 30.0, "{cold} K");
        }
    }
}
