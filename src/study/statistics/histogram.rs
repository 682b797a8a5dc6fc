//! Counts of whole numbers of quanta, in bins that do not depend on what comes first.

/// A bin is 2¹⁸ quanta wide: 0.25 K where a quantum is 2⁻²⁰ K.
const BIN_SHIFT: u32 = 18;

/// Counts of bins, from the lowest that holds a value to the highest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Histogram {
    lowest: i64,
    counts: Vec<u64>,
}

impl Histogram {
    /// Counts a value.
    pub(super) fn count(&mut self, quanta: i64) {
        *self.bin(quanta >> BIN_SHIFT) += 1;
    }

    /// Counts what another histogram has counted.
    pub(super) fn merge(&mut self, other: &Self) {
        for (bin, count) in (other.lowest..).zip(&other.counts) {
            if *count > 0 {
                *self.bin(bin) += count;
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
                edge = Some((bin as f64 + ((values - below) / count).clamp(0.0, 1.0)) * (1i64 << BIN_SHIFT) as f64);
                below += count;
            }
            if below >= values && edge.is_some() {
                break;
            }
        }
        edge
    }

    /// The count of a bin, the range grown just so far as to hold it: two histograms of the same values are equal.
    fn bin(&mut self, bin: i64) -> &mut u64 {
        if self.counts.is_empty() {
            self.lowest = bin;
        }
        if bin < self.lowest {
            let more = (self.lowest - bin) as usize;
            self.counts.splice(0..0, std::iter::repeat_n(0, more));
            self.lowest = bin;
        }
        let place = (bin - self.lowest) as usize;
        if place >= self.counts.len() {
            self.counts.resize(place + 1, 0);
        }
        &mut self.counts[place]
    }
}
