//! Full marches of every shipped case: GPU and CPU are bit-identical in single precision; single precision is accurate
//! enough; and the GPU in double precision agrees with the CPU, on a case of each kind or, with `BONDLINE_ALL`, on all.

use crate::support::{
    DOUBLE_K, SINGLE_K, SINGLE_REACTING_K, Scratch, adapter, case, cases, cases_of_each_kind, count_differences,
    max_difference_k, modified, nominal_and_random, runs_all, with_factor,
};
use bondline::adapt::adapt;
use bondline::case::{Bounds, Case, Property};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::cpu::{Cpu, ScalarReference};
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::{Backend, March, MarchError, PendingBatch, Precision, march_all};
use bondline::physics::table::table_index;
use bondline::plan::Plan;
use bondline::traces::{MemberStatus, Traces};
use std::fs;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread;

/// Members drawn besides the nominal one; MANY for two cases: two workgroups, the second not full.
const FEW: usize = 9;
const MANY: usize = 99;

/// A device opened once, so that its compiled kernels serve every test.
struct Shared(LazyLock<Mutex<Gpu>>);

impl Shared {
    fn gpu(&self) -> MutexGuard<'_, Gpu> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn open(precision: Precision, checks: bool) -> Mutex<Gpu> {
    let device = Device::open(adapter(), checks).expect("the device opens");
    Mutex::new(Gpu::new(device, precision).expect("the device passes its self-tests"))
}

static SINGLE: Shared = Shared(LazyLock::new(|| open(Precision::F32, false)));
static CHECKED: Shared = Shared(LazyLock::new(|| open(Precision::F32, true)));
static DOUBLE: Shared = Shared(LazyLock::new(|| open(Precision::F64, false)));

/// A case marched on the device.
struct Marched {
    case: Case,
    plan: Plan,
    ensemble: Ensemble,
    single: Traces,
    /// In double precision, for cases of each kind.
    double: Option<Traces>,
}

/// Every shipped case, marched once for all tests; one thread for each device, as compiling takes longest.
static MARCHED: LazyLock<Vec<Marched>> = LazyLock::new(|| {
    let inputs: Vec<(Case, Plan, Ensemble)> = cases()
        .into_iter()
        .map(|case| {
            let members = if ["slab", "lcat-2259"].contains(&case.id()) { MANY } else { FEW };
            (case.clone(), adapt(&case).expect("the processor marches"), nominal_and_random(&case, members))
        })
        .collect();
    let kinds: Vec<String> = cases_of_each_kind().iter().map(|case| case.id().to_owned()).collect();
    let (single, double) = thread::scope(|scope| {
        let double = scope.spawn(|| {
            let of = |(case, plan, ensemble): &(Case, Plan, Ensemble)| {
                let is_chosen = kinds.iter().any(|kind| kind == case.id());
                is_chosen.then(|| traces_of(&mut *DOUBLE.gpu(), plan, ensemble))
            };
            inputs.iter().map(of).collect::<Vec<_>>()
        });
        let single = inputs.iter().map(|(_, plan, ensemble)| traces_of(&mut *SINGLE.gpu(), plan, ensemble));
        (single.collect::<Vec<_>>(), double.join().expect("the device marches every case"))
    });
    let with = |((case, plan, ensemble), (single, double))| Marched { case, plan, ensemble, single, double };
    inputs.into_iter().zip(single.into_iter().zip(double)).map(with).collect()
});

fn marched_in_double() -> impl Iterator<Item = (&'static Marched, &'static Traces)> {
    MARCHED.iter().filter_map(|marched| marched.double.as_ref().map(|double| (marched, double)))
}

fn traces_of(march: &mut dyn March, plan: &Plan, ensemble: &Ensemble) -> Traces {
    march.march(plan, ensemble, 0..ensemble.len()).expect("the march does not fail")
}

fn on_cpu(precision: Precision, plan: &Plan, ensemble: &Ensemble) -> Traces {
    traces_of(&mut Cpu::new(precision), plan, ensemble)
}

