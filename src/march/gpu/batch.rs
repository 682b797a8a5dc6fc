//! A batch of members on a device: upload, dispatches, readback.

use super::device::{Device, Readback};
use super::gather::{gather_traces, trace_words};
use super::layout::{DispatchParameters, flat, plan_bytes};
use super::scalar::DeviceScalar;
use super::shader;
use super::state::{Block, slots, state_words};
use crate::ensemble::Ensemble;
use crate::march::{MarchError, member_status};
use crate::physics::layout::{Bead, BoundaryForcing, Cell};
use crate::physics::step::CAPACITY_REDUCTIONS;
use crate::plan::Plan;
use crate::traces::Traces;
use bytemuck::Zeroable;
use std::time::Instant;

/// A kernel compiled by the driver.
pub(super) struct Pipeline {
    pub(super) compute: wgpu::ComputePipeline,
    /// Source of the kernel without its column lengths.
    pub(super) source: String,
    /// Length of its columns, cells.
    pub(super) cells: usize,
    /// Threads per member.
    pub(super) threads_per_member: u32,
    /// Whether the kernel is differentiated.
    pub(super) is_differentiated: bool,
    /// Whether it reads tables from a texture.
    pub(super) reads_texels: bool,
    /// Largest timed number of members, and the steps per dispatch for it.
    pub(super) measured: Option<(u32, u32)>,
}

/// A batch whose dispatches are submitted and whose results are read back asynchronously.
pub(super) struct Batch {
    invocations: Vec<Invocation>,
    progress: Readback,
    values: OutputReadbacks,
    tangents: Option<OutputReadbacks>,
}

/// The work of an invocation: a member, and the factor of its directional derivative.
#[derive(Clone, Copy)]
pub(super) struct Invocation {
    pub(super) member: usize,
    pub(super) direction: Option<usize>,
}

/// State and traces of a batch, or their derivatives, on the device.
struct OutputBuffers {
    state: wgpu::Buffer,
    traces: wgpu::Buffer,
}

/// Readbacks of the final state and of the traces.
struct OutputReadbacks {
    state: Readback,
    traces: Readback,
}

impl OutputBuffers {
    /// `bytes` is the size of one word of all members.
    fn new(device: &Device, plan: &Plan, bytes: u64) -> Self {
        Self {
            state: device.storage("state", state_words(plan) as u64 * bytes),
            traces: device.storage("traces", trace_words(plan) as u64 * bytes),
        }
    }

    fn read_back(&self, device: &Device, plan: &Plan, bytes: u64) -> OutputReadbacks {
        let outcome = Block::Heat.slot(plan);
        OutputReadbacks {
            state: device.read_back(&self.state, outcome as u64 * bytes, (state_words(plan) - outcome) as u64 * bytes),
            traces: device.read_back(&self.traces, 0, trace_words(plan) as u64 * bytes),
        }
    }
}

/// First binding of the derivatives of factors, state and traces in a differentiated kernel.
const TANGENT_BINDINGS: u32 = 14;

