//! Shared by the tests: tolerances with their reasons, the shipped cases, the device, and scratch folders.

use bondline::case::{Bounds, Case, CaseBuilder, Factor, Property, Schedule};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::gpu::device::{self, Adapter, Device};
use bondline::traces::Traces;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Single against double precision, K: a twentieth of the resolution of a thermocouple.
pub(crate) const SINGLE_K: f64 = 1e-3;
/// The same with decomposition, K: at an activation energy of 30 RT, one rounding of a temperature is 30 roundings of a
/// rate, and the effect of a reaction is permanent.
pub(crate) const SINGLE_REACTING_K: f64 = 1e-2;
/// Double precision on a device against the CPU, K: drivers may fuse and reorder operations; the rounding error of a
/// few thousand steps at 1,000 K is a thousandth of this.
pub(crate) const DOUBLE_K: f64 = 1e-6;
/// Residual of the energy balance, relative to the heat transferred: below the last digit of every report.
pub(crate) const BALANCE: f64 = 2e-4;
/// The same for members that decompose with factors anywhere within their bounds: the conversion within a step is
/// second order, and steps of 0.5 s are long at three times the nominal heat of reaction.
pub(crate) const BALANCE_LARGE_BOUNDS: f64 = 1e-2;
/// Residual of the mass balance in double precision, relative to the mass transferred: rounding of a few thousand
/// steps, with a margin.
pub(crate) const MASS: f64 = 1e-8;
/// The same in single precision: rounding of a hundred steps.
pub(crate) const MASS_SINGLE: f64 = 1e-5;
/// Effect of reactions that are skipped while their conversion is below 1e-9 of the reactant, K: ten times the
/// temperature change of that heat of reaction at 1e6 J/kg and 1e3 J/kg/K.
pub(crate) const SKIPPED_REACTION_K: f64 = 1e-5;
/// Equality or order of temperatures but for rounding in double precision, K: 10,000 times the spacing of doubles at
/// 1,000 K.
pub(crate) const ROUNDING_K: f64 = 1e-9;

/// Exact derivatives against differences with a step of 1e-5, relative to the largest derivative by the same factor.
/// If a cell passes a table node or the onset of a reaction between the two points, the difference is off by up to a
/// sixth of this.
pub(crate) const DERIVATIVE_AT_TABLE_NODE: f64 = 1e-3;
/// Derivative below which a factor counts as without effect, K per unit of the factor.
pub(crate) const MIN_DERIVATIVE_K: f64 = 1e-2;
/// Error of an estimate from data without noise: the size of the last step of a fit.
pub(crate) const NOISE_FREE_ESTIMATE: f64 = 1e-6;

/// Error of a recovered flux relative to the largest true flux, and of its time integral relative to the true one:
/// required of an inversion from one thermocouple with 1 K noise.
pub(crate) const FLUX_ERROR: f64 = 0.05;
pub(crate) const FLUENCE_ERROR: f64 = 0.02;

/// Ends of a posterior interval against the linear one, in widths of the interval. The 2.5 % quantile of 2,000 draws
/// has a standard error of 0.015 widths; three of these, and as much for nonlinearity.
pub(crate) const POSTERIOR_ENDS: f64 = 0.1;

/// Difference from temperatures computed by PATO, K (rms). Its 100 cells and first-order implicit steps leave 1.08 K at
/// the best fit of a converged march; half of that is the margin for another march.
pub(crate) const PATO_K: f64 = 1.5;

/// A factor at an optimum against SciPy on the same data: both stop at rounding of the objective, worth a millionth.
pub(crate) const SCIPY_OPTIMUM: f64 = 5e-6;
/// A Sobol index against SALib with 250,000 samples, whose error is some millionths.
pub(crate) const SALIB_INDEX: f64 = 1e-4;
/// Quantiles of a posterior against emcee, in widths of the 95 % interval: standard error of some 10,000 effective
/// draws of each.
pub(crate) const EMCEE_QUANTILES: f64 = 0.02;
/// A factor estimated from noise-free data of the same march, in double and in single precision.
pub(crate) const RECOVERED: f64 = 1e-4;
pub(crate) const RECOVERED_SINGLE: f64 = 1e-3;
/// Committed synthetic readings against regenerated ones, K: half of their last decimal, and rounding.
pub(crate) const FILE_K: f64 = 1e-6;
/// Ends of profiles against an interval from a grid of the same objective, in widths of the interval: linear
/// interpolation between 41 values.
pub(crate) const PROFILE_ENDS: f64 = 0.03;

