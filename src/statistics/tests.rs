//! Statistics of an accumulator, and their independence of the order of members.

use super::*;
use crate::case::{Bounds, Factor, Property};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};

const REFERENCE: [f64; 3] = [900.0, 300.0, 79.0];

fn marginals() -> [Marginal; 2] {
    [(0.75, 1.25), (0.9, 1.1)].map(|bounds| Marginal::new(1.0, bounds, SamplingKind::Normal))
}

/// Members of a simple model: one output depends on both factors, one is constant, one is a time.
fn members(count: usize) -> (Vec<f64>, Vec<f64>) {
    let factor = |name: &str, small| Factor {
        name: name.into(),
        group: "INS".into(),
        property: Property::Conductivity,
        state: None,
        nominal: 1.0,
        small,
        large: small,
    };
    let factors = [factor("f_k", (0.75, 1.25)), factor("f_cp", (0.9, 1.1))];
    let sampling = Sampling { kind: SamplingKind::Normal, seed: 1 };
    let ensemble = Ensemble::sample(&factors, Bounds::Small, &sampling, count);
    let rows: Vec<Vec<f64>> = (0..count).map(|member| ensemble.member(member)).collect();
    let outputs = rows.iter().flat_map(|f| [900.0 * f[0] / f[1].sqrt(), 300.0, 79.0 + 30.0 * (f[1] - 1.0)]);
    (outputs.collect(), rows.concat())
}

fn tallied(outputs: &[f64], factors: &[f64]) -> Accumulator {
    let mut accumulator = Accumulator::new(&REFERENCE, &marginals());
    accumulator.add_block(outputs, factors, &vec![true; outputs.len() / 3]);
    accumulator
}

