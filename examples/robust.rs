use bondline::case::{GasPath, Schedule};
use bondline::ensemble::Ensemble;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::plan::Plan;
use bondline::traces::Gauge;
use bondline::verify::problems::charring::smooth;
fn main() {
    for precision in [Precision::F64, Precision::F32] {
        for k in [1e-15, 1e-16, 3e-17, 1e-17, 1e-18] {
            for (p0, p1) in
                [(101325.0, 101325.0), (8010.0, 8010.0), (3100.0, 3100.0), (1000.0, 1000.0), (100., 100.), (10., 10.)]
            {
                let mut case = smooth(GasPath::Darcy, k);
                case.exposure.pressure_pa = Schedule { times_s: vec![0.0, 10.0, 12.0], values: vec![p0, p0, p1] };
                let plan = Plan::new(&case);
                let tr = Cpu::new(precision).march(&plan, &Ensemble::at(0, vec![]), 0..1).unwrap();
                let b = tr.balances[0];
                let peak = tr.gauge(0, Gauge::PeakPressure).unwrap().iter().fold(0.0f64, |a, &x| a.max(x));
                println!(
                    "{precision:?} K {k:e} {p0}->{p1}: {:?} peak {peak:.4e} mass {:.1e} heat {:.1e} lost {:.4} out {:.4} stored {:.2e}",
                    tr.arrivals[0],
                    b.mass_residual(),
                    b.residual(),
                    b.solid_lost_kg_m2,
                    b.gas_out_kg_m2,
                    b.gas_stored_kg_m2
                );
            }
        }
    }
    for path in [GasPath::Unhindered, GasPath::QuasiSteady] {
        for precision in [Precision::F64, Precision::F32] {
            let plan = Plan::new(&smooth(path, 1e-13));
            let tr = Cpu::new(precision).march(&plan, &Ensemble::at(0, vec![]), 0..1).unwrap();
            let b = tr.balances[0];
            println!(
                "{path:?} {precision:?} {:?} mass {:.1e} heat {:.1e} lost {}",
                tr.arrivals[0],
                b.mass_residual(),
                b.residual(),
                b.solid_lost_kg_m2
            );
            println!(
                "{:?} {:?}",
                tr.gauge(0, Gauge::GasFlux).unwrap().iter().step_by(6).collect::<Vec<_>>(),
                (0..4).map(|s| *tr.trace(0, s).last().unwrap()).collect::<Vec<_>>()
            );
        }
    }
}
