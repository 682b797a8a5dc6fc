//! A typical flexible heat shield, for orders and balances.

use crate::case::{
    Case, Emissivity, EstimationSettings, Exposure, Face, Layup, OpenFace, Ply, Resolution, Schedule, Sensor, Side,
};
use crate::verify::problem::{clamped_table, material};

/// Two plies of ceramic fabric, two of aerogel felt and a gas barrier, with contacts, under a flux with hot-wall
/// correction that ends at 41 s. The hot face radiates, the back is cooled. Properties are estimates, smooth enough for
/// observed orders.
pub fn flexible_layup() -> Case {
    let at_k: Vec<f64> = (0..=68).map(|i| 300.0 + 20.0 * f64::from(i)).collect();
    let over =
        |value: &dyn Fn(f64) -> f64| clamped_table(at_k.clone(), at_k.iter().map(|&t| value(t / 300.0)).collect());
    let fabric = material(998.0, over(&|t| 760.0 * t.powf(0.33)), over(&|t| 0.083 * t.powf(0.35)));
    let felt = material(170.0, over(&|t| 890.0 * t.powf(0.2)), over(&|t| 0.0073 * t.powf(0.3) + 0.0022 * t.powi(3)));
    let barrier = material(886.0, over(&|t| 1250.0 * t.powf(0.5)), over(&|_| 0.1));
    let plies: Vec<Ply> = [
        ("OF1", &fabric, 0.51e-3),
        ("OF2", &fabric, 0.51e-3),
        ("INS1", &felt, 3e-3),
        ("INS2", &felt, 3e-3),
        ("GB", &barrier, 0.14e-3),
    ]
    .into_iter()
    .map(|(name, material, thickness_m)| Ply {
        name: name.to_owned(),
        group: name.trim_end_matches(['1', '2']).to_owned(),
        material: material.clone(),
        thickness_m,
    })
    .collect();
    let layup = Layup { contacts_w_m2_k: vec![Some(500.0); plies.len() - 1], plies, origin_m: 0.0 };
    let sensors = layup.faces_m().into_iter().take(4).enumerate();
    let sensors = sensors
        .map(|(i, depth_m)| Sensor {
            name: format!("TC{}", i + 1),
            depth_m,
            side: Side::Both,
            time_constant_s: 0.0,
            pyrometer: None,
        })
        .collect();
    Case {
        input_files: Default::default(),
        id: "flexible".to_owned(),
        name: "flexible layup".to_owned(),
        note: String::new(),
        layup,
        sensors,
        limits: Vec::new(),
        gas: None,
        exposure: Exposure {
            duration_s: 200.0,
            initial_k: vec![(0.0, 300.0)],
            pressure_pa: Schedule::constant(8010.0),
            back_pressure_pa: None,
            holder: None,
            hot_face: Face::Open(OpenFace {
                flux_w_m2: Schedule { times_s: vec![0.0, 0.5, 41.0, 41.2], values: vec![0.0, 267e3, 267e3, 0.0] },
                recovery_enthalpy_j_kg: Some(Schedule::constant(12e6)),
                emissivity: Emissivity::Constant(0.7),
                ..OpenFace::insulated()
            }),
            back_face: Face::Open(OpenFace {
                film_w_m2_k: Schedule::constant(15.0),
                emissivity: Emissivity::Constant(0.85),
                ..OpenFace::insulated()
            }),
        },
        factors: Vec::new(),
        correlation: Default::default(),
        observations: Vec::new(),
        estimate: EstimationSettings::default(),
        resolution: Resolution::default(),
        reading_notes: Default::default(),
    }
}
