use bondline::march::{Precision, cpu::Cpu};
use bondline::verify::{problems::all, table};
fn main() {
    let names: Vec<String> = std::env::args().skip(1).collect();
    for problem in all() {
        if names.iter().any(|n| problem.case.name.contains(n.as_str())) {
            let t = std::time::Instant::now();
            let rows = problem.rows(&mut Cpu::new(Precision::F64)).unwrap();
            print!("{}", table(&rows));
            println!("-- {} {:?}", problem.case.name, t.elapsed());
        }
    }
}
