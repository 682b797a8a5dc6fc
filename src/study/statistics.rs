//! Statistics of an ensemble, gathered member by member and exactly.
//!
//! Floating-point sums depend on the order of their terms, and with it on the batch and on the number of threads. Here
//! every deviation from a reference is rounded once, to a whole number of quanta, and all sums are sums of integers:
//! they come out the same in any order, and two tallies of half an ensemble merge to exactly the tally of the whole.
//! Compensated or pairwise summation would only make the differences small.
//!
//! With `d` the deviation of an output and `x` that of a factor, a tally holds `Σd, Σd², Σx, Σx², Σxd`, the extremes,
//! for the percentiles a histogram of `d`, and for the Sobol indices `Σd` in each class of `x`. Its memory has a bound
//! that does not depend on the members.

mod classes;
mod histogram;
mod numbers;
mod output;
mod sums;

pub use classes::Span;

use classes::{CLASSES, index};
use output::{Output, Shift};
use rayon::prelude::*;
use sums::{Sums, centred};

/// Quanta of an output in one unit of it: one is 2⁻²⁰ K, far below what a march resolves.
const OUTPUT_QUANTA: f64 = (1u64 << 20) as f64;
/// Quanta of a factor in one unit of it.
const FACTOR_QUANTA: f64 = (1u64 << 40) as f64;
/// The largest deviation of an output that is counted, K: a sum of squares then stays in range for 2⁵⁴ members.
const OUTPUT_REACH: f64 = (1u64 << 16) as f64;
/// The largest deviation of a factor that is counted: a sum of squares then stays in range for 2²⁶ members.
const FACTOR_REACH: f64 = (1u64 << 10) as f64;
/// Outputs that are gathered together: the stretch of a member's row that fills two lines of the cache.
const STRETCH: usize = 16;

/// What has been counted of an ensemble: `outputs` numbers of each member, temperatures in K or times in s, and the
/// `factors` that led to them.
///
/// Where no member has been counted, mean and percentiles are NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    reference: Vec<f64>,
    spans: Vec<Span>,
    members: usize,
    left_out: usize,
    outputs: Vec<Output>,
    factors: Vec<Sums>,
    /// Members in each class of each factor.
    classes: Vec<[u64; CLASSES]>,
}

impl Tally {
    /// An empty tally. The references, one an output, and the nominal values of the spans, one a factor, are what
    /// deviations are counted from.
    pub fn new(reference: &[f64], spans: &[Span]) -> Self {
        Self {
            reference: reference.to_vec(),
            spans: spans.to_vec(),
            members: 0,
            left_out: 0,
            outputs: vec![Output::new(spans.len()); reference.len()],
            factors: vec![Sums::default(); spans.len()],
            classes: vec![[0; CLASSES]; spans.len()],
        }
    }

    /// Counts one member.
    ///
    /// # Panics
    /// When there are not as many outputs and factors as references.
    pub fn add(&mut self, outputs: &[f64], factors: &[f64]) {
        self.add_block(outputs, factors, &[true]);
    }

    /// Counts a block of members: `outputs` is member × output, `factors` is member × factor, and only the members
    /// that `arrived` are counted, the others passed over.
    ///
    /// A member that arrived with a number that is not finite, or further than 65,536 from its reference (a factor
    /// 1,024), is left out whole and counted in [`left_out`](Self::left_out): clamped, it would bias every figure.
    ///
    /// # Panics
    /// When the lengths do not fit the references and the number of members.
    pub fn add_block(&mut self, outputs: &[f64], factors: &[f64], arrived: &[bool]) {
        let (width, breadth) = (self.reference.len(), self.spans.len());
        assert_eq!(outputs.len(), arrived.len() * width, "outputs are not member × output");
        assert_eq!(factors.len(), arrived.len() * breadth, "factors are not member × factor");

        let arrivals: Vec<usize> = (0..arrived.len()).filter(|&member| arrived[member]).collect();
        let counted = |member: &usize| {
            let (outputs, factors) = (&outputs[member * width..][..width], &factors[member * breadth..][..breadth]);
            let near = |value: &f64, reference: f64, reach: f64| (value - reference).abs() <= reach;
            outputs.iter().zip(&self.reference).all(|(value, reference)| near(value, *reference, OUTPUT_REACH))
                && factors.iter().zip(&self.spans).all(|(value, span)| near(value, span.nominal, FACTOR_REACH))
        };
        let members: Vec<usize> = arrivals.par_iter().copied().filter(counted).collect();
        self.members += members.len();
        self.left_out += arrivals.len() - members.len();

        let mut shifts = Vec::with_capacity(members.len() * breadth);
        for member in &members {
            let row = factors[member * breadth..].iter().zip(&self.spans);
            for ((value, span), (sums, counts)) in row.zip(self.factors.iter_mut().zip(&mut self.classes)) {
                let quanta = ((value - span.nominal) * FACTOR_QUANTA).round() as i64;
                let class = span.class(*value);
                sums.add(quanta);
                counts[usize::from(class)] += 1;
                shifts.push(Shift { quanta, class });
            }
        }

        let stretches = self.outputs.par_chunks_mut(STRETCH).zip(self.reference.par_chunks(STRETCH)).enumerate();
        stretches.for_each(|(stretch, (tallied, reference))| {
            for (place, member) in members.iter().enumerate() {
                let row = &outputs[member * width + stretch * STRETCH..];
                let shifts = &shifts[place * breadth..][..breadth];
                for ((output, reference), value) in tallied.iter_mut().zip(reference).zip(row) {
                    output.add(*value, ((value - reference) * OUTPUT_QUANTA).round() as i64, shifts);
                }
            }
        });
    }