#[test]
fn mean_deviation_and_correlation_equal_the_two_pass_formulas() {
    let (outputs, factors) = members(5000);
    let accumulator = tallied(&outputs, &factors);
    let column = |values: &[f64], width: usize, i: usize| values.iter().skip(i).step_by(width).copied().collect();
    let mean = |v: &Vec<f64>| v.iter().sum::<f64>() / v.len() as f64;
    let product = |a: &Vec<f64>, b: &Vec<f64>| {
        let (a_mean, b_mean) = (mean(a), mean(b));
        a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum::<f64>()
    };
    for i in [0, 2] {
        let y: Vec<f64> = column(&outputs, 3, i);
        assert!((accumulator.mean(i) - mean(&y)).abs() < 1e-7);
        assert!((accumulator.deviation(i) - (product(&y, &y) / 4999.0).sqrt()).abs() < 1e-7);
        assert_eq!(accumulator.min(i), y.iter().copied().fold(f64::INFINITY, f64::min));
        assert_eq!(accumulator.max(i), y.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        for j in 0..2 {
            let x: Vec<f64> = column(&factors, 2, j);
            let pearson = product(&x, &y) / (product(&x, &x) * product(&y, &y)).sqrt();
            assert!((accumulator.correlation(i, j) - pearson).abs() < 1e-7);
        }
        assert!(
            (accumulator.squared_correlation_share(i, 0) + accumulator.squared_correlation_share(i, 1) - 1.0).abs()
                < 1e-12
        );
    }
    assert!(accumulator.correlation(2, 1) > 0.999_999);
}

#[test]
fn a_constant_output_has_no_deviation_and_no_correlation() {
    let (outputs, factors) = members(100);
    let accumulator = tallied(&outputs, &factors);
    assert_eq!((accumulator.mean(1), accumulator.deviation(1), accumulator.percentile(1, 97.5)), (300.0, 0.0, 300.0));
    assert_eq!((accumulator.correlation(1, 0), accumulator.squared_correlation_share(1, 0)), (0.0, 0.0));
}

#[test]
fn pieces_merged_in_any_order_equal_the_whole_bit_for_bit() {
    let (outputs, factors) = members(3000);
    let whole = tallied(&outputs, &factors);
    let piece = |from: usize, to: usize| tallied(&outputs[from * 3..to * 3], &factors[from * 2..to * 2]);
    let cuts = [(0, 1), (1, 1400), (1400, 2999), (2999, 3000)];
    for order in [[0, 1, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]] {
        let mut merged = Accumulator::new(&REFERENCE, &marginals());
        for place in order {
            merged.merge(&piece(cuts[place].0, cuts[place].1));
        }
        assert_eq!(merged, whole);
        assert_eq!(Accumulator::from_integers(&REFERENCE, &marginals(), &merged.to_integers()), Some(merged));
    }
    let mut one_by_one = Accumulator::new(&REFERENCE, &marginals());
    for member in (0..3000).rev() {
        one_by_one.add(&outputs[member * 3..][..3], &factors[member * 2..][..2]);
    }
    assert_eq!(one_by_one, whole);
}

#[test]
fn the_size_of_an_accumulator_does_not_depend_on_its_members() {
    let (outputs, factors) = members(2000);
    let mut accumulator = tallied(&outputs, &factors);
    let few = accumulator.clone();
    (0..20).for_each(|_| accumulator.merge(&accumulator.clone()));
    assert_eq!((accumulator.members(), accumulator.to_integers().len()), (2000 << 20, few.to_integers().len()));
    assert!(
        (accumulator.mean(0) - few.mean(0)).abs() < 1e-9
            && (accumulator.deviation(0) / few.deviation(0) - 1.0).abs() < 1e-3
    );
    assert_eq!(accumulator.percentile(0, 97.5), few.percentile(0, 97.5));
}

#[test]
fn inconsistent_integers_are_rejected() {
    let (outputs, factors) = members(50);
    let accumulator = tallied(&outputs, &factors);
    let restored = |numbers: &[i128]| Accumulator::from_integers(&REFERENCE, &marginals(), numbers);
    let numbers = accumulator.to_integers();
    let low = i128::from(accumulator.outputs[0].min.to_bits());
    assert_eq!(restored(&numbers), Some(accumulator));
    let not_a_number = |&number: &i128| if number == low { i128::from(f64::NAN.to_bits()) } else { number };
    assert_eq!(restored(&numbers.iter().map(not_a_number).collect::<Vec<_>>()), None);
    assert_eq!(restored(&numbers[..numbers.len() - 1]), None);
    assert_eq!(restored(&[&numbers[..], &[0]].concat()), None);
    // Members; the sum of the constant function's square; the last bin.
    for wrong in [0, 11, numbers.len() - 1] {
        let mut numbers = numbers.clone();
        numbers[wrong] += 1;
        assert_eq!(restored(&numbers), None, "number {wrong}");
    }
}

#[test]
fn accumulators_that_differ_by_one_quantum_are_unequal() {
    let (mut outputs, factors) = members(1000);
    let whole = tallied(&outputs, &factors);
    outputs[3 * 500] += 1.5 / OUTPUT_QUANTA;
    assert_ne!(tallied(&outputs, &factors), whole);
}

/// Ten thousand values evenly spread over 100 K: percentile p lies p K above the lowest.
#[test]
fn percentiles_of_a_uniform_distribution_are_linear() {
    let mut accumulator = Accumulator::new(&[850.1], &[]);
    let values: Vec<f64> = (0..10_000).map(|i| 800.0 + (i as f64 + 0.5) / 100.0).collect();
    accumulator.add_block(&values, &[], &vec![true; values.len()]);
    for percent in [2.5, 25.0, 50.0, 75.0, 97.5] {
        assert!((accumulator.percentile(0, percent) - 800.0 - percent).abs() < 0.02, "{percent}");
    }
    assert_eq!(accumulator.percentile(0, 0.0), accumulator.min(0));
    assert_eq!(accumulator.percentile(0, 100.0), accumulator.max(0));
}

#[test]
fn no_percentile_is_in_a_gap_of_the_values() {
    let mut accumulator = Accumulator::new(&[0.0], &[]);
    accumulator.add_block(&[1.0, 1.0, 1.0, 50.0], &[], &[true; 4]);
    assert!((accumulator.percentile(0, 50.0) - 1.0).abs() < 0.25);
    assert_eq!(accumulator.percentile(0, 95.0), 50.0);
}

#[test]
fn failed_members_are_skipped_and_out_of_range_members_are_excluded_and_counted() {
    let (mut outputs, factors) = members(6);
    let honest = tallied(&outputs[9..], &factors[6..]);
    (outputs[0], outputs[5], outputs[6]) = (f64::NAN, 1e300, f64::NAN);
    let mut accumulator = Accumulator::new(&REFERENCE, &marginals());
    accumulator.add_block(&outputs, &factors, &[true, true, false, true, true, true]);
    assert_eq!((accumulator.members(), accumulator.excluded()), (3, 2));
    assert_eq!(accumulator.outputs, honest.outputs);
    assert_eq!(accumulator.factors, honest.factors);
}

#[test]
fn the_largest_deviations_do_not_overflow() {
    let mut accumulator = Accumulator::new(&[0.0], &[Marginal::new(0.0, (-1.0, 1.0), SamplingKind::Normal)]);
    let far: Vec<f64> =
        (0..20_000).map(|i| if i % 2 == 0 { MAX_OUTPUT_DEVIATION } else { -MAX_OUTPUT_DEVIATION }).collect();
    let factors: Vec<f64> = far.iter().map(|value| -value / MAX_OUTPUT_DEVIATION * MAX_FACTOR_DEVIATION).collect();
    accumulator.add_block(&far, &factors, &vec![true; far.len()]);
    assert_eq!(accumulator.mean(0), 0.0);
    assert!((accumulator.deviation(0) / MAX_OUTPUT_DEVIATION - (20_000.0f64 / 19_999.0).sqrt()).abs() < 1e-14);
    assert!((accumulator.correlation(0, 0) + 1.0).abs() < 1e-14);
}

#[test]
fn an_empty_accumulator_has_no_mean() {
    let accumulator = Accumulator::new(&REFERENCE, &marginals());
    assert!(accumulator.mean(0).is_nan() && accumulator.percentile(0, 50.0).is_nan());
    assert_eq!((accumulator.deviation(0), accumulator.correlation(0, 0)), (0.0, 0.0));
}
