//! Decomposition and gas flow over time.

use crate::case::Case;
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{line, time_axis};
use crate::report::nominal::gas;
use crate::study::nominal::{GaugeTrace, Prediction};
use crate::traces::Gauge;

/// Mass lost and fronts only where plies decompose, pressures only with Darcy's law.
pub(in crate::report::nominal) fn figures(case: &Case, outcome: &Prediction) -> Vec<Figure> {
    let reading = |gauge| outcome.gauge_trace(gauge);
    let times_s = &outcome.instants_s;
    let mut figures = Vec::new();
    let mut add = |id: &str, title: &str, caption, y, layers| {
        let (id, title) = (id.to_owned(), title.to_owned());
        figures.push(Figure { id, title, caption, x: time_axis(case), y, layers });
    };
    if let Some(flux) = reading(Gauge::GasFlux) {
        let layers = vec![curve("", 0, Stroke::Solid, times_s, flux.values.clone())];
        add(
            "gas-flux",
            "Gas flux out of the hot face",
            gas::flux_caption(flux),
            Axis::linear("Gas flux, kg/m²/s"),
            layers,
        );
    }
    if let Some(lost) = reading(Gauge::MassLost).filter(|_| gas::decomposes(case)) {
        let layers = vec![curve("", 1, Stroke::Solid, times_s, lost.values.clone())];
        add("gas-lost", "Mass lost", gas::mass_lost_caption(lost), Axis::linear("Mass lost, kg/m²"), layers);
    }
    if let (Some(virgin), Some(char)) = (reading(Gauge::VirginFront), reading(Gauge::CharFront))
        && virgin.peak > 0.0
    {
        let met =
            [(char, "char front", 7), (virgin, "virgin front", 2)].into_iter().filter(|(front, ..)| front.peak > 0.0);
        let layers = met.map(|(front, name, ink)| curve(name, ink, Stroke::Solid, times_s, depths_mm(front))).collect();
        let axis = Axis::linear("Depth in the undeformed layup, mm");
        add("gas-fronts", "Char front and virgin front", gas::fronts_caption(virgin, char), axis, layers);
    }
    if let (Some(largest), Some(back)) = (reading(Gauge::PeakPressure), reading(Gauge::BackPressure))
        && gas::has_darcy_flow(case)
    {
        let kilopascals = |of: &GaugeTrace| of.values.iter().map(|pressure_pa| 1e-3 * pressure_pa).collect();
        let layers = vec![
            curve("maximum in the layup", 0, Stroke::Solid, times_s, kilopascals(largest)),
            curve("at the back face", 1, Stroke::Dashed, times_s, kilopascals(back)),
        ];
        let axis = Axis::linear("Pressure, kPa");
        add("gas-pressure", "Gas pressure in the layup", gas::pressure_caption(largest, back), axis, layers);
    }
    figures
}

fn curve(name: &str, series: usize, stroke: Stroke, times_s: &[f64], values: Vec<f64>) -> Layer {
    line(name.to_owned(), Ink::Series(series), stroke, times_s, &values)
}

/// Depths of a front; a gap where there is none, as zero would put it at the hot face.
fn depths_mm(front: &GaugeTrace) -> Vec<f64> {
    front.values.iter().map(|&depth_m| if depth_m > 0.0 { 1e3 * depth_m } else { f64::NAN }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::GasFlowModel;
    use crate::report::marched;

    fn drawn(outcomes: &marched::Study) -> Vec<String> {
        figures(&outcomes.case, &outcomes.nominal).into_iter().map(|figure| figure.id).collect()
    }

    #[test]
    fn gas_charts_are_drawn_only_for_quantities_that_are_present() {
        let outcomes = marched::study();
        assert!(drawn(&outcomes).is_empty());
        let mut charring = marched::charring();
        assert_eq!(drawn(&charring), ["gas-flux", "gas-lost", "gas-fronts", "gas-pressure"]);
        charring.case.gas.as_mut().expect("gas").model = GasFlowModel::QuasiSteady;
        assert_eq!(drawn(&charring), ["gas-flux", "gas-lost", "gas-fronts"]);
        charring.nominal.gauge_traces.iter_mut().for_each(|reading| reading.peak = 0.0);
        assert_eq!(drawn(&charring), ["gas-flux", "gas-lost"]);
        charring.case.layup = marched::study().case.layup;
        assert_eq!(drawn(&charring), ["gas-flux"]);
    }

    #[test]
    fn a_front_is_drawn_in_millimetres_with_a_gap_where_there_is_none() {
        let mut outcomes = marched::charring();
        let front = &mut outcomes.nominal.gauge_traces[Gauge::CharFront as usize];
        front.values[..10].fill(0.0);
        front.values[10] = 1.75e-3;
        let figures = figures(&outcomes.case, &outcomes.nominal);
        let fronts = figures.iter().find(|figure| figure.id == "gas-fronts").expect("fronts are drawn");
        let Layer::Line { name, y, .. } = &fronts.layers[0] else { panic!("a curve") };
        assert_eq!(name, "char front");
        assert!(y[..10].iter().all(|depth_mm| depth_mm.is_nan()));
        assert!((y[10] - 1.75).abs() < 1e-9, "{} mm at 40 s", y[10]);
    }
}
