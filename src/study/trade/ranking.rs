//! Ranks of layups by their required mass, and their uncertainty from the number of members: the members are resampled
//! (bootstrap; Davison & Hinkley, *Bootstrap Methods and their Application*, 1997), the same for all layups.

use super::{SizedLayup, Sweep};
use crate::random::RandomStream;
use crate::study::margins::quantile_rank;

/// Number of resamples.
pub const RESAMPLES: usize = 2000;

/// Masses that differ by less than this share are equal: layups whose materials differ in nothing that matters.
const EQUAL_SHARE: f64 = 1e-6;

/// Stream of random numbers of the resamples, apart from those of the members.
const STREAM: u64 = 0x7261_6e6b;

/// The rank of a layup, from one. Layups of equal mass have the same rank.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Rank {
    /// The rank.
    pub rank: usize,
    /// How it scatters over the resamples; `None` for members that are not drawn independently.
    pub resampled: Option<ResampledRank>,
}

/// A rank over the resamples.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ResampledRank {
    /// Lowest and highest rank in the central 95 % of the resamples.
    pub interval: (usize, usize),
    /// Share of the resamples in which no other layup is lighter.
    pub first_share: f64,
}

/// The ranks of layups; `None` for those without a finite mass.
pub(super) fn ranks(layups: &[&SizedLayup], sweep: &Sweep, probability: f64) -> Vec<Option<Rank>> {
    let found = ranks_of(&layups.iter().map(|layup| layup.required_mass_kg_m2()).collect::<Vec<_>>());
    let resampled = match sweep.sampling.kind.has_independent_members() {
        true => {
            resampled_ranks(layups, sweep.members, probability, sweep.sampling.seed).into_iter().map(Some).collect()
        }
        false => vec![None; layups.len()],
    };
    let each = layups.iter().zip(found).zip(resampled);
    let rank = |((layup, rank), resampled): ((&&SizedLayup, usize), Option<ResampledRank>)| {
        layup.required_mass_kg_m2().is_finite().then_some(Rank { rank, resampled })
    };
    each.map(rank).collect()
}

fn resampled_ranks(layups: &[&SizedLayup], members: usize, probability: f64, seed: u64) -> Vec<ResampledRank> {
    let inorder: Vec<Vec<usize>> = layups
        .iter()
        .map(|layup| {
            let needed_m = &layup.member_thicknesses_m;
            let mut inorder: Vec<usize> = (0..members).collect();
            inorder.sort_by(|&a, &b| needed_m[b].total_cmp(&needed_m[a]));
            inorder
        })
        .collect();
    let above = members - quantile_rank(members, probability);
    let mut resampled: Vec<Vec<usize>> = vec![Vec::with_capacity(RESAMPLES); layups.len()];
    let mut random = RandomStream::new(seed, STREAM);
    let mut counts = vec![0_usize; members];
    for _ in 0..RESAMPLES {
        counts.fill(0);
        (0..members).for_each(|_| counts[random.uniform_index(members)] += 1);
        // The quantile is the first member, from the thickest, that more than `above` are not thinner than.
        let mass = |(layup, inorder): (&&SizedLayup, &Vec<usize>)| {
            let mut so_far = 0;
            let member = inorder.iter().find(|&&member| {
                so_far += counts[member];
                so_far > above
            });
            member.map_or(f64::NAN, |&member| layup.mass_kg_m2(layup.member_thicknesses_m[member]))
        };
        let masses: Vec<f64> = layups.iter().zip(&inorder).map(mass).collect();
        resampled.iter_mut().zip(ranks_of(&masses)).for_each(|(ranks, rank)| ranks.push(rank));
    }
    let summary = |mut resampled: Vec<usize>| {
        resampled.sort_unstable();
        let tail = RESAMPLES / 40;
        ResampledRank {
            interval: (resampled[tail], resampled[RESAMPLES - 1 - tail]),
            first_share: resampled.partition_point(|&rank| rank == 1) as f64 / RESAMPLES as f64,
        }
    };
    resampled.into_iter().map(summary).collect()
}

/// The rank of each mass: one more than the number of lighter ones.
fn ranks_of(masses: &[f64]) -> Vec<usize> {
    let mut inorder = masses.to_vec();
    inorder.sort_by(f64::total_cmp);
    masses.iter().map(|mass| 1 + inorder.partition_point(|other| *other < mass * (1.0 - EQUAL_SHARE))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_masses_share_a_rank_and_masses_without_end_come_last() {
        assert_eq!(ranks_of(&[2.0, 1.0, 2.0 + 1e-9, f64::INFINITY, 3.0]), [2, 1, 2, 5, 4]);
    }
}
