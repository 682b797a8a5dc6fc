//! Search for the best set of candidates: exhaustion, or exchanges from random starts.

use super::Objective;
use crate::random::RandomStream;

/// A set of candidates that no exchange improves.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimalSet {
    /// Indices of the candidates, rising.
    pub candidates: Vec<usize>,
    /// The criterion; smaller is better.
    pub loss: f64,
}

/// Products of sets and members up to which all sets are tried.
const EXHAUSTIVE: f64 = 2e6;
/// Random starts.
const STARTS: u64 = 40;
/// Members for the starts: the best few are refined with all members.
const START_MEMBERS: usize = 400;
/// Sets that are kept.
const KEPT: usize = 5;

/// The best sets of `size` of the first `candidates` candidates, the best first, and whether all sets were tried; any
/// two candidates of a set are `compatible`. Empty if there is no such set.
pub fn optimal_sets(
    objective: &Objective<'_>,
    candidates: usize,
    size: usize,
    compatible: &dyn Fn(usize, usize) -> bool,
    seed: u64,
) -> (Vec<OptimalSet>, bool) {
    let search = Search { objective, candidates, compatible };
    if sets(candidates, size) * objective.table.members() as f64 <= EXHAUSTIVE {
        return (search.exhaustive(size), true);
    }
    (search.exchanges(size, seed), false)
}

/// Number of sets of a size.
fn sets(candidates: usize, size: usize) -> f64 {
    (0..size).map(|n| (candidates as f64 - n as f64).max(0.0) / (n as f64 + 1.0)).product()
}

struct Search<'a> {
    objective: &'a Objective<'a>,
    candidates: usize,
    compatible: &'a dyn Fn(usize, usize) -> bool,
}

impl Search<'_> {
    fn fits(&self, candidate: usize, others: impl IntoIterator<Item = usize>) -> bool {
        others.into_iter().all(|other| other != candidate && (self.compatible)(candidate, other))
    }

    fn exhaustive(&self, size: usize) -> Vec<OptimalSet> {
        let mut found = Vec::new();
        let mut set = Vec::with_capacity(size);
        self.extend(&mut set, size, &mut found);
        found
    }

    fn extend(&self, set: &mut Vec<usize>, size: usize, found: &mut Vec<OptimalSet>) {
        if set.len() == size {
            keep(found, OptimalSet { candidates: set.clone(), loss: self.objective.loss(set) });
            return;
        }
        for candidate in set.last().map_or(0, |last| last + 1)..self.candidates {
            if self.fits(candidate, set.iter().copied()) {
                set.push(candidate);
                self.extend(set, size, found);
                set.pop();
            }
        }
    }

    fn exchanges(&self, size: usize, seed: u64) -> Vec<OptimalSet> {
        let all = self.objective.table.members();
        let mut local = Vec::new();
        for start in 0..STARTS {
            let mut numbers = RandomStream::new(seed, start);
            if let Some(set) = self.random_set(size, &mut numbers) {
                keep(&mut local, self.improved(set, all.min(START_MEMBERS)));
            }
        }
        let mut found = Vec::new();
        local.into_iter().for_each(|set| keep(&mut found, self.improved(set.candidates, all)));
        found
    }

    fn random_set(&self, size: usize, numbers: &mut RandomStream) -> Option<Vec<usize>> {
        const ATTEMPTS: usize = 50;
        (0..ATTEMPTS).find_map(|_| {
            let mut set: Vec<usize> = Vec::with_capacity(size);
            while set.len() < size {
                let open: Vec<usize> =
                    (0..self.candidates).filter(|&candidate| self.fits(candidate, set.iter().copied())).collect();
                if open.is_empty() {
                    return None;
                }
                set.push(open[numbers.uniform_index(open.len())]);
            }
            Some(set)
        })
    }

    /// Exchange one candidate after another for the best one, until none improves the set.
    fn improved(&self, mut set: Vec<usize>, members: usize) -> OptimalSet {
        let (objective, table) = (self.objective, self.objective.table);
        let mut loss = objective.loss_of(&table.sums(&set, members), members);
        loop {
            let before = loss;
            for place in 0..set.len() {
                let others: Vec<usize> =
                    set.iter().copied().enumerate().filter(|(i, _)| *i != place).map(|x| x.1).collect();
                let sums = table.sums(&others, members);
                for candidate in (0..self.candidates).filter(|&candidate| self.fits(candidate, others.iter().copied()))
                {
                    let with = objective.loss_with(&sums, candidate, members);
                    if with < loss - 1e-12 * loss.abs() {
                        (loss, set[place]) = (with, candidate);
                    }
                }
            }
            if loss >= before {
                break;
            }
        }
        set.sort_unstable();
        OptimalSet { candidates: set, loss }
    }
}

