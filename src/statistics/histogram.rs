//! Mergeable histogram of integers, with bins as narrow as the range allows.
//!
//! The bin width is the smallest power of two for which all values fit the largest number of bins, and bin edges are
//! multiples of it. So the bins depend on the extremes alone, not on the order; histograms merge to exactly that of all
//! values, in bounded memory. A sketch such as a t-digest is as small, but depends on the order of merging.
//!
//! A value may have a payload of further numbers, which are summed per bin.

/// Words that are added at once: one vector.
const WORDS: usize = 4;

/// The payloads of values, a row each: a one for the count, the numbers, and zeros up to a whole vector.
pub(super) struct PayloadRows {
    numbers: usize,
    words: Vec<u32>,
}

impl PayloadRows {
    /// Payloads of `numbers` numbers each, one row per value.
    pub(super) fn new(numbers: usize, rows: impl Iterator<Item = Vec<u32>>) -> Self {
        let mut payloads = Self { numbers, words: Vec::new() };
        let width = payloads.width();
        for row in rows {
            payloads.words.push(1);
            payloads.words.extend(row);
            payloads.words.resize(payloads.words.len().next_multiple_of(width), 0);
        }
        payloads
    }

    /// The payload of each value.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[u32]> {
        self.words.chunks_exact(self.width()).map(|row| &row[1..=self.numbers])
    }

    fn width(&self) -> usize {
        (1 + self.numbers).next_multiple_of(WORDS)
    }
}

/// Counts per bin, from the lowest occupied bin to the highest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram {
    bins_max: i64,
    /// Numbers per bin: the count, and the sums of the payloads.
    columns: usize,
    /// Binary logarithm of the bin width in quanta.
    width_log2: u32,
    lowest: i64,
    /// Bin × column.
    counts: Vec<u64>,
}

impl Histogram {
    /// An empty histogram with at most `bins_max` bins, whose values have a payload of `payload` numbers each.
    pub(super) fn new(bins_max: i64, payload: usize) -> Self {
        Self { bins_max, columns: 1 + payload, width_log2: 0, lowest: 0, counts: Vec::new() }
    }

    /// Add values without payloads.
    pub(super) fn add(&mut self, values: &[i64]) {
        debug_assert_eq!(self.columns, 1, "the values have payloads");
        self.extend_over(values);
        for &value in values {
            self.bin(value)[0] += 1;
        }
    }

    /// Add values with their payloads. The sums over all values are below 2³², so that four are added at
    /// once.
    pub(super) fn add_with_payload(&mut self, values: &[i64], payloads: &PayloadRows) {
        debug_assert_eq!(self.columns, 1 + payloads.numbers, "the payloads have another length");
        self.extend_over(values);
        let width = payloads.width();
        let mut sums = vec![0u32; self.bins().len() * width];
        for (number, &value) in values.iter().enumerate() {
            let row = &payloads.words[number * width..][..width];
            let place = ((value >> self.width_log2) - self.lowest) as usize * width;
            let sums = &mut sums[place..place + width];
            // Indices: `zip` is not inlined from another unit of the build.
            let words = row.as_chunks::<WORDS>().0;
            for (chunk, sums) in sums.as_chunks_mut::<WORDS>().0.iter_mut().enumerate() {
                for (word, sum) in sums.iter_mut().enumerate() {
                    *sum += words[chunk][word];
                }
            }
        }
        for (counts, sums) in self.counts.chunks_exact_mut(self.columns).zip(sums.chunks_exact(width)) {
            for (count, &sum) in counts.iter_mut().zip(sums) {
                *count += u64::from(sum);
            }
        }
    }

    /// Bins in rising order: the count, and the sums of the payloads.
    pub(super) fn bins(&self) -> impl ExactSizeIterator<Item = &[u64]> {
        self.counts.chunks_exact(self.columns)
    }

    /// Add another histogram.
    pub(super) fn merge(&mut self, other: &Self) {
        while self.width_log2 < other.width_log2 {
            self.coarsen();
        }
        for (bin, counts) in (other.lowest..).zip(other.bins()) {
            if counts[0] > 0 {
                self.extend_to(bin << other.width_log2);
                for (mine, theirs) in self.bin(bin << other.width_log2).iter_mut().zip(counts) {
                    *mine += theirs;
                }
            }
        }
    }