/// Coverage of a 95 % band by independent members. The standard error of 3,000 members for the band and of 2,000 that
/// are counted is 0.6 %; three of these.
pub(crate) const BAND_COVERAGE_95: f64 = 0.02;
/// Coverage of a 50 % band, whose standard error is 1.4 %.
pub(crate) const BAND_COVERAGE_50: f64 = 0.045;
/// Coverage of 80 to 95 % of 500 members against 2,000 others, whose standard error is 2 %.
pub(crate) const STORED_COVERAGE: f64 = 0.06;

/// Sum of the parts of a variance against the whole: each part is corrected for sampling error and not below zero.
pub(crate) const SOBOL_SUM: f64 = 2e-3;

/// Address space of a sweep with two threads, KiB, independent of the number of members: twice the need of program,
/// stacks and report, as a margin for machines whose libraries need more.
pub(crate) const MEMORY_KIB: usize = 256 * 1024;

/// Iterations after which the software rasteriser ends every loop of an invocation without an error (LLVM's `gallivm`,
/// `LP_MAX_TGSI_LOOP_ITERATIONS` = 65,535).
pub(crate) const LAVAPIPE_LOOP_LIMIT: u32 = 65_535;

/// Uniform buffers of a kernel in addition to that of a dispatch. While it compiles, the software rasteriser (Mesa
/// 22.3) has room for the words of four on which conditions depend, the first of them its own; a fifth is written out
/// of bounds.
pub(crate) const UNIFORM_BUFFERS: usize = 3;

