//! Trade studies: sizes against those of `size`, ranks against other seeds and changed properties, and what has no
//! thickness.

use crate::support::{Scratch, case};
use bondline::case::{Case, Material, Property, Table};
use bondline::ensemble::SamplingKind;
use bondline::question::{self, Draw, Limit, NamedCase, PlyChoice, Requirement, Size};
use bondline::report::files::OutputFolder;
use bondline::session::{BackendKind, Options, Session};
use bondline::study::trade::{SizedLayup, Trade};
use std::sync::Arc;

fn session(case: Case) -> Session {
    Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("the CPU does not fail")
}

/// LCAT 2259 with a coarse tolerance, which saves time: the comparisons hold at any.
fn lcat(id: &str) -> Case {
    let mut builder = case(id).to_builder();
    builder.resolution.tolerance_k = Some(1.0);
    builder.build().expect("a valid case")
}

fn requirement(limit_k: f64) -> Requirement {
    Requirement { limit: Some(Limit::new("TC4", limit_k)), probability: 0.9, ..Requirement::default() }
}

fn size(limit_k: f64, seed: u64) -> Size {
    let (ply, draw) = ("INS".to_owned(), Draw { seed, ..Draw::default() });
    Size { ply, requirement: requirement(limit_k), members: 60, draw }
}

fn choice(ply: &str, materials: &[&str]) -> PlyChoice {
    PlyChoice { ply: ply.to_owned(), materials: materials.iter().map(|&id| id.to_owned()).collect() }
}

/// Four insulators and two barriers that differ in nothing that matters here.
fn options(limit_k: f64, seed: u64) -> question::Trade {
    let choices =
        vec![choice("INS", &["pyrogel3350", "pi-aerogel", "saffil-96", "apa"]), choice("GB", &["akk", "kkl"])];
    let (size, draw) = ("INS".to_owned(), Draw { seed, ..Draw::default() });
    question::Trade { choices, size, requirement: requirement(limit_k), members: 60, draw, exposures: Vec::new() }
}

/// The case with a material of some group.
fn with_material(case: &Case, group: &str, material: &Material) -> Case {
    let mut builder = case.to_builder();
    for ply in builder.layup.plies.iter_mut().filter(|ply| ply.group == group) {
        ply.material = Arc::new(Material { decomposition: None, ..material.clone() });
    }
    builder.build().expect("a valid case")
}

fn layup<'a>(found: &'a Trade, materials: &[&str]) -> &'a SizedLayup {
    found.layups.iter().find(|layup| found.materials_of(layup) == materials).expect("a layup of the choices")
}

fn trade(case: Case, options: &question::Trade) -> Trade {
    session(case).trade(options).expect("a trade study")
}

#[test]
fn each_layup_has_the_thickness_that_size_finds_to_the_bit() {
    let found = trade(lcat("lcat-2259"), &options(650.0, 1));
    assert_eq!(found.layups.len(), 8);
    for id in ["pi_aerogel", "saffil_96"] {
        let case = with_material(&lcat("lcat-2259"), "INS", &Material::named(id).expect("a known one"));
        let sized = session(case).size(&size(650.0, 1)).expect("a sizing");
        let own = layup(&found, &[id, "akk"]);
        assert_eq!((own.required, own.nominal[0], own.interval), (sized.required, sized.nominal, sized.interval));
        let mut thicknesses_m = own.member_thicknesses_m.clone();
        thicknesses_m.sort_by(f64::total_cmp);
        assert_eq!(thicknesses_m, sized.member_thicknesses_m);
        assert_eq!(own.shares, sized.shares);
        let other = layup(&found, &["pyrogel3350", "akk"]);
        assert_ne!(other.required, sized.required, "another material has another thickness");
    }
}

