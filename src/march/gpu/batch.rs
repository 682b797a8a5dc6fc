//! Members on their way through a plan on a device: what goes up, what is dispatched, what comes down.

use super::device::{Device, Landing};
use super::gather::{gather, trace_words};
use super::layout::{Run, flat, plan_bytes};
use super::shader;
use super::state::{Block, slots, state_words};
use super::word::Word;
use crate::ensemble::Ensemble;
use crate::march::{MarchError, arrival};
use crate::plan::Plan;
use crate::plan::layout::{Bead, Cell, Drive};
use crate::traces::Traces;
use bytemuck::Zeroable;
use std::time::Instant;

/// A kernel as a device compiled it.
pub(super) struct Pipeline {
    pub(super) inner: wgpu::ComputePipeline,
    /// What its kernel's text is at any length of its columns.
    pub(super) text: String,
    /// Cells that its columns have room for.
    pub(super) cells: usize,
    /// Invocations that carry each member.
    pub(super) lanes: u32,
    /// Whether it tells derivatives.
    pub(super) tells: bool,
    /// Whether it reads tables from texels.
    pub(super) texels: bool,
    /// Members that were timed, the most so far, and steps that a dispatch of them takes.
    pub(super) timed: Option<(u32, u32)>,
}

/// A batch whose dispatches are submitted and whose results land by themselves.
pub(super) struct Batch {
    carried: Vec<Carried>,
    progress: Landing,
    values: Words,
    changes: Option<Words>,
}

/// What an invocation carries: a member, and the factor along which it tells how the member changes.
#[derive(Clone, Copy)]
pub(super) struct Carried {
    pub(super) member: usize,
    pub(super) along: Option<usize>,
}

/// State and traces of a batch, or their changes, on a device.
struct Room {
    state: wgpu::Buffer,
    traces: wgpu::Buffer,
}

/// What is read of them.
struct Words {
    left: Landing,
    shown: Landing,
}

impl Room {
    /// For so many bytes a word.
    fn new(device: &Device, plan: &Plan, bytes: u64) -> Self {
        Self {
            state: device.storage("state", state_words(plan) as u64 * bytes),
            traces: device.storage("traces", trace_words(plan) as u64 * bytes),
        }
    }

    fn land(&self, device: &Device, plan: &Plan, bytes: u64) -> Words {
        let outcome = Block::Heat.slot(plan);
        Words {
            left: device.land(&self.state, outcome as u64 * bytes, (state_words(plan) - outcome) as u64 * bytes),
            shown: device.land(&self.traces, 0, trace_words(plan) as u64 * bytes),
        }
    }
}

/// Where the changes of factors, state and traces are bound where a kernel tells them: behind all others.
const CHANGES: u32 = 14;

impl Batch {
    /// Upload, submit every dispatch, and have copied down what they leave.
    ///
    /// # Errors
    /// When the rows of the plan do not fit together, or the device has no room for them.
    pub(super) fn begin<W: Word>(
        device: &Device,
        pipeline: &mut Pipeline,
        plan: &Plan,
        ensemble: &Ensemble,
        carried: Vec<Carried>,
    ) -> Result<Self, MarchError> {
        plan.check_consistency().map_err(MarchError::InconsistentPlan)?;
        let count = carried.len();
        let bytes = (size_of::<W>() * count) as u64;
        let run = device.uniform("run", &[Run::zeroed()])?;
        let values = Room::new(device, plan, bytes);
        let progress = device.storage("progress", (2 * size_of::<u32>() * count) as u64);
        let rows = rows::<W>(device, plan, pipeline)?;
        let factors = device.upload("factors", &factors::<W>(plan, ensemble, &carried));
        let changes = pipeline.tells.then(|| {
            (device.upload("changes of factors", &seeds::<W>(plan, &carried)), Room::new(device, plan, bytes))
        });
        let own = [(0, &run), (10, &factors), (11, &values.state), (12, &values.traces), (13, &progress)];
        let told = changes.iter().flat_map(|(seeds, room)| (CHANGES..).zip([seeds, &room.state, &room.traces]));
        let mut entries: Vec<(u32, wgpu::BindingResource<'_>)> =
            rows.buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding())).collect();
        entries.extend(own.into_iter().chain(told).map(|(binding, buffer)| (binding, buffer.as_entire_binding())));
        entries.push((7, wgpu::BindingResource::TextureView(&rows.texels)));
        let group = device.bind(&pipeline.inner, entries);
        dispatch(device, plan, pipeline, &group, &run, count as u32)?;
        Ok(Self {
            carried,
            progress: device.land(&progress, 0, (2 * size_of::<u32>() * count) as u64),
            values: values.land(device, plan, bytes),
            changes: changes.map(|(_, room)| room.land(device, plan, bytes)),
        })
    }

    /// What the members did, once they have; and how that changes along the factor of each, where that is told.
    ///
    /// # Errors
    /// When the device is lost, or ended loops early.
    pub(super) fn finish<W: Word>(self, device: &Device, plan: &Plan) -> Result<(Traces, Option<Traces>), MarchError> {
        let (count, first) = (self.carried.len(), self.carried.first().map_or(0, |carried| carried.member));
        let progress: Vec<u32> = device.landed(self.progress)?;
        if let Some(place) = progress[..count].iter().position(|&step| step as usize != plan.steps() + 1) {
            return Err(MarchError::CutShort {
                member: self.carried[place].member,
                step: progress[place] as usize,
                steps: plan.steps(),
            });
        }
        if let Some(&step) = progress[count..].iter().find(|&&step| step as usize > plan.steps()) {
            return Err(device.error(format!("says that a member diverged on step {step} of {}", plan.steps())));
        }
        let gathered = |words: Words| -> Result<Traces, MarchError> {
            let (left, shown) = (device.landed::<W>(words.left)?, device.landed::<W>(words.shown)?);
            Ok(gather(plan, first, count, &shown, &left))
        };
        let mut values = gathered(self.values)?;
        let ends = progress[count..].iter().zip(values.extremes_k.chunks_exact(plan.plies.len()));
        values.arrivals =
            ends.map(|(&strayed, extremes_k)| arrival(plan, (strayed as usize).checked_sub(1), extremes_k)).collect();
        let changes = self.changes.map(gathered).transpose()?;
        let changes = changes.map(|changes| Traces { arrivals: values.arrivals.clone(), ..changes });
        Ok((values, changes))
    }
}

