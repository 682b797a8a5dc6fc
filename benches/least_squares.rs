//! Residual evaluations on problems with known solutions: see benches/README.md.
//!
//! `cargo bench --bench least_squares > ours.json` prints one JSON object a run, in the format of
//! `benches/peers/least_squares.py`.

use bondline::fit::{DifferenceScheme, Options, minimize};
use bondline::verify::least_squares::{CountedProblem, TestProblem, more_garbow_hillstrom, nist_strd};
use nalgebra::DVector;
use serde_json::json;

fn main() {
    for (group, problems) in [("nist", nist_strd()), ("classics", more_garbow_hillstrom())] {
        for known in &problems {
            for (start, at) in known.all_starts() {
                for (method, trials, bends) in
                    [("bondline", 1, false), ("bondline, bent", 1, true), ("bondline, four at once", 4, false)]
                {
                    for analytic in [true, false] {
                        print(
                            group,
                            known,
                            (&start, &at),
                            (method, Options { trials, geodesic_acceleration: bends, ..serial(analytic) }),
                            analytic,
                        );
                    }
                }
            }
        }
    }
}

/// Options that match the peers: one point at a time, and forward differences.
fn serial(analytic: bool) -> Options {
    Options {
        max_iterations: 2000,
        tolerance_reduction: 1e-12,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-10,
        difference_scheme: DifferenceScheme::OneSided,
        difference_step: f64::EPSILON.sqrt(),
        derivative_error: if analytic { 1e-12 } else { 1e-9 },
        ..Options::default()
    }
}

fn print(
    group: &str,
    known: &TestProblem,
    (start, at): (&str, &[f64]),
    (method, options): (&str, Options),
    analytic: bool,
) {
    let mut evaluations = CountedProblem::new(known, analytic);
    let Ok(fit) = minimize(&mut evaluations, &DVector::from_row_slice(at), &options);
    let record = json!({
        "group": group,
        "problem": known.name,
        "start": start,
        "method": method,
        "derivatives": if analytic { "told" } else { "differences" },
        // With given derivatives, the evaluation at the start includes the residuals, which the peers count separately.
        "residuals": evaluations.residual_evaluations + usize::from(analytic),
        "tangents": evaluations.tangent_evaluations,
        "objective": fit.objective,
        "minima": known.minima,
        "ended": fit.termination.to_string(),
    });
    println!("{record}");
}
