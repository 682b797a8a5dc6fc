//! Corner plot of the posterior, and predictive intervals of every sensor.

use crate::case::Case;
use crate::report::estimate::posterior;
use crate::report::figure::{Axis, CornerVariable, DensityRegion, Figure, Ink, Layer, Stroke};
use crate::report::figures::{CONSTANT_K, file_name, line, measured, temperature_axis, thinned, time_axis};
use crate::report::format;
use crate::study::answers::Answers;
use crate::study::estimate::ParameterEstimates;
use crate::study::posterior::{Posterior, PosteriorPredictive, PredictiveBand};

pub(in crate::report::estimate) fn figures(
    answers: &Answers,
    found: &ParameterEstimates,
    outcome: &Posterior,
) -> Vec<Figure> {
    let mut figures = vec![corner_plot(found, outcome)];
    figures.extend((0..found.factors.len()).map(|factor| chain_traces(found, outcome, factor)));
    for (case, of) in answers.cases().zip(&outcome.predicted) {
        figures.extend((0..case.sensors.len()).filter_map(|sensor| predictive_intervals(answers, case, of, sensor)));
    }
    figures
}

fn corner_plot(found: &ParameterEstimates, outcome: &Posterior) -> Figure {
    let variable = |place: usize| {
        let marginal = &outcome.marginals[place];
        CornerVariable {
            name: found.factors[place].factor.name.clone(),
            range: marginal.histogram_range,
            bin_centres: marginal.bin_centres(),
            shares: marginal.shares.clone(),
            estimate: found.values[place],
            interval: marginal.interval,
        }
    };
    let region = |pair: &crate::study::posterior::PairMarginal| DensityRegion {
        across: pair.factors.0,
        up: pair.factors.1,
        enclosed: pair.enclosed_mass.clone(),
    };
    let several = if outcome.pairs.is_empty() {
        ""
    } else {
        " Below, pairs: regions of highest density with 50 % (dark) and 95 % (light) of the samples."
    };
    Figure {
        id: "corner".to_owned(),
        title: "Posterior of the factors".to_owned(),
        caption: format!(
            "Diagonal: histograms of the samples, 95 % intervals (dashed) and estimates (vermilion).{several} {}",
            posterior::mcmc_summary(outcome)
        ),
        x: Axis::linear(""),
        y: Axis::linear(""),
        layers: vec![Layer::CornerPlot {
            variables: (0..outcome.marginals.len()).map(variable).collect(),
            regions: outcome.pairs.iter().map(region).collect(),
        }],
    }
}

/// Traces of some walkers.
fn chain_traces(found: &ParameterEstimates, outcome: &Posterior, factor: usize) -> Figure {
    let (name, chains) = (&found.factors[factor].factor.name, &outcome.chains);
    let iterations: Vec<f64> = chains.iterations.iter().map(|&iteration| iteration as f64).collect();
    let mut layers = vec![Layer::Interval { name: "burn-in".to_owned(), from: 0.0, to: outcome.burn_in as f64 }];
    layers.extend(chains.walkers.iter().zip(&chains.values[factor]).enumerate().map(|(place, (walker, values))| {
        line(format!("walker {walker}"), Ink::Series(place), Stroke::Hairline, &iterations, values)
    }));
    let diagnostics = outcome.marginals[factor].diagnostics;
    Figure {
        id: file_name("chains", name),
        title: format!("Markov chains of {name}"),
        caption: format!(
            "{} of {} over the iterations. Chains that have converged fluctuate about one level after the burn-in and \
             cannot be told apart. R-hat {}; autocorrelation time {} iterations.",
            format::counted(chains.walkers.len(), "walker"),
            format::count(outcome.walkers.number),
            format::significant(diagnostics.r_hat, 4),
            format::significant(diagnostics.autocorrelation_time, 2)
        ),
        x: Axis::linear("Iteration").with_range(0.0, outcome.walkers.iterations as f64),
        y: Axis::linear(name),
        layers,
    }
}

/// One sensor; `None` if its temperature is constant.
fn predictive_intervals(answers: &Answers, case: &Case, of: &PosteriorPredictive, sensor: usize) -> Option<Figure> {
    let found = &of.sensors[sensor];
    let width_k =
        |band: &PredictiveBand| band.low_k.iter().zip(&band.high_k).map(|(low, high)| high - low).fold(0.0, f64::max);
    let widest_k = width_k(&found.discrepancy).max(width_k(&found.parameters));
    if widest_k <= CONSTANT_K {
        return None;
    }
    let name = answers.sensor_name(case, sensor);
    let band = |name: &str, ink: Ink, opacity: f64, band: &PredictiveBand| Layer::Band {
        name: name.to_owned(),
        ink,
        opacity,
        x: thinned(&of.instants_s),
        low: thinned(&band.low_k),
        high: thinned(&band.high_k),
    };
    let mut layers = vec![
        band("with discrepancy", Ink::Series(4), 0.25, &found.discrepancy),
        band("factors only", Ink::Series(0), 0.35, &found.parameters),
        line("median".to_owned(), Ink::Series(0), Stroke::Solid, &of.instants_s, &found.parameters.median_k),
    ];
    let seen = case.observations.iter().find(|seen| seen.sensor == sensor);
    layers.extend(seen.map(|seen| measured("measured".to_owned(), Ink::Measured, seen)));
    Some(Figure {
        id: file_name("predictive", &name),
        title: format!("Posterior prediction of {name}"),
        caption: format!(
            "Pointwise 95 % predictive intervals: by the factors only (largest width {}) and with model discrepancy \
             ({}). {}",
            format::temperature_difference(width_k(&found.parameters)),
            format::temperature_difference(width_k(&found.discrepancy)),
            posterior::coverage(case, sensor, found)
        ),
        x: time_axis(case),
        y: temperature_axis(),
        layers,
    })
}
