//! What the tests share: every tolerance with its reason, the shipped cases, the device, and folders to work in.

use bondline::case::{Bounds, Case, CaseBuilder, Factor, Property, Schedule};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::gpu::device::{self, Adapter, Device};
use bondline::traces::Traces;
use std::fs;
use std::path::{Path, PathBuf};

/// Single precision against double, K: a twentieth of what a thermocouple resolves.
pub(crate) const SINGLE_K: f64 = 1e-3;
/// The same where plies decompose, K: an activation energy of thirty times RT makes thirty roundings of a temperature
/// one of a rate, and what it takes stays taken.
pub(crate) const SINGLE_REACTING_K: f64 = 1e-2;
/// Double precision on a device against that on the processor, K: drivers may fuse and reorder, and the rounding of a
/// few thousand steps at 1,000 K stays three powers of ten below this.
pub(crate) const DOUBLE_K: f64 = 1e-6;
/// Heat unaccounted for, of the heat moved: a fiftieth of a per cent, below any figure that a report prints.
pub(crate) const BALANCE: f64 = 2e-4;
/// The same of members that decompose with factors drawn from all that is allowed: what reactions take within a step is
/// known to its second order, and at three times their heat a step of half a second is long.
pub(crate) const BALANCE_FAR: f64 = 1e-2;
/// Mass unaccounted for, of the mass moved, in double precision: rounding of a few thousand steps, and a margin.
pub(crate) const MASS: f64 = 1e-8;
/// The same in single precision: rounding of a hundred steps.
pub(crate) const MASS_SINGLE: f64 = 1e-5;
/// What reactions that are left out while they come to a billionth of their reactant leave undone, K: ten times what so
/// much heat of reaction is worth at 1e6 J/kg and 1e3 J/kg/K.
pub(crate) const IDLE_K: f64 = 1e-5;
/// What ought to be equal or in order but for rounding in double precision, K: ten thousand times the spacing of
/// doubles at 1,000 K, a ten-thousandth of what anybody prints.
pub(crate) const ROUNDING_K: f64 = 1e-9;

/// Derivatives at the nominal factors beside differences of step 1e-5, of the largest by the same factor: where a cell
/// passes the node of a table or the onset of a reaction between the two points of a difference, the difference is off
/// by up to a sixth of this.
pub(crate) const CORNER_DERIVATIVE: f64 = 1e-3;
/// Derivative under which a factor counts as without effect, K by a unit of it.
pub(crate) const FELT_K: f64 = 1e-2;
/// An estimate from data without noise beside the truth: what the last step of a fit may be worth.
pub(crate) const FOUND: f64 = 1e-6;

/// A recovered flux beside the true one, over the largest true flux, and its integral over the true one: what is asked
/// of a history from one thermocouple with noise of 1 K.
pub(crate) const HISTORY: f64 = 0.05;
pub(crate) const HISTORY_FLUENCE: f64 = 0.02;

/// Ends of an interval of a posterior beside the linear one, in widths of it: a quantile of 2.5 % of two thousand draws
/// is off by 0.015 of the width, three of which are left, and as much for what is not quite linear.
pub(crate) const POSTERIOR_ENDS: f64 = 0.1;

/// What may be left of temperatures that PATO made, K (rms): its 100 cells and implicit steps of first order leave 1.08
/// K at the best fit of a march that is converged, and half of that is left for another march.
pub(crate) const ANOTHER_CODE_K: f64 = 1.5;

/// A factor at an optimum beside SciPy's on the same data: both stop where a reduction is rounding, which is worth a
/// millionth.
pub(crate) const SCIPY_OPTIMUM: f64 = 5e-6;
/// A Sobol index beside SALib's of a quarter of a million draws, which are off by some millionths.
pub(crate) const SALIB_INDEX: f64 = 1e-4;
/// Quantiles of a posterior beside emcee's, in widths of the 95 % interval: chance of some ten thousand independent
/// draws of each.
pub(crate) const EMCEE_QUANTILES: f64 = 0.02;
/// A factor found from noise-free data made by the same march, in double and in single precision.
pub(crate) const RECOVERED: f64 = 1e-4;
pub(crate) const RECOVERED_SINGLE: f64 = 1e-3;
/// Committed synthetic readings beside those made anew, K: half of their last decimal, and rounding.
pub(crate) const FILE_K: f64 = 1e-6;
/// Ends of profiles and of an interval from a grid of the same objective, in widths of it: a grid of 41 values read off
/// straight.
pub(crate) const PROFILE_ENDS: f64 = 0.03;

/// A share of 95 % of other members: chance of 3,000 members that made a band and of 2,000 that are counted is 0.6 %,
/// and three of it are left.
pub(crate) const BAND_SHARE: f64 = 0.02;
/// A share of a half of them, whose chance is 1.4 %.
pub(crate) const HALF_SHARE: f64 = 0.045;
/// A share of 80 to 95 % of 500 members beside that of 2,000 others, whose chance is 2 %.
pub(crate) const KEPT_SHARE: f64 = 0.06;

/// Parts of a variance that are to sum to a whole: chance is taken off each, and none is let below zero.
pub(crate) const INDEX: f64 = 2e-3;

/// Memory that a sweep of any number of members may reserve with two threads, KiB: twice what one takes whose program,
/// stacks and report are all there is, for machines whose libraries take more.
pub(crate) const MEMORY_KIB: usize = 256 * 1024;

