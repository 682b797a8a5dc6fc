//! The test problems of Moré, Garbow & Hillstrom, "Testing unconstrained optimization software", ACM Trans. Math.
//! Softw. 7 (1981), also used to test MINPACK, from their standard starts. Minima were recomputed with fifty digits. A
//! minimum at infinity is identified by its sum of squares alone.

use super::{Complex, TestProblem, real};
use crate::verify::reference::column_series;
use std::f64::consts::TAU;

const TABLES: &str = include_str!("../../../data/verification/more_garbow_hillstrom.csv");

/// All problems in the order of the paper, except that the linear ones come first.
pub fn more_garbow_hillstrom() -> Vec<TestProblem> {
    let mut found = vec![linear_full(10), linear_full(50), linear_rank_one(10), linear_rank_one(50)];
    found.extend([
        linear_rank_one_with_zeros(10),
        linear_rank_one_with_zeros(50),
        rosenbrock(),
        helical_valley(),
        powell_singular(),
    ]);
    found.extend([freudenstein_roth(), bard(), kowalik_osborne(), meyer()]);
    found.extend([(6, 2.287_670_053_552_436e-3), (9, 1.399_760_138_098_02e-6), (12, WATSON_12)].map(watson));
    found.extend([box_three(), jennrich_sampson(), brown_dennis(), chebyquad(1, 8, CHEBYQUAD_1.to_vec())]);
    found.push(chebyquad(8, 8, vec![3.516_873_725_678_013e-3]));
    found.push(chebyquad(9, 9, vec![0.0]));
    found.push(chebyquad(10, 10, vec![6.503_954_800_882_993e-3, 4.772_713_630_3e-3]));
    found.extend([10, 30, 40].map(brown_almost_linear));
    found.extend([osborne_1(), osborne_2()]);
    found
}

// To the digits that MINPACK prints, as is the first of the next.
const WATSON_12: f64 = 4.722_381e-10;
/// The second is a stationary point between two minima, with zero gradient by symmetry: the standard start lies there,
/// and the minimiser stops at once.
const CHEBYQUAD_1: [f64; 2] = [3.550_390_5, 4.0 / 9.0 + 256.0 / 225.0 + 1156.0 / 1225.0 + 4096.0 / 3969.0];

fn test_problem(
    name: &str,
    start: &[f64],
    minima: &[f64],
    residuals: impl Fn(&[Complex]) -> Vec<Complex> + Send + Sync + 'static,
) -> TestProblem {
    TestProblem {
        name: name.to_owned(),
        starts: vec![start.to_vec()],
        minima: minima.to_vec(),
        certified: None,
        residuals: Box::new(residuals),
    }
}

fn sum(x: &[Complex]) -> Complex {
    x.iter().copied().sum()
}

fn linear_full(m: usize) -> TestProblem {
    test_problem(&format!("linear, full rank, {m} residuals"), &[1.0; 5], &[m as f64 - 5.0], move |x| {
        let common = sum(x) * (2.0 / m as f64) + 1.0;
        (0..m).map(|i| x.get(i).copied().unwrap_or_default() - common).collect()
    })
}

fn linear_rank_one(m: usize) -> TestProblem {
    let n = m as f64;
    let least = n * (n - 1.0) / (2.0 * (2.0 * n + 1.0));
    test_problem(&format!("linear, rank one, {m} residuals"), &[1.0; 5], &[least], move |x| {
        let sum: Complex = x.iter().enumerate().map(|(j, x)| x * (j as f64 + 1.0)).sum();
        (1..=m).map(|i| sum * i as f64 - 1.0).collect()
    })
}

fn linear_rank_one_with_zeros(m: usize) -> TestProblem {
    let n = m as f64;
    let least = (n * n + 3.0 * n - 6.0) / (2.0 * (2.0 * n - 3.0));
    let name = format!("linear, rank one, columns and rows of zeros, {m} residuals");
    test_problem(&name, &[1.0; 5], &[least], move |x| {
        let inner = 1..x.len() - 1;
        let sum: Complex = inner.map(|j| x[j] * (j as f64 + 1.0)).sum();
        (0..m).map(|i| if i == 0 || i == m - 1 { real(-1.0) } else { sum * i as f64 - 1.0 }).collect()
    })
}

