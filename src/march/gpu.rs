//! The Vulkan backend.
//!
//! The plan and the members' factors are uploaded once, dispatches of one kernel advance all members by a few steps
//! each, and the traces are read back once. Each dispatch is short, as drivers stop long ones or stop counting loop
//! iterations. The kernel records the last step of each member, so that an incomplete march is reported as an error.
//!
//! Derivatives come from the same kernel, differentiated in forward mode by its factors, one direction an invocation: a
//! member with seven factors takes seven invocations, each of which computes the member and one directional derivative.
//! All directions in one invocation would need more private memory than devices have.
//!
//! Small ensembles on hardware use one workgroup a member, whose threads share the member's cells: see
//! `cooperative.rs`; so do large ones whose columns exceed the memory of a thread. Derivatives do not, as they have
//! more invocations; where their columns exceed the memory of a thread, the device has none.

mod batch;
mod cache;
mod cooperative;
#[expect(unreachable_pub, reason = "public in this folder")]
mod correct_rounding;
pub mod device;
mod differentiate;
mod gather;
mod layout;
mod scalar;
pub mod self_tests;
#[expect(unreachable_pub, reason = "public in this folder")]
pub(crate) mod shader;
#[expect(unreachable_pub, reason = "public in this folder")]
mod spirv;
#[expect(unreachable_pub, reason = "public in this folder")]
mod spirv_words;
mod state;
#[cfg(test)]
mod tests;
mod unused_code;

use super::{Backend, March, MarchError, PendingBatch, Precision, readings, trace_rows};
use crate::ensemble::Ensemble;
use crate::physics::layout::Cell;
use crate::plan::Plan;
use crate::traces::Traces;
use batch::{Batch, Invocation, Pipeline};
pub use cooperative::COOPERATIVE_THREADS;
use device::Device;
use gather::trace_words;
use scalar::DeviceScalar;
use state::state_words;
use std::ops::Range;

/// Most members in one batch, with bounded host memory. An H200 took 7.5 s for 400,000 members of `lcat-2259` in
/// batches of 33,792, 8.2 s in batches of 135,168 and 12.7 s in batches of 8,192. A software device needs fewer, and
/// shares the memory of the host.
const MAX_BATCH_MEMBERS: usize = 32_768;
const MAX_BATCH_MEMBERS_SOFTWARE: usize = 2048;

/// Most bytes of a batch's largest buffer: four batches may be in progress, two at each of two resolutions.
const MAX_BUFFER_BYTES: u64 = 1 << 30;

/// A Vulkan device as a backend.
pub struct Gpu {
    device: Device,
    precision: Precision,
    /// Most members in one batch; fewer after the memory of the device was exhausted.
    max_batch_members: usize,
    is_memory_exhausted: bool,
    /// Whether quotients and square roots are those of IEEE 754.
    divides_exactly: bool,
    /// Threads per member, if set by [`with_threads_per_member`](Self::with_threads_per_member).
    threads_per_member: Option<u32>,
    pipelines: Vec<Pipeline>,
    memory: Vec<KernelMemory>,
}

/// Memory of a kernel's threads.
struct KernelMemory {
    source: String,
    is_differentiated: bool,
    /// Bytes of a thread, or of a workgroup in a cooperative kernel.
    bytes: u32,
}

impl Gpu {
    /// A device that passes the self-test of a precision. Its kernels correct quotients and square roots if the device
    /// does not round them correctly.
    ///
    /// # Errors
    /// When error-free transformations fail, or the device does not support f64.
    pub fn new(mut device: Device, precision: Precision) -> Result<Self, MarchError> {
        if precision == Precision::F64 && !device.has_f64 {
            return Err(device.error("does not support 64-bit floats in shaders; use the precision \"f32\""));
        }
        let rounding = device.adopt_rounding(precision)?;
        if rounding.sums > 0 {
            return Err(MarchError::SelfTest {
                device: device.name,
                test: "error-free transformations",
                found: format!("{} of {} sums have a wrong rounding error", rounding.sums, self_tests::PAIRS),
            });
        }
        let max_batch_members = if device.is_software { MAX_BATCH_MEMBERS_SOFTWARE } else { MAX_BATCH_MEMBERS };
        let divides_exactly = rounding.divides_exactly();
        Ok(Self { divides_exactly, ..Self::untested(device, precision, max_batch_members) })
    }

    /// A device whose self-tests have passed.
    fn untested(device: Device, precision: Precision, max_batch_members: usize) -> Self {
        Self {
            device,
            precision,
            max_batch_members,
            is_memory_exhausted: false,
            divides_exactly: true,
            threads_per_member: None,
            pipelines: Vec::new(),
            memory: Vec::new(),
        }
    }

