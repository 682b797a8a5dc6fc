//! Shared code of the benches: cases, backends and timing.

use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::device::{self, Device};
use bondline::march::gpu::{COOPERATIVE_THREADS, Gpu};
use bondline::march::{Backend, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::Traces;
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

/// A shipped case.
pub(crate) fn case(id: &str) -> Case {
    case_with(id, &[])
}

/// A shipped case with settings changed.
pub(crate) fn case_with(id: &str, sets: &[(String, String)]) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(id);
    Case::load_with(&path, sets).unwrap_or_else(|error| panic!("{error}"))
}

/// A backend under test.
pub(crate) struct BenchBackend {
    name: String,
    /// CPU threads; `None` for a hardware device.
    pub threads: Option<usize>,
    pub precision: Precision,
    pub march: Timed,
}

impl BenchBackend {
    pub(crate) fn new(name: &str, threads: Option<usize>, march: impl March + 'static) -> Self {
        let precision = march.backend().precision;
        Self { name: name.to_owned(), threads, precision, march: Timed { march: Box::new(march), seconds: 0.0 } }
    }

    /// Name in the tables.
    pub(crate) fn title(&self) -> String {
        let digits = if self.precision == Precision::F64 { "f64" } else { "f32" };
        match self.threads {
            None => format!("{} {digits}", self.name),
            Some(1) => format!("{} {digits}, 1 thread", self.name),
            Some(threads) => format!("{} {digits}, {threads} threads", self.name),
        }
    }
}

/// The CPU backend with SIMD lanes on all threads, in f64 and f32.
pub(crate) fn simd_backends() -> [BenchBackend; 2] {
    let threads = rayon::current_num_threads();
    [Precision::F64, Precision::F32].map(|precision| BenchBackend::new("lanes", Some(threads), Cpu::new(precision)))
}

/// The first Vulkan device, in f32 and if supported in f64, with one thread or one workgroup a member, or the backend's
/// choice; empty without a device.
pub(crate) fn gpu_backends(workgroups: Option<bool>) -> Vec<BenchBackend> {
    let Ok(adapter) = device::find(None) else { return vec![] };
    let threads = adapter.is_software().then(rayon::current_num_threads);
    let of = if workgroups == Some(true) { ", a workgroup a member," } else { "" };
    let name = adapter.name.split(' ').next().unwrap_or("device").to_owned() + of;
    let precisions = [Precision::F32, Precision::F64].into_iter().take(if adapter.has_f64 { 2 } else { 1 });
    let open = |precision| Gpu::new(Device::open(adapter.clone(), false)?, precision);
    precisions
        .map(|precision| open(precision).unwrap_or_else(|error| panic!("{error}")))
        .map(|gpu| match workgroups {
            Some(of) => gpu.with_threads_per_member(if of { COOPERATIVE_THREADS } else { 1 }),
            None => gpu,
        })
        .map(|gpu| BenchBackend::new(&name, threads, gpu))
        .collect()
}

/// A backend that measures its time.
pub(crate) struct Timed {
    march: Box<dyn March>,
    /// Time in the backend so far, s.
    pub seconds: f64,
}

impl March for Timed {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        let began = Instant::now();
        let traces = self.march.march(plan, ensemble, members);
        self.seconds += began.elapsed().as_secs_f64();
        traces
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let began = Instant::now();
        let traces = self.march.tangents(plan, points, factors);
        self.seconds += began.elapsed().as_secs_f64();
        traces
    }
}

/// The shortest of some times, s, and the relative excess of the longest. Other load on the machine only adds time, so
/// the shortest is the best estimate.
pub(crate) fn shortest(seconds: &[f64]) -> (f64, f64) {
    let least = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    let most = seconds.iter().copied().fold(0.0, f64::max);
    (least, most / least - 1.0)
}
