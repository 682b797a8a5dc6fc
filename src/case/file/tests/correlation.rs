//! Correlated factors in a case file.

use super::{Scratch, VALID_CASE, errors};
use crate::case::Case;

/// Two more factors and these correlations for the valid case.
fn more(correlations: &[(&str, &str)]) -> String {
    let pair = |(factors, value): &(&str, &str)| format!("[[correlation]]\nfactors = {factors}\nvalue = {value}\n\n");
    let third = "[[factor]]\nname = \"f_third\"\ngroup = \"INS\"\nproperty = \"heat_capacity\"\nsmall = [0.9, 1.1]\n\n\
                 [[factor]]\nname = \"f_fourth\"\ngroup = \"INS\"\nproperty = \"density\"\nsmall = [0.9, 1.1]\n\n";
    format!("{third}{}[observations]", correlations.iter().map(pair).collect::<String>())
}

fn refused(name: &str, correlations: &[(&str, &str)]) -> Vec<String> {
    errors(name, "[observations]", &more(correlations))
}

#[test]
fn pairs_of_factors_can_be_correlated() {
    let scratch = Scratch::new("together");
    let pairs = [("[\"f_k\", \"f_third\"]", "0.6"), ("[\"f_fourth\", \"f_third\"]", "-0.5")];
    let case = Case::load(&scratch.write("case.toml", VALID_CASE.replacen("[observations]", &more(&pairs), 1)));
    let case = case.unwrap_or_else(|error| panic!("{error}"));
    let index = |name: &str| case.factors.iter().position(|factor| factor.name == name).expect("a factor");
    let (k, third, fourth) = (index("f_k"), index("f_third"), index("f_fourth"));
    assert_eq!(case.correlation.pairs(), [(k, third, 0.6), (fourth, third, -0.5)]);
    // L Lᵀ is the correlation matrix.
    let rows = case.correlation.cholesky_rows();
    let product = |a: usize, b: usize| rows[a].iter().zip(&rows[b]).map(|(one, other)| one * other).sum::<f64>();
    for (a, b, value) in [(k, third, 0.6), (third, fourth, -0.5), (k, fourth, 0.0), (third, third, 1.0)] {
        assert!((product(a, b) - value).abs() < 1e-12, "{a} and {b}");
    }
}

#[test]
fn invalid_correlations_are_refused_with_line_and_column() {
    let pair = "[\"f_k\", \"f_third\"]";
    for (number, (correlations, message)) in [
        (vec![(pair, "1")], "expected a correlation above -1 and below 1, found 1"),
        (vec![(pair, "0.5"), ("[\"f_third\", \"f_k\"]", "0.4")], "is stated twice"),
        (vec![("[\"f_k\", \"f_k\"]", "0.5")], "a factor is paired with itself"),
        (vec![("[\"f_k\"]", "0.5")], "expected two factors such as [\"f_k_INS\", \"f_rho_INS\"], found 1 names"),
        (vec![("[\"f_k\", \"f_thirt\"]", "0.5")], "unknown factor \"f_thirt\""),
        (
            vec![(pair, "0.9"), ("[\"f_third\", \"f_fourth\"]", "0.9"), ("[\"f_k\", \"f_fourth\"]", "-0.9")],
            "their matrix is not positive definite",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let found = refused(&format!("together-{number}"), &correlations);
        assert!(found.len() == 1 && found[0].contains(message), "{found:?}, not {message}");
        assert!(found[0].contains("case.toml:"), "{found:?} has no line");
    }
}
