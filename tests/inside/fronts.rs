//! Gauges of random layups: fronts of conversion in the layup and in order, and neither they nor the mass lost nor the
//! gas turn back.

use bondline::adapt::adapt;
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, Precision};
use bondline::random::RandomStream;
use bondline::traces::Gauge;
use std::collections::BTreeMap;

const CASES: u64 = 12;

/// A reacting layer, alone or on an inert one, heated through by a strong flux; its half conversion lies at 450 to
/// 800 K and takes from a tenth to some hundred kelvin.
fn layup(number: u64) -> Case {
    let mut random = RandomStream::new(number, 0);
    let mut draw = |low: f64, high: f64| low * (high / low).powf(random.uniform());
    let (at_k, steepness) = (draw(450.0, 800.0), draw(10.0, 120.0));
    let energy_kj_mol = 8.314_462_618e-3 * steepness * at_k;
    let rate_1_s = 0.2 * steepness / at_k * steepness.exp();
    let material = format!(
        r#"
density.value = "{} kg/m^3"
heat_capacity.value = "1000 J/kg/K"
conductivity.value = "{} W/m/K"
emissivity.value = 0.8
[decomposition]
[[decomposition.reaction]]
mass_loss = 0.3
pre_exponential = "{rate_1_s:e} 1/s"
activation_energy = "{energy_kj_mol} kJ/mol"
order = {}
heat = "{} MJ/kg"
[decomposition.char]
heat_capacity.times_virgin = 1.0
conductivity.times_virgin = 1.3
"#,
        draw(150.0, 1500.0),
        draw(0.05, 1.0),
        [1.0, 1.5, 2.0][number as usize % 3],
        draw(0.1, 2.0),
    );
    let inert = r#"
density.value = "200 kg/m^3"
heat_capacity.value = "1000 J/kg/K"
conductivity.value = "0.05 W/m/K"
emissivity.value = 0.8
"#;
    let below =
        if number.is_multiple_of(2) { "" } else { r#", { name = "I", material = "inert", thickness = "3 mm" }"# };
    let text = format!(
        r#"
duration = "{} s"
initial_temperature = "300 K"
decomposition = true
ply = [{{ name = "R", material = "reacting", thickness = "{} mm" }}{below}]
sensor = [{{ name = "B", below = "R" }}]
gas.flow = "quasi-steady"
[hot_face]
kind = "heated"
flux = "{} kW/m^2"
[resolution]
tolerance = "1 K"
[[factor]]
name = "f"
property = "heating"
small = [0.8, 1.2]
"#,
        draw(20.0, 300.0),
        draw(0.5, 6.0),
        draw(15.0, 80.0),
    );
    let files = [("reacting", material), ("inert", inert.to_owned())];
    let files = files.map(|(name, text)| (format!("materials/{name}.toml"), format!("name = \"{name}\"\n{text}")));
    Case::from_toml(&text, "own", &BTreeMap::from(files)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn fronts_stay_in_order_and_neither_they_nor_the_mass_lost_nor_the_gas_turn_back() {
    let mut arrived = 0;
    for number in 0..CASES {
        let case = layup(number);
        let layup_m: f64 = case.layup.plies.iter().map(|ply| ply.thickness_m).sum();
        let plan = adapt(&case).expect("the processor does not fail");
        let members = Ensemble::from_values(1, vec![0.8, 1.0, 1.2]);
        let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        let traces = march.march(&plan, &members, 0..3).expect("the processor does not fail");
        for member in 0..3 {
            let [virgin_m, char_m] = [Gauge::VirginFront, Gauge::CharFront]
                .map(|gauge| traces.gauge(member, gauge).expect("a layup that decomposes has fronts"));
            for (virgin_m, char_m) in virgin_m.iter().zip(char_m) {
                assert!((0.0..=*virgin_m).contains(char_m), "case {number}: char {char_m} m, virgin {virgin_m} m");
                assert!(*virgin_m <= layup_m * (1.0 + 1e-12), "case {number}: {virgin_m} m of {layup_m} m");
            }
            let [flux_kg_m2_s, lost_kg_m2] = [Gauge::GasFlux, Gauge::MassLost]
                .map(|gauge| traces.gauge(member, gauge).expect("a layup that decomposes loses gas"));
            let inflow_kg_m2_s = flux_kg_m2_s.iter().copied().fold(0.0, f64::min);
            assert!(inflow_kg_m2_s == 0.0, "case {number}: gas flows in: {inflow_kg_m2_s} kg/m²/s");
            assert!(lost_kg_m2.is_sorted(), "case {number}: the mass lost falls: {lost_kg_m2:?}");
            for (values, gauge) in [(virgin_m, Gauge::VirginFront), (char_m, Gauge::CharFront)] {
                assert!(values.is_sorted(), "case {number}: {} falls back: {values:?}", gauge.name());
                let peak = traces.gauge_peak(member, gauge).expect("a layup that decomposes has fronts");
                assert!((peak.value - values[values.len() - 1]).abs() < 1e-9, "case {number}: peak {peak:?}");
            }
            arrived += usize::from(virgin_m.ends_with(&[layup_m]) && char_m.iter().any(|depth_m| *depth_m > 0.0));
        }
    }
    assert!(arrived > 3, "fronts arrive at the back face in few of the cases: {arrived}");
}
