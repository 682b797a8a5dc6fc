//! A random sample of the members, with their factors and outputs.
//!
//! A bottom-k sample: the members whose factors have the smallest hashes (Cohen & Kaplan, *Summarizing data using
//! bottom-k sketches*, PODC 2007). Which members these are depends on the set of members alone, so samples of parts
//! merge to exactly that of the whole.

use super::basis::Basis;
use crate::random::splitmix64;

/// Largest number of members in the sample: a tenth of the memory of the statistics. Of 5,000 members, intervals of
/// Sobol indices held 97.4 % of the indices of five functions with this sample, and 98.6 % with all members.
pub(super) const MEMBERS_MAX: usize = 512;

/// A member of the sample.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SampledMember {
    hash: u64,
    pub(super) factors: Vec<f64>,
    /// Outputs in coarse quanta.
    pub(super) outputs: Vec<i32>,
}

/// The sampled members, by rising hash.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MemberSample {
    members_max: usize,
    members: Vec<SampledMember>,
}

impl MemberSample {
    /// An empty sample, which stays empty if no basis function varies, as no function is then fitted.
    pub(super) fn new(basis: &Basis) -> Self {
        Self { members_max: if basis.len() > 1 { MEMBERS_MAX } else { 0 }, members: Vec::new() }
    }

    pub(super) fn members(&self) -> &[SampledMember] {
        &self.members
    }

    /// Add members with these factors, whose outputs in coarse quanta are computed only for those that are sampled.
    pub(super) fn add(&mut self, factors: &[&[f64]], outputs: impl Fn(usize) -> Vec<i32>) {
        if self.members_max == 0 {
            return;
        }
        let mut hashes: Vec<(u64, usize)> = factors.iter().map(|factors| hash(factors)).zip(0..).collect();
        if let Some(last) = self.members.get(self.members_max - 1) {
            hashes.retain(|&(hash, _)| hash <= last.hash);
        }
        hashes.sort_unstable();
        hashes.truncate(self.members_max);
        let sampled = |(hash, place): (u64, usize)| SampledMember {
            hash,
            factors: factors[place].to_vec(),
            outputs: outputs(place),
        };
        self.members.extend(hashes.into_iter().map(sampled));
        self.sort();
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.members.extend_from_slice(&other.members);
        self.sort();
    }

    /// Sort by hash, and where a member was added twice by outputs, and drop what exceeds the sample.
    fn sort(&mut self) {
        self.members.sort_by(|one, other| (one.hash, &one.outputs).cmp(&(other.hash, &other.outputs)));
        self.members.truncate(self.members_max);
    }

    /// The sampled members as integers: the bits of the factors of each member, and its outputs.
    pub(super) fn integers(&self) -> impl Iterator<Item = i128> {
        self.members.iter().flat_map(|member| {
            let factors = member.factors.iter().map(|value| i128::from(value.to_bits()));
            factors.chain(member.outputs.iter().map(|&output| i128::from(output)))
        })
    }

    /// Restore the sample of `members` members, with this many factors and outputs each, from
    /// [`integers`](Self::integers).
    pub(super) fn restore(
        &mut self,
        numbers: &mut impl Iterator<Item = i128>,
        members: usize,
        [factors, outputs]: [usize; 2],
    ) -> Option<()> {
        for _ in 0..members.min(self.members_max) {
            let mut number = || numbers.next();
            let factor = |bits: i128| u64::try_from(bits).ok().map(f64::from_bits).filter(|value| value.is_finite());
            let factors = (0..factors).map(|_| number().and_then(factor)).collect::<Option<Vec<f64>>>()?;
            let outputs = (0..outputs).map(|_| i32::try_from(number()?).ok()).collect::<Option<Vec<i32>>>()?;
            self.members.push(SampledMember { hash: hash(&factors), factors, outputs });
        }
        let is_sorted = self.members.is_sorted_by_key(|member| member.hash);
        is_sorted.then_some(())
    }
}

fn hash(factors: &[f64]) -> u64 {
    factors.iter().fold(0, |hash, value| splitmix64(hash ^ value.to_bits()))
}
