//! Residual evaluations on problems with known answers: see benches/README.md.
//!
//! `cargo bench --bench least_squares > ours.json` prints one JSON object a run, of the same form as
//! `benches/peers/least_squares.py` does.

use bondline::fit::{Options, Sides, minimize};
use bondline::verify::least_squares::{Asked, Known, classics, nist};
use nalgebra::DVector;
use serde_json::json;

fn main() {
    for (group, problems) in [("nist", nist()), ("classics", classics())] {
        for known in &problems {
            for (start, at) in known.every_start() {
                for (method, trials, bends) in
                    [("bondline", 1, false), ("bondline, bent", 1, true), ("bondline, four at once", 4, false)]
                {
                    for tells in [true, false] {
                        print(group, known, (&start, &at), (method, Options { trials, bends, ..serial(tells) }), tells);
                    }
                }
            }
        }
    }
}

/// As the peers are asked: one point after another, and a point a variable for a difference.
fn serial(tells: bool) -> Options {
    Options {
        patience: 2000,
        tolerance_reduction: 1e-12,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-10,
        sides: Sides::One,
        difference_step: f64::EPSILON.sqrt(),
        derivative_error: if tells { 1e-12 } else { 1e-9 },
        ..Options::default()
    }
}

fn print(group: &str, known: &Known, (start, at): (&str, &[f64]), (method, options): (&str, Options), tells: bool) {
    let mut asked = Asked::new(known, tells);
    let Ok(fit) = minimize(&mut asked, &DVector::from_row_slice(at), &options);
    let record = json!({
        "group": group,
        "problem": known.name,
        "start": start,
        "method": method,
        "derivatives": if tells { "told" } else { "differences" },
        // What is told at the start has the residuals there in it, which the peers compute apart.
        "residuals": asked.residuals + usize::from(tells),
        "tangents": asked.tangents,
        "objective": fit.objective,
        "minima": known.minima,
        "ended": fit.termination.to_string(),
    });
    println!("{record}");
}
