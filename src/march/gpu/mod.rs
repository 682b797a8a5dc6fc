//! The march on a Vulkan device: upload, dispatch, download.
//!
//! A plan and the members' factors go up once; identical dispatches carry every member a few steps each;
//! traces come down once. No dispatch is long, which keeps clear of drivers that time out or stop counting
//! loops, and the kernel records how far each member came, so that a march cut short is an error and never
//! a wrong temperature.
//!
//! Derivatives come from the same kernel, differentiated by its factors, one direction an invocation: a member with seven factors is seven
//! invocations, each of which marches the member and how it changes along one. Not taken, all directions in one invocation: private memory is
//! what invocations are short of.
//!
//! Few members on hardware have a workgroup each, whose lanes share a member's cells: see `lanes.rs`. Derivatives have not, as their
//! invocations are more to begin with.

mod batch;
mod cache;
pub mod device;
mod differentiate;
mod gather;
mod lanes;
mod layout;
pub mod self_tests;
#[expect(unreachable_pub, reason = "public in this folder")]
pub(crate) mod shader;
#[expect(unreachable_pub, reason = "public in this folder")]
mod spirv;
mod state;
#[cfg(test)]
mod tests;
mod word;

use super::{Backend, Begun, March, MarchError, Precision, read_out};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::Traces;
use batch::{Batch, Carried, Pipeline};
use device::Device;
use gather::trace_words;
pub use lanes::LANES;
use state::state_words;
use std::ops::Range;
use word::Word;

/// Members at once, at most: enough to fill any device, and a bound on the host's memory. A software device is full with
/// fewer, and its memory is the host's too.
const MEMBERS_MAX: usize = 8192;
const MEMBERS_MAX_SOFTWARE: usize = 2048;

/// Bytes of a batch's largest buffer, at most: four batches may be under way, two runs of members at two resolutions.
const BATCH_BYTES: u64 = 1 << 30;

/// A Vulkan device as a march.
pub struct Gpu {
    device: Device,
    precision: Precision,
    /// Lanes of a member, where they were asked for.
    lanes: Option<u32>,
    pipelines: Vec<Pipeline>,
    /// Texts of cooperative kernels with the bytes that a workgroup shares in each.
    workgroup_bytes: Vec<(String, u32)>,
}

impl Gpu {
    /// A device that passed the self-tests its precision leans on.
    ///
    /// # Errors
    /// When error-free transforms fail, or f64 is asked of a device without.
    pub fn new(device: Device, precision: Precision) -> Result<Self, MarchError> {
        if precision == Precision::F64 && !device.has_f64 {
            return Err(device.error("has no 64-bit floats in shaders; use --precision f32"));
        }
        for (tested, wrong, tried) in device.self_tests()?.transforms {
            if tested == precision && wrong > 0 {
                return Err(MarchError::SelfTest {
                    device: device.name,
                    test: "error-free transforms",
                    found: format!("{wrong} of {tried} sums lost their rounding error"),
                });
            }
        }
        Ok(Self { device, precision, lanes: None, pipelines: vec![], workgroup_bytes: vec![] })
    }

    /// The same with so many invocations for each member, whatever is faster: to prove and to measure them. A plan that a workgroup has no
    /// room for has one all the same.
    #[must_use]
    pub fn with_lanes(mut self, lanes: u32) -> Self {
        let limits = &self.device.limits;
        let most = limits.max_compute_workgroup_size_x.min(limits.max_compute_invocations_per_workgroup);
        self.lanes = Some(lanes.clamp(1, most));
        self
    }

    /// Invocations that carry each of so many members; one where a workgroup has no room for what its lanes share.
    ///
    /// # Errors
    /// When the cooperative kernel does not compile.
    pub fn lanes(&mut self, plan: &Plan, members: usize) -> Result<u32, MarchError> {
        let wanted = lanes::wanted(self.lanes, self.device.is_software, members);
        if wanted == 1 {
            return Ok(1);
        }
        let text = shader::columns(plan, wanted) + &self.text(plan, wanted);
        let known = self.workgroup_bytes.iter().find(|(known, _)| *known == text).map(|(_, bytes)| *bytes);
        let bytes = match known {
            Some(bytes) => bytes,
            None => {
                let bytes = self.device.kernel(text.clone())?.workgroup_bytes();
                self.workgroup_bytes.push((text, bytes));
                bytes
            }
        };
        Ok(if bytes > self.device.limits.max_compute_workgroup_storage_size { 1 } else { wanted })
    }

    /// Whether a kernel reads the tables of a plan from texels.
    fn reads_texels(&self, plan: &Plan) -> bool {
        self.precision == Precision::F32 && self.device.reads_texels(plan.rows.tables.len())
    }