#[test]
fn ranks_are_by_mass_equal_layups_share_one_and_another_seed_confirms_them() {
    let found = trade(lcat("lcat-2259"), &options(650.0, 1));
    let masses: Vec<f64> = found.ranked().iter().map(SizedLayup::required_mass_kg_m2).collect();
    assert!(masses.windows(2).all(|pair| pair[0] <= pair[1]), "{masses:?}");
    let ranks: Vec<usize> = found.ranked().iter().filter_map(|layup| Some(layup.rank?.rank)).collect();
    assert_eq!(
        ranks,
        [1, 1, 3, 3, 5, 5, 7, 7],
        "akk and kkl differ in their emissivity alone, and the back is insulated"
    );
    let shares: f64 = found.ranked().iter().filter_map(|layup| Some(layup.rank?.resampled?.first_share)).sum();
    assert!((shares - 2.0).abs() < 1e-9, "two layups are first in every resample: {shares}");
    let again = trade(lcat("lcat-2259"), &options(650.0, 7));
    for other in again.ranked() {
        let own = layup(&found, &again.materials_of(other));
        let (rank, other) = (own.rank.expect("a rank"), other.rank.expect("a rank"));
        let (low, high) = rank.resampled.expect("independent members").interval;
        assert!((low..=high).contains(&other.rank), "{rank:?} and {other:?}");
    }
    let thickness_m = |found: &Trade| found.layups[0].member_thicknesses_m.clone();
    assert_ne!(thickness_m(&found), thickness_m(&again), "another seed has other members");
}

/// Binomial counts, order statistics and resamples are those of independent members.
#[test]
fn masses_and_ranks_of_members_that_are_not_independent_have_no_interval() {
    let choices = vec![choice("INS", &["pyrogel3350", "saffil-96"])];
    let of = |sampling: SamplingKind| {
        let mut question = question::Trade { choices: choices.clone(), ..options(650.0, 1) };
        question.draw.sampling = sampling;
        let mut session = session(lcat("lcat-2259"));
        let found = session.trade(&question);
        (found.expect("a trade study"), session.summary().expect("a summary"))
    };
    let (normal, _) = of(SamplingKind::Normal);
    assert!(normal.layups.iter().all(|layup| layup.interval.0.is_some()), "the lower end needs 60 members");
    assert!(normal.ranked().iter().all(|layup| layup.rank.is_some_and(|rank| rank.resampled.is_some())));
    for sampling in [SamplingKind::LatinHypercube, SamplingKind::Sobol] {
        let (found, summary) = of(sampling);
        assert_eq!(found.ranked().len(), 2);
        for layup in &found.layups {
            assert_eq!(layup.interval, (None, None));
            assert!(layup.rank.is_some_and(|rank| rank.resampled.is_none()), "{:?}", layup.rank);
        }
        let summary = summary.split_whitespace().collect::<Vec<_>>().join(" ");
        let reason = format!("members of {} sampling are not independent", sampling.name());
        assert!(summary.contains(&reason) && !summary.contains("of the resamples"), "{summary}");
    }
}

#[test]
fn a_layup_under_two_exposures_has_the_larger_thickness_of_each_member() {
    let mut hotter = case("lcat-2330").to_builder();
    hotter.resolution.tolerance_k = Some(1.0);
    let hotter = hotter.build().expect("a valid case");
    let options = |exposures: Vec<Case>| question::Trade {
        choices: vec![choice("INS", &["pyrogel3350", "saffil-96"])],
        exposures: exposures.into_iter().map(NamedCase::from).collect(),
        ..options(650.0, 1)
    };
    let both = trade(lcat("lcat-2259"), &options(vec![hotter.clone()]));
    assert_eq!(both.exposures, ["lcat-2259", "lcat-2330"]);
    // The layup of the first case under the exposure of the second.
    let mut swapped = lcat("lcat-2259").to_builder();
    (swapped.exposure, swapped.resolution) = (hotter.exposure().clone(), hotter.resolution());
    swapped.observations.clear();
    swapped.id = "swapped".to_owned();
    let alone = [lcat("lcat-2259"), swapped.build().expect("a case")].map(|case| trade(case, &options(Vec::new())));
    for id in ["pyrogel3350", "saffil_96"] {
        let needed_m = |found: &Trade| layup(found, &[id]).member_thicknesses_m.clone();
        let (found, one, two) = (needed_m(&both), needed_m(&alone[0]), needed_m(&alone[1]));
        assert_ne!(one, two);
        for ((found_m, one_m), two_m) in found.iter().zip(&one).zip(&two) {
            // The tolerance of the peak, 0.02 K, is a micrometre here.
            assert!((found_m - one_m.max(*two_m)).abs() < 2e-6, "{found_m} of {one_m} and {two_m}");
        }
    }
}

