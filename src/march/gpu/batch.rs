//! Members on their way through a plan on a device: what goes up, what is dispatched, what comes down.

use super::device::{Device, Landing};
use super::shader;
use crate::ensemble::Ensemble;
use crate::march::{MarchError, arrival};
use crate::plan::layout::{
    Bead, Bulk, Cell, Conduction, Drive, Face, HEATS, Path, Place, Ply, Reaction, Scaling, Sensor, Substance,
};
use crate::plan::{GasPath, Plan};
use crate::traces::{Balance, Traces};
use bytemuck::{Pod, Zeroable};
use std::array::from_fn;
use std::ops::Range;
use std::time::Instant;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Run {
    first_step: u32,
    end_step: u32,
    steps: u32,
    members: u32,
    one: f32,
    plies: u32,
    sensors: u32,
    faces: u32,
    stages: u32,
    gauges: u32,
    unused: [u32; 2],
}

/// A scalar that crosses to the device.
pub(super) trait Word: Pod {
    fn word(value: f64) -> Self;
    fn real(self) -> f64;
}

impl Word for f32 {
    fn word(value: f64) -> Self {
        value as Self
    }
    fn real(self) -> f64 {
        f64::from(self)
    }
}

impl Word for f64 {
    fn word(value: f64) -> Self {
        value
    }
    fn real(self) -> f64 {
        self
    }
}
/// A kernel as a device compiled it.
pub(super) struct Kernel {
    pub(super) pipeline: wgpu::ComputePipeline,
    /// Whether it reads tables from texels.
    pub(super) texels: bool,
    /// Members that were timed, the most so far, and steps that a dispatch of them takes.
    pub(super) timed: Option<(u32, u32)>,
}

/// A batch whose dispatches are submitted and whose results land by themselves.
pub(super) struct Batch {
    members: Range<usize>,
    progress: Landing,
    left: Landing,
    shown: Landing,
}

impl Batch {
    /// Upload, submit every dispatch, and have copied down what they leave.
    ///
    /// # Errors
    /// When the device has no room for rows of the plan.
    pub(super) fn begin<W: Word>(
        device: &Device,
        kernel: &mut Kernel,
        plan: &Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Self, MarchError> {
        let count = members.len();
        let bytes = (size_of::<W>() * count) as u64;
        let run = device.uniform("run", &[Run::zeroed()])?;
        let state = device.storage("state", state_words(plan) as u64 * bytes);
        let traces = device.storage("traces", trace_words(plan) as u64 * bytes);
        let progress = device.storage("progress", (2 * size_of::<u32>() * count) as u64);
        let rows = rows::<W>(device, plan, kernel.texels)?;
        let factors = device.upload("factors", &factors::<W>(plan, ensemble, members.clone()));
        let own = [(0, &run), (14, &factors), (15, &state), (16, &traces), (17, &progress)];
        let mut entries: Vec<(u32, wgpu::BindingResource<'_>)> =
            rows.buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding())).collect();
        entries.extend(own.map(|(binding, buffer)| (binding, buffer.as_entire_binding())));
        entries.push((22, wgpu::BindingResource::TextureView(&rows.texels)));
        let group = device.bind(&kernel.pipeline, entries);
        dispatch(device, plan, kernel, &group, &run, count as u32)?;
        let outcome = 2 * plan.cells() + 4 * plan.places.len();
        Ok(Self {
            members,
            progress: device.land(&progress, 0, (2 * size_of::<u32>() * count) as u64),
            left: device.land(&state, outcome as u64 * bytes, (state_words(plan) - outcome) as u64 * bytes),
            shown: device.land(&traces, 0, trace_words(plan) as u64 * bytes),
        })
    }

    /// What the members did, once they have.
    ///
    /// # Errors
    /// When the device is lost, or ended loops early.
    pub(super) fn finish<W: Word>(self, device: &Device, plan: &Plan) -> Result<Traces, MarchError> {
        let count = self.members.len();
        let progress: Vec<u32> = device.landed(self.progress)?;
        if let Some(member) = progress[..count].iter().position(|&step| step as usize != plan.steps() + 1) {
            return Err(MarchError::CutShort {
                member: self.members.start + member,
                step: progress[member] as usize,
                steps: plan.steps(),
            });
        }
        let (left, shown) = (device.landed::<W>(self.left)?, device.landed::<W>(self.shown)?);
        Ok(gather(plan, self.members, &shown, &left, &progress[count..]))
    }
}