    /// The text of the kernel of a plan, but for the lengths of its columns.
    fn text(&self, plan: &Plan, lanes: u32) -> String {
        shader::of_any_length(plan, self.precision, self.reads_texels(plan), lanes, shader::MARCH)
    }

    fn word_bytes(&self) -> u64 {
        match self.precision {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }

    /// Room in one buffer of a batch.
    fn binding_bytes(&self) -> u64 {
        let limits = &self.device.limits;
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).min(BATCH_BYTES)
    }

    /// Bytes of one member in the largest of its buffers.
    fn member_bytes(&self, plan: &Plan) -> u64 {
        (trace_words(plan).max(state_words(plan)) as u64) * self.word_bytes()
    }

    /// A pipeline that marches a plan, so many lanes a member, or telling derivatives; compiled once for both resolutions.
    fn pipeline(&mut self, plan: &Plan, lanes: u32, tells: bool) -> Result<&mut Pipeline, MarchError> {
        let (texels, text) = (self.reads_texels(plan), self.text(plan, lanes));
        // Half of longer columns would lie idle, in memory that other members could be carried in.
        let room = plan.cells()..=2 * plan.cells();
        let fits = |known: &Pipeline| known.text == text && known.tells == tells && room.contains(&known.cells);
        let known = self.pipelines.iter().position(fits);
        let place = known.unwrap_or(self.pipelines.len());
        if known.is_none() {
            let mut kernel = self.device.kernel(shader::columns(plan, lanes) + &text)?;
            if tells {
                kernel = kernel.differentiated("factors").map_err(|why| self.device.error(why))?;
            }
            let inner = self.device.pipeline(&kernel, "march")?;
            self.device.keep();
            self.pipelines.push(Pipeline { inner, text, cells: plan.cells(), lanes, tells, texels, timed: None });
        }
        Ok(&mut self.pipelines[place])
    }

    fn begin_in<'a, W: Word>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Begun<'a>, MarchError> {
        let device = self.device.clone();
        let carried = members.map(|member| Carried { member, along: None }).collect();
        let lanes = self.lanes(plan, ensemble.len())?;
        let batch = Batch::begin::<W>(&device, self.pipeline(plan, lanes, false)?, plan, ensemble, carried)?;
        Ok(Box::new(move || Ok(read_out(batch.finish::<W>(&device, plan)?.0, plan, 1))))
    }

    fn tangents_in<W: Word>(
        &mut self,
        plan: &Plan,
        points: &Ensemble,
        factors: &[usize],
    ) -> Result<Traces, MarchError> {
        let along: Vec<Option<usize>> =
            if factors.is_empty() { vec![None] } else { factors.iter().copied().map(Some).collect() };
        let carried: Vec<Carried> =
            (0..points.len()).flat_map(|member| along.iter().map(move |&along| Carried { member, along })).collect();
        let mut told = Traces::none(0, plan.places.len(), plan.records);
        let most = self.capacity(plan).max(1);
        for (run, some) in carried.chunks(most).enumerate() {
            let device = self.device.clone();
            let batch = Batch::begin::<W>(&device, self.pipeline(plan, 1, true)?, plan, points, some.to_vec())?;
            let (values, changes) = batch.finish::<W>(&device, plan)?;
            for (place, carried) in some.iter().enumerate() {
                // The member is the same in each invocation of its point, and told once.
                if (run * most + place).is_multiple_of(along.len()) {
                    told.extend(&values, place..place + 1);
                }
                if let (Some(changes), Some(_)) = (&changes, carried.along) {
                    told.extend(changes, place..place + 1);
                }
            }
        }
        Ok(read_out(told, plan, 1 + factors.len()))
    }
}

impl March for Gpu {
    fn backend(&self) -> Backend {
        Backend { name: self.device.name.clone(), kind: "gpu", precision: self.precision }
    }

    fn capacity(&self, plan: &Plan) -> usize {
        let most = if self.device.is_software { MEMBERS_MAX_SOFTWARE } else { MEMBERS_MAX };
        ((self.binding_bytes() / self.member_bytes(plan).max(1)) as usize).min(most)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.begin(plan, ensemble, members)?()
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Begun<'a>, MarchError> {
        if self.capacity(plan) < members.len() {
            return Err(MarchError::TooLarge {
                device: self.device.name.clone(),
                limit: self.binding_bytes(),
                what: "members",
                needed: self.member_bytes(plan) * members.len() as u64,
            });
        }
        match self.precision {
            Precision::F32 => self.begin_in::<f32>(plan, ensemble, members),
            Precision::F64 => self.begin_in::<f64>(plan, ensemble, members),
        }
    }
    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        match self.precision {
            Precision::F32 => self.tangents_in::<f32>(plan, points, factors).map(Some),
            Precision::F64 => self.tangents_in::<f64>(plan, points, factors).map(Some),
        }
    }
}
