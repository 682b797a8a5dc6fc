use super::*;
use std::f64::consts::PI;

/// Smallest coverage over all indices of a function: 95 % less the standard error of a hundred seeds, as the indices of
/// a function are missed together.
const COVERED: f64 = 0.93;
const UNIFORM: Distribution = Distribution { kind: SamplingKind::Uniform, nominal: CENTRED };
const OFF_CENTRE: Distribution = Distribution { kind: SamplingKind::Normal, nominal: [-0.6, 0.5, 0.8, -0.3] };

#[track_caller]
fn assert_covered(distribution: &Distribution, sizes: &[[usize; 2]]) {
    let mut missed = vec![];
    for &size in sizes {
        let found = coverage(&sweeps(size, distribution), size[1], distribution);
        let all = found.into_iter().filter(|(_, covered, _)| *covered < COVERED);
        missed.extend(all.map(|(model, covered, _)| format!("{size:?}: {}: {covered:.3}", model.name())));
    }
    assert!(missed.is_empty(), "{distribution:?}: {missed:#?}");
}

/// One number of members and factors, or with `BONDLINE_ALL` 300 to 5,000 members and one to twelve factors.
fn sizes() -> Vec<[usize; 2]> {
    if std::env::var_os("BONDLINE_ALL").is_none() {
        return vec![[700, 3]];
    }
    [1, 2, 3, 6, 12].into_iter().flat_map(|factors| [300, 700, 1600, 5000].map(|members| [members, factors])).collect()
}

#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_normal_factors() {
    assert_covered(&NORMAL, &sizes());
}

#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_off_centre_normal_factors() {
    assert_covered(&OFF_CENTRE, &sizes());
}

#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_uniform_factors() {
    assert_covered(&UNIFORM, &sizes());
}

/// Of members that scatter less than independent ones.
#[test]
fn intervals_contain_the_indices_of_products_kinks_and_jumps_for_stratified_members() {
    for kind in [SamplingKind::LatinHypercube, SamplingKind::Sobol] {
        assert_covered(&Distribution { kind, nominal: CENTRED }, &[[300, 3]]);
    }
}

#[test]
fn the_intervals_of_one_factor_do_not_contain_the_indices_of_another() {
    let model = &MODELS[7];
    let mut swapped = Exact::of(model, 3, &NORMAL);
    swapped.first.swap(0, 2);
    swapped.total.swap(0, 2);
    let counts = (0..20).map(|seed| {
        let found = indices(&[model], [1600, 3], &NORMAL, &Correlation::default(), seed);
        swapped.count(&found[0])
    });
    let [held, all] = counts.fold([0.0; 2], |[held, all], count| [held + count[0], all + count[1]]);
    // Four of nine indices are those of another factor.
    assert!(held / all < 0.7, "{}", held / all);
}

/// Intervals that hold everything would be covered too.
#[test]
fn intervals_are_as_narrow_as_the_unexplained_variance_permits() {
    let widths: BTreeMap<&str, f64> = coverage(&sweeps([300, 3], &NORMAL), 3, &NORMAL)
        .into_iter()
        .map(|(model, _, width)| (model.name(), width))
        .collect();
    for (name, most) in [("smooth", 0.01), ("product of two", 1e-3), ("peak with a kink", 0.1)] {
        assert!(widths[name] < most, "{name}: {}", widths[name]);
    }
}

/// For correlated factors too, here with the indices of the sum of two of three grades; see the formulas in
/// `polynomial_chaos.rs`.
#[test]
fn intervals_contain_the_indices_of_correlated_factors() {
    const SUM: Model = Model::OfFew("sum", 2, |x| x[0] + x[1]);
    for (r, members) in [(-0.7, 300), (0.3, 1600), (0.8, 300), (0.8, 1600)] {
        let correlation = Correlation::new(3, &[(0, 1, r)]).expect("positive definite");
        let (shared, followed) = ((r / 2.0f64).asin() / (2.0 * PI), (r * r / 2.0).asin() / (2.0 * PI));
        let all = 1.0 / 6.0 + 2.0 * shared;
        let (first, total) = ((1.0 / 12.0 + 2.0 * shared + followed) / all, (1.0 / 12.0 - followed) / all);
        let exact = Exact { first: vec![first; 2], total: vec![total; 2], second: BTreeMap::new() };
        let counts: Vec<[f64; 3]> = (0..SEEDS)
            .into_par_iter()
            .map(|seed| exact.count(&indices(&[&SUM], [members, 3], &UNIFORM, &correlation, seed)[0]))
            .collect();
        let sum = |of: usize| counts.iter().map(|count| count[of]).sum::<f64>();
        assert!(sum(0) / sum(1) >= COVERED, "{r}, {members} members: {}", sum(0) / sum(1));
    }
}

/// Factors of which two are correlated by 0.7: of a nearly linear function partial correlations are near one, where
/// ranks have an error that is not linear in the members. 300 members; 600 sweeps with `BONDLINE_ALL`.
#[test]
fn intervals_contain_the_partial_rank_correlations_of_correlated_factors_up_to_one() {
    let (sweeps, least) = match std::env::var_os("BONDLINE_ALL") {
        // 95 % less three standard errors of 60 sweeps.
        None => (60, 0.865),
        // Least of the exponential, whose correlations the reference knows to its bins of ranks alone.
        Some(_) => (600, 0.89),
    };
    let covered = partial_rank_coverage(300, sweeps);
    assert_eq!(covered.len(), MODELS.len() + 1);
    for (name, shares) in covered {
        assert!(shares.iter().all(|share| *share >= least), "{name}: {shares:?}");
    }
}