    /// Sets the threads per member, for tests and benchmarks. A plan whose columns do not fit their memory still takes
    /// the other kernel.
    #[must_use]
    pub fn with_threads_per_member(mut self, threads: u32) -> Self {
        let limits = &self.device.limits;
        let most = limits.max_compute_workgroup_size_x.min(limits.max_compute_invocations_per_workgroup);
        self.threads_per_member = Some(threads.clamp(1, most));
        self
    }

    /// Threads per member for an ensemble: the other kernel's where the columns of the preferred one exceed the memory
    /// of its threads.
    ///
    /// # Errors
    /// When a kernel does not compile, or the columns of neither fit.
    pub fn threads_per_member(&mut self, plan: &Plan, members: usize) -> Result<u32, MarchError> {
        let requested = self.threads_per_member.unwrap_or(cooperative::threads_per_member(
            self.precision,
            self.device.is_software,
            members,
        ));
        let other = if requested == 1 { COOPERATIVE_THREADS } else { 1 };
        for threads in [requested, other] {
            if self.fits_memory(plan, threads, false)? {
                return Ok(threads);
            }
        }
        Err(self.device.error(format!(
            "the columns of {} cells fit neither the {} bytes of a thread nor the {} bytes of a workgroup",
            plan.cells(),
            self.device.max_private_bytes,
            self.device.limits.max_compute_workgroup_storage_size
        )))
    }

    /// Whether the columns of a kernel fit the memory of its threads.
    fn fits_memory(&mut self, plan: &Plan, threads: u32, is_differentiated: bool) -> Result<bool, MarchError> {
        let limit = if threads == 1 {
            self.device.max_private_bytes
        } else {
            self.device.limits.max_compute_workgroup_storage_size
        };
        if limit == u32::MAX {
            return Ok(true);
        }
        let lengths = shader::column_lengths(plan, self.column_cells(plan, threads), threads);
        let text = lengths + &self.source(plan, threads);
        let is_known = |known: &KernelMemory| known.source == text && known.is_differentiated == is_differentiated;
        let bytes = match self.memory.iter().find(|known| is_known(known)) {
            Some(known) => known.bytes,
            None => {
                let mut kernel = self.device.kernel(text.clone())?;
                if is_differentiated {
                    kernel = kernel.differentiated("factors").map_err(|why| self.device.error(why))?;
                }
                let bytes = if threads == 1 { kernel.private_bytes() } else { kernel.workgroup_bytes() };
                self.memory.push(KernelMemory { source: text, is_differentiated, bytes });
                bytes
            }
        };
        Ok(bytes <= limit)
    }

    /// Whether the kernel of a plan reads tables from a texture.
    fn reads_texels(&self, plan: &Plan) -> bool {
        self.precision == Precision::F32 && self.device.prefers_texels(plan.rows.data.tables.len())
    }

    /// The source of the kernel of a plan without its column lengths.
    fn source(&self, plan: &Plan, threads: u32) -> String {
        shader::source_without_lengths(plan, self.precision, self.reads_texels(plan), threads, shader::MARCH)
    }

    fn word_bytes(&self) -> u64 {
        match self.precision {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }

    /// Most bytes of one buffer of a batch.
    fn binding_bytes(&self) -> u64 {
        let limits = &self.device.limits;
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).min(MAX_BUFFER_BYTES)
    }

    /// Bytes of one member in its largest buffer.
    fn member_bytes(&self, plan: &Plan) -> u64 {
        (trace_words(plan).max(state_words(plan)) as u64) * self.word_bytes()
    }

    /// The pipeline of a plan, compiled once for both resolutions.
    fn pipeline(&mut self, plan: &Plan, threads: u32, tells: bool) -> Result<&mut Pipeline, MarchError> {
        let (texels, text) = (self.reads_texels(plan), self.source(plan, threads));
        let cells = self.column_cells(plan, threads);
        // With more than twice the cells, half of the columns would be unused memory.
        let room = plan.cells()..=2 * cells;
        let fits =
            |known: &Pipeline| known.source == text && known.is_differentiated == tells && room.contains(&known.cells);
        let known = self.pipelines.iter().position(fits);
        let place = known.unwrap_or(self.pipelines.len());
        if known.is_none() {
            let mut kernel = self.device.kernel(shader::column_lengths(plan, cells, threads) + &text)?;
            if tells {
                kernel = kernel.differentiated("factors").map_err(|why| self.device.error(why))?;
            }
            let inner = self.device.pipeline(&kernel, "march")?;
            self.device.save_cache();
            self.pipelines.push(Pipeline {
                compute: inner,
                source: text,
                cells,
                threads_per_member: threads,
                is_differentiated: tells,
                reads_texels: texels,
                measured: None,
            });
        }
        Ok(&mut self.pipelines[place])
    }

