//! Adapted plans, kept in a folder of the user: the next command on a case need not choose cells and time steps again.

use crate::case::Case;
use crate::kept_work::checksum::{Checksum, sealed, unsealed};
use crate::kept_work::sweep_piece::fingerprint;
use crate::limits::{CELLS, KEPT_PLANS, PLAN_FILE_MIB, STEPS, read_file};
use crate::plan::{Discretisation, ErrorEstimate, Plan};
use crate::user_cache;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A folder of adapted plans, one file each. Its name is a hash of the content of the case and of the solver's sources,
/// which the file has too, with a checksum. A file that is damaged or of another case is ignored; the folder may be
/// deleted at any time, and other files in it are left alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanCache {
    folder: PathBuf,
}

const EXTENSION: &str = "json";

/// The part of a plan that is kept: the rest follows from the case.
#[derive(Serialize, Deserialize)]
struct KeptPlan {
    /// Version, sources and case, as [`key`].
    key: String,
    discretisation: Discretisation,
    error_estimate: Option<ErrorEstimate>,
}

impl PlanCache {
    /// The plans in a folder, which is made with the first plan.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The folder `bondline/plans` in `$XDG_CACHE_HOME` or `~/.cache`, which the command uses; `None` if neither is
    /// known.
    pub fn of_user() -> Option<Self> {
        Some(Self::new(user_cache::folder()?.join("plans")))
    }

    /// The plan of a case, if it is kept; equal to the adapted one, to the last bit.
    pub(super) fn find(&self, case: &Case) -> Option<Plan> {
        let text = String::from_utf8(read_file(&self.file(case), &PLAN_FILE_MIB).ok()?).ok()?;
        let kept: KeptPlan = serde_json::from_str(unsealed(&text).ok()?).ok()?;
        (kept.key == key(case) && fits(&kept.discretisation, case)).then(|| {
            let mut plan = Plan::new(case).rediscretised(case, kept.discretisation);
            plan.error_estimate = kept.error_estimate;
            plan
        })
    }

    /// Keep the plan of a case, and remove the oldest files beyond the limit. A folder that cannot be written keeps
    /// nothing.
    pub(super) fn keep(&self, case: &Case, plan: &Plan) {
        let (discretisation, error_estimate) = (plan.discretisation.clone(), plan.error_estimate.clone());
        let kept = KeptPlan { key: key(case), discretisation, error_estimate };
        if user_cache::replace(&self.file(case), sealed(&kept).as_bytes()).is_ok() {
            remove_oldest(&self.folder, KEPT_PLANS.max as usize);
        }
    }

    fn file(&self, case: &Case) -> PathBuf {
        self.folder.join(Checksum::of(key(case).as_bytes())).with_extension(EXTENSION)
    }
}

/// Key of the cache: everything on which a plan depends.
fn key(case: &Case) -> String {
    [env!("CARGO_PKG_VERSION"), env!("BONDLINE_SOLVER"), &fingerprint(case)].join(" ")
}

/// Whether a discretisation can be that of a case: a forged file must not exhaust the memory.
fn fits(discretisation: &Discretisation, case: &Case) -> bool {
    let Discretisation { grid, time_steps } = discretisation;
    let (plies, segments) = (case.layup.plies.len(), &time_steps.segments);
    let is_density = |density: f64, most: u64| (f64::MIN_POSITIVE..=most as f64).contains(&density);
    let cells = grid.cells_per_ply.iter().zip(&grid.subdivisions);
    grid.cells_per_ply.len() == plies
        && grid.subdivisions.len() == plies
        && cells.clone().all(|(&cells, &parts)| is_density(cells, CELLS.max) && is_density(parts as f64, CELLS.max))
        && cells.map(|(cells, &parts)| cells * parts as f64).sum::<f64>() <= CELLS.max as f64
        && segments.iter().all(|segment| {
            is_density(segment.step_density * segment.subdivisions as f64, STEPS.max) && segment.start_s.is_finite()
        })
        && segments.is_sorted_by(|one, next| one.start_s < next.start_s)
}

/// Remove the plans of a folder beyond a number, and what killed processes left of them, the oldest first. Another
/// process may remove them too, so errors are ignored.
fn remove_oldest(folder: &Path, most: usize) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let file = |entry: fs::DirEntry| {
        let own = is_own(entry.file_name().to_str()?) && entry.file_type().ok()?.is_file();
        own.then_some((entry.metadata().ok()?.modified().ok()?, entry.path()))
    };
    let mut files: Vec<(SystemTime, PathBuf)> = entries.flatten().filter_map(file).collect();
    files.sort();
    for (_, path) in files.iter().take(files.len().saturating_sub(most)) {
        let _ = fs::remove_file(path);
    }
}

