use bondline::case::*;
use bondline::ensemble::Ensemble;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::plan::Plan;
use bondline::traces::{Gauge, Traces};
use bondline::verify::problems::charring::smooth;
fn rms(a: &[f64], b: &[f64]) -> f64 { (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64).sqrt() }
fn main() {
    for (label, inert, shape, path) in [("default", false, 0, GasPath::Unhindered), ("default", false, 0, GasPath::QuasiSteady), ("default", false, 0, GasPath::Darcy)] {
        let mut last: Option<Traces> = None;
        for n in [1, 2, 4, 8, 16, 32] {
            let f = n as f64; let cells: usize = std::env::args().nth(1).unwrap().parse().unwrap();
            let mut case = smooth(path, 1e-13);
            if inert { let mut m = (*case.layup.plies[0].material).clone(); m.decomposition = None; case.layup.plies[0].material = std::sync::Arc::new(m); case.gas = None; }
            if shape > 0 {
                if let Face::Open(o) = &mut case.exposure.hot_face {
                    o.flux_w_m2 = Schedule { times_s: vec![0.0], values: vec![0.0] };
                    if shape == 1 { o.emissivity = Emissivity::Constant(0.0); }
                }
                case.exposure.initial_k = (0..=2000).map(|i| { let x = i as f64 / 2000.0; (5e-3 * x, 900.0 + 300.0 * (std::f64::consts::PI * x).cos()) }).collect();
                case.resolution.growth = 1.0; case.resolution.first_step_s = 0.2; case.resolution.largest_step_s = 0.2;
            }
            let d = case.resolution;
            case.resolution = Resolution { first_step_s: d.first_step_s / f, growth: d.growth / f, largest_step_s: d.largest_step_s / f, cells, ..d };
            if shape > 0 { case.resolution.growth = 1.0; }
            let tr = Cpu::new(Precision::F64).march(&Plan::new(&case), &Ensemble::at(0, vec![]), 0..1).unwrap();
            if let Some(l) = &last {
                let g = |g| tr.gauge(0, g).map_or(0.0, |t| rms(t, l.gauge(0, g).unwrap()));
                let b = tr.balances[0];
                let per: Vec<String> = (0..4).map(|s| format!("{:.1e}", rms(tr.trace(0, s), l.trace(0, s)))).collect();
                let at: Vec<String> = [1, 5, 10, 20, 30, 31, 40, 60].iter().map(|&i| format!("{:.1e}", tr.trace(0, 0)[i] - l.trace(0, 0)[i])).collect();
                println!("{label} {path:?} {n}: T {:.2e} {per:?} {at:?} flux {:.2e} lost {:.2e} peak {:.2e} heat {:.2e} {:?}", rms(&tr.temperatures_k, &l.temperatures_k), g(Gauge::GasFlux), g(Gauge::MassLost), g(Gauge::PeakPressure), b.residual(), tr.arrivals);
            }
            last = Some(tr);
        }
    }
}
