use super::*;
use crate::random::RandomStream;
use statrs::distribution::{Binomial, ContinuousCDF, Discrete, Normal};
use std::convert::Infallible;

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

/// Up to three ways to exceed a limit in four variables: u₁ or −u₁ above β + bend u₂², and u₃ above β. Between two of
/// them the limit state has a kink.
#[derive(Clone, Copy, Debug)]
struct Ways {
    count: usize,
    distance: f64,
    bend: f64,
}

impl Ways {
    fn least(&self, point: &[f64]) -> (f64, Vec<f64>) {
        let bent = self.distance + self.bend * point[1] * point[1];
        let by_bend = 2.0 * self.bend * point[1];
        let all = [
            (bent - point[0], vec![-1.0, by_bend, 0.0, 0.0]),
            (bent + point[0], vec![1.0, by_bend, 0.0, 0.0]),
            (self.distance - point[2], vec![0.0, 0.0, -1.0, 0.0]),
        ];
        let nearest = all.into_iter().take(self.count).min_by(|one, other| one.0.total_cmp(&other.0));
        nearest.expect("a way at least")
    }

    fn probability(&self) -> f64 {
        let normal = Normal::standard();
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let points = (-800..800).map(|n| 0.01 * f64::from(n));
        let bent: f64 = points.map(|x| 0.01 * density(x) * normal.cdf(-self.distance - self.bend * x * x)).sum();
        let third = if self.count == 3 { normal.cdf(-self.distance) } else { 0.0 };
        1.0 - (1.0 - self.count.min(2) as f64 * bent) * (1.0 - third)
    }
}

impl LimitState for Ways {
    type Error = Infallible;

    fn variables(&self) -> usize {
        4
    }

    fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Infallible> {
        Ok(points.iter().map(|point| self.least(point).0).collect())
    }

    fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, Infallible> {
        Ok(points.iter().map(|point| self.least(point)).collect())
    }
}

/// Seeds that stopped, and of these the ones whose interval contains the probability, with some of the design points.
fn stopped_and_covered(ways: Ways, used: usize, seeds: u64) -> (usize, usize) {
    let Ok(found) = find_design_points(&mut ways.clone());
    assert_eq!(found.points.len(), ways.count, "{ways:?}: {found:?}");
    let centres: Vec<Vec<f64>> = found.points.into_iter().take(used).map(|point| point.scores).collect();
    let truth = ways.probability();
    let results = (0..seeds).map(|seed| {
        let sampling = ImportanceSampling::new(centres.clone(), seed);
        let Ok(found) = sample_until(&mut ways.clone(), &sampling, HalfWidth::Relative(0.1), 3_000_000);
        let last = found.looks[found.looks.len() - 1];
        (found.is_reached, last.low <= Some(truth) && last.high >= Some(truth))
    });
    results
        .filter(|(is_reached, _)| *is_reached)
        .fold((0, 0), |(stopped, covered), (_, is_covered)| (stopped + 1, covered + usize::from(is_covered)))
}

/// With `BONDLINE_ALL` for β up to 4.
#[test]
fn intervals_that_stop_at_a_tenth_of_a_rare_probability_contain_it_in_93_of_100_seeds_for_one_to_three_design_points() {
    let (distances, seeds) = match std::env::var_os("BONDLINE_ALL") {
        Some(_) => (&[2.5, 3.0, 3.5, 4.0][..], 200),
        None => (&[2.5][..], 200),
    };
    for &distance in distances {
        for (count, bend) in [(1, 0.0), (1, 0.15), (2, 0.0), (2, 0.15), (3, 0.0), (3, 0.15)] {
            let ways = Ways { count, distance, bend };
            let (stopped, covered) = stopped_and_covered(ways, count, seeds);
            assert!(stopped == seeds as usize && covered >= 93 * stopped / 100, "{ways:?}: {covered} of {stopped}");
        }
    }
}

#[test]
fn combinations_that_no_search_found_do_not_stop_a_sampling_early() {
    let ways = Ways { count: 2, distance: 2.5, bend: 0.0 };
    let (stopped, covered) = stopped_and_covered(ways, 1, 200);
    assert!(stopped == 200 && covered >= 186, "{covered} of {stopped}");
}