fn rosenbrock() -> TestProblem {
    test_problem("Rosenbrock", &[-1.2, 1.0], &[0.0], |x| vec![(x[1] - x[0] * x[0]) * 10.0, -x[0] + 1.0])
}

fn helical_valley() -> TestProblem {
    test_problem("helical valley", &[-1.0, 0.0, 0.0], &[0.0], |x| {
        let half = if x[0].re < 0.0 { 0.5 } else { 0.0 };
        let quarter = if x[1].re < 0.0 { -0.25 } else { 0.25 };
        let turn = if x[0].re == 0.0 { real(quarter) } else { super::arctangent(x[1] / x[0]) / TAU + half };
        vec![(x[2] - turn * 10.0) * 10.0, ((x[0] * x[0] + x[1] * x[1]).sqrt() - 1.0) * 10.0, x[2]]
    })
}

fn powell_singular() -> TestProblem {
    test_problem("Powell, singular", &[3.0, -1.0, 0.0, 1.0], &[0.0], |x| {
        let (a, b) = (x[1] - x[2] * 2.0, x[0] - x[3]);
        vec![x[0] + x[1] * 10.0, (x[2] - x[3]) * 5f64.sqrt(), a * a, b * b * 10f64.sqrt()]
    })
}

fn freudenstein_roth() -> TestProblem {
    test_problem("Freudenstein and Roth", &[0.5, -2.0], &[0.0, 48.984_253_679_240_02], |x| {
        let one = x[0] - 13.0 + ((-x[1] + 5.0) * x[1] - 2.0) * x[1];
        vec![one, x[0] - 29.0 + ((x[1] + 1.0) * x[1] - 14.0) * x[1]]
    })
}

fn bard() -> TestProblem {
    let y = column_series(TABLES, "Bard", "y");
    // With the second and third variable at infinity the prediction is a constant.
    let mean = y.iter().map(|(_, y)| y).sum::<f64>() / y.len() as f64;
    let constant = y.iter().map(|(_, y)| (y - mean).powi(2)).sum();
    test_problem("Bard", &[1.0; 3], &[8.214_877_306_578_975e-3, constant], move |x| {
        y.iter().map(|&(u, y)| -(x[0] + real(u) / (x[1] * (16.0 - u) + x[2] * u.min(16.0 - u))) + y).collect()
    })
}

fn kowalik_osborne() -> TestProblem {
    let (y, u) = (column_series(TABLES, "Kowalik and Osborne", "y"), column_series(TABLES, "Kowalik and Osborne", "u"));
    // The second lies at infinity, where the first variable, the third and the fourth grow in proportion.
    let minima = [3.075_056_038_492_374e-4, 1.027_342_88e-3];
    test_problem("Kowalik and Osborne", &[0.25, 0.39, 0.415, 0.39], &minima, move |x| {
        let law = |u: f64| x[0] * (x[1] * u + u * u) / (x[2] * u + x[3] + u * u);
        y.iter().zip(&u).map(|(&(_, y), &(_, u))| -law(u) + y).collect()
    })
}

fn meyer() -> TestProblem {
    let y = column_series(TABLES, "Meyer", "y");
    test_problem("Meyer", &[0.02, 4000.0, 250.0], &[87.945_855_170_851_12], move |x| {
        y.iter().map(|&(i, y)| x[0] * (x[1] / (x[2] + 45.0 + 5.0 * i)).exp() - y).collect()
    })
}

fn watson((n, least): (usize, f64)) -> TestProblem {
    test_problem(&format!("Watson, {n} variables"), &vec![0.0; n], &[least], |x| {
        let mut residuals: Vec<Complex> = (1..=29)
            .map(|i| {
                let t = f64::from(i) / 29.0;
                let (mut slope, mut value, mut power) = (real(0.0), real(0.0), 1.0);
                for (j, x) in x.iter().enumerate() {
                    if j > 0 {
                        slope += x * (j as f64 * power / t);
                    }
                    value += x * power;
                    power *= t;
                }
                slope - value * value - 1.0
            })
            .collect();
        residuals.extend([x[0], x[1] - x[0] * x[0] - 1.0]);
        residuals
    })
}