/// Keep a set if it is among the best.
fn keep(found: &mut Vec<OptimalSet>, set: OptimalSet) {
    if found.iter().any(|other| other.candidates == set.candidates) {
        return;
    }
    let place = found.partition_point(|other| other.loss <= set.loss);
    found.insert(place, set);
    found.truncate(KEPT);
}

#[cfg(test)]
mod tests {
    use super::super::{Criterion, InformationTable, Robustness};
    use super::*;
    use crate::fit::noise_model::ScoreSum;

    /// Random derivatives of 12 to 16 candidates with eight readings each, at six members; of every other table the
    /// noise decorrelates over two readings.
    fn random_table(seed: u64) -> (InformationTable, usize) {
        let mut numbers = RandomStream::new(seed, 7);
        let candidates = 12 + numbers.uniform_index(5);
        let mut table = InformationTable::new(3, 6, candidates);
        for candidate in 0..candidates {
            for member in 0..6 {
                let mut sums = [0.0, if seed % 4 < 2 { 0.0 } else { 2.0 }].map(|time| ScoreSum::new(3, time));
                for _ in 0..8 {
                    let strength = (numbers.normal()).exp();
                    let slopes: Vec<f64> = (0..3).map(|_| strength * numbers.normal()).collect();
                    sums.iter_mut().for_each(|sum| sum.add(1.0, &slopes));
                }
                table.set(candidate, member, &sums[0].triangle, &sums[1].triangle);
            }
        }
        (table, candidates)
    }

    #[test]
    fn exchanges_find_the_exhaustive_optimum_of_50_random_problems_under_every_criterion() {
        for seed in 0..50 {
            let (table, candidates) = random_table(seed);
            let criterion = [Criterion::D, Criterion::A, Criterion::C][seed as usize % 3];
            let robustness = if seed % 2 == 0 { Robustness::Mean } else { Robustness::Worst };
            let prediction: Vec<f64> = (0..18).map(|n| f64::from(n % 5) - 1.5).collect();
            let objective = Objective { table: &table, criterion, robustness, prediction: &prediction };
            // Neighbours are too close.
            let compatible = |one: usize, other: usize| one.abs_diff(other) >= 2;
            let search = Search { objective: &objective, candidates, compatible: &compatible };
            let (best, exchanged) = (search.exhaustive(4), search.exchanges(4, seed));
            assert_eq!(best[0].candidates, exchanged[0].candidates, "problem {seed}");
            assert!((best[0].loss - exchanged[0].loss).abs() < 1e-9 * best[0].loss.abs().max(1.0));
            assert!(best[0].candidates.windows(2).all(|pair| pair[1] - pair[0] >= 2));
        }
    }

    /// Negative control: without restarts some optimum is missed, so that the test above can fail.
    #[test]
    fn a_single_start_misses_some_optimum() {
        let missed = (0..50).filter(|&seed| {
            let (table, candidates) = random_table(seed);
            let objective =
                Objective { table: &table, criterion: Criterion::D, robustness: Robustness::Worst, prediction: &[] };
            let compatible = |one: usize, other: usize| one.abs_diff(other) >= 2;
            let search = Search { objective: &objective, candidates, compatible: &compatible };
            let start = search.random_set(4, &mut RandomStream::new(seed, 0)).expect("there is room");
            search.improved(start, 6).candidates != search.exhaustive(4)[0].candidates
        });
        assert!(missed.count() > 0);
    }

    #[test]
    fn there_is_no_set_where_no_two_candidates_are_compatible() {
        let (table, candidates) = random_table(1);
        let objective =
            Objective { table: &table, criterion: Criterion::D, robustness: Robustness::Mean, prediction: &[] };
        assert_eq!(optimal_sets(&objective, candidates, 2, &|_, _| false, 1), (Vec::new(), true));
        assert_eq!(sets(40, 4), 91_390.0);
    }
}
