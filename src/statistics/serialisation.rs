//! Serialisation of an accumulator as integers, without loss of a bit.

use super::Accumulator;
use super::output::OutputSums;
use super::sums::Sums;
use crate::ensemble::Marginal;

impl Accumulator {
    /// [`to_integers`](Self::to_integers), one after the other.
    pub(crate) fn integers(&self) -> impl Iterator<Item = i128> {
        [self.members as i128, self.excluded as i128]
            .into_iter()
            .chain(self.factors.iter().flat_map(|sums| [sums.sum, sums.squares]))
            .chain(self.grades.iter().chain(&self.gram).flatten().copied())
            .chain(self.sample.integers())
            .chain(self.outputs.iter().flat_map(OutputSums::integers))
    }

    /// The content as integers: members and excluded members; per factor its sum, its sum of squares, the sum of its
    /// grades and of their products with those of the factors up to it; per function the sums of its products with
    /// those up to it; the sampled members, each with its factors and outputs; per output its sum, its sum of
    /// squares, its products with each factor, the bits of its minimum and maximum, its products with each function,
    /// the histogram of its ranks, and that of its values.
    pub fn to_integers(&self) -> Vec<i128> {
        self.integers().collect()
    }

    /// Restore from [`to_integers`](Self::to_integers) and the references; `None` where they do not fit: too few, too
    /// many, or counts that do not add up to the members.
    pub fn from_integers(reference: &[f64], marginals: &[Marginal], numbers: &[i128]) -> Option<Self> {
        let mut accumulator = Self::new(reference, marginals);
        let mut numbers = numbers.iter().copied();
        accumulator.members = usize::try_from(numbers.next()?).ok()?;
        accumulator.excluded = usize::try_from(numbers.next()?).ok()?;
        let members = accumulator.members as u64;
        for sums in &mut accumulator.factors {
            *sums = Sums { sum: numbers.next()?, squares: numbers.next()? };
        }
        for sum in accumulator.grades.iter_mut().chain(&mut accumulator.gram).flatten() {
            *sum = numbers.next()?;
        }
        accumulator.sample.restore(&mut numbers, accumulator.members, [marginals.len(), reference.len()])?;
        // The first function is the constant: its square is summed over every member.
        let counted = accumulator.gram[0][0] == accumulator.members as i128 * CONSTANT * CONSTANT;
        for output in &mut accumulator.outputs {
            let OutputSums {
                sums,
                cross_products: crossed,
                min: low,
                max: high,
                histogram,
                rank_histogram: ranked,
                moments,
            } = output;
            *sums = Sums { sum: numbers.next()?, squares: numbers.next()? };
            crossed.iter_mut().try_for_each(|sum| numbers.next().map(|number| *sum = number))?;
            (*low, *high) = (bits(&mut numbers)?, bits(&mut numbers)?);
            moments.iter_mut().try_for_each(|sum| numbers.next().map(|number| *sum = number))?;
            *ranked = ranked.clone().restored(&mut numbers, members)?;
            *histogram = histogram.clone().restored(&mut numbers, members)?;
        }
        (counted && numbers.next().is_none()).then_some(accumulator)
    }
}

impl OutputSums {
    fn integers(&self) -> impl Iterator<Item = i128> {
        let extremes = [self.min, self.max].map(|value| i128::from(value.to_bits()));
        let sums = [self.sums.sum, self.sums.squares].into_iter().chain(self.cross_products.iter().copied());
        let histograms = self.rank_histogram.to_integers().chain(self.histogram.to_integers());
        sums.chain(extremes).chain(self.moments.iter().copied()).chain(histograms)
    }
}

impl Accumulator {
    /// [`from_integers`](Self::from_integers), with the references of this accumulator.
    pub fn restored_from(&self, numbers: &[i128]) -> Option<Self> {
        Self::from_integers(&self.reference, self.basis.marginals(), numbers)
    }
}

/// The constant function, in quanta.
const CONSTANT: i128 = super::basis::QUANTA as i128;

fn bits(numbers: &mut dyn Iterator<Item = i128>) -> Option<f64> {
    u64::try_from(numbers.next()?).ok().map(f64::from_bits).filter(|value| !value.is_nan())
}