impl Batch {
    /// Upload, submit every dispatch and the copies of the results.
    ///
    /// # Errors
    /// When the rows of the plan do not fit together, a buffer exceeds a limit or the free memory of the device, or the
    /// driver reports an error.
    pub(super) fn begin<W: DeviceScalar>(
        device: &Device,
        pipeline: &mut Pipeline,
        plan: &Plan,
        ensemble: &Ensemble,
        carried: Vec<Invocation>,
    ) -> Result<Self, MarchError> {
        plan.check_consistency().map_err(MarchError::InconsistentPlan)?;
        let count = carried.len();
        let bytes = (size_of::<W>() * count) as u64;
        let run = device.uniform("run", &[DispatchParameters::zeroed()])?;
        let values = OutputBuffers::new(device, plan, bytes);
        let progress = device.storage("progress", (2 * size_of::<u32>() * count) as u64);
        let rows = upload_plan::<W>(device, plan, pipeline)?;
        let factors = device.upload("factors", &factors::<W>(plan, ensemble, &carried));
        let changes = pipeline.is_differentiated.then(|| {
            (device.upload("factor tangents", &seeds::<W>(plan, &carried)), OutputBuffers::new(device, plan, bytes))
        });
        device.check()?;
        let value_buffers = [(0, &run), (10, &factors), (11, &values.state), (12, &values.traces), (13, &progress)];
        let tangent_buffers = changes
            .iter()
            .flat_map(|(seeds, buffers)| (TANGENT_BINDINGS..).zip([seeds, &buffers.state, &buffers.traces]));
        let mut entries: Vec<(u32, wgpu::BindingResource<'_>)> =
            rows.buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding())).collect();
        entries.extend(
            value_buffers
                .into_iter()
                .chain(tangent_buffers)
                .map(|(binding, buffer)| (binding, buffer.as_entire_binding())),
        );
        entries.extend(rows.texels.iter().map(|texels| (7, wgpu::BindingResource::TextureView(texels))));
        let group = device.bind(&pipeline.compute, entries);
        submit_dispatches(device, plan, pipeline, &group, &run, count as u32)?;
        let begun = Self {
            invocations: carried,
            progress: device.read_back(&progress, 0, (2 * size_of::<u32>() * count) as u64),
            values: values.read_back(device, plan, bytes),
            tangents: changes.map(|(_, buffers)| buffers.read_back(device, plan, bytes)),
        };
        device.check().map(|()| begun)
    }

    /// Wait for the traces of the members, and their derivatives if the kernel is differentiated.
    ///
    /// # Errors
    /// When the device is lost, or terminated loops early.
    pub(super) fn finish<W: DeviceScalar>(
        self,
        device: &Device,
        plan: &Plan,
    ) -> Result<(Traces, Option<Traces>), MarchError> {
        let (count, first) =
            (self.invocations.len(), self.invocations.first().map_or(0, |invocation| invocation.member));
        let progress: Vec<u32> = device.finish_readback(self.progress)?;
        if let Some(place) = progress[..count].iter().position(|&step| step as usize != plan.steps() + 1) {
            return Err(MarchError::Incomplete {
                member: self.invocations[place].member,
                step: progress[place] as usize,
                steps: plan.steps(),
            });
        }
        if let Some(&step) = progress[count..].iter().find(|&&step| step as usize > plan.steps()) {
            return Err(device.error(format!("reports that a member diverged on step {step} of {}", plan.steps())));
        }
        let read_traces = |words: OutputReadbacks| -> Result<Traces, MarchError> {
            let (final_state, recorded) =
                (device.finish_readback::<W>(words.state)?, device.finish_readback::<W>(words.traces)?);
            Ok(gather_traces(plan, first, count, &recorded, &final_state))
        };
        let mut values = read_traces(self.values)?;
        let ends = progress[count..].iter().zip(values.extremes_k.chunks_exact(plan.rows.plies.len()));
        values.statuses = ends
            .map(|(&diverged_step, extremes_k)| {
                member_status(plan, (diverged_step as usize).checked_sub(1), extremes_k)
            })
            .collect();
        let changes = self.tangents.map(read_traces).transpose()?;
        let changes = changes.map(|changes| Traces { statuses: values.statuses.clone(), ..changes });
        Ok((values, changes))
    }
}

/// Factor × member.
fn factors<W: DeviceScalar>(plan: &Plan, ensemble: &Ensemble, carried: &[Invocation]) -> Vec<W> {
    let count = carried.len();
    let mut factors = vec![W::from_f64(0.0); plan.rows.factors * count];
    for (place, carried) in carried.iter().enumerate() {
        for (factor, &value) in ensemble.member(carried.member).iter().enumerate() {
            factors[factor * count + place] = W::from_f64(value);
        }
    }
    factors
}

