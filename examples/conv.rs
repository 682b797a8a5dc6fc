use bondline::case::{Face, Schedule};
use bondline::ensemble::Ensemble;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::plan::Plan;
use bondline::traces::Gauge;
use bondline::verify::problems::all;
fn main() {
    for (label, swing, thermal) in [("linear", 100.0, false), ("strong", 1e5, false), ("thermal", 0.0, true)] {
        let mut last = None;
        for step in [4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5, 3.125e-5] {
            let pr = all().into_iter().find(|p| p.case.name == "a small step of pressure").unwrap();
            let mut pr = pr.stepped(step);
            pr.case.resolution.cells = 100;
            pr.case.exposure.pressure_pa =
                Schedule { times_s: vec![0.0, 0.2], values: vec![101325.0, 101325.0 + swing] };
            if thermal {
                let s = Schedule { times_s: vec![0.0, 0.2], values: vec![1000.0, 1400.0] };
                pr.case.exposure.hot_face = Face::Held(s.clone());
                pr.case.exposure.back_face = Face::Held(s);
            }
            let plan = Plan::new(&pr.case);
            let tr = Cpu::new(Precision::F64).march(&plan, &Ensemble::at(0, vec![]), 0..1).unwrap();
            let i = plan.instants_s.len() - 1;
            let b = tr.gauge(0, Gauge::BackPressure).unwrap()[i];
            let f = tr.gauge(0, Gauge::GasFlux).unwrap()[i];
            if let Some((lb, lf)) = last {
                let (lb, lf): (f64, f64) = (lb, lf);
                println!("{label} {step} steps {} back {:e} flux {:e} of {f:e}", plan.steps(), b - lb, f - lf);
            }
            last = Some((b, f));
        }
    }
}