#[test]
fn a_layup_that_no_thickness_suffices_for_has_no_rank() {
    let mut options = options(650.0, 1);
    options.choices = vec![choice("INS", &["pyrogel3350", "saffil-96"])];
    let free = trade(lcat("lcat-2259"), &options);
    assert!(free.unranked().is_empty());
    // Between the thicknesses that the two require.
    let needed_m = |id: &str| layup(&free, &[id]).required.found_m().expect("between the bounds");
    let (thin_m, thick_m) = (needed_m("pyrogel3350"), needed_m("saffil_96"));
    assert!(thin_m < 0.9 * thick_m, "{thin_m} and {thick_m}");
    options.requirement.thickness_range_m = Some((1.5e-3, 0.5 * (thin_m + thick_m)));
    let found = trade(lcat("lcat-2259"), &options);
    assert_eq!(found.ranked().len(), 1);
    let (ranked, unranked) = (&found.ranked()[0], &found.unranked()[0]);
    assert_eq!((found.materials_of(ranked), found.materials_of(unranked)), (vec!["pyrogel3350"], vec!["saffil_96"]));
    assert!(unranked.rank.is_none() && unranked.below_limit(unranked.thickness_range_m.1).fraction() < 0.9);
    assert_eq!(ranked.rank.and_then(|rank| Some((rank.rank, rank.resampled?.first_share))), Some((1, 1.0)));
}

#[test]
fn a_property_that_changes_as_far_as_stated_makes_the_other_layup_as_light() {
    let options = question::Trade { choices: vec![choice("OF", &["nextel440-bf20", "sic-5hs"])], ..options(650.0, 1) };
    let cloth = Material::named("sic-5hs").expect("a known one");
    let found = trade(with_material(&lcat("lcat-2259"), "OF", &cloth), &options);
    let gap_kg_m2 = |found: &Trade| {
        let [other, own] = ["nextel440_bf20", "sic_5hs"].map(|id| layup(found, &[id]).required_mass_kg_m2());
        other - own
    };
    let before = gap_kg_m2(&found);
    assert!(before > 0.05, "{before}");
    let changes = found.rank_changes.as_ref().expect("the CPU has derivatives");
    let mut checked = 0;
    for change in changes.iter().filter(|change| change.material == "sic_5hs") {
        let mut material = cloth.clone();
        match change.property {
            Property::Density => material.density_kg_m3 *= 1.0 + change.change,
            Property::HeatCapacity => {
                let table = &material.heat_capacity;
                let values = table.values().iter().map(|value| value * (1.0 + change.change)).collect();
                let moved = Table::new(table.temperatures_k().to_vec(), values, table.outside());
                material.heat_capacity = moved.expect("a valid table");
            }
            _ => continue,
        }
        checked += 1;
        let moved = trade(with_material(&lcat("lcat-2259"), "OF", &material), &options);
        let after = gap_kg_m2(&moved);
        // What is left is the curvature.
        assert!(after.abs() < 0.2 * before, "{change:?}: a gap of {before} and then {after}");
    }
    assert!(checked > 0, "{changes:?}");
}

#[test]
fn a_study_without_a_rank_has_a_report() {
    let mut options = options(320.0, 1);
    options.choices = vec![choice("INS", &["pyrogel3350", "saffil-96"])];
    options.requirement.thickness_range_m = Some((1.5e-3, 6e-3));
    let mut session = session(lcat("lcat-2259"));
    assert!(session.trade(&options).expect("a trade study").ranked().is_empty());
    let summary = session.summary().expect("a summary");
    assert!(summary.contains("No layup holds TC4 below 320 K"), "{summary}");
    let scratch = Scratch::new("trade-without-rank");
    let folder = OutputFolder::open(&scratch.path().join("out"), "lcat-2259", false).expect("a folder");
    session.report(&folder).expect("a report");
    assert!(scratch.read("out/report.html").contains("Layups that no allowed thickness suffices for"));
}