/// Loop turns after which the software rasteriser silently ends every loop of an invocation (LLVM's `gallivm`,
/// `LP_MAX_TGSI_LOOP_ITERATIONS` = 65,535).
pub(crate) const LOOPS_ENDED: u32 = 65_535;

/// Uniform buffers for whose words, where conditions hang on them, the software rasteriser (Mesa 22.3) has room while
/// it compiles: four, of which the first is its own. Those of a fifth it writes beyond it.
pub(crate) const UNIFORM_BUFFERS: usize = 3;

/// The root of the repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text of a file of the repository.
pub(crate) fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// All files under a folder of the repository that end so, in order, as paths from the root.
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

/// One shipped case, by the name of its folder.
pub(crate) fn case(id: &str) -> Case {
    load(&format!("cases/{id}/case.toml"))
}

fn load(path: &str) -> Case {
    Case::load(&root().join(path)).unwrap_or_else(|error| panic!("{error}"))
}

/// The case of every day, on few cells and long steps: for truths that hold at any resolution.
pub(crate) fn coarse() -> Case {
    changed(&case("lcat-2259"), |case| {
        case.resolution.cells = 40;
        case.resolution.growth = 0.2;
        case.resolution.largest_step_s = 2.0;
        case.resolution.every_s = 2.0;
    })
}

/// A case with some of its content changed, which must hold.
pub(crate) fn changed(case: &Case, change: impl FnOnce(&mut CaseBuilder)) -> Case {
    let mut builder = case.to_builder();
    change(&mut builder);
    builder.build().unwrap_or_else(|error| panic!("{}: {error}", case.id()))
}

/// A schedule of times (s) and values in SI.
pub(crate) fn schedule(times_s: &[f64], values: &[f64]) -> Schedule {
    Schedule::new(times_s.to_vec(), values.to_vec()).unwrap_or_else(|error| panic!("{error}"))
}

/// A case with one factor more, last.
pub(crate) fn with_factor(case: &Case, group: &str, property: Property) -> Case {
    let (name, group) = (format!("f_more_{}", case.factors().len()), group.to_owned());
    let (small, large) = ((0.75, 1.25), (0.5, 1.5));
    changed(case, |case| {
        case.factors.push(Factor { name, group, property, state: None, nominal: 1.0, small, large });
    })
}

/// The nominal member, and as many drawn evenly from all that the side constraints allow.
pub(crate) fn drawn(case: &Case, members: usize) -> Ensemble {
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: 2026 };
    let sample = Ensemble::sample(case.factors(), Bounds::Large, &sampling, members);
    let mut rows: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
    (0..members).for_each(|member| rows.extend(sample.member(member)));
    Ensemble::at(case.factors().len(), rows)
}

/// The software rasteriser, which computes alike on every machine. There is always one: its absence fails.
pub(crate) fn adapter() -> Adapter {
    let adapters = device::adapters();
    let names: Vec<String> = adapters.iter().map(|adapter| adapter.name.clone()).collect();
    let found = adapters.into_iter().find(Adapter::is_software);
    found.unwrap_or_else(|| {
        panic!("tests need the software Vulkan driver, found {names:?}: scripts/test.sh installs it")
    })
}

/// The software rasteriser with the runtime's checks on.
pub(crate) fn device() -> Device {
    Device::open(adapter(), true).expect("the device opens")
}

/// Uniform numbers in 0..1 from a seed: the same on every machine.
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

/// A folder of its own, removed with the value; the name keeps tests that run side by side apart.
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

    /// Write a file, its folder made where there is none.
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

    /// Every file below, relative to the folder, in order.
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

/// All numbers of traces: temperatures, gauges, heats, masses and extremes.
pub(crate) fn numbers(traces: &Traces) -> Vec<f64> {
    let heats = traces.balances.iter().flat_map(|b| {
        let faces = [b.hot_in_j_m2, b.hot_out_j_m2, b.back_in_j_m2, b.back_out_j_m2];
        let masses = [b.solid_lost_kg_m2, b.gas_in_kg_m2, b.gas_out_kg_m2, b.gas_stored_kg_m2];
        faces.into_iter().chain([b.holder_in_j_m2, b.holder_out_j_m2, b.stored_j_m2]).chain(masses)
    });
    let extremes = traces.extremes_k.iter().flat_map(|&(low, high)| [low, high]);
    let gauges = traces.gauges.iter().copied();
    traces.temperatures_k.iter().copied().chain(gauges).chain(heats).chain(extremes).collect()
}

/// Numbers that are not the same to the last bit, and arrivals that differ.
pub(crate) fn differing(one: &Traces, other: &Traces) -> usize {
    let (a, b) = (numbers(one), numbers(other));
    let arrivals = one.arrivals.iter().zip(&other.arrivals).filter(|(a, b)| a != b).count();
    let odd = a.len().abs_diff(b.len()) + one.arrivals.len().abs_diff(other.arrivals.len());
    odd + arrivals + a.iter().zip(&b).filter(|(a, b)| a.to_bits() != b.to_bits()).count()
}

/// The largest difference of temperature, K; infinite where members arrived otherwise or a number is none.
pub(crate) fn apart_k(one: &Traces, other: &Traces) -> f64 {
    if one.arrivals != other.arrivals || one.temperatures_k.len() != other.temperatures_k.len() {
        return f64::INFINITY;
    }
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k).map(|(a, b)| (a - b).abs());
    pairs.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
}
