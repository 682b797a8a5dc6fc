//! The march on a Vulkan device: upload, dispatch, download.
//!
//! A plan and the members' factors go up once; identical dispatches carry every member a few steps each;
//! traces come down once. No dispatch is long, which keeps clear of drivers that time out or stop counting
//! loops, and the kernel records how far each member came, so that a march cut short is an error and never
//! a wrong temperature.

pub mod device;
pub mod shader;
pub mod spirv;

use super::{Backend, March, MarchError, Precision, arrival, read_out};
use crate::ensemble::Ensemble;
use crate::plan::layout::{HEATS, Path, Reaction};
use crate::plan::{GasPath, Plan};
use crate::traces::{Balance, Traces};
use bytemuck::{Pod, Zeroable};
use device::Device;
use std::array::from_fn;
use std::collections::HashMap;
use std::ops::Range;

/// Members at once, at most: enough to fill any device, and a bound on the host's memory. A software device is full with
/// fewer, and its memory is the host's too.
const MEMBERS_MAX: usize = 8192;
const MEMBERS_MAX_SOFTWARE: usize = 2048;

/// A Vulkan device as a march.
pub struct Gpu {
    device: Device,
    precision: Precision,
    pipelines: HashMap<String, wgpu::ComputePipeline>,
}

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
trait Word: Pod {
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
        Ok(Self { device, precision, pipelines: HashMap::new() })
    }

    fn word_bytes(&self) -> u64 {
        match self.precision {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }

    /// Bytes of one member in the largest of its buffers.
    fn member_bytes(&self, plan: &Plan) -> u64 {
        (trace_words(plan).max(state_words(plan)) as u64) * self.word_bytes()
    }

    fn carry<W: Word>(
        &mut self,
        plan: &Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Traces, MarchError> {
        let count = members.len();
        let text = shader::kernel(plan, self.precision, shader::MARCH);
        if !self.pipelines.contains_key(&text) {
            let pipeline = self.device.pipeline(&text, "march")?;
            self.pipelines.insert(text.clone(), pipeline);
        }
        let pipeline = &self.pipelines[&text];
        let buffers = self.buffers::<W>(plan, ensemble, members.clone());
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .enumerate()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: binding as u32,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let bind_group = self.device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("march"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        self.dispatch(plan, pipeline, &bind_group, &buffers[0], count as u32);

        let [state, traces, progress, ..] = &buffers[15..] else {
            return Err(self.device.error("the march has no state, traces and progress buffers"));
        };
        let progress: Vec<u32> = self.device.download(progress, 0, (2 * count * 4) as u64)?;
        if let Some(member) = progress[..count].iter().position(|&step| step as usize != plan.steps() + 1) {
            return Err(MarchError::CutShort {
                member: members.start + member,
                step: progress[member] as usize,
                steps: plan.steps(),
            });
        }
        let bytes = (count * size_of::<W>()) as u64;
        let outcome = 2 * plan.cells() + 4 * plan.places.len();
        let left: Vec<W> =
            self.device.download(state, outcome as u64 * bytes, (state_words(plan) - outcome) as u64 * bytes)?;
        let shown: Vec<W> = self.device.download(traces, 0, trace_words(plan) as u64 * bytes)?;
        Ok(gather(plan, members, &shown, &left, &progress[count..]))
    }

    /// All buffers in binding order, filled.
    fn buffers<W: Word>(&self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Vec<wgpu::Buffer> {
        let (device, rows, count) = (&self.device, plan.rows.map(W::word), members.len());
        fn flat<S: Copy, T>(rows: &[T], each: impl Fn(&T, &mut Vec<S>)) -> Vec<S> {
            let mut words = Vec::new();
            rows.iter().for_each(|row| each(row, &mut words));
            words
        }
        let mut factors = vec![W::word(0.0); (plan.factors * count).max(1)];
        for (place, member) in members.enumerate() {
            for (factor, &value) in ensemble.member(member).iter().enumerate() {
                factors[factor * count + place] = W::word(value);
            }
        }
        // An empty row where there is none, as a binding cannot be empty.
        let some = |words: Vec<W>| if words.is_empty() { vec![W::word(0.0)] } else { words };
        let run = device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("run"),
            size: size_of::<Run>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let words = size_of::<W>() * count;
        let mut reactions = flat(&rows.reactions, |row, into| row.flatten(into));
        let mut paths = flat(&plan.paths, |row, into| row.flatten(into));
        if plan.paths.is_empty() {
            reactions = vec![W::word(0.0); Reaction::<W>::FIELDS.len()];
            paths = vec![0; Path::<u32>::FIELDS.len()];
        }
        vec![
            run,
            device.upload("cells", &flat(&rows.cells, |row, into| row.flatten(into))),
            device.upload("plies", &flat(&plan.plies, |row, into| row.flatten(into))),
            device.upload("bulks", &flat(&rows.bulks, |row, into| row.flatten(into))),
            device.upload("contacts", &some(rows.contacts_m2_k_w.clone())),
            device.upload("faces", &flat(&rows.faces, |row, into| row.flatten(into))),
            device.upload("scalings", &flat(&plan.scalings, |row, into| row.flatten(into))),
            device.upload("drives", &flat(&rows.drives, |row, into| row.flatten(into))),
            device.upload("lengths", &rows.lengths_s),
            device.upload("tables", &rows.tables),
            device.upload("sensors", &flat(&rows.sensors, |row, into| row.flatten(into))),
            device.upload("places", &flat(&plan.places, |row, into| row.flatten(into))),
            device.upload("beads", &flat(&rows.beads, |row, into| row.flatten(into))),
            device.upload("instants", &plan.instants),
            device.upload("factors", &factors),
            device.storage("state", (state_words(plan) * words) as u64),
            device.storage("traces", (trace_words(plan) * words) as u64),
            device.storage("progress", (2 * 4 * count) as u64),
            device.upload("substances", &flat(&rows.substances, |row, into| row.flatten(into))),
            device.upload("reactions", &reactions),
            device.upload("paths", &paths),
            device.upload("conductions", &flat(&plan.conductions, |row, into| row.flatten(into))),
        ]
    }

    /// Submit every dispatch; the queue keeps their order.
    fn dispatch(
        &self,
        plan: &Plan,
        pipeline: &wgpu::ComputePipeline,
        bind_group: &wgpu::BindGroup,
        run: &wgpu::Buffer,
        members: u32,
    ) {
        let stride = shader::steps_a_dispatch(plan, self.device.is_software);
        let steps = plan.steps() as u32 + 1;
        let mut first_step = 0;
        while first_step < steps {
            let end_step = (first_step + stride).min(steps);
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
            self.device.queue.write_buffer(run, 0, bytemuck::bytes_of(&words));
            let mut encoder = self.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, bind_group, &[]);
                pass.dispatch_workgroups(members.div_ceil(shader::WORKGROUP), 1, 1);
            }
            self.device.queue.submit([encoder.finish()]);
            first_step = end_step;
        }
    }
}

/// Words of the sums of heat, in two words each, and of the heat stored: where the extremes begin.
const HEATS_END: usize = 2 * HEATS + 1;

/// Words of one member in the state: two a cell, four a sensor, then what it leaves behind.
fn state_words(plan: &Plan) -> usize {
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
fn trace_words(plan: &Plan) -> usize {
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

impl March for Gpu {
    fn backend(&self) -> Backend {
        Backend { name: self.device.name.clone(), kind: "gpu", precision: self.precision }
    }

    fn capacity(&self, plan: &Plan) -> usize {
        let limit = self.device.limits.max_storage_buffer_binding_size.min(self.device.limits.max_buffer_size);
        let most = if self.device.is_software { MEMBERS_MAX_SOFTWARE } else { MEMBERS_MAX };
        ((limit / self.member_bytes(plan).max(1)) as usize).min(most)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        if self.capacity(plan) < members.len() {
            return Err(MarchError::TooLarge {
                device: self.device.name.clone(),
                limit: self.device.limits.max_storage_buffer_binding_size,
                needed: self.member_bytes(plan) * members.len() as u64,
            });
        }
        let records = match self.precision {
            Precision::F32 => self.carry::<f32>(plan, ensemble, members),
            Precision::F64 => self.carry::<f64>(plan, ensemble, members),
        };
        Ok(read_out(records?, plan))
    }
}
