use bondline::case::Resolution;
use bondline::ensemble::Ensemble;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::plan::Plan;
use bondline::traces::Gauge;
use bondline::verify::problems::all;
fn main() {
    for (cells, first, growth, largest) in [
        (400, 1e-6, 0.02, 1.),
        (400, 1e-3, 1., 1e-3),
        (400, 4e-3, 1., 4e-3),
        (400, 1e-2, 1., 1e-2),
        (400, 2e-2, 1., 2e-2),
        (100, 1e-6, 0.02, 1.),
        (400, 1e-6, 0.005, 1.),
    ] {
        let mut p = all().into_iter().find(|p| p.case.name == "gas driven into almost nothing").unwrap();
        p.case.resolution = Resolution { cells, first_step_s: first, growth, largest_step_s: largest, every_s: 1.0 };
        let traces = Cpu::new(Precision::F64).march(&Plan::new(&p.case), &Ensemble::at(0, vec![]), 0..1).unwrap();
        println!(
            "{cells} {first} {growth} {largest}: {:?} mass {:e}",
            traces.arrivals,
            traces.balances[0].mass_residual()
        );
        println!("{:?}", &traces.gauge(0, Gauge::PeakPressure).unwrap()[..3]);
        for row in p.rows(&mut Cpu::new(Precision::F64)).unwrap() {
            println!("   {} {:e}", row.quantity, row.difference);
        }
    }
}
