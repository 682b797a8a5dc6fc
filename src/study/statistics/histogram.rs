//! Counts of whole numbers of quanta, in bins as narrow as their range allows.
//!
//! A bin is a power of two of quanta wide, the least with which all values lie in 1,024 bins or fewer, and its edges
//! are multiples of its width. So the bins depend on the extremes alone, not on what came first, and histograms merge
//! to exactly that of all their values, while their memory has a bound. A sketch such as a t-digest is as small, but
//! merges to other numbers in another order.

/// Bins at most: where values spread widest, one is a 512th of their range or less.
const BINS_MAX: i64 = 1024;

/// Counts of bins, from the lowest that holds a value to the highest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Histogram {
    /// A bin is 2 to this power quanta wide.
    width_log2: u32,
    lowest: i64,
    counts: Vec<u64>,
}

impl Histogram {
    /// Counts a value.
    pub(super) fn count(&mut self, quanta: i64) {
        *self.bin(quanta) += 1;
    }

    /// Counts what another histogram has counted.
    pub(super) fn merge(&mut self, other: &Self) {
        while self.width_log2 < other.width_log2 {
            self.coarsen();
        }
        for (bin, count) in (other.lowest..).zip(&other.counts) {
            if *count > 0 {
                *self.bin(bin << other.width_log2) += count;
            }
        }
    }

    /// The value in quanta below which so many values lie; `None` where there are none at all.
    pub(super) fn above(&self, values: f64) -> Option<f64> {
        let mut below = 0.0;
        let mut edge = None;
        for (bin, &count) in (self.lowest..).zip(&self.counts) {
            let count = count as f64;
            if count > 0.0 {
                let share = ((values - below) / count).clamp(0.0, 1.0);
                edge = Some((bin as f64 + share) * (1i64 << self.width_log2) as f64);
                below += count;
            }
            if below >= values && edge.is_some() {
                break;
            }
        }
        edge
    }

    /// All of it as whole numbers: width, lowest bin, how many bins, and their counts.
    pub(super) fn numbers(&self) -> impl Iterator<Item = i128> {
        let head = [i128::from(self.width_log2), i128::from(self.lowest), self.counts.len() as i128];
        head.into_iter().chain(self.counts.iter().map(|&count| i128::from(count)))
    }

    /// From [`numbers`](Self::numbers), of which it takes its own; `None` where they are not such of so many values.
    pub(super) fn restored(numbers: &mut dyn Iterator<Item = i128>, values: u64) -> Option<Self> {
        let width_log2 = u32::try_from(numbers.next()?).ok().filter(|&log2| log2 < 48)?;
        let lowest = i64::try_from(numbers.next()?).ok().filter(|lowest| lowest.unsigned_abs() < 1 << 48)?;
        let bins = usize::try_from(numbers.next()?).ok().filter(|&bins| bins <= BINS_MAX as usize)?;
        let counts: Vec<u64> = (0..bins).map(|_| u64::try_from(numbers.next()?).ok()).collect::<Option<_>>()?;
        let held = counts.iter().try_fold(0u64, |sum, &count| sum.checked_add(count));
        (held == Some(values)).then_some(Self { width_log2, lowest, counts })
    }

    /// The count of the bin that holds a value, the range grown just so far as to hold it.
    fn bin(&mut self, quanta: i64) -> &mut u64 {
        if self.counts.is_empty() {
            self.lowest = quanta >> self.width_log2;
        }
        let (bin, more) = loop {
            let bin = quanta >> self.width_log2;
            let first = bin.min(self.lowest);
            let last = bin.max(self.lowest + self.counts.len() as i64 - 1);
            if last - first < BINS_MAX {
                break (bin, (self.lowest - first) as usize);
            }
            self.coarsen();
        };
        if more > 0 {
            self.counts.splice(0..0, std::iter::repeat_n(0, more));
            self.lowest = bin;
        }
        let place = (bin - self.lowest) as usize;
        if place >= self.counts.len() {
            self.counts.resize(place + 1, 0);
        }
        &mut self.counts[place]
    }

    /// Bins twice as wide: each pair becomes one.
    fn coarsen(&mut self) {
        let lowest = self.lowest >> 1;
        for place in 0..self.counts.len() {
            let into = (((self.lowest + place as i64) >> 1) - lowest) as usize;
            // A pair lies at or behind its new place, so no count is overwritten before it is moved.
            let count = std::mem::take(&mut self.counts[place]);
            self.counts[into] += count;
        }
        let last = (self.lowest + self.counts.len() as i64 - 1) >> 1;
        self.counts.truncate((last - lowest + 1) as usize);
        (self.width_log2, self.lowest) = (self.width_log2 + 1, lowest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: impl IntoIterator<Item = i64>) -> Histogram {
        let mut histogram = Histogram::default();
        values.into_iter().for_each(|value| histogram.count(value));
        histogram
    }

    /// Values that spread ever wider, on both sides of nothing.
    fn widening() -> impl DoubleEndedIterator<Item = i64> + Clone {
        (0..4000i64).map(|i| (i * i * i + 17 * i) * if i % 3 == 0 { -1 } else { 1 })
    }

    #[test]
    fn a_histogram_depends_on_its_values_and_not_on_their_order_or_how_they_are_parted() {
        let whole = of(widening());
        assert_eq!(whole, of(widening().rev()));
        for parted in [1, 10, 3990] {
            let (mut first, last) = (of(widening().take(parted)), of(widening().skip(parted)));
            let mut turned = last.clone();
            first.merge(&last);
            turned.merge(&of(widening().take(parted)));
            assert_eq!((&first, &turned), (&whole, &whole), "parted at {parted}");
        }
        assert_ne!(whole, of(widening().skip(1)));
    }

    #[test]
    fn bins_are_as_many_as_allowed_and_no_more_and_no_wider_than_that_takes() {
        let histogram = of(widening());
        let bins = histogram.counts.len() as i64;
        assert!((BINS_MAX / 2..=BINS_MAX).contains(&bins), "{bins}");
        assert_eq!(of(0..BINS_MAX).width_log2, 0);
        assert_eq!(of(0..=BINS_MAX).width_log2, 1);
    }

    #[test]
    fn an_empty_histogram_merges_into_nothing_else() {
        let (mut whole, empty) = (of(widening()), Histogram::default());
        whole.merge(&empty);
        assert_eq!(whole, of(widening()));
        let mut into = Histogram::default();
        into.merge(&whole);
        assert_eq!(into, whole);
        assert_eq!(empty.above(0.0), None);
    }
}
