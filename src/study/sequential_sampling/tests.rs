use super::*;
use crate::random::RandomStream;
use statrs::distribution::{Binomial, ContinuousCDF, Discrete, Normal};

/// Coverage of the interval at the end, exactly: the count of members above the limit at each look is a Markov chain.
fn coverage(probability: f64, half_width: HalfWidth, tail: f64) -> f64 {
    const MOST: usize = 60_000;
    const NEGLIGIBLE: f64 = 1e-8;
    let (mut chances, mut lowest, mut before, mut covered) = (vec![1.0], 0, 0, 0.0);
    for members in looks(MOST) {
        let further = Binomial::new(probability, (members - before) as u64).expect("a probability");
        let mean = probability * (members - before) as f64;
        let reach = 7.0 * mean.sqrt() + 8.0;
        let least = (mean - reach).max(0.0) as usize;
        let most = ((mean + reach) as usize).min(members - before);
        let added: Vec<f64> = (least..=most).map(|count| further.pmf(count as u64)).collect();
        let mut next = vec![0.0; chances.len() + added.len() - 1];
        for (i, chance) in chances.iter().enumerate().filter(|(_, chance)| **chance > NEGLIGIBLE) {
            added.iter().enumerate().for_each(|(j, added)| next[i + j] += chance * added);
        }
        (lowest, before) = (lowest + least, members);
        for (i, chance) in next.iter_mut().enumerate().filter(|(_, chance)| **chance > NEGLIGIBLE) {
            let counted = Proportion { count: lowest + i, total: members };
            let (low, high) = counted.interval(tail);
            let look = Look { members, estimate: counted.fraction(), low: Some(low), high: Some(high) };
            if look.is_within(half_width) || members == MOST {
                covered += if (low..=high).contains(&probability) { *chance } else { 0.0 };
                *chance = 0.0;
            }
        }
        if next.iter().all(|chance| *chance <= NEGLIGIBLE) {
            break;
        }
        chances = next;
    }
    covered
}

#[test]
fn the_interval_of_a_probability_covers_it_in_95_of_100_sweeps_although_its_width_ends_them() {
    let worst = |tail: f64| {
        // The worst of a grid of probabilities and half-widths.
        let targets = [(0.164, HalfWidth::Absolute(0.01)), (0.0864, HalfWidth::Relative(0.2))];
        targets.map(|(probability, half_width)| coverage(probability, half_width, tail)).into_iter().fold(1.0, f64::min)
    };
    let found = worst(TAIL);
    assert!((0.95..0.97).contains(&found), "{found}");
    // Negative control: intervals of 95 % at each look.
    let found = worst(0.025);
    assert!(found < 0.948, "{found}");
}

#[test]
fn the_interval_of_a_percentile_covers_it_in_95_of_100_sweeps_although_its_width_ends_them() {
    let normal = Normal::standard();
    let (probability, target) = (0.95, HalfWidth::Absolute(2.5));
    let truth_k = 600.0 + 20.0 * normal.inverse_cdf(probability);
    let is_covered = |seed: u64| {
        let mut numbers = RandomStream::new(seed, 0);
        let mut peaks_k: Vec<f64> = Vec::new();
        for members in looks(100_000) {
            peaks_k.extend((peaks_k.len()..members).map(|_| 600.0 + 20.0 * numbers.normal()));
            peaks_k.sort_by(f64::total_cmp);
            let look = look(&peaks_k, TargetQuantity::Percentile(probability));
            if look.is_within(target) {
                assert!(members < 10_000, "{members}");
                return look.low <= Some(truth_k) && look.high >= Some(truth_k);
            }
        }
        false
    };
    let covered = (0..400).filter(|&seed| is_covered(seed)).count();
    // Three standard errors of a share of 95 % of 400 are 13.
    assert!((367..=399).contains(&covered), "{covered} of 400");
}

#[test]
fn looks_grow_by_a_quarter_and_end_with_the_largest_number() {
    let found: Vec<usize> = looks(1000).collect();
    assert_eq!(found, [500, 625, 782, 978, 1000]);
    assert_eq!(looks(30).collect::<Vec<_>>(), [30]);
}