    /// The value, in quanta, below which `values` values lie; `None` for an empty histogram.
    pub(super) fn quantile(&self, values: f64) -> Option<f64> {
        let mut below = 0.0;
        let mut edge = None;
        for (bin, counts) in (self.lowest..).zip(self.bins()) {
            let count = counts[0] as f64;
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

    /// The content as integers: width, lowest bin, number of bins, and their counts.
    pub(super) fn to_integers(&self) -> impl Iterator<Item = i128> {
        let head = [i128::from(self.width_log2), i128::from(self.lowest), self.bins().len() as i128];
        head.into_iter().chain(self.counts.iter().map(|&count| i128::from(count)))
    }

    /// Restore a histogram of the same shape from [`to_integers`](Self::to_integers); `None` where they are invalid
    /// or do not hold `values` values.
    pub(super) fn restored(self, numbers: &mut dyn Iterator<Item = i128>, values: u64) -> Option<Self> {
        let width_log2 = u32::try_from(numbers.next()?).ok().filter(|&log2| log2 < 48)?;
        let lowest = i64::try_from(numbers.next()?).ok().filter(|lowest| lowest.unsigned_abs() < 1 << 48)?;
        let bins = usize::try_from(numbers.next()?).ok().filter(|&bins| bins <= self.bins_max as usize)?;
        let counts: Vec<u64> =
            (0..bins * self.columns).map(|_| u64::try_from(numbers.next()?).ok()).collect::<Option<_>>()?;
        let held = counts.iter().step_by(self.columns).try_fold(0u64, |sum, &count| sum.checked_add(count));
        (held == Some(values)).then_some(Self { width_log2, lowest, counts, ..self })
    }

    /// The numbers of the bin that contains a value in range.
    fn bin(&mut self, quanta: i64) -> &mut [u64] {
        let place = ((quanta >> self.width_log2) - self.lowest) as usize * self.columns;
        &mut self.counts[place..place + self.columns]
    }

    /// Extend the range to contain all values.
    fn extend_over(&mut self, values: &[i64]) {
        let Some((&first, others)) = values.split_first() else { return };
        let (mut lowest, mut highest) = (first, first);
        for &value in others {
            (lowest, highest) = (lowest.min(value), highest.max(value));
        }
        self.extend_to(lowest);
        self.extend_to(highest);
    }

    /// Extend the range to contain a value.
    fn extend_to(&mut self, quanta: i64) {
        if self.counts.is_empty() {
            self.lowest = quanta >> self.width_log2;
        }
        let (bin, more) = loop {
            let bin = quanta >> self.width_log2;
            let first = bin.min(self.lowest);
            let last = bin.max(self.lowest + self.bins().len() as i64 - 1);
            if last - first < self.bins_max {
                break (bin, (self.lowest - first) as usize);
            }
            self.coarsen();
        };
        if more > 0 {
            self.counts.splice(0..0, std::iter::repeat_n(0, more * self.columns));
            self.lowest = bin;
        }
        let end = ((bin - self.lowest) as usize + 1) * self.columns;
        if end > self.counts.len() {
            self.counts.resize(end, 0);
        }
    }

    /// Double the bin width by merging pairs.
    fn coarsen(&mut self) {
        let (lowest, bins) = (self.lowest >> 1, self.bins().len());
        for place in 0..bins {
            let into = (((self.lowest + place as i64) >> 1) - lowest) as usize;
            for column in 0..self.columns {
                // A pair is at or behind its new position, so no count is overwritten before it is moved.
                let count = std::mem::take(&mut self.counts[place * self.columns + column]);
                self.counts[into * self.columns + column] += count;
            }
        }
        let last = (self.lowest + bins as i64 - 1) >> 1;
        self.counts.truncate((last - lowest + 1) as usize * self.columns);
        (self.width_log2, self.lowest) = (self.width_log2 + 1, lowest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Few in Miri, which interprets every instruction.
    const BINS_MAX: i64 = if cfg!(miri) { 32 } else { 1024 };
    const VALUES: i64 = if cfg!(miri) { 60 } else { 4000 };

    fn last_digits(values: impl IntoIterator<Item = i64>) -> PayloadRows {
        PayloadRows::new(1, values.into_iter().map(|value| vec![(value.unsigned_abs() % 10) as u32]))
    }

    /// A histogram of values that carry their last digit.
    fn of(values: impl IntoIterator<Item = i64>) -> Histogram {
        let mut histogram = Histogram::new(BINS_MAX, 1);
        values.into_iter().for_each(|value| histogram.add_with_payload(&[value], &last_digits([value])));
        histogram
    }

    /// Values of growing magnitude and both signs.
    fn widening() -> impl DoubleEndedIterator<Item = i64> + Clone {
        (0..VALUES).map(|i| (i * i * i + 17 * i) * if i % 3 == 0 { -1 } else { 1 })
    }

    #[test]
    fn a_histogram_depends_neither_on_the_order_of_values_nor_on_merging() {
        let whole = of(widening());
        assert_eq!(whole, of(widening().rev()));
        let mut together = Histogram::new(BINS_MAX, 1);
        together.add_with_payload(&widening().collect::<Vec<_>>(), &last_digits(widening()));
        assert_eq!(together, whole, "all at once");
        for parted in [1, 10, VALUES as usize - 10] {
            let (mut first, last) = (of(widening().take(parted)), of(widening().skip(parted)));
            let mut turned = last.clone();
            first.merge(&last);
            turned.merge(&of(widening().take(parted)));
            assert_eq!((&first, &turned), (&whole, &whole), "split at {parted}");
        }
        assert_ne!(whole, of(widening().skip(1)));
    }

    #[test]
    fn bins_are_as_narrow_as_their_largest_number_allows() {
        let histogram = of(widening());
        let bins = histogram.bins().len() as i64;
        assert!((BINS_MAX / 2..=BINS_MAX).contains(&bins), "{bins}");
        assert_eq!(of(0..BINS_MAX).width_log2, 0);
        assert_eq!(of(0..=BINS_MAX).width_log2, 1);
    }

    #[test]
    fn merging_an_empty_histogram_changes_nothing() {
        let (mut whole, empty) = (of(widening()), Histogram::new(BINS_MAX, 1));
        whole.merge(&empty);
        assert_eq!(whole, of(widening()));
        let mut into = Histogram::new(BINS_MAX, 1);
        into.merge(&whole);
        assert_eq!(into, whole);
        assert_eq!(empty.quantile(0.0), None);
    }

    #[test]
    fn carried_numbers_are_summed_in_their_bins() {
        let histogram = of(widening());
        let carried: u64 = histogram.bins().map(|bin| bin[1]).sum();
        assert_eq!(carried, widening().map(|value| value.unsigned_abs() % 10).sum::<u64>());
        let above = |bins: &mut dyn Iterator<Item = &[u64]>| bins.map(|bin| bin[1]).sum::<u64>();
        let positive = above(&mut histogram.bins().skip(histogram.lowest.unsigned_abs() as usize));
        assert_eq!(
            positive,
            widening().filter(|&value| value >= 0).map(|value| value.unsigned_abs() % 10).sum::<u64>()
        );
    }
}
