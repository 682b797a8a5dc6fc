//! Whether answers can be used: one rule for the marches behind all of them.

use super::answers::Answers;
use super::validity::{discretisation_failure, inaccuracy, unusable};
use crate::case::Case;
use crate::plan::ErrorEstimate;

impl Answers {
    /// Why these answers cannot be used, if they cannot: the first march behind one of them that failed or is too
    /// inaccurate. Of a sweep these are the members that are not extreme; of members that are drawn elsewhere, those at
    /// corners of the bounds.
    pub(crate) fn unusable_reason(&self) -> Option<String> {
        let cases: Vec<&Case> = std::iter::once(&self.case).chain(&self.other_cases).collect();
        let tolerance_k = self.case.resolution.tolerance_k;
        let of_error = |error_k: Option<f64>, tolerance_k: Option<f64>| {
            unusable(discretisation_failure(&ErrorEstimate::of_temperature(error_k?, tolerance_k?)))
        };
        let nominal = || self.nominal.as_ref().and_then(|nominal| nominal.unusable_reason(&self.case));
        let fitted = || {
            let mut fits = self.estimated.iter().flat_map(|found| &found.fitted).zip(&cases);
            fits.find_map(|(fit, case)| fit.after.unusable_reason(case))
        };
        let compared = || {
            let mut fits = self.model_comparison.iter().flat_map(|found| &found.estimated.fitted);
            fits.find_map(|fit| unusable(inaccuracy(fit.after.error_estimate.as_ref(), &fit.after.balance)))
        };
        let posterior = || {
            let mut errors_k = self.posterior.iter().flat_map(|found| &found.discretisation_errors_k).zip(&cases);
            errors_k.find_map(|(error_k, case)| of_error(*error_k, case.resolution.tolerance_k))
        };
        let swept = || {
            let found = self.uncertainty.as_ref()?.discretisation_error.as_ref()?;
            of_error(found.others.temperature_k, tolerance_k)
        };
        let corners_k = || self.nominal.as_ref()?.error_estimate.as_ref()?.corners_k;
        let covered = || self.coverage_study.as_ref().and_then(|_| of_error(corners_k(), tolerance_k));
        let sized = || {
            let sizing = self.sizing.as_ref()?;
            unusable(inaccuracy(sizing.error_estimate.as_ref(), &sizing.balance.unwrap_or_default()))
        };
        let traded = || {
            let mut layups = self.trade.iter().flat_map(|trade| &trade.layups);
            layups.find_map(|layup| unusable(inaccuracy(layup.error_estimate.as_ref(), &layup.balance)))
        };
        let recovered = || {
            let found = self.flux_inversion.as_ref()?;
            of_error(found.discretisation_error_k, tolerance_k).or_else(|| unusable(inaccuracy(None, &found.balance)))
        };
        let designed = || {
            let mut scenarios = self.experiment_design.iter().flat_map(|design| &design.scenarios);
            scenarios.find_map(|scenario| {
                let reached = scenario.error_estimate.as_ref();
                let corners_k = reached.and_then(|reached| reached.corners_k);
                unusable(inaccuracy(reached, &scenario.balance)).or_else(|| of_error(corners_k, tolerance_k))
            })
        };
        let marches: [(&str, &dyn Fn() -> Option<String>); 10] = [
            ("the nominal march", &nominal),
            ("the march at the estimate", &fitted),
            ("the march at the estimate of the other case", &compared),
            ("the march at an end of the posterior", &posterior),
            ("the march of a member", &swept),
            ("the march at a corner of the bounds", &covered),
            ("the march at the required thickness", &sized),
            ("the march of a layup", &traded),
            ("the march with the heating found", &recovered),
            ("the march of a design", &designed),
        ];
        marches.into_iter().find_map(|(march, reason)| reason().map(|reason| format!("{march} {reason}")))
    }
}
