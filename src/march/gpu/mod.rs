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

pub mod device;
mod differentiate;
mod gather;
pub mod shader;
pub mod spirv;

use super::{Backend, March, MarchError, Precision, arrival, read_out};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::plan::layout::{Path, Reaction};
use crate::traces::Traces;
use bytemuck::{Pod, Zeroable};
use device::Device;
use gather::{gather, outcome, state_words, trace_words};
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
    /// By the kernel's text, and whether it tells derivatives.
    pipelines: HashMap<(String, bool), wgpu::ComputePipeline>,
}

/// What an invocation carries: a member, and the factor along which it tells how the member changes.
#[derive(Clone, Copy)]
struct Carried {
    member: usize,
    along: Option<usize>,
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

    /// Traces of what is carried, and of what changes of each along its factor where that is to be told.
    fn carry(
        &mut self,
        plan: &Plan,
        ensemble: &Ensemble,
        carried: &[Carried],
        tells: bool,
    ) -> Result<(Traces, Option<Traces>), MarchError> {
        match self.precision {
            Precision::F32 => self.carry_as::<f32>(plan, ensemble, carried, tells),
            Precision::F64 => self.carry_as::<f64>(plan, ensemble, carried, tells),
        }
    }

    /// The pipeline that marches a plan, telling derivatives or not; compiled once.
    fn pipeline(&mut self, plan: &Plan, tells: bool) -> Result<wgpu::ComputePipeline, MarchError> {
        let asked = (shader::kernel(plan, self.precision, shader::MARCH), tells);
        if let Some(pipeline) = self.pipelines.get(&asked) {
            return Ok(pipeline.clone());
        }
        let mut kernel = self.device.kernel(asked.0.clone())?;
        if tells {
            kernel = kernel.differentiated("factors").map_err(|why| self.device.error(why))?;
        }
        let pipeline = self.device.pipeline(&kernel, "march")?;
        self.pipelines.insert(asked, pipeline.clone());
        Ok(pipeline)
    }

    /// The same in the words of a precision.
    fn carry_as<W: Word>(
        &mut self,
        plan: &Plan,
        ensemble: &Ensemble,
        carried: &[Carried],
        tells: bool,
    ) -> Result<(Traces, Option<Traces>), MarchError> {
        let (count, first) = (carried.len(), carried.first().map_or(0, |carried| carried.member));
        let pipeline = self.pipeline(plan, tells)?;
        let mut buffers = self.buffers::<W>(plan, ensemble, carried);
        if tells {
            buffers.extend(self.changes::<W>(plan, carried));
        }
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
        self.dispatch(plan, &pipeline, &bind_group, &buffers[0], count as u32);

        let [state, traces, progress, ..] = &buffers[15..] else {
            return Err(self.device.error("the march has no state, traces and progress buffers"));
        };
        let progress: Vec<u32> = self.device.download(progress, 0, (2 * count * 4) as u64)?;
        if let Some(member) = progress[..count].iter().position(|&step| step as usize != plan.steps() + 1) {
            return Err(MarchError::CutShort {
                member: carried[member].member,
                step: progress[member] as usize,
                steps: plan.steps(),
            });
        }
        let bytes = (count * size_of::<W>()) as u64;
        let outcome = outcome(plan);
        let gathered = |state: &wgpu::Buffer, traces: &wgpu::Buffer| -> Result<Traces, MarchError> {
            let left: Vec<W> =
                self.device.download(state, outcome as u64 * bytes, (state_words(plan) - outcome) as u64 * bytes)?;
            let shown: Vec<W> = self.device.download(traces, 0, trace_words(plan) as u64 * bytes)?;
            Ok(gather(plan, first, count, &shown, &left))
        };
        let mut values = gathered(state, traces)?;
        let ends = progress[count..].iter().zip(values.extremes_k.chunks_exact(plan.plies.len()));
        values.arrivals =
            ends.map(|(&strayed, extremes_k)| arrival(plan, (strayed as usize).checked_sub(1), extremes_k)).collect();
        let changes = match &buffers[..] {
            [.., _seeds, state, traces] if tells => {
                Some(Traces { arrivals: values.arrivals.clone(), ..gathered(state, traces)? })
            }
            _ => None,
        };
        Ok((values, changes))
    }

    /// Buffers for what changes, in the order of those that it belongs to: factors, state, traces.
    fn changes<W: Word>(&self, plan: &Plan, carried: &[Carried]) -> [wgpu::Buffer; 3] {
        let (device, count) = (&self.device, carried.len());
        let mut seeds = vec![W::word(0.0); (plan.factors * count).max(1)];
        for (place, Carried { along, .. }) in carried.iter().enumerate() {
            along.iter().for_each(|factor| seeds[factor * count + place] = W::word(1.0));
        }
        let words = size_of::<W>() * count;
        [
            device.upload("changes of factors", &seeds),
            device.storage("changes of state", (state_words(plan) * words) as u64),
            device.storage("changes of traces", (trace_words(plan) * words) as u64),
        ]
    }

    /// All buffers in binding order, filled.
    fn buffers<W: Word>(&self, plan: &Plan, ensemble: &Ensemble, carried: &[Carried]) -> Vec<wgpu::Buffer> {
        let (device, rows, count) = (&self.device, plan.rows.map(W::word), carried.len());
        fn flat<S: Copy, T>(rows: &[T], each: impl Fn(&T, &mut Vec<S>)) -> Vec<S> {
            let mut words = Vec::new();
            rows.iter().for_each(|row| each(row, &mut words));
            words
        }
        let mut factors = vec![W::word(0.0); (plan.factors * count).max(1)];
        for (place, carried) in carried.iter().enumerate() {
            for (factor, &value) in ensemble.member(carried.member).iter().enumerate() {
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
        let carried: Vec<Carried> = members.map(|member| Carried { member, along: None }).collect();
        let (records, _) = self.carry(plan, ensemble, &carried, false)?;
        Ok(read_out(records, plan))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let along: Vec<Option<usize>> =
            if factors.is_empty() { vec![None] } else { factors.iter().copied().map(Some).collect() };
        let carried: Vec<Carried> =
            (0..points.len()).flat_map(|member| along.iter().map(move |&along| Carried { member, along })).collect();
        let mut told = Traces::none(0, plan.places.len(), plan.records);
        let most = self.capacity(plan).max(1);
        for (run, some) in carried.chunks(most).enumerate() {
            let (values, changes) = self.carry(plan, points, some, true)?;
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
        Ok(Some(read_out(told, plan)))
    }
}