/// The root of the repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text of a file of the repository.
pub(crate) fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Files below a folder of the repository whose names end in `ending`: sorted paths from the root.
pub(crate) fn files(folder: &str, ending: &str) -> Vec<String> {
    let mut folders = vec![root().join(folder)];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let paths: Vec<PathBuf> = entries.map(|entry| entry.expect("the folder is readable").path()).collect();
        for path in paths {
            if path.is_dir() {
                folders.push(path);
            } else if path.to_string_lossy().ends_with(ending) {
                let path = path.strip_prefix(root()).expect("found under the root");
                found.push(path.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    found.sort();
    found
}

/// Every shipped case.
pub(crate) fn cases() -> Vec<Case> {
    let found: Vec<Case> = files("cases", "/case.toml").iter().map(|path| load(path)).collect();
    assert!(found.len() >= 7, "only {} cases under cases/", found.len());
    found
}

/// Whether the slow parts run too: `scripts/test.sh --all`.
pub(crate) fn runs_all() -> bool {
    std::env::var_os("BONDLINE_ALL").is_some()
}

/// Shipped cases, one for each kind of kernel: one inert ply, an inert layup, decomposing layups with a conductivity in
/// parts and without, Darcy flow of air, Darcy flow of pyrolysis gas. With `BONDLINE_ALL` every shipped case: for tests
/// that compile a slow kernel a case.
pub(crate) fn cases_of_each_kind() -> Vec<Case> {
    const KINDS: [&str; 6] =
        ["slab", "lcat-2259", "stack-saffil-sic", "lcat-2259-pyrolysis", "permeation", "tacot-held"];
    if runs_all() { cases() } else { KINDS.map(case).into() }
}

/// One shipped case, by the name of its folder.
pub(crate) fn case(id: &str) -> Case {
    load(&format!("cases/{id}/case.toml"))
}

fn load(path: &str) -> Case {
    Case::load(&root().join(path)).unwrap_or_else(|error| panic!("{error}"))
}

/// The main shipped case with few cells and long steps, for properties that hold at any resolution.
pub(crate) fn coarse() -> Case {
    modified(&case("lcat-2259"), |case| {
        case.resolution.cells = 40;
        case.resolution.step_growth = 0.2;
        case.resolution.max_step_s = 2.0;
        case.resolution.output_interval_s = 2.0;
    })
}

/// A case with changes, which must be valid.
pub(crate) fn modified(case: &Case, change: impl FnOnce(&mut CaseBuilder)) -> Case {
    let mut builder = case.to_builder();
    change(&mut builder);
    builder.build().unwrap_or_else(|error| panic!("{}: {error}", case.id()))
}

/// A schedule of times, s, and values in SI units.
pub(crate) fn schedule(times_s: &[f64], values: &[f64]) -> Schedule {
    Schedule::new(times_s.to_vec(), values.to_vec()).unwrap_or_else(|error| panic!("{error}"))
}

/// A case with one more factor, the last one.
pub(crate) fn with_factor(case: &Case, group: &str, property: Property) -> Case {
    let (name, group) = (format!("f_more_{}", case.factors().len()), group.to_owned());
    let (small, large) = ((0.75, 1.25), (0.5, 1.5));
    modified(case, |case| {
        case.factors.push(Factor { name, group, property, state: None, nominal: 1.0, small, large });
    })
}

/// The nominal member, and members sampled uniformly between the large bounds.
pub(crate) fn nominal_and_random(case: &Case, members: usize) -> Ensemble {
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: 2026 };
    let sample = Ensemble::sample(case.factors(), Bounds::Large, &sampling, members);
    let mut rows: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
    (0..members).for_each(|member| rows.extend(sample.member(member)));
    Ensemble::from_values(case.factors().len(), rows)
}

/// The software rasteriser, which gives the same results on every machine. Panics if it is not installed.
pub(crate) fn adapter() -> Adapter {
    let adapters = device::adapters();
    let names: Vec<String> = adapters.iter().map(|adapter| adapter.name.clone()).collect();
    let found = adapters.into_iter().find(Adapter::is_software);
    found.unwrap_or_else(|| {
        panic!("tests need the software Vulkan driver, found {names:?}: scripts/test.sh installs it")
    })
}

/// The software rasteriser with the bounds checks of the runtime.
pub(crate) fn device() -> Device {
    Device::open(adapter(), true).expect("the device opens")
}

/// Uniform random numbers in 0..1 from a seed.
pub(crate) struct Uniform(pub u64);

impl Uniform {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A scratch folder, removed on drop. Tests that run at the same time need different names.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("bondline-test-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Write a file; its folder is created if it does not exist.
    pub(crate) fn write(&self, file: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(file);
        fs::create_dir_all(path.parent().expect("a file is in a folder")).expect("a folder in a temporary one");
        fs::write(&path, text).expect("a file in a temporary folder");
        path
    }

    pub(crate) fn read(&self, file: &str) -> String {
        let path = self.0.join(file);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// All files below the folder: sorted paths relative to it.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let (mut found, mut folders) = (Vec::new(), vec![self.0.clone()]);
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder that can be read") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    found.push(path.strip_prefix(&self.0).expect("below the folder").to_owned());
                }
            }
        }
        found.sort();
        found
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A summary without what differs between two runs of one command: times, date, command line, threads and checksum.
pub(crate) fn without_run(mut summary: Value) -> Value {
    let keys = summary.as_object_mut().expect("an object");
    for key in ["seconds", "checksum"] {
        assert!(keys.remove(key).is_some(), "no {key}");
    }
    let run = keys["provenance"].as_object_mut().expect("an object");
    for key in ["date", "command_line", "threads"] {
        assert!(run.remove(key).is_some(), "no {key}");
    }
    summary
}

/// All numbers of traces: temperatures, those of limits, gauges, peaks, heats, masses and extremes.
pub(crate) fn all_numbers(traces: &Traces) -> Vec<f64> {
    let heats = traces.balances.iter().flat_map(|b| {
        let faces = [b.hot_in_j_m2, b.hot_out_j_m2, b.back_in_j_m2, b.back_out_j_m2];
        let masses = [b.solid_lost_kg_m2, b.gas_in_kg_m2, b.gas_out_kg_m2, b.gas_stored_kg_m2];
        faces.into_iter().chain([b.holder_in_j_m2, b.holder_out_j_m2, b.stored_j_m2]).chain(masses)
    });
    let extremes = traces.extremes_k.iter().flat_map(|&(low, high)| [low, high]);
    let gauges = traces.gauges.iter().copied();
    let readings = traces.temperatures_k.iter().chain(&traces.limited_k).copied();
    let peaks = traces.peaks.iter().chain(&traces.limited_peaks).flat_map(|peak| [peak.temperature_k, peak.time_s]);
    let of_gauges = traces.gauge_peaks.iter().flat_map(|peak| [peak.value, peak.time_s]);
    let peaks = peaks.chain(of_gauges).chain(traces.times_above_s.iter().copied());
    readings.chain(gauges).chain(peaks).chain(heats).chain(extremes).collect()
}

/// Count of numbers that are not bit-identical, and of members whose status differs.
pub(crate) fn count_differences(one: &Traces, other: &Traces) -> usize {
    let (a, b) = (all_numbers(one), all_numbers(other));
    let statuses = one.statuses.iter().zip(&other.statuses).filter(|(a, b)| a != b).count();
    let odd = a.len().abs_diff(b.len()) + one.statuses.len().abs_diff(other.statuses.len());
    odd + statuses + a.iter().zip(&b).filter(|(a, b)| a.to_bits() != b.to_bits()).count()
}

/// Largest temperature difference, K; infinite if the status of a member differs or a number is NaN.
pub(crate) fn max_difference_k(one: &Traces, other: &Traces) -> f64 {
    if one.statuses != other.statuses || one.temperatures_k.len() != other.temperatures_k.len() {
        return f64::INFINITY;
    }
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k).map(|(a, b)| (a - b).abs());
    pairs.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
}