/// Factor × member.
fn factors<W: Word>(plan: &Plan, ensemble: &Ensemble, carried: &[Carried]) -> Vec<W> {
    let count = carried.len();
    let mut factors = vec![W::word(0.0); plan.factors * count];
    for (place, carried) in carried.iter().enumerate() {
        for (factor, &value) in ensemble.member(carried.member).iter().enumerate() {
            factors[factor * count + place] = W::word(value);
        }
    }
    factors
}

/// How the factors change along that of each, in the same order.
fn seeds<W: Word>(plan: &Plan, carried: &[Carried]) -> Vec<W> {
    let count = carried.len();
    let mut seeds = vec![W::word(0.0); plan.factors * count];
    for (place, Carried { along, .. }) in carried.iter().enumerate() {
        along.iter().for_each(|factor| seeds[factor * count + place] = W::word(1.0));
    }
    seeds
}

/// The rows of a plan on a device.
struct Rows {
    buffers: Vec<(u32, wgpu::Buffer)>,
    texels: wgpu::TextureView,
}

fn rows<W: Word>(device: &Device, plan: &Plan, pipeline: &Pipeline) -> Result<Rows, MarchError> {
    let rows = plan.rows.map(W::word);
    let mut cells = flat!(Cell of rows.cells);
    cells.resize(cells.len() / rows.cells.len() * pipeline.cells, W::zeroed());
    let buffers = vec![
        (1, device.uniform("cells", &cells)?),
        (2, device.uniform("plan", &plan_bytes(plan, &rows))?),
        (3, device.upload("contacts", &rows.contacts_m2_k_w)),
        (4, device.upload("drives", &flat!(Drive of rows.drives))),
        (5, device.upload("lengths", &rows.lengths_s)),
        (6, device.upload("tables", if pipeline.texels { &[] } else { &rows.tables })),
        (8, device.upload("beads", &flat!(Bead of rows.beads))),
        (9, device.upload("instants", &plan.instants)),
    ];
    let words: Vec<f32> =
        if pipeline.texels { plan.rows.tables.iter().map(|&word| f32::word(word)).collect() } else { vec![] };
    Ok(Rows { buffers, texels: device.texels("texels", &words) })
}

/// Submit every dispatch; the queue keeps their order. On hardware the first dispatch of a kernel with so many members is waited for,
/// with nothing else under way, and tells by its time how many steps the others take: no loop turns tell how fast a device is.
fn dispatch(
    device: &Device,
    plan: &Plan,
    pipeline: &mut Pipeline,
    group: &wgpu::BindGroup,
    run: &wgpu::Buffer,
    members: u32,
) -> Result<(), MarchError> {
    let steps = plan.steps() as u32 + 1;
    let lanes = pipeline.lanes;
    let groups = (members * lanes).div_ceil(shader::workgroup(lanes));
    let submit = |first_step: u32, end_step: u32| {
        let words = Run {
            slots: slots(plan),
            first_step,
            end_step,
            steps: plan.steps() as u32,
            members,
            one: 1.0,
            plies: plan.plies.len() as u32,
            sensors: plan.places.len() as u32,
            faces: 2,
            open_faces: plan.open_faces as u32,
            stages: 2,
            gauges: plan.gauges() as u32,
            lanes,
            sums: shader::sums(plan),
            cells: plan.cells() as u32,
            last_cell: plan.cells() as u32 - 1,
            unused: 0,
        };
        device.queue.write_buffer(run, 0, bytemuck::bytes_of(&words));
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline.inner);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        device.queue.submit([encoder.finish()]);
    };
    let mut first_step = 0;
    let stride = match pipeline.timed {
        _ if device.is_software => shader::steps_a_dispatch(plan, lanes, true),
        Some((most, stride)) if members <= most => stride,
        _ => {
            let tried = shader::steps_a_dispatch(plan, lanes, false).min(steps);
            device.wait()?;
            let began = Instant::now();
            submit(0, tried);
            device.wait()?;
            first_step = tried;
            let stride = shader::steps_in_time(tried, began.elapsed());
            pipeline.timed = Some((members, stride));
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