/// A plan with every conductivity changed by a relative amount.
pub(crate) fn with_scaled_conductivities(plan: &Plan, share: f64) -> Plan {
    let mut plan = plan.clone();
    let columns = 2 * plan.rows.properties();
    // Plies of one material share their tables, which follow each other.
    let tables = plan.rows.plies.iter().zip(&plan.rows.tables);
    let mut plies: Vec<_> = tables
        .map(|(ply, table)| (table.offset as usize, table.columns as usize, ply.rows, ply.levels * table.rows))
        .collect();
    plies.dedup();
    for (table, width, rows, length) in plies {
        let end = table + length as usize * width;
        for row in Arc::make_mut(&mut plan.rows.data.tables)[table..end].chunks_exact_mut(width) {
            for state in row[..columns * rows as usize].chunks_exact_mut(columns) {
                // Solid, radiative and gas conductivity, each with its rise.
                for place in [0, 1, 8, 9, 12, 13].into_iter().filter(|&place| place < columns) {
                    state[place] *= 1.0 + share;
                }
            }
        }
    }
    plan
}

/// A plan with one table value changed by one ulp of f32 (one at each pressure level): the conductivity of the first
/// ply at the start of the row of a temperature.
fn with_one_ulp_changed(plan: &Plan, temperature_k: f64) -> Plan {
    let mut plan = plan.clone();
    let table = plan.rows.tables[0];
    let row = table_index(temperature_k, &plan.rows.data.tables, &table).row as u32;
    for level in 0..plan.rows.plies[0].levels {
        let place = (table.offset + (level * table.rows + row) * table.columns) as usize;
        let word = &mut Arc::make_mut(&mut plan.rows.data.tables)[place];
        *word = f64::from((*word as f32).next_up());
    }
    plan
}

#[test]
fn gpu_and_processor_are_bit_identical_in_single_precision() {
    for marched in MARCHED.iter() {
        let cpu = on_cpu(Precision::F32, &marched.plan, &marched.ensemble);
        assert!(
            cpu.statuses.iter().all(|status| *status == MemberStatus::Completed),
            "{}: not all members complete",
            marched.case.id()
        );
        let count = count_differences(&marched.single, &cpu);
        assert_eq!(count, 0, "{}: numbers that differ, of {}", marched.case.id(), cpu.temperatures_k.len());
    }
}

/// The coarse plan runs in the kernel of the fine one, whose columns are longer.
#[test]
fn a_coarse_plan_in_the_kernel_of_the_fine_one_is_bit_identical_to_the_processor() {
    for marched in MARCHED.iter() {
        let coarse = marched.plan.coarse.as_deref().expect("a plan has both resolutions");
        let single = traces_of(&mut *SINGLE.gpu(), coarse, &marched.ensemble);
        let count = count_differences(&single, &on_cpu(Precision::F32, coarse, &marched.ensemble));
        assert_eq!(count, 0, "{}: numbers that differ, of {}", marched.case.id(), single.temperatures_k.len());
        assert_ne!(
            count_differences(&single, &marched.single),
            0,
            "{}: the fine plan was marched again",
            marched.case.id()
        );
    }
}

#[test]
fn a_table_value_changed_by_one_ulp_is_detected() {
    for marched in MARCHED.iter() {
        let (coldest_k, hottest_k) = marched.single.extremes_k[0];
        let perturbed = with_one_ulp_changed(&marched.plan, 0.5 * (coldest_k + hottest_k));
        let cpu = on_cpu(Precision::F32, &perturbed, &marched.ensemble);
        assert_ne!(count_differences(&marched.single, &cpu), 0, "{}", marched.case.id());
    }
}

#[test]
fn single_precision_on_the_gpu_is_accurate_at_every_sensor_and_instant() {
    for marched in MARCHED.iter() {
        let off_k = max_difference_k(&marched.single, &on_cpu(Precision::F64, &marched.plan, &marched.ensemble));
        let decomposes = marched.case.layup().plies.iter().any(|ply| ply.material.decomposition.is_some());
        let allowed_k = if decomposes { SINGLE_REACTING_K } else { SINGLE_K };
        assert!(off_k <= allowed_k, "{}: {off_k:.1e} K", marched.case.id());
    }
}

#[test]
fn a_conductivity_changed_by_1e_3_is_detected_in_single_precision() {
    for marched in MARCHED.iter() {
        let off_k = max_difference_k(
            &marched.single,
            &on_cpu(Precision::F64, &with_scaled_conductivities(&marched.plan, 1e-3), &marched.ensemble),
        );
        assert!(off_k > SINGLE_REACTING_K, "{}: {off_k:.1e} K", marched.case.id());
    }
}

