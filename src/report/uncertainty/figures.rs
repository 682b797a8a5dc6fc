//! Prediction intervals and sensitivity indices over time.

use crate::case::Case;
use crate::report::figure::{Axis, Figure, Ink, Layer, StackedArea, Stroke};
use crate::report::figures::{
    CONSTANT_K, data_window, file_name, line, measured, temperature_axis, thinned, time_axis,
};
use crate::report::format;
use crate::statistics::ConfidenceInterval;
use crate::study::nominal::Prediction;
use crate::study::uncertainty::Uncertainty;

pub(super) fn figures(case: &Case, outcome: &Uncertainty, nominal: Option<&Prediction>) -> Vec<Figure> {
    // A sensor of constant temperature has no spread.
    let moves =
        |sensor: &usize| outcome.spreads[*sensor].deviation_k.iter().any(|deviation_k| *deviation_k > CONSTANT_K);
    let sensors = (0..case.sensors.len()).filter(moves);
    let mut figures: Vec<Figure> =
        sensors.clone().map(|sensor| temperature_bands(case, outcome, nominal, sensor)).collect();
    figures.extend(sensors.clone().map(|sensor| variance_shares(case, outcome, sensor)));
    figures.extend(sensors.filter_map(|sensor| total_indices(case, outcome, sensor)));
    figures.push(peak_distribution(case, outcome));
    figures
}

fn temperature_bands(case: &Case, outcome: &Uncertainty, nominal: Option<&Prediction>, sensor: usize) -> Figure {
    let name = &case.sensors[sensor].name;
    let times = &outcome.instants_s;
    let [low, quarter, median, three_quarters, high] = &outcome.spreads[sensor].percentiles_k;
    let band = |name: &str, opacity: f64, low: &[f64], high: &[f64]| Layer::Band {
        name: name.to_owned(),
        ink: Ink::Series(0),
        opacity,
        x: thinned(times),
        low: thinned(low),
        high: thinned(high),
    };
    let mut layers: Vec<Layer> = data_window(case, sensor, "data window").into_iter().collect();
    layers.push(band("95 % pointwise", 0.18, low, high));
    layers.push(band("50 % pointwise", 0.38, quarter, three_quarters));
    // One layer for all members, with gaps between them.
    let members = &outcome.spreads[sensor].members_k;
    let joined = |trace: &[f64]| -> Vec<f64> { thinned(trace).into_iter().chain([f64::NAN]).collect() };
    layers.push(Layer::Line {
        name: format::counted(members.len(), "member"),
        ink: Ink::Guide,
        stroke: Stroke::Hairline,
        x: members.iter().flat_map(|_| joined(times)).collect(),
        y: members.iter().flat_map(|trace| joined(trace)).collect(),
    });
    let whole = &outcome.spreads[sensor].simultaneous;
    layers.push(line("95 % simultaneous".to_owned(), Ink::Series(0), Stroke::Thin, times, &whole.low_k));
    layers.push(line(String::new(), Ink::Series(0), Stroke::Thin, times, &whole.high_k));
    layers.push(line("median".to_owned(), Ink::Series(0), Stroke::Solid, times, median));
    if let Some(nominal) = nominal {
        let trace = &nominal.temperatures_k[sensor];
        layers.push(line("nominal".to_owned(), Ink::Series(1), Stroke::Dashed, &nominal.instants_s, trace));
    }
    let seen = case.observations.iter().find(|seen| seen.sensor == sensor);
    layers.extend(seen.map(|seen| measured("measured".to_owned(), Ink::Measured, seen)));
    let peak = &outcome.peaks[sensor];
    Figure {
        id: file_name("spread", name),
        title: format!("{name}: predicted temperature with 50 % and 95 % intervals"),
        caption: format!(
            "Bands: pointwise 50 % (dark) and 95 % (light) intervals of {}. Thin dashed lines: simultaneous 95 % band, \
             in which 95 % of the members stay at all instants. Grey lines: the first members. Of {} stored traces {} \
             % stay in the pointwise 95 % band at all instants, {} % in the simultaneous one. Peaks of the members: \
             mean {}, 95 % interval {} to {}.",
            format::counted(outcome.completed, "member"),
            format::count(whole.in_pointwise.total),
            format::grouped(100.0 * whole.in_pointwise.fraction(), 1),
            format::grouped(100.0 * whole.in_simultaneous.fraction(), 1),
            format::kelvin(peak.mean_k),
            format::kelvin(peak.percentiles_k[0]),
            format::kelvin(peak.percentiles_k[4]),
        ),
        x: time_axis(case),
        y: temperature_axis(),
        layers,
    }
}