    /// Cells of the columns of a new kernel for a plan. With the runtime's checks every element is cleared by a store
    /// of its own, which compiles for long: then no more than the plan has.
    fn column_cells(&self, plan: &Plan, threads: u32) -> usize {
        if self.device.checks {
            return plan.cells();
        }
        let row_bytes = (Cell::<u32>::FIELDS.len() as u64 * self.word_bytes()).next_multiple_of(16);
        let most = self.device.limits.max_uniform_buffer_binding_size / row_bytes;
        shader::column_cells(plan, most as usize, threads)
    }

    fn begin_in<'a, W: DeviceScalar>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        let device = self.device.clone();
        let rows = trace_rows(plan, ensemble, members.clone(), &[]);
        let carried = members.map(|member| Invocation { member, direction: None }).collect();
        let threads = self.threads_per_member(plan, ensemble.len())?;
        let batch = Batch::begin::<W>(&device, self.pipeline(plan, threads, false)?, plan, ensemble, carried)?;
        Ok(Box::new(move || Ok(readings(batch.finish::<W>(&device, plan)?.0, plan, &rows))))
    }

    fn tangents_in<W: DeviceScalar>(
        &mut self,
        plan: &Plan,
        points: &Ensemble,
        factors: &[usize],
    ) -> Result<Option<Traces>, MarchError> {
        if !self.fits_memory(plan, 1, true)? {
            return Ok(None);
        }
        let along: Vec<Option<usize>> =
            if factors.is_empty() { vec![None] } else { factors.iter().copied().map(Some).collect() };
        let carried: Vec<Invocation> = (0..points.len())
            .flat_map(|member| along.iter().map(move |&along| Invocation { member, direction: along }))
            .collect();
        let mut traces = Traces::empty(0, plan.rows.sensor_locations.len(), plan.rows.records);
        let most = self.capacity(plan).max(1);
        for (run, some) in carried.chunks(most).enumerate() {
            let device = self.device.clone();
            let batch = Batch::begin::<W>(&device, self.pipeline(plan, 1, true)?, plan, points, some.to_vec())?;
            let (values, changes) = batch.finish::<W>(&device, plan)?;
            for (place, carried) in some.iter().enumerate() {
                // Every invocation of a point marches the same member; only the first adds it.
                if (run * most + place).is_multiple_of(along.len()) {
                    traces.extend(&values, place..place + 1);
                }
                if let (Some(changes), Some(_)) = (&changes, carried.direction) {
                    traces.extend(changes, place..place + 1);
                }
            }
        }
        Ok(Some(readings(traces, plan, &trace_rows(plan, points, 0..points.len(), factors))))
    }
}

impl March for Gpu {
    fn backend(&self) -> Backend {
        let Device { name, driver, is_software, .. } = &self.device;
        let kind = if *is_software { "software" } else { "gpu" };
        Backend { name: name.clone(), kind, driver: Some(driver.clone()), precision: self.precision }
    }

    fn capacity(&self, plan: &Plan) -> usize {
        ((self.binding_bytes() / self.member_bytes(plan).max(1)) as usize).min(self.max_batch_members)
    }

    fn remarks(&self) -> Vec<String> {
        let memory = || {
            format!(
                "The memory of the device was exhausted: it marched at most {} members at a time from then on.",
                self.max_batch_members
            )
        };
        let rounding = || {
            "The device does not round quotients as IEEE 754: its results agree with the CPU's within rounding, not to \
             the bit."
                .to_owned()
        };
        self.is_memory_exhausted.then(memory).into_iter().chain((!self.divides_exactly).then(rounding)).collect()
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.begin(plan, ensemble, members)?()
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        if self.member_bytes(plan) * members.len() as u64 > self.binding_bytes() {
            return Err(MarchError::TooLarge {
                device: self.device.name.clone(),
                limit: self.binding_bytes(),
                what: "members",
                needed: self.member_bytes(plan) * members.len() as u64,
            });
        }
        let begun = match self.precision {
            Precision::F32 => self.begin_in::<f32>(plan, ensemble, members.clone()),
            Precision::F64 => self.begin_in::<f64>(plan, ensemble, members.clone()),
        };
        match begun {
            // The halves one after the other, so that the memory of the first is free for the second.
            Err(MarchError::OutOfMemory { .. }) if members.len() > 1 => {
                let middle = members.start + members.len() / 2;
                self.max_batch_members = members.len() / 2;
                self.is_memory_exhausted = true;
                let mut traces = self.march(plan, ensemble, members.start..middle)?;
                let rest = self.march(plan, ensemble, middle..members.end)?;
                traces.extend(&rest, 0..rest.members());
                Ok(Box::new(|| Ok(traces)))
            }
            begun => begun,
        }
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        match self.precision {
            Precision::F32 => self.tangents_in::<f32>(plan, points, factors),
            Precision::F64 => self.tangents_in::<f64>(plan, points, factors),
        }
    }
}