#[test]
fn gpu_and_processor_agree_within_a_microkelvin_in_double_precision() {
    for (marched, double) in marched_in_double() {
        let off_k = max_difference_k(double, &on_cpu(Precision::F64, &marched.plan, &marched.ensemble));
        assert!(off_k <= DOUBLE_K, "{}: {off_k:.1e} K", marched.case.id());
    }
}

#[test]
fn a_conductivity_changed_by_1e_6_is_detected_in_double_precision() {
    for (marched, double) in marched_in_double() {
        let off_k = max_difference_k(
            double,
            &on_cpu(Precision::F64, &with_scaled_conductivities(&marched.plan, 1e-6), &marched.ensemble),
        );
        assert!(off_k > DOUBLE_K, "{}: {off_k:.1e} K", marched.case.id());
    }
}

#[test]
fn simd_lanes_are_bit_identical_to_one_member_at_a_time() {
    for marched in MARCHED.iter() {
        for precision in [Precision::F32, Precision::F64] {
            let few = Ensemble::from_values(marched.ensemble.factors(), rows(&marched.ensemble, 0..FEW + 1));
            let alone = traces_of(&mut ScalarReference(precision), &marched.plan, &few);
            let count = count_differences(&on_cpu(precision, &marched.plan, &few), &alone);
            assert_eq!(count, 0, "{} in {precision:?}", marched.case.id());
            let perturbed = on_cpu(precision, &with_scaled_conductivities(&marched.plan, 1e-6), &few);
            assert_ne!(count_differences(&perturbed, &alone), 0, "{} in {precision:?}: perturbed", marched.case.id());
        }
    }
}

/// On few cells: with checks, each cell is cleared by a store of its own, which compiles for minutes. On more than 32,
/// as drivers unroll shorter loops and may then add in another order. Reactions with `BONDLINE_ALL`.
#[test]
fn runtime_checks_change_no_bit_with_and_without_gas() {
    let ids: &[&str] =
        if runs_all() { &["slab", "lcat-2259-pyrolysis", "permeation", "tacot-held"] } else { &["slab", "permeation"] };
    for id in ids {
        let case = modified(&case(id), |case| case.resolution.cells = 40);
        let (plan, ensemble) = (Plan::new(&case), nominal_and_random(&case, FEW));
        let [free, checked] = [&SINGLE, &CHECKED].map(|device| traces_of(&mut *device.gpu(), &plan, &ensemble));
        assert!(
            free.statuses.iter().all(|status| *status == MemberStatus::Completed),
            "{id}: not all members complete"
        );
        assert_eq!(count_differences(&free, &checked), 0, "{id}");
    }
}

fn rows(ensemble: &Ensemble, members: Range<usize>) -> Vec<f64> {
    members.flat_map(|member| ensemble.member(member)).collect()
}

/// A march with a limited capacity.
struct Cut<'a>(&'a mut dyn March, usize);

impl March for Cut<'_> {
    fn backend(&self) -> Backend {
        self.0.backend()
    }
    fn capacity(&self, _plan: &Plan) -> usize {
        self.1
    }
    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.0.march(plan, ensemble, members)
    }
    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        self.0.begin(plan, ensemble, members)
    }
}

/// A device begins each batch while the one before is running.
#[test]
fn the_batch_size_changes_no_bit() {
    let marched = MARCHED.iter().find(|marched| marched.case.id() == "lcat-2259").expect("shipped");
    let sampling = Sampling { kind: SamplingKind::Sobol, seed: 7 };
    let ensemble = Ensemble::sample(marched.case.factors(), Bounds::Small, &sampling, 24);
    let mut single = SINGLE.gpu();
    for march in [&mut *single as &mut dyn March, &mut Cpu::new(Precision::F32), &mut Cpu::new(Precision::F64)] {
        let whole = traces_of(march, &marched.plan, &ensemble);
        for size in [1, 7, 16] {
            let mut seen = 0;
            march_all(&mut Cut(march, size), &marched.plan, &ensemble, &mut |batch| {
                assert_eq!(batch.first, seen);
                for member in 0..batch.members() {
                    assert_eq!(batch.member(member), whole.member(seen + member), "member {} of {size}", seen + member);
                    assert_eq!(batch.statuses[member], whole.statuses[seen + member]);
                    assert_eq!(batch.balances[member], whole.balances[seen + member]);
                }
                seen += batch.members();
            })
            .expect("the march does not fail");
            assert_eq!(seen, ensemble.len());
        }
    }
}