/// Whether a file has the name of a plan, or of one that is being written.
fn is_own(name: &str) -> bool {
    let is_hash = |text: &str, digits: usize| {
        text.len() == digits && text.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
    };
    match name.split('.').collect::<Vec<_>>()[..] {
        [hash, EXTENSION] => is_hash(hash, 32),
        [hash, EXTENSION, random, user_cache::TEMPORARY] => is_hash(hash, 32) && is_hash(random, 16),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adapt::adapt;
    use std::ffi::OsString;

    /// An empty folder, removed at the end.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("bondline-plans-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).expect("a folder for temporary files");
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn case(id: &str) -> Case {
        Case::load(format!("{}/cases/{id}", env!("CARGO_MANIFEST_DIR")).as_ref()).expect("a shipped case loads")
    }

    fn only_file(folder: &Path) -> PathBuf {
        fs::read_dir(folder).expect("a folder").next().expect("a file").expect("readable").path()
    }

    #[test]
    fn a_kept_plan_is_the_adapted_one_and_belongs_to_its_case_alone() {
        let scratch = Scratch::new("equal");
        let cache = PlanCache::new(scratch.0.join("plans"));
        for id in ["lamp-test", "permeation"] {
            let case = case(id);
            assert!(cache.find(&case).is_none());
            let plan = adapt(&case).expect("the CPU backend does not fail");
            cache.keep(&case, &plan);
            let kept = cache.find(&case).expect("it is kept");
            assert_eq!(format!("{kept:?}"), format!("{plan:?}"), "{id}");
            assert!(cache.find(&case.clone().with_tolerance_k(0.123)).is_none(), "{id}");
        }
    }

    #[test]
    fn damaged_files_and_those_of_other_plies_are_ignored() {
        let scratch = Scratch::new("damaged");
        let cache = PlanCache::new(scratch.0.join("plans"));
        let case = case("slab");
        let plan = adapt(&case).expect("the CPU backend does not fail");
        cache.keep(&case, &plan);
        let path = only_file(&scratch.0.join("plans"));
        let text = fs::read_to_string(&path).expect("it was written");
        for damaged in [text.replace("cells_per_ply\":[", "cells_per_ply\":[1"), text[..text.len() - 9].to_owned()] {
            assert_ne!(damaged, text);
            fs::write(&path, damaged).expect("it can be written");
            assert!(cache.find(&case).is_none());
        }
        let forged = |change: fn(&mut Discretisation)| {
            let mut discretisation = plan.discretisation.clone();
            change(&mut discretisation);
            let kept = KeptPlan { key: key(&case), discretisation, error_estimate: None };
            fs::write(&path, sealed(&kept)).expect("it can be written");
            cache.find(&case).is_none()
        };
        assert!(!forged(|_| {}), "the file itself is accepted");
        assert!(forged(|found| found.grid.cells_per_ply.push(1.0)));
        assert!(forged(|found| found.grid.cells_per_ply[0] = 1e12));
        assert!(forged(|found| found.grid.subdivisions[0] = usize::MAX));
        assert!(forged(|found| found.time_steps.segments[0].subdivisions = 0));
        assert!(forged(|found| found.time_steps.segments.reverse()));
    }

    #[test]
    fn the_plan_of_another_case_under_the_name_of_this_one_is_ignored() {
        let scratch = Scratch::new("another");
        let cache = PlanCache::new(scratch.0.join("plans"));
        let [one, other] = [case("slab"), case("slab").with_tolerance_k(0.5)];
        let mut plan = adapt(&other).expect("the CPU backend does not fail");
        plan.error_estimate = None;
        cache.keep(&other, &plan);
        fs::rename(cache.file(&other), cache.file(&one)).expect("it can be renamed");
        assert!(cache.find(&one).is_none());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_the_folder_does_not_lead_a_plan_elsewhere() {
        let scratch = Scratch::new("link");
        let cache = PlanCache::new(scratch.0.join("plans"));
        let (case, elsewhere) = (case("slab"), scratch.0.join("elsewhere"));
        let plan = adapt(&case).expect("the CPU backend does not fail");
        cache.keep(&case, &plan);
        let kept = cache.file(&case);
        fs::write(&elsewhere, "precious").expect("a file in a temporary folder");
        // Whatever name of a temporary file can be guessed: with the number of this process, or none.
        let guesses = [std::process::id().to_string(), "tmp".to_owned(), user_cache::TEMPORARY.to_owned()];
        for guess in
            guesses.iter().flat_map(|end| [end.clone(), format!("json.{end}")]).map(|end| kept.with_extension(end))
        {
            std::os::unix::fs::symlink(&elsewhere, guess).expect("a link");
        }
        cache.keep(&case, &plan);
        assert_eq!(fs::read_to_string(&elsewhere).expect("it is left"), "precious");
        fs::remove_file(&kept).expect("it was written");
        std::os::unix::fs::symlink(&elsewhere, &kept).expect("a link");
        cache.keep(&case, &plan);
        assert_eq!(fs::read_to_string(&elsewhere).expect("it is left"), "precious");
        assert!(cache.find(&case).is_some());
    }

    #[test]
    fn the_oldest_plans_are_removed_beyond_the_limit_and_other_files_are_left_alone() {
        let scratch = Scratch::new("limit");
        let others = ["notes.txt", "0123456789abcdef.json", "thesis.json", ".json"];
        others.iter().for_each(|name| fs::write(scratch.0.join(name), "mine").expect("a file"));
        let plan = |number: usize| format!("{number:032x}.json");
        let left_over = format!("{}.{:016x}.partial", plan(4), 9);
        for (age_s, name) in [(30, plan(1)), (10, plan(2)), (20, plan(3)), (40, left_over)] {
            let file = fs::File::create(scratch.0.join(name)).expect("a file");
            let time = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1000 - age_s);
            file.set_modified(time).expect("the time of a file can be set");
        }
        remove_oldest(&scratch.0, 2);
        let mut left: Vec<_> = fs::read_dir(&scratch.0).expect("a folder").flatten().map(|at| at.file_name()).collect();
        left.sort();
        let mut expected: Vec<OsString> = others.map(OsString::from).into_iter().collect();
        expected.extend([2, 3].map(|number| OsString::from(plan(number))));
        expected.sort();
        assert_eq!(left, expected);
    }
}