    /// Counts what another tally has counted.
    ///
    /// # Panics
    /// When the two do not count from the same references.
    pub fn merge(&mut self, other: &Self) {
        assert!(
            self.reference == other.reference && self.spans == other.spans,
            "tallies count from different references"
        );
        self.members += other.members;
        self.left_out += other.left_out;
        for (mine, theirs) in self.outputs.iter_mut().zip(&other.outputs) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.factors.iter_mut().zip(&other.factors) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.classes.iter_mut().flatten().zip(other.classes.iter().flatten()) {
            *mine += theirs;
        }
    }

    /// Members counted.
    pub fn members(&self) -> usize {
        self.members
    }

    /// Factors that led to the outputs.
    pub fn factors(&self) -> usize {
        self.spans.len()
    }

    /// Members that arrived but could not be counted.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Arithmetic mean of an output.
    pub fn mean(&self, output: usize) -> f64 {
        let sum = self.outputs[output].sums.first as f64;
        self.reference[output] + sum / self.members as f64 / OUTPUT_QUANTA
    }

    /// Standard deviation of an output, of a sample (divided by members less one); zero for a single member.
    pub fn deviation(&self, output: usize) -> f64 {
        let sums = &self.outputs[output].sums;
        let squares = centred(self.members, sums.squares, sums.first, sums.first);
        if self.members < 2 { 0.0 } else { (squares / (self.members - 1) as f64).sqrt() / OUTPUT_QUANTA }
    }

    /// The lowest value of an output, positive infinity where no member has been counted.
    pub fn low(&self, output: usize) -> f64 {
        self.outputs[output].low
    }

    /// The highest value of an output, negative infinity where no member has been counted.
    pub fn high(&self, output: usize) -> f64 {
        self.outputs[output].high
    }

    /// The value below which `percent` of the members lie, from up to 1,024 bins between the extremes within which
    /// members are taken as evenly spread: right to a fraction of a 512th of their range, and never beyond it.
    pub fn percentile(&self, output: usize, percent: f64) -> f64 {
        let Output { low, high, histogram, .. } = &self.outputs[output];
        match histogram.above(percent / 100.0 * self.members as f64) {
            Some(quanta) => (self.reference[output] + quanta / OUTPUT_QUANTA).max(*low).min(*high),
            None => f64::NAN,
        }
    }