fn variance_shares(case: &Case, outcome: &Uncertainty, sensor: usize) -> Figure {
    let name = &case.sensors[sensor].name;
    let indices = &outcome.spreads[sensor].indices;
    let percent = |factor: usize| indices.iter().map(|indices| 100.0 * indices.shares[factor]).collect::<Vec<f64>>();
    let parts = case.factors.iter().enumerate().map(|(index, factor)| StackedArea {
        name: factor.name.clone(),
        ink: Ink::Series(index),
        values: thinned(&percent(index)),
    });
    let top_factors = super::ranked_shares(outcome, sensor).first().map(|&(most, share)| {
        format!(
            " In the variance of the peak (nominally at {}) {} ({}) has the largest share, {}.",
            format::seconds(outcome.peaks[sensor].nominal.time_s),
            case.factors[most].name,
            format::factor_meaning(&case.factors[most]),
            format::percent(share),
        )
    });
    Figure {
        id: file_name("shares", name),
        title: format!("Variance shares at {name}"),
        caption: format!(
            "Share of each factor in the variance at {name} over time.{} A share is the squared correlation of factor \
             and temperature, normalised so that all shares sum to one.",
            top_factors.unwrap_or_default(),
        ),
        x: time_axis(case),
        y: Axis::linear("Share of the variance, %").with_range(0.0, 100.0),
        layers: vec![Layer::StackedAreas { x: thinned(&outcome.instants_s), parts: parts.collect() }],
    }
}

/// Total Sobol indices over time with their intervals, of the factors that exceed 2 % at any time; `None` if too few
/// members completed.
fn total_indices(case: &Case, outcome: &Uncertainty, sensor: usize) -> Option<Figure> {
    let name = &case.sensors[sensor].name;
    let spread = &outcome.spreads[sensor];
    // Where the variance is zero, indices are undefined.
    let most_k = spread.deviation_k.iter().copied().fold(0.0, f64::max);
    let from = spread.deviation_k.iter().position(|&deviation_k| deviation_k > 0.01 * most_k)?;
    let (times, indices) = (&outcome.instants_s[from..], &spread.indices[from..]);
    let curve = |factor: usize, of: fn(&ConfidenceInterval) -> f64| -> Vec<f64> {
        indices.iter().map(|indices| 100.0 * of(&indices.total[factor])).collect()
    };
    let mut layers: Vec<Layer> = data_window(case, sensor, "data window").into_iter().collect();
    let matters = |factor: &usize| curve(*factor, |index| index.value).into_iter().any(|percent| percent > 2.0);
    for factor in (0..case.factors.len()).filter(matters) {
        let stroke = if factor % 2 == 0 { Stroke::Solid } else { Stroke::Dashed };
        layers.push(Layer::Band {
            name: String::new(),
            ink: Ink::Series(factor),
            opacity: 0.18,
            x: thinned(times),
            low: thinned(&curve(factor, |index| index.low)),
            high: thinned(&curve(factor, |index| index.high)),
        });
        let values = curve(factor, |index| index.value);
        layers.push(line(case.factors[factor].name.clone(), Ink::Series(factor), stroke, times, &values));
    }
    let rest = indices.iter().map(|indices| indices.unexplained).fold(0.0, f64::max);
    let sum = if outcome.is_independent {
        "Their sum counts each pairwise interaction twice."
    } else {
        "The factors are correlated: the indices overlap or leave gaps, and do not sum to one."
    };
    let drawn = layers.iter().any(|layer| matches!(layer, Layer::Band { .. }));
    drawn.then(|| Figure {
        id: file_name("indices", name),
        title: format!("Total Sobol indices at {name}"),
        caption: format!(
            "Total Sobol indices over time with 95 % intervals, of factors that exceed 2 % at any time: expected share \
             of the variance that remains if all other factors become known. {sum} At most {} of the variance is \
             unexplained by polynomials of one and of two factors.",
            format::percent_near_limits(rest),
        ),
        x: time_axis(case),
        y: Axis::linear("Total Sobol index, %"),
        layers,
    })
}

/// Peaks less the nominal peak of each sensor, as spreads are small compared with the differences between sensors.
fn peak_distribution(case: &Case, outcome: &Uncertainty) -> Figure {
    let less_nominal = outcome
        .peaks
        .iter()
        .map(|peak| peak.percentiles_k.map(|percentile_k| percentile_k - peak.nominal.temperature_k))
        .collect();
    let sensors = case.sensors.len() as f64;
    Figure {
        id: "peaks".to_owned(),
        title: "Distribution of the peak temperatures".to_owned(),
        caption: "Peaks of the members less the nominal peak of each sensor: 50 % (thick bar), 95 % (thin bar) and \
                  median (light mark)."
            .to_owned(),
        x: Axis::categories("", case.sensors.iter().map(|sensor| sensor.name.clone()).collect()),
        y: Axis::linear("Peak less nominal peak, K"),
        layers: vec![
            line(String::new(), Ink::Guide, Stroke::Dashed, &[-0.5, sensors - 0.5], &[0.0, 0.0]),
            Layer::BoxPlot { name: String::new(), ink: Ink::Series(0), percentiles: less_nominal },
        ],
    }
}