#[test]
fn marches_without_gauges_change_no_other_bit() {
    let marched = MARCHED.iter().find(|marched| marched.case.id() == "lcat-2259-pyrolysis").expect("shipped");
    let without_gauges = marched.plan.clone().without_gauges();
    let mut single = SINGLE.gpu();
    for march in [&mut *single as &mut dyn March, &mut Cpu::new(Precision::F64)] {
        let [mut whole, bare] = [&marched.plan, &without_gauges].map(|plan| traces_of(march, plan, &marched.ensemble));
        assert!(!whole.gauges.is_empty() && bare.gauges.is_empty());
        whole.gauges.clear();
        whole.gauge_peaks.clear();
        assert_eq!(count_differences(&whole, &bare), 0, "{:?}", march.backend());
    }
}

#[test]
fn cached_damaged_and_uncachable_kernels_change_no_bit() {
    let (scratch, case) = (Scratch::new("cached-kernels"), case("slab"));
    let (plan, ensemble) = (Plan::new(&case), nominal_and_random(&case, FEW));
    let expected = traces_of(&mut *SINGLE.gpu(), &plan, &ensemble);
    let marched = |folder: &Path| {
        let device = Device::open_with(adapter(), false, Some(folder)).expect("the device opens");
        let mut gpu = Gpu::new(device, Precision::F32).expect("the device passes its self-tests");
        assert_eq!(count_differences(&traces_of(&mut gpu, &plan, &ensemble), &expected), 0, "{}", folder.display());
    };
    let folder = scratch.path().join("kernels");
    marched(&folder);
    let [file] = &scratch.files()[..] else { panic!("expected one cached file, found {:?}", scratch.files()) };
    let cached = fs::read(scratch.path().join(file)).expect("a file that can be read");
    marched(&folder);
    scratch.write(&file.to_string_lossy(), &cached[..cached.len() - 1]);
    marched(&folder);
    assert_eq!(
        fs::read(scratch.path().join(file)).expect("a file that can be read"),
        cached,
        "the cache was not repaired"
    );
    marched(&scratch.write("no-folder", "a file in place of the folder"));
}

#[test]
fn a_member_with_extreme_heating_diverges_at_the_same_step_everywhere_and_leaves_the_others_unchanged() {
    diverges_everywhere(&with_factor(&case("lcat-2259"), "", Property::Heating), 1e6);
}

/// The factor acts on the lowest ply; back substitution spreads it upwards.
#[test]
fn a_member_with_nan_diverges_at_the_same_step_everywhere_and_leaves_the_others_unchanged() {
    diverges_everywhere(&with_factor(&case("lcat-2259"), "GB", Property::Density), f64::NAN);
}

/// One of twelve members has this value of the last factor.
fn diverges_everywhere(case: &Case, value: f64) {
    let plan = Plan::new(case);
    let width = case.factors().len();
    let regular = rows(&nominal_and_random(case, 11), 0..12);
    let mut with_outlier = regular.clone();
    with_outlier[4 * width + width - 1] = value;
    let (regular, with_outlier) = (Ensemble::from_values(width, regular), Ensemble::from_values(width, with_outlier));
    let (mut single, mut double) = (SINGLE.gpu(), DOUBLE.gpu());
    let marches: [&mut dyn March; 6] = [
        &mut Cpu::new(Precision::F64),
        &mut Cpu::new(Precision::F32),
        &mut ScalarReference(Precision::F64),
        &mut ScalarReference(Precision::F32),
        &mut *single,
        &mut *double,
    ];
    let mut statuses = Vec::new();
    for march in marches {
        let backend = march.backend();
        let (expected, found) = (traces_of(march, &plan, &regular), traces_of(march, &plan, &with_outlier));
        for member in (0..regular.len()).filter(|&member| member != 4) {
            assert_eq!(found.statuses[member], MemberStatus::Completed, "{backend:?}: member {member}");
            assert_eq!(found.member(member), expected.member(member), "{backend:?}: member {member}");
        }
        statuses.push((backend, found.statuses[4].clone()));
    }
    let (_, first) = &statuses[0];
    assert!(matches!(first, MemberStatus::Diverged { time_s } if *time_s < 1.0), "{first:?}");
    assert!(statuses.iter().all(|(_, status)| status == first), "{statuses:?}");
}