/// Factor × member.
fn factors<W: Word>(plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Vec<W> {
    let count = members.len();
    let mut factors = vec![W::word(0.0); plan.factors * count];
    for (place, member) in members.enumerate() {
        for (factor, &value) in ensemble.member(member).iter().enumerate() {
            factors[factor * count + place] = W::word(value);
        }
    }
    factors
}

/// The rows of a plan on a device.
struct Rows {
    buffers: Vec<(u32, wgpu::Buffer)>,
    texels: wgpu::TextureView,
}

/// Rows one behind the other, each begun on 16 bytes; one of zeros where there are none, as a binding cannot be empty.
fn flat<S: Pod, T>(rows: &[T], fields: usize, flatten: impl Fn(&T, &mut Vec<S>)) -> Vec<S> {
    let stride = fields.next_multiple_of(16 / size_of::<S>());
    let mut words = Vec::with_capacity(stride * rows.len().max(1));
    for row in rows {
        flatten(row, &mut words);
        words.resize(words.len().next_multiple_of(stride), S::zeroed());
    }
    words.resize(words.len().max(stride), S::zeroed());
    words
}

/// Rows of one kind, by their name in `plan/layout.rs`.
macro_rules! flat {
    ($kind:ident of $rows:expr) => {
        flat(&$rows[..], $kind::<u32>::FIELDS.len(), |row, into| row.flatten(into))
    };
}

fn rows<W: Word>(device: &Device, plan: &Plan, texels: bool) -> Result<Rows, MarchError> {
    let rows = plan.rows.map(W::word);
    let buffers = vec![
        (1, device.uniform("cells", &flat!(Cell of rows.cells))?),
        (2, device.uniform("plies", &flat!(Ply of plan.plies))?),
        (3, device.uniform("bulks", &flat!(Bulk of rows.bulks))?),
        (4, device.upload("contacts", &rows.contacts_m2_k_w)),
        (5, device.uniform("faces", &flat!(Face of rows.faces))?),
        (6, device.uniform("scalings", &flat!(Scaling of plan.scalings))?),
        (7, device.upload("drives", &flat!(Drive of rows.drives))),
        (8, device.upload("lengths", &rows.lengths_s)),
        (9, device.upload("tables", if texels { &[] } else { &rows.tables })),
        (10, device.uniform("sensors", &flat!(Sensor of rows.sensors))?),
        (11, device.uniform("places", &flat!(Place of plan.places))?),
        (12, device.upload("beads", &flat!(Bead of rows.beads))),
        (13, device.upload("instants", &plan.instants)),
        (18, device.uniform("substances", &flat!(Substance of rows.substances))?),
        (19, device.uniform("reactions", &flat!(Reaction of rows.reactions))?),
        (20, device.uniform("paths", &flat!(Path of plan.paths))?),
        (21, device.uniform("conductions", &flat!(Conduction of plan.conductions))?),
    ];
    let words: Vec<f32> = if texels { plan.rows.tables.iter().map(|&word| f32::word(word)).collect() } else { vec![] };
    Ok(Rows { buffers, texels: device.texels("texels", &words) })
}

/// Submit every dispatch; the queue keeps their order. On hardware the first dispatch of a kernel with so many members is waited for,
/// with nothing else under way, and tells by its time how many steps the others take: no loop turns tell how fast a device is.
fn dispatch(
    device: &Device,
    plan: &Plan,
    kernel: &mut Kernel,
    group: &wgpu::BindGroup,
    run: &wgpu::Buffer,
    members: u32,
) -> Result<(), MarchError> {
    let steps = plan.steps() as u32 + 1;
    let submit = |first_step: u32, end_step: u32| {
        let words = Run {
            first_step,
            end_step,
            steps: plan.steps() as u32,
            members,
            one: 1.0,
            plies: plan.plies.len() as u32,
            sensors: plan.places.len() as u32,
            faces: 2,
            stages: 2,
            gauges: plan.gauges() as u32,
            unused: [0; 2],
        };
        device.queue.write_buffer(run, 0, bytemuck::bytes_of(&words));
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&kernel.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(members.div_ceil(shader::WORKGROUP), 1, 1);
        }
        device.queue.submit([encoder.finish()]);
    };
    let mut first_step = 0;
    let stride = match kernel.timed {
        _ if device.is_software => shader::steps_a_dispatch(plan, true),
        Some((most, stride)) if members <= most => stride,
        _ => {
            let tried = shader::steps_a_dispatch(plan, false).min(steps);
            device.wait()?;
            let began = Instant::now();
            submit(0, tried);
            device.wait()?;
            first_step = tried;
            let stride = shader::steps_in_time(tried, began.elapsed());
            kernel.timed = Some((members, stride));
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

/// Words of the sums of heat, in two words each, and of the heat stored: where the extremes begin.
const HEATS_END: usize = 2 * HEATS + 1;

/// Words of one member in the state: two a cell, four a sensor, then what it leaves behind.
pub(super) fn state_words(plan: &Plan) -> usize {
    2 * plan.cells() + 4 * plan.places.len() + HEATS_END + 2 * plan.plies.len() + gas_words(plan)
}

/// Words of what gas took along before those of the advancements.
const GONE_WORDS: usize = 14;

/// Words of one member's gas: what it took along, three a reaction in a cell, three a cell and, by Darcy's law, six more.
fn gas_words(plan: &Plan) -> usize {
    let made = plan.cells() * (3 * plan.reactions.max(1) + 3);
    match plan.gas {
        None => 0,
        Some(GasPath::Darcy) => GONE_WORDS + made + 6 * plan.cells(),
        Some(_) => GONE_WORDS + made,
    }
}

/// Words of one member in the traces.
pub(super) fn trace_words(plan: &Plan) -> usize {
    2 * (plan.places.len() + plan.gauges()) * plan.records
}

/// Traces from what came down, which lies member by member within each word.
fn gather<W: Word>(plan: &Plan, members: Range<usize>, shown: &[W], left: &[W], strayed: &[u32]) -> Traces {
    let (count, sensors, instants) = (members.len(), plan.places.len(), plan.records);
    let traced = sensors + plan.gauges();
    let mut temperatures_k = vec![0.0; count * sensors * instants];
    for instant in 0..instants {
        for sensor in 0..sensors {
            let base = 2 * (instant * traced + sensor) * count;
            for member in 0..count {
                temperatures_k[(member * sensors + sensor) * instants + instant] =
                    shown[base + member].real() + shown[base + count + member].real();
            }
        }
    }
    let mut gauges = vec![0.0; count * plan.gauges() * instants];
    for instant in 0..instants {
        for gauge in 0..plan.gauges() {
            let base = 2 * (instant * traced + sensors + gauge) * count;
            for member in 0..count {
                gauges[(member * plan.gauges() + gauge) * instants + instant] = shown[base + member].real();
            }
        }
    }
    let mut traces = Traces {
        first: members.start,
        sensors,
        instants,
        temperatures_k,
        gauges,
        arrivals: Vec::with_capacity(count),
        balances: Vec::with_capacity(count),
        extremes_k: Vec::with_capacity(count * plan.plies.len()),
    };
    for member in 0..count {
        let word = |index: usize| left[index * count + member].real();
        let heat = |index: usize| word(2 * index) + word(2 * index + 1);
        let extremes_k: Vec<(f64, f64)> =
            (0..plan.plies.len()).map(|ply| (word(HEATS_END + 2 * ply), word(HEATS_END + 1 + 2 * ply))).collect();
        let step = (strayed[member] as usize).checked_sub(1);
        traces.arrivals.push(arrival(plan, step, &extremes_k));
        let mut balance = Balance::new(from_fn(heat), word(2 * HEATS));
        if plan.gas.is_some() {
            let gone = HEATS_END + 2 * plan.plies.len();
            let sum = |place: usize| word(gone + 2 * place) + word(gone + 2 * place + 1);
            balance = balance.and_gas([sum(0), sum(1), sum(2), sum(3), word(gone + 8), word(gone + 9)]);
        }
        traces.balances.push(balance);
        traces.extremes_k.extend(extremes_k);
    }
    traces
}