/// Seeds of the forward mode: derivatives of the factors, factor × member.
fn seeds<W: DeviceScalar>(plan: &Plan, carried: &[Invocation]) -> Vec<W> {
    let count = carried.len();
    let mut seeds = vec![W::from_f64(0.0); plan.rows.factors * count];
    for (place, Invocation { direction: along, .. }) in carried.iter().enumerate() {
        along.iter().for_each(|factor| seeds[factor * count + place] = W::from_f64(1.0));
    }
    seeds
}

/// The data of a plan on a device, with the tables in a buffer or in a texture.
struct PlanBuffers {
    buffers: Vec<(u32, wgpu::Buffer)>,
    texels: Option<wgpu::TextureView>,
}

fn upload_plan<W: DeviceScalar>(device: &Device, plan: &Plan, pipeline: &Pipeline) -> Result<PlanBuffers, MarchError> {
    let rows = plan.rows.data.map(W::from_f64);
    let mut cells = flat!(Cell of rows.cells);
    cells.resize(cells.len() / rows.cells.len() * pipeline.cells, W::zeroed());
    let mut buffers = vec![
        (1, device.uniform("cells", &cells)?),
        (2, device.uniform("plan", &plan_bytes(plan, &rows))?),
        (3, device.upload("contacts_m2_k_w", &rows.contacts_m2_k_w)),
        (4, device.upload("boundary_forcing", &flat!(BoundaryForcing of rows.boundary_forcing))),
        (5, device.upload("step_lengths_s", &rows.step_lengths_s)),
        (8, device.upload("beads", &flat!(Bead of rows.beads))),
        (9, device.upload("instants", &plan.rows.record_at_step)),
    ];
    let texels = if pipeline.reads_texels {
        let words: Vec<f32> = plan.rows.data.tables.iter().map(|&word| f32::from_f64(word)).collect();
        Some(device.texels("texels", &words))
    } else {
        buffers.push((6, device.upload("tables", &rows.tables)));
        None
    };
    Ok(PlanBuffers { buffers, texels })
}

/// Submit all dispatches in order. On hardware the first dispatch of a kernel with more members than before is timed
/// alone and sets the number of steps of the others, as loop counts do not predict the speed of a device.
fn submit_dispatches(
    device: &Device,
    plan: &Plan,
    pipeline: &mut Pipeline,
    group: &wgpu::BindGroup,
    run: &wgpu::Buffer,
    members: u32,
) -> Result<(), MarchError> {
    let steps = plan.steps() as u32 + 1;
    let threads = pipeline.threads_per_member;
    let groups = (members * threads).div_ceil(shader::workgroup_size(threads));
    let submit = |first_step: u32, end_step: u32| {
        let words = DispatchParameters {
            slots: slots(plan),
            first_step,
            end_step,
            steps: plan.steps() as u32,
            members,
            one: 1.0,
            plies: plan.rows.plies.len() as u32,
            sensors: plan.rows.sensor_locations.len() as u32,
            faces: 2,
            open_faces: plan.rows.exchanging_faces as u32,
            stages: 2,
            gauges: plan.gauges() as u32,
            threads_per_member: threads,
            partial_sums: shader::partial_sums(plan),
            cells: plan.cells() as u32,
            last_cell: plan.cells() as u32 - 1,
            reductions: CAPACITY_REDUCTIONS as u32,
        };
        device.write(run, bytemuck::bytes_of(&words));
        device.dispatch(&pipeline.compute, group, groups);
    };
    let mut first_step = 0;
    let stride = match pipeline.measured {
        _ if device.is_software => shader::steps_per_dispatch(plan, threads, true),
        Some((most, stride)) if members <= most => stride,
        _ => {
            let first_steps = shader::steps_per_dispatch(plan, threads, false).min(steps);
            device.wait()?;
            let began = Instant::now();
            submit(0, first_steps);
            device.wait()?;
            first_step = first_steps;
            let stride = shader::steps_in_time(first_steps, began.elapsed());
            pipeline.measured = Some((members, stride));
            stride
        }
    };
    while first_step < steps {
        let end_step = first_step.saturating_add(stride).min(steps);
        submit(first_step, end_step);
        first_step = end_step;
    }
    Ok(())
}
