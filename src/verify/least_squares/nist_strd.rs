//! Statistical Reference Datasets (StRD) of the National Institute of Standards and Technology, nonlinear regression
//! (<https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml>): all 27 problems, with estimates, standard deviations
//! and sums of squares certified to eleven digits, each with a distant and a near start.

use super::{CertifiedValues, Complex, TestProblem, arctangent, real};
use crate::verify::reference::column_series;
use std::f64::consts::{PI, TAU};

const CERTIFIED: &str = include_str!("../../../data/verification/nist_strd_certified.csv");
const OBSERVATIONS: &str = include_str!("../../../data/verification/nist_strd_observations.csv");

type C = Complex;
/// The response to the predictors `[x, x₂]`.
type Response = fn(&[C], [f64; 2]) -> C;

const RESPONSES: [(&str, Response); 27] = [
    // Lower difficulty.
    ("Misra1a", |b, [x, _]| b[0] * (-(b[1] * -x).exp() + 1.0)),
    ("Chwirut2", chwirut),
    ("Chwirut1", chwirut),
    ("Lanczos3", three_exponentials),
    ("Gauss1", two_gaussians),
    ("Gauss2", two_gaussians),
    ("DanWood", |b, [x, _]| b[0] * (b[1] * x.ln()).exp()),
    ("Misra1b", |b, [x, _]| b[0] * (-(b[1] * (x / 2.0) + 1.0).powi(-2) + 1.0)),
    // Average difficulty.
    ("Kirby2", |b, [x, _]| polynomial(&b[..3], x) / (polynomial(&b[3..], x) * x + 1.0)),
    ("Hahn1", rational_cubic),
    ("Nelson", |b, [x, x2]| b[0] - b[1] * x * (b[2] * -x2).exp()),
    ("MGH17", |b, [x, _]| b[0] + b[1] * (b[3] * -x).exp() + b[2] * (b[4] * -x).exp()),
    ("Lanczos1", three_exponentials),
    ("Lanczos2", three_exponentials),
    ("Gauss3", two_gaussians),
    ("Misra1c", |b, [x, _]| b[0] * (-(b[1] * (2.0 * x) + 1.0).powf(-0.5) + 1.0)),
    ("Misra1d", |b, [x, _]| b[0] * b[1] * x / (b[1] * x + 1.0)),
    ("Roszman1", |b, [x, _]| b[0] - b[1] * x - arctangent(b[2] / (-b[3] + x)) / PI),
    ("ENSO", enso),
    // Higher difficulty.
    ("MGH09", |b, [x, _]| b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x)),
    ("Thurber", rational_cubic),
    ("BoxBOD", |b, [x, _]| b[0] * (-(b[1] * -x).exp() + 1.0)),
    ("Rat42", |b, [x, _]| b[0] / ((b[1] - b[2] * x).exp() + 1.0)),
    ("MGH10", |b, [x, _]| b[0] * (b[1] / (b[2] + x)).exp()),
    ("Eckerle4", |b, [x, _]| b[0] / b[1] * (((-b[2] + x) / b[1]).powi(2) * -0.5).exp()),
    ("Rat43", |b, [x, _]| b[0] / (((b[1] - b[2] * x).exp() + 1.0).ln() / b[3]).exp()),
    ("Bennett5", |b, [x, _]| b[0] * (-(b[1] + x).ln() / b[2]).exp()),
];

fn chwirut(b: &[C], [x, _]: [f64; 2]) -> C {
    (b[0] * -x).exp() / (b[1] + b[2] * x)
}

fn three_exponentials(b: &[C], [x, _]: [f64; 2]) -> C {
    (0..3).map(|i| b[2 * i] * (b[2 * i + 1] * -x).exp()).sum()
}

fn two_gaussians(b: &[C], [x, _]: [f64; 2]) -> C {
    let bell = |height: C, middle: C, width: C| height * (-((-middle + x) / width).powi(2)).exp();
    b[0] * (b[1] * -x).exp() + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7])
}

fn polynomial(b: &[C], x: f64) -> C {
    b.iter().rev().fold(real(0.0), |sum, &b| sum * x + b)
}

fn rational_cubic(b: &[C], [x, _]: [f64; 2]) -> C {
    polynomial(&b[..4], x) / (polynomial(&b[4..], x) * x + 1.0)
}

fn enso(b: &[C], [x, _]: [f64; 2]) -> C {
    let wave = |period: C, cosine: C, sine: C| {
        let phase = real(TAU * x) / period;
        cosine * phase.cos() + sine * phase.sin()
    };
    b[0] + wave(real(12.0), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
}

/// All problems, in NIST's order of difficulty.
pub fn nist_strd() -> Vec<TestProblem> {
    RESPONSES.iter().map(|&(name, law)| test_problem(name, law)).collect()
}

fn test_problem(name: &str, law: Response) -> TestProblem {
    let column =
        |column| column_series(CERTIFIED, name, column).into_iter().map(|(_, value)| value).collect::<Vec<_>>();
    let answers = column("estimate");
    let observed = column_series(OBSERVATIONS, name, "y");
    let (predictors, responses): (Vec<[f64; 2]>, Vec<f64>) = if name == "Nelson" {
        let second = column_series(OBSERVATIONS, name, "x2");
        // The model is for the logarithm of the response.
        observed.iter().zip(second).map(|(&(x, y), (_, x2))| ([x, x2], y.ln())).unzip()
    } else {
        observed.iter().map(|&(x, y)| ([x, 0.0], y)).unzip()
    };
    TestProblem {
        name: name.to_owned(),
        starts: vec![column("far"), column("near")],
        minima: vec![answers[0]],
        certified: Some(CertifiedValues { estimates: answers[1..].to_vec(), standard_deviations: column("deviation") }),
        residuals: Box::new(move |b| predictors.iter().zip(&responses).map(|(&x, y)| law(b, x) - y).collect()),
    }
}
