//! Exact integer sums, and centred sums of products.

/// Sums of one quantity, in quanta.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    pub(super) sum: i128,
    pub(super) squares: i128,
}

impl Sums {
    pub(super) fn add(&mut self, quanta: &[i64]) {
        self.sum += quanta.iter().map(|&quanta| i128::from(quanta)).sum::<i128>();
        self.squares += sum_of_products(quanta, quanta);
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.sum += other.sum;
        self.squares += other.squares;
    }
}

/// `Σab`.
pub(super) fn sum_of_products(a: &[i64], b: &[i64]) -> i128 {
    a.iter().zip(b).map(|(&a, &b)| i128::from(a) * i128::from(b)).sum()
}

/// `Σ (a − ā)(b − b̄) = Σab − ΣaΣb/n`, from the sum of products and the two sums.
///
/// The product of two sums may overflow 128 bits, and in floating point the difference would cancel. So the sums are
/// split into integer means and remainders, `Σa = n m + r`, and only `r s/n`, which is below `n`, is rounded.
pub(super) fn centred(members: usize, products: i128, first: i128, second: i128) -> f64 {
    if members == 0 {
        return 0.0;
    }
    let n = members as i128;
    let (mean, rest) = (first.div_euclid(n), first.rem_euclid(n));
    let (second_mean, second_rest) = (second.div_euclid(n), second.rem_euclid(n));
    let whole = products - mean * second - second_mean * rest;
    whole as f64 - rest as f64 * second_rest as f64 / n as f64
}