fn box_three() -> TestProblem {
    test_problem("Box, three variables", &[0.0, 10.0, 20.0], &[0.0], |x| {
        let at = |t: f64| (x[0] * -t).exp() - (x[1] * -t).exp() + x[2] * ((-10.0 * t).exp() - (-t).exp());
        (1..=10).map(|i| at(f64::from(i) / 10.0)).collect()
    })
}

fn jennrich_sampson() -> TestProblem {
    test_problem("Jennrich and Sampson", &[0.3, 0.4], &[124.362_182_355_614_9], |x| {
        (1..=10)
            .map(|i| -((x[0] * f64::from(i)).exp() + (x[1] * f64::from(i)).exp()) + (2.0 + 2.0 * f64::from(i)))
            .collect()
    })
}

fn brown_dennis() -> TestProblem {
    test_problem("Brown and Dennis", &[25.0, 5.0, -5.0, -1.0], &[85_822.201_627_485_43], |x| {
        let at = |t: f64| {
            let (one, other) = (x[0] + x[1] * t - t.exp(), x[2] + x[3] * t.sin() - t.cos());
            one * one + other * other
        };
        (1..=20).map(|i| at(f64::from(i) / 5.0)).collect()
    })
}

/// Shifted Chebyshev polynomials, averaged over the variables, less their integrals.
fn chebyquad(n: usize, m: usize, minima: Vec<f64>) -> TestProblem {
    let start: Vec<f64> = (1..=n).map(|j| j as f64 / (n as f64 + 1.0)).collect();
    test_problem(&format!("Chebyquad, {n} variables"), &start, &minima, move |x| {
        let mut residuals = vec![real(0.0); m];
        for x in x {
            let doubled = x * 2.0 - 1.0;
            let (mut before, mut polynomial) = (real(1.0), doubled);
            for residual in &mut residuals {
                *residual += polynomial / n as f64;
                (before, polynomial) = (polynomial, doubled * polynomial * 2.0 - before);
            }
        }
        let integral = |i: usize| if i.is_multiple_of(2) { 1.0 / ((i * i) as f64 - 1.0) } else { 0.0 };
        residuals.iter().enumerate().map(|(i, residual)| residual + integral(i + 1)).collect()
    })
}

fn brown_almost_linear(n: usize) -> TestProblem {
    test_problem(&format!("Brown, almost linear, {n} variables"), &vec![0.5; n], &[0.0, 1.0], move |x| {
        let common = sum(x) - (n as f64 + 1.0);
        let mut residuals: Vec<Complex> = x[..n - 1].iter().map(|x| x + common).collect();
        residuals.push(x.iter().product::<Complex>() - 1.0);
        residuals
    })
}

fn osborne_1() -> TestProblem {
    let y = column_series(TABLES, "Osborne 1", "y");
    test_problem("Osborne 1", &[0.5, 1.5, -1.0, 0.01, 0.02], &[5.464_894_697_482_906e-5], move |x| {
        let law = |t: f64| x[0] + x[1] * (x[3] * -t).exp() + x[2] * (x[4] * -t).exp();
        y.iter().map(|&(i, y)| -law(10.0 * (i - 1.0)) + y).collect()
    })
}

fn osborne_2() -> TestProblem {
    let y = column_series(TABLES, "Osborne 2", "y");
    let start = [1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5];
    test_problem("Osborne 2", &start, &[4.013_773_629_354_774e-2], move |x| {
        let bell = |t: f64, j: usize| x[j] * (x[j + 4] * -(-x[j + 7] + t).powi(2)).exp();
        let law = |t: f64| x[0] * (x[4] * -t).exp() + bell(t, 1) + bell(t, 2) + bell(t, 3);
        y.iter().map(|&(i, y)| -law((i - 1.0) / 10.0) + y).collect()
    })
}