    /// Pearson correlation of an output and a factor (the paper's Eq. 13); zero where either does not vary.
    pub fn correlation(&self, output: usize, factor: usize) -> f64 {
        let (y, x) = (&self.outputs[output], &self.factors[factor]);
        let output_squares = centred(self.members, y.sums.squares, y.sums.first, y.sums.first);
        let factor_squares = centred(self.members, x.squares, x.first, x.first);
        let products = centred(self.members, y.crossed[factor], x.first, y.sums.first);
        let both = (output_squares * factor_squares).sqrt();
        if both > 0.0 { (products / both).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// A factor's share of the uncertainty of an output: its squared correlation over the sum of all factors'; zero
    /// where nothing varies.
    pub fn share(&self, output: usize, factor: usize) -> f64 {
        let square = |factor| self.correlation(output, factor).powi(2);
        let all: f64 = (0..self.factors.len()).map(square).sum();
        if all > 0.0 { square(factor) / all } else { 0.0 }
    }

    /// First-order Sobol index of an output by a factor: the share of the output's variance that would be gone were the
    /// factor known, whatever the form of the dependence. Of an index S chance leaves 2 √(S (1 − S)/members) in doubt, and
    /// some 16/members, twice √(2·32), of none. Zero where nothing varies or members are no more than the factor's classes.
    pub fn index(&self, output: usize, factor: usize) -> f64 {
        let Output { sums, in_class, .. } = &self.outputs[output];
        index(self.members, sums, &self.classes[factor], &in_class[factor])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Bounds, Factor, Property};
    use crate::ensemble::{Ensemble, Sampling, SamplingKind};

    const REFERENCE: [f64; 3] = [900.0, 300.0, 79.0];
    const FACTORS: [Span; 2] =
        [Span { nominal: 1.0, low: 0.75, high: 1.25 }, Span { nominal: 1.0, low: 0.9, high: 1.1 }];

    /// Members of a small law: one output that follows both factors, one that never varies, one that is a time.
    fn members(count: usize) -> (Vec<f64>, Vec<f64>) {
        let factor = |name: &str, small| Factor {
            name: name.into(),
            group: "INS".into(),
            property: Property::Conductivity,
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

    fn tallied(outputs: &[f64], factors: &[f64]) -> Tally {
        let mut tally = Tally::new(&REFERENCE, &FACTORS);
        tally.add_block(outputs, factors, &vec![true; outputs.len() / 3]);
        tally
    }

    #[test]
    fn mean_deviation_and_correlation_equal_the_two_pass_formulas() {
        let (outputs, factors) = members(5000);
        let tally = tallied(&outputs, &factors);
        let column = |values: &[f64], width: usize, i: usize| values.iter().skip(i).step_by(width).copied().collect();
        let mean = |v: &Vec<f64>| v.iter().sum::<f64>() / v.len() as f64;
        let product = |a: &Vec<f64>, b: &Vec<f64>| {
            let (a_mean, b_mean) = (mean(a), mean(b));
            a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum::<f64>()
        };
        for i in [0, 2] {
            let y: Vec<f64> = column(&outputs, 3, i);
            assert!((tally.mean(i) - mean(&y)).abs() < 1e-7);
            assert!((tally.deviation(i) - (product(&y, &y) / 4999.0).sqrt()).abs() < 1e-7);
            assert_eq!(tally.low(i), y.iter().copied().fold(f64::INFINITY, f64::min));
            assert_eq!(tally.high(i), y.iter().copied().fold(f64::NEG_INFINITY, f64::max));
            for j in 0..2 {
                let x: Vec<f64> = column(&factors, 2, j);
                let pearson = product(&x, &y) / (product(&x, &x) * product(&y, &y)).sqrt();
                assert!((tally.correlation(i, j) - pearson).abs() < 1e-7);
            }
            assert!((tally.share(i, 0) + tally.share(i, 1) - 1.0).abs() < 1e-12);
        }
        assert!(tally.correlation(2, 1) > 0.999_999);
    }

    #[test]
    fn an_output_that_never_varies_has_no_deviation_and_no_factor_to_blame() {
        let (outputs, factors) = members(100);
        let tally = tallied(&outputs, &factors);
        assert_eq!((tally.mean(1), tally.deviation(1), tally.percentile(1, 97.5)), (300.0, 0.0, 300.0));
        assert_eq!((tally.correlation(1, 0), tally.share(1, 0)), (0.0, 0.0));
    }

    #[test]
    fn pieces_merged_in_any_order_equal_the_whole_bit_for_bit() {
        let (outputs, factors) = members(1000);
        let whole = tallied(&outputs, &factors);
        let piece = |from: usize, to: usize| tallied(&outputs[from * 3..to * 3], &factors[from * 2..to * 2]);
        let cuts = [(0, 1), (1, 400), (400, 999), (999, 1000)];
        for order in [[0, 1, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]] {
            let mut merged = Tally::new(&REFERENCE, &FACTORS);
            for place in order {
                merged.merge(&piece(cuts[place].0, cuts[place].1));
            }
            assert_eq!(merged, whole);
            assert_eq!(Tally::restored(&REFERENCE, &FACTORS, &merged.numbers()), Some(merged));
        }
        let mut one_by_one = Tally::new(&REFERENCE, &FACTORS);
        for member in (0..1000).rev() {
            one_by_one.add(&outputs[member * 3..][..3], &factors[member * 2..][..2]);
        }
        assert_eq!(one_by_one, whole);
    }

    #[test]
    fn a_tally_of_a_thousand_million_members_is_as_large_as_one_of_a_thousand() {
        let (outputs, factors) = members(1000);
        let mut tally = tallied(&outputs, &factors);
        let few = tally.clone();
        (0..20).for_each(|_| tally.merge(&tally.clone()));
        assert_eq!((tally.members(), tally.numbers().len()), (1000 << 20, few.numbers().len()));
        assert!(
            (tally.mean(0) - few.mean(0)).abs() < 1e-9 && (tally.deviation(0) / few.deviation(0) - 1.0).abs() < 1e-3
        );
        assert_eq!(tally.percentile(0, 97.5), few.percentile(0, 97.5));
    }

    #[test]
    fn numbers_that_do_not_add_up_are_no_tally() {
        let (outputs, factors) = members(50);
        let tally = tallied(&outputs, &factors);
        let restored = |numbers: &[i128]| Tally::restored(&REFERENCE, &FACTORS, numbers);
        let numbers = tally.numbers();
        assert_eq!(restored(&numbers), Some(tally));
        assert_eq!(restored(&numbers[..numbers.len() - 1]), None);
        assert_eq!(restored(&[&numbers[..], &[0]].concat()), None);
        for wrong in [0, 4, numbers.len() - 1] {
            let mut numbers = numbers.clone();
            numbers[wrong] += 1;
            assert_eq!(restored(&numbers), None, "number {wrong}");
        }
    }

    #[test]
    fn the_equality_of_tallies_sees_a_single_quantum() {
        let (mut outputs, factors) = members(1000);
        let whole = tallied(&outputs, &factors);
        outputs[3 * 500] += 1.5 / OUTPUT_QUANTA;
        assert_ne!(tallied(&outputs, &factors), whole);
    }

    /// Ten thousand values evenly spread over 100 K: percentile p lies p K above the lowest.
    #[test]
    fn percentiles_of_an_even_spread_are_straight() {
        let mut tally = Tally::new(&[850.1], &[]);
        let values: Vec<f64> = (0..10_000).map(|i| 800.0 + (i as f64 + 0.5) / 100.0).collect();
        tally.add_block(&values, &[], &vec![true; values.len()]);
        for percent in [2.5, 25.0, 50.0, 75.0, 97.5] {
            assert!((tally.percentile(0, percent) - 800.0 - percent).abs() < 0.02, "{percent}");
        }
        assert_eq!(tally.percentile(0, 0.0), tally.low(0));
        assert_eq!(tally.percentile(0, 100.0), tally.high(0));
    }

    #[test]
    fn a_gap_in_the_values_is_no_place_for_a_percentile() {
        let mut tally = Tally::new(&[0.0], &[]);
        tally.add_block(&[1.0, 1.0, 1.0, 50.0], &[], &[true; 4]);
        assert!((tally.percentile(0, 50.0) - 1.0).abs() < 0.25);
        assert_eq!(tally.percentile(0, 95.0), 50.0);
    }

    #[test]
    fn members_that_did_not_arrive_are_passed_over_and_absurd_ones_left_out_and_counted() {
        let (mut outputs, factors) = members(6);
        let honest = tallied(&outputs[9..], &factors[6..]);
        (outputs[0], outputs[5], outputs[6]) = (f64::NAN, 1e300, f64::NAN);
        let mut tally = Tally::new(&REFERENCE, &FACTORS);
        tally.add_block(&outputs, &factors, &[true, true, false, true, true, true]);
        assert_eq!((tally.members(), tally.left_out()), (3, 2));
        assert_eq!(tally.outputs, honest.outputs);
        assert_eq!(tally.factors, honest.factors);
    }

    #[test]
    fn the_furthest_members_that_are_counted_do_not_overflow() {
        let mut tally = Tally::new(&[0.0], &[Span { nominal: 0.0, low: -1.0, high: 1.0 }]);
        let far: Vec<f64> = (0..20_000).map(|i| if i % 2 == 0 { OUTPUT_REACH } else { -OUTPUT_REACH }).collect();
        let factors: Vec<f64> = far.iter().map(|value| -value / OUTPUT_REACH * FACTOR_REACH).collect();
        tally.add_block(&far, &factors, &vec![true; far.len()]);
        assert_eq!(tally.mean(0), 0.0);
        assert!((tally.deviation(0) / OUTPUT_REACH - (20_000.0f64 / 19_999.0).sqrt()).abs() < 1e-14);
        assert!((tally.correlation(0, 0) + 1.0).abs() < 1e-14);
    }

    #[test]
    fn an_empty_tally_says_so() {
        let tally = Tally::new(&REFERENCE, &FACTORS);
        assert!(tally.mean(0).is_nan() && tally.percentile(0, 50.0).is_nan());
        assert_eq!((tally.deviation(0), tally.correlation(0, 0)), (0.0, 0.0));
    }
}
