//! A tally as a list of whole numbers, so that it can be put by and taken up again without the loss of a bit.

use super::classes::CLASSES;
use super::histogram::Histogram;
use super::output::Output;
use super::sums::Sums;
use super::{Span, Tally};

impl Tally {
    /// All that has been counted: members and those left out; of each factor its sum, its sum of squares and the
    /// members of each class; of each output its sum, its sum of squares, its products with each factor, the bits of its
    /// lowest and highest value, its sum in each class of each factor, and its histogram.
    pub fn numbers(&self) -> Vec<i128> {
        let mut numbers = vec![self.members as i128, self.left_out as i128];
        for (sums, counts) in self.factors.iter().zip(&self.classes) {
            numbers.extend([sums.first, sums.squares]);
            numbers.extend(counts.iter().map(|&count| i128::from(count)));
        }
        for output in &self.outputs {
            numbers.extend([output.sums.first, output.sums.squares]);
            numbers.extend(&output.crossed);
            numbers.extend([output.low, output.high].map(|value| i128::from(value.to_bits())));
            numbers.extend(output.in_class.iter().flatten());
            numbers.extend(output.histogram.numbers());
        }
        numbers
    }

    /// From [`numbers`](Self::numbers) and the references they were counted from; `None` where they do not belong
    /// together: too few or too many, or counts that do not add up to the members.
    pub fn restored(reference: &[f64], spans: &[Span], numbers: &[i128]) -> Option<Self> {
        let mut tally = Self::new(reference, spans);
        let mut numbers = numbers.iter().copied();
        tally.members = usize::try_from(numbers.next()?).ok()?;
        tally.left_out = usize::try_from(numbers.next()?).ok()?;
        let members = tally.members as u64;
        for (sums, counts) in tally.factors.iter_mut().zip(&mut tally.classes) {
            *sums = Sums { first: numbers.next()?, squares: numbers.next()? };
            for count in counts.iter_mut() {
                *count = u64::try_from(numbers.next()?).ok()?;
            }
            let held = counts.iter().try_fold(0u64, |sum, &count| sum.checked_add(count));
            if held != Some(members) {
                return None;
            }
        }
        for output in &mut tally.outputs {
            *output = Output {
                sums: Sums { first: numbers.next()?, squares: numbers.next()? },
                crossed: spans.iter().map(|_| numbers.next()).collect::<Option<_>>()?,
                low: bits(&mut numbers)?,
                high: bits(&mut numbers)?,
                in_class: spans.iter().map(|_| class_sums(&mut numbers)).collect::<Option<_>>()?,
                histogram: Histogram::restored(&mut numbers, members)?,
            };
        }
        numbers.next().is_none().then_some(tally)
    }
}

fn bits(numbers: &mut dyn Iterator<Item = i128>) -> Option<f64> {
    u64::try_from(numbers.next()?).ok().map(f64::from_bits)
}

fn class_sums(numbers: &mut dyn Iterator<Item = i128>) -> Option<[i128; CLASSES]> {
    let mut sums = [0; CLASSES];
    for sum in &mut sums {
        *sum = numbers.next()?;
    }
    Some(sums)
}
