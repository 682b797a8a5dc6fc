//! WGSL functions against their Rust twins on thousands of inputs, in both precisions, bit for bit.

use super::super::device::Device;
use super::super::layout::DispatchParameters;
use super::super::shader;
use super::super::spirv::{self, Kernel};
use super::{Target, Uniform, device, mutants};
use crate::case::Case;
use crate::march::Precision;
use crate::physics::Real;
use crate::physics::compensated::{add_compensated, difference, two_sum};
use crate::physics::decomposition::{arrhenius_rate, consumed_share, mean_decay};
use crate::physics::double_word::DoubleWord;
use crate::physics::exponential::{decay, exponential, logarithm, power};
use crate::physics::holder::lateral_heat_flux;
use crate::physics::layout::{Bead, BoundaryForcing, Reaction, Sensor, TABLE_STEPS, TableLocation};
use crate::physics::material::{
    ConductivityParts, conductance_across, conductance_slope_across, conductance_within, flux_slopes, solid_properties,
};
use crate::physics::surface_flux::{FaceScale, surface_flux};
use crate::physics::table::{
    TabulatedStates, column_offset, first_integral, integral, interpolate, rise_by_enthalpy, table_index, table_segment,
};
use crate::physics::thermocouple::{
    bead_response, covered_length, interface_temperature, parabola_excess, peak_excess,
};
use crate::physics::tridiagonal::{factorise, substitute};
use crate::plan::Plan;
use bytemuck::{Pod, Zeroable};

const SAMPLES: usize = 16_384;
/// Cells of the tridiagonal systems.
const CELLS: usize = 24;
/// Columns of the tables: eight properties and their rises.
const COLUMNS: usize = 16;

/// From inputs and tables to outputs.
type Twin<W> = fn(&[W], &[W], &mut [W]);

/// A probe: a WGSL body, its inputs, and its Rust twin.
struct Probe<W> {
    /// Statements over `x`, the inputs, that fill `y`, the outputs.
    body: &'static str,
    inputs: Vec<(f64, f64)>,
    outputs: usize,
    twin: Twin<W>,
}

/// A table of curved columns, so that rows and fractions both matter.
fn tables<W: Real<Scalar = W, Constant = W>>() -> Vec<W> {
    let curved = |i: usize| {
        let (node, column) = ((i / COLUMNS) as f64, (i % COLUMNS) as f64);
        (1.0 + column) * (0.01 + 1e-4 * node + 1e-6 * node * node).sqrt() + 0.1 * (0.1 * node).sin()
    };
    let mut words: Vec<f64> = (0..TABLE_STEPS * COLUMNS).map(curved).collect();
    // Half steps, the first half of which hold two rows: a row starts at every half and at 0.3 and 0.4.
    for bucket in 0..2 * TABLE_STEPS {
        let (step, is_first) = ((bucket / 2) as f64, bucket % 2 == 0);
        let starts = if is_first { [step + 0.3, step + 0.4] } else { [1e9, 1e9] };
        let row = (4 * (bucket / 2) + if is_first { 0 } else { 3 }) as f64;
        words.extend([row, 0.5 * bucket as f64, starts[0], starts[1]]);
    }
    // Rows of (conductivity, heat capacity, slope, enthalpy), (lower bound, start), with a rising heat capacity.
    let (mut enthalpy, starts) = (0.0, [0.0, 0.3, 0.4, 0.5, 1.0]);
    for row in 0..4 * TABLE_STEPS {
        let start = (row / 4) as f64 + starts[row % 4];
        let steps = starts[row % 4 + 1] - starts[row % 4];
        let [capacity, slope] = [700.0 + 0.5 * (row as f64) + if row % 7 == 0 { 4e4 } else { 0.0 }, 3.0];
        words.extend([0.1, 0.0, capacity, slope, 0.0, 0.0, enthalpy, 0.0, 600.0, 0.1, start, 0.0]);
        enthalpy += 5.0 * steps * (capacity + 0.5 * slope * steps);
    }
    // A list: the origin, then five starts that are no steps from it.
    words.extend([0.63, 1e9, 1e9, 1e9, 57.1, 60.9, 200.25, 300.5, 650.3, 1e9, 1e9, 1e9]);
    words.into_iter().map(W::scalar).collect()
}

/// The table of curved columns, with rows of `columns` columns from `offset` on.
const fn uniform(offset: u32, columns: u32) -> TableLocation<u32> {
    TableLocation {
        offset,
        columns,
        rows: TABLE_STEPS as u32,
        directory: 0,
        buckets_per_step: 1,
        last_bucket: TABLE_STEPS as u32 - 1,
        list_length: 0,
        conductivity_integral: 0,
        enthalpy_search_span: 0,
    }
}

/// The rows that a directory finds, as in [`tables`].
const UNEVEN: TableLocation<u32> = TableLocation {
    offset: (TABLE_STEPS * COLUMNS + 2 * TABLE_STEPS * 4) as u32,
    columns: 12,
    rows: 4 * TABLE_STEPS as u32,
    directory: (TABLE_STEPS * COLUMNS) as u32,
    buckets_per_step: 2,
    last_bucket: 2 * TABLE_STEPS as u32 - 1,
    list_length: 0,
    conductivity_integral: 0,
    enthalpy_search_span: 2048,
};

/// The rows that a list finds, as in [`tables`].
const LISTED: TableLocation<u32> = TableLocation {
    rows: TABLE_STEPS as u32 + 5,
    directory: (TABLE_STEPS * (COLUMNS + 2 * 4 + 4 * 12)) as u32,
    list_length: 6,
    ..uniform(0, 4)
};

/// A kernel that evaluates all probes.
fn text<W>(plan: &Plan, precision: Precision, texels: bool, probes: &[Probe<W>]) -> String {
    let inputs = probes.iter().map(|probe| probe.inputs.len()).sum::<usize>();
    let outputs = probes.iter().map(|probe| probe.outputs).sum::<usize>();
    let (mut from, mut to, mut bodies) = (0, 0, String::new());
    for Probe { body, inputs: own, outputs: results, .. } in probes {
        bodies += &format!(
            "{{ var x: array<real, {ins}>; var y: array<real, {results}>;
             for (var i = 0u; i < {ins}u; i++) {{ x[i] = inputs[id.x * {inputs}u + {from}u + i]; }}
             {body}
             for (var i = 0u; i < {results}u; i++) {{ outputs[id.x * {outputs}u + {to}u + i] = y[i]; }} }}\n",
            ins = own.len(),
        );
        from += own.len();
        to += results;
    }
    let entry = format!(
        "var<private> {mutant}: u32;
         @group(0) @binding(30) var<storage, read> ones: array<real>;
         @group(0) @binding(31) var<storage, read> inputs: array<real>;
         @group(0) @binding(32) var<storage, read_write> outputs: array<real>;
         @compute @workgroup_size(64) fn probe(@builtin(global_invocation_id) id: vec3<u32>) {{
             one = ones[0];
             {mutant} = u32(ones[1]);
             {bodies} }}",
        mutant = mutants::VARIABLE,
    );
    shader::kernel(plan, precision, texels, 1, ("probe", &entry))
}

/// A plan whose kernel has a conductivity in three parts, and directories of rows.
fn plan() -> Plan {
    let mut plan = Plan::new(&Case::load("cases/permeation".as_ref()).expect("shipped case"));
    plan.rows.conductivity_parts = 3;
    // For a kernel with look-ups in directories.
    plan.rows.tables[0].directory = 4;
    plan
}

/// All probes as one kernel, and the outputs of their twins.
struct Probed<W> {
    kernel: Kernel,
    device: Device,
    texels: wgpu::TextureView,
    buffers: Vec<(u32, wgpu::Buffer)>,
    expected: Vec<W>,
}

impl<W: Pod + Real<Scalar = W, Constant = W> + PartialEq> Probed<W> {
    fn new(device: &Device, precision: Precision, texels: bool, probes: &[Probe<W>]) -> Self {
        let mut uniform = Uniform::new(2026);
        let tables = tables::<W>();
        let (mut inputs, mut expected) = (vec![], vec![]);
        for _ in 0..SAMPLES {
            for probe in probes {
                let x: Vec<W> = probe.inputs.iter().map(|&(low, high)| W::scalar(uniform.between(low, high))).collect();
                let mut y = vec![W::scalar(0.0); probe.outputs];
                (probe.twin)(&x, &tables, &mut y);
                inputs.extend(x);
                expected.extend(y);
            }
        }
        let plan = plan();
        let kernel = device.kernel(text(&plan, precision, texels, probes)).expect("probes compile");
        // One of them holds the tables, the other is empty.
        let words: Vec<f32> = tables.iter().map(|&word| W::splat(word).lane(0) as f32).collect();
        let run = DispatchParameters {
            one: 1.0,
            threads_per_member: 1,
            cells: CELLS as u32,
            last_cell: CELLS as u32 - 1,
            ..DispatchParameters::zeroed()
        };
        let buffers = vec![
            (0, device.uniform("run", &[run]).expect("uniform buffer fits")),
            (6, device.upload("tables", if texels { &[] } else { &tables[..] })),
            (31, device.upload("inputs", &inputs)),
            (32, device.upload("outputs", &expected)),
        ];
        let texels = device.texels("texels", if texels { &words } else { &[] });
        Self { kernel, device: device.clone(), texels, buffers, expected }
    }

    /// Indices of outputs that differ from those of the twins in any bit.
    fn differing(&self, pipeline: &wgpu::ComputePipeline, mutant: u32) -> Vec<usize> {
        let ones =
            self.device.upload("ones", &[W::scalar(1.0), W::scalar(mutant.into()), W::scalar(0.0), W::scalar(0.0)]);
        let layout = spirv::compile(&self.kernel, "probe", true, None).expect("it has the entry point").bindings;
        let all = self.buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
        let others = [(7, wgpu::BindingResource::TextureView(&self.texels)), (30, ones.as_entire_binding())];
        let bound = all.chain(others).filter(|(binding, _)| layout.iter().any(|(known, _)| known == binding));
        let outputs = &self.buffers[3].1;
        let found: Vec<W> = self.device.run(pipeline, (SAMPLES / 64) as u32, bound, outputs).expect("the probes run");
        let differ = |(_, (a, b)): &(usize, (&W, &W))| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b);
        found.iter().zip(&self.expected).enumerate().filter(differ).map(|(place, _)| place).collect()
    }
}

fn put<W: Copy>(y: &mut [W], values: &[W]) {
    y.copy_from_slice(values);
}

fn pair<W: Real>(x: &[W], at: usize) -> DoubleWord<W> {
    DoubleWord::new(x[at], x[at + 1])
}

/// Functions of no member state, with inputs of the size met in a march.
fn probes<W: Real<Scalar = W, Constant = W>>() -> Vec<Probe<W>> {
    let (hot, cold) = ((300.0, 1800.0), (250.0, 2500.0));
    // Second words are zero in f64.
    let second = |end: f64| if W::MANTISSA_BITS > 23 { (0.0, 0.0) } else { (-end, end) };
    let low = second(1e-4);
    let (k, slope) = ((0.01, 0.6), (-1e5, 1e5));
    vec![
        Probe {
            body: "let p = two_sum(x[0], x[1]); y[0] = p.high; y[1] = p.low;",
            inputs: vec![hot, (-2.0, 2.0)],
            outputs: 2,
            twin: |x, _, y| {
                put(y, &two_sum(x[0], x[1]));
            },
        },
        Probe {
            body: "let p = add_compensated(DoubleWord(x[0], x[1]), x[2]); y[0] = p.high; y[1] = p.low;",
            inputs: vec![hot, low, (-2.0, 2.0)],
            outputs: 2,
            twin: |x, _, y| {
                let p = add_compensated(pair(x, 0), x[2]);
                put(y, &[p.high, p.low()]);
            },
        },
        Probe {
            body: "y[0] = difference(DoubleWord(x[0], x[1]), DoubleWord(x[2], x[3]));",
            inputs: vec![hot, low, hot, low],
            outputs: 1,
            twin: |x, _, y| put(y, &[difference(pair(x, 0), pair(x, 2))]),
        },
        Probe {
            body: "let narrow = TableLocation(4u, 8u, TABLE_STEPS, 0u, 1u, TABLE_STEPS - 1u, 0u, 0u, 0u);
                   let wide = TableLocation(0u, 16u, TABLE_STEPS, 0u, 1u, TABLE_STEPS - 1u, 0u, 0u, 0u);
                   let s = table_index(x[0], narrow); y[0] = real(s.row); y[1] = s.fraction;
                   y[2] = interpolate(table_segment(s, narrow), 1u);
                   y[3] = integral(table_segment(s, narrow), 1u);
                   y[4] = interpolate(column_offset(table_segment(s, wide), 4u), 3u);",
            inputs: vec![(-50.0, 4500.0)],
            outputs: 5,
            twin: |x, tables, y| {
                let (narrow, wide) = (uniform(4, 8), uniform(0, 16));
                let s = table_index(x[0], tables, &narrow);
                let row = table_segment(tables, s, &narrow);
                let offset = column_offset(table_segment(tables, s, &wide), 4);
                put(y, &[s.row, s.fraction, interpolate(row, 1), integral(row, 1), interpolate(offset, 3)]);
            },
        },
        Probe {
            body: "let s = table_index(x[0], TableLocation(0u, 4u, TABLE_STEPS + 5u, TABLE_STEPS * 72u, 1u,
                       TABLE_STEPS - 1u, 6u, 0u, 0u));
                   y[0] = real(s.row); y[1] = s.fraction;",
            inputs: vec![(-50.0, 4500.0)],
            outputs: 2,
            twin: |x, tables, y| {
                let s = table_index(x[0], tables, &LISTED);
                put(y, &[s.row, s.fraction]);
            },
        },
        Probe {
            body: "let uneven = TableLocation(TABLE_STEPS * 24u, 12u, 4u * TABLE_STEPS, TABLE_STEPS * 16u, 2u,
                       2u * TABLE_STEPS - 1u, 0u, 0u, 2048u);
                   let s = table_index(x[0], uneven); y[0] = real(s.row); y[1] = s.fraction;
                   y[2] = integral(table_segment(s, uneven), 1u);
                   let states = TabulatedStates(1u, 4u, virgin());
                   let far = rise_by_enthalpy(x[0], x[1], 0.0, uneven, states); y[3] = far[0]; y[4] = far[1];
                   y[5] = rise_by_enthalpy(x[0], 1e-3 * x[1], 1.0, uneven, states)[0];",
            inputs: vec![(-50.0, 4500.0), (-400.0, 400.0)],
            outputs: 6,
            twin: |x, tables, y| {
                let s = table_index(x[0], tables, &UNEVEN);
                let rise = |predicted_k, reduced| {
                    let weights = [W::from_f64(1.0), W::from_f64(0.0), W::from_f64(0.0), W::from_f64(0.0)];
                    let states = TabulatedStates { count: 1, properties: 4, weights };
                    rise_by_enthalpy(x[0], predicted_k, W::from_f64(reduced), tables, &UNEVEN, &states)
                };
                let stored = integral(table_segment(tables, s, &UNEVEN), 1);
                let [near, _] = rise(W::from_f64(1e-3) * x[1], 1.0);
                let [far, least] = rise(x[1], 0.0);
                put(y, &[s.row, s.fraction, stored, far, least, near]);
            },
        },
        Probe {
            body: "let wide = TableLocation(0u, 16u, TABLE_STEPS, 0u, 1u, TABLE_STEPS - 1u, 0u, 0u, 0u);
                   let row = table_segment(table_index(x[0], wide), wide);
                   let r = first_integral(row, column_offset(row, 4u));
                   y[0] = r[0]; y[1] = r[1]; y[2] = r[2];",
            inputs: vec![cold],
            outputs: 3,
            twin: |x, tables, y| {
                let wide = uniform(0, 16);
                let row = table_segment(tables, table_index(x[0], tables, &wide), &wide);
                put(y, &first_integral(row, column_offset(row, 4)));
            },
        },
        Probe {
            body: "let wide = TableLocation(0u, 16u, TABLE_STEPS, 0u, 1u, TABLE_STEPS - 1u, 0u, 0u, 0u);
                   let here = solid_properties(table_segment(table_index(x[0], wide), wide), 3u,
                       ConductivityParts(x[1], x[2], x[3]), true);
                   y[0] = here.conductivity; y[1] = here.heat_capacity; y[2] = here.slope;",
            inputs: vec![cold, (0.5, 1.5), (0.5, 1.5), (0.5, 1.5)],
            outputs: 3,
            twin: |x, tables, y| {
                let scale = ConductivityParts { solid: x[1], gas: x[2], radiative: x[3] };
                let wide = uniform(0, 16);
                let row = table_segment(tables, table_index(x[0], tables, &wide), &wide);
                let here = solid_properties(row, 3, scale, true);
                put(y, &[here.conductivity, here.heat_capacity, here.slope]);
            },
        },
        Probe {
            body: "y[0] = conductance_within(x[0], x[1], x[2]);
                   y[1] = conductance_across(x[0], x[3], x[1], x[4], x[5]);",
            inputs: vec![k, k, (5e3, 5e4), (1e-5, 1e-4), (1e-5, 1e-4), (0.0, 0.01)],
            outputs: 2,
            twin: |x, _, y| {
                put(y, &[conductance_within(x[0], x[1], x[2]), conductance_across(x[0], x[3], x[1], x[4], x[5])]);
            },
        },
        Probe {
            body: "y[0] = conductance_slope_across(x[0], x[1], x[2]);
                   let by = flux_slopes(x[0], array<real, 2>(x[3], x[4])); y[1] = by[0]; y[2] = by[1];",
            inputs: vec![(1.0, 1e3), k, (1e-5, 1e-4), (-500.0, 500.0), (-500.0, 500.0)],
            outputs: 3,
            twin: |x, _, y| {
                let [by_node, by_next] = flux_slopes(x[0], [x[3], x[4]]);
                put(y, &[conductance_slope_across(x[0], x[1], x[2]), by_node, by_next]);
            },
        },
        Probe {
            body: "let q = surface_flux(
                       BoundaryForcing(x[0], x[16], x[5], x[15], x[1], x[3], x[2], x[4], 0.0, 0.0, 0.0),
                       FaceScale(x[6], x[7], x[8], x[9]), x[10], x[11], x[12], x[13], x[14]);
                   y[0] = q.flux; y[1] = q.slope;",
            inputs: vec![
                (0.0, 3e5),
                (0.0, 5e4),
                hot,
                (0.0, 100.0),
                (290.0, 310.0),
                (0.0, 2e-7),
                (0.5, 1.5),
                (0.5, 1.5),
                (0.5, 1.5),
                (0.5, 1.5),
                cold,
                (0.3, 0.9),
                (0.0, 2e6),
                (900.0, 1300.0),
                (-0.02, 0.05),
                (0.5, 1.5),
                (0.5, 1.5),
            ],
            outputs: 2,
            twin: |x, _, y| {
                let drive = BoundaryForcing {
                    convection: x[0],
                    recovery: x[16],
                    hot_wall: x[5],
                    blowing: x[15],
                    radiant_w_m2: x[1],
                    film_w_m2_k: x[3],
                    gas_k: x[2],
                    surroundings_k: x[4],
                    pressure_pa: W::scalar(0.0),
                    held_k: W::scalar(0.0),
                    holder_k: W::scalar(0.0),
                };
                let scale = FaceScale { heating: x[6], film: x[7], exchange: x[8], emissivity: x[9] };
                let q = surface_flux(drive, scale, x[10], x[11], x[12], x[13], x[14]);
                put(y, &[q.flux, q.slope]);
            },
        },
        Probe {
            body: "y[0] = exponential(x[0]); y[1] = logarithm(x[1]); y[2] = power(x[1], x[2]); y[3] = mean_decay(x[3]);
                   y[4] = consumed_share(x[4], x[3], 1.0); y[5] = consumed_share(x[4], x[3], 2.0);
                   y[6] = consumed_share(x[4], x[3], 3.0); y[7] = consumed_share(x[4], x[3], x[7]);
                   y[8] = arrhenius_rate(Reaction(x[9], x[5], 1.0, 500.0, 80.0, 0.1, 1.0, 0.0, 0.0), x[6], 1.1, x[8]);
                   y[9] = decay(x[3]);",
            inputs: vec![
                (-90.0, 90.0),
                (1e-3, 1e3),
                (-2.0, 2.0),
                (0.0, 3.0),
                (0.0, 1.0),
                (5e3, 3e4),
                hot,
                (0.3, 0.9),
                (5.0, 50.0),
                (-20.0, 100.0),
            ],
            outputs: 10,
            twin: |x, _, y| {
                let of = |value: f64| W::scalar(value);
                let reaction = Reaction {
                    log_rate_1_s: x[9],
                    activation_k: x[5],
                    order: of(1.0),
                    onset_k: of(500.0),
                    idle: of(80.0),
                    loss: of(0.1),
                    share: of(1.0),
                    heat_j_kg: of(0.0),
                    chained: of(0.0),
                };
                let gone = |order: f64| consumed_share(x[4], x[3], of(order));
                put(
                    y,
                    &[
                        exponential(x[0]),
                        logarithm(x[1]),
                        power(x[1], x[2]),
                        mean_decay(x[3]),
                        gone(1.0),
                        gone(2.0),
                        gone(3.0),
                        consumed_share(x[4], x[3], x[7]),
                        arrhenius_rate(reaction, x[6], of(1.1), x[8]),
                        decay(x[3]),
                    ],
                );
            },
        },
        Probe {
            body: "y[0] = lateral_heat_flux(x[0], x[1], DoubleWord(x[2], x[3]));",
            inputs: vec![(0.0, 50.0), (280.0, 310.0), hot, low],
            outputs: 1,
            twin: |x, _, y| put(y, &[lateral_heat_flux(x[0], x[1], pair(x, 2))]),
        },
        Probe {
            body: "let r = interface_temperature(DoubleWord(x[0], x[1]), DoubleWord(x[2], x[3]), x[4], x[5], x[6],
                       Sensor(x[7], x[8], x[9], x[10], 0.0, 0.0)); y[0] = r.high; y[1] = r.low;",
            inputs: vec![hot, low, hot, low, k, k, (100.0, 1000.0), (0.0, 1.0), (0.0, 1.0), (1e-5, 1e-4), (1e-5, 1e-4)],
            outputs: 2,
            twin: |x, _, y| {
                let none = W::scalar(0.0);
                let sensor =
                    Sensor { above: x[7], below: x[8], above_m: x[9], below_m: x[10], depth_m: none, start_k: none };
                let r = interface_temperature(pair(x, 0), pair(x, 2), x[4], x[5], x[6], sensor);
                put(y, &[r.high, r.low()]);
            },
        },
        Probe {
            body: "y[0] = peak_excess(array<real, 3>(x[0], x[1], x[2]), array<real, 3>(x[3], x[4], x[5]));",
            inputs: vec![slope, slope, slope, (1e-4, 1e-3), (1e-4, 1e-3), (1e-4, 1e-3)],
            outputs: 1,
            twin: |x, _, y| put(y, &[peak_excess([x[0], x[1], x[2]], [x[3], x[4], x[5]])]),
        },
        Probe {
            body: "y[0] = parabola_excess(x[0], x[1], x[2]);",
            inputs: vec![slope, slope, (1e-4, 1e-3)],
            outputs: 1,
            twin: |x, _, y| put(y, &[parabola_excess(x[0], x[1], x[2])]),
        },
        Probe {
            body: "y[0] = covered_length(x[0], x[1], x[2], false); y[1] = covered_length(x[0], x[1], x[2], true);",
            inputs: vec![(1e-5, 1e-3), (0.0, 1e-5), (1e-4, 1e-3)],
            outputs: 2,
            twin: |x, _, y| put(y, &[covered_length(x[0], x[1], x[2], false), covered_length(x[0], x[1], x[2], true)]),
        },
        Probe {
            body: "let b = bead_response(DoubleWord(x[0], x[1]), DoubleWord(x[2], x[3]), DoubleWord(x[4], x[5]),
                       Bead(x[6], x[7]));
                   y[0] = b.high; y[1] = b.low;",
            inputs: vec![hot, low, hot, second(100.0), hot, second(100.0), (0.0, 1.0), (0.0, 1.0)],
            outputs: 2,
            twin: |x, _, y| {
                let b = bead_response(pair(x, 0), pair(x, 2), pair(x, 4), Bead { start: x[6], end: x[7] });
                put(y, &[b.high, b.low()]);
            },
        },
        Probe {
            body: "for (var i = 0u; i < run.cells; i++) {
                       pressure_lower[i] = -x[i % 5u]; pressure_upper[i] = -x[(i + 1u) % 5u];
                       pressure_diagonal[i] = x[i % 5u] + x[(i + 1u) % 5u] + x[5];
                       pressure_unknowns[i] = x[(i + 3u) % 5u]; }
                   factorise();
                   substitute();
                   y[0] = pressure_unknowns[0]; y[1] = pressure_unknowns[run.cells / 2u];
                   y[2] = pressure_unknowns[run.cells - 1u];",
            inputs: vec![(1.0, 500.0), (1.0, 500.0), (1.0, 500.0), (1.0, 500.0), (1.0, 500.0), (0.1, 1000.0)],
            outputs: 3,
            twin: |x, _, y| {
                let mut lower: Vec<W> = (0..CELLS).map(|i| -x[i % 5]).collect();
                let mut upper: Vec<W> = (0..CELLS).map(|i| -x[(i + 1) % 5]).collect();
                let mut diagonal: Vec<W> = (0..CELLS).map(|i| x[i % 5] + x[(i + 1) % 5] + x[5]).collect();
                let mut side: Vec<W> = (0..CELLS).map(|i| x[(i + 3) % 5]).collect();
                factorise(&mut lower, &mut diagonal, &mut upper);
                substitute(&lower, &diagonal, &upper, &mut side);
                put(y, &[side[0], side[CELLS / 2], side[CELLS - 1]]);
            },
        },
    ]
}

/// The probe of an output's index in a sample.
fn body<W>(probes: &[Probe<W>], output: usize) -> &'static str {
    let mut end = 0;
    let of = |probe: &&Probe<W>| {
        end += probe.outputs;
        output < end
    };
    probes.iter().find(of).expect("output belongs to a probe").body
}

/// The probes whose outputs differ from those of their twins, with the number of differences.
fn wrong<W>(device: &Device, precision: Precision, texels: bool, probes: &[Probe<W>]) -> Vec<(&'static str, usize)>
where
    W: Pod + Real<Scalar = W, Constant = W> + PartialEq,
{
    let probed = Probed::new(device, precision, texels, probes);
    let pipeline = device.pipeline(&probed.kernel, "probe").expect("the driver compiles it");
    let each = probed.expected.len() / SAMPLES;
    let mut wrong: Vec<(&str, usize)> = vec![];
    for place in probed.differing(&pipeline, 0) {
        let body = body(probes, place % each);
        match wrong.iter_mut().find(|(known, _)| *known == body) {
            Some((_, times)) => *times += 1,
            None => wrong.push((body, 1)),
        }
    }
    wrong
}

/// The probes as targets of mutants.
pub(super) fn targets(device: &Device) -> Vec<Target> {
    fn target<W>(device: &Device, precision: Precision, texels: bool) -> Target
    where
        W: Pod + Real<Scalar = W, Constant = W> + PartialEq,
    {
        let probed = Probed::<W>::new(device, precision, texels, &probes());
        let kernel = Kernel::parse(probed.kernel.source.clone()).expect("it is sound");
        Target {
            name: format!("probes in {precision:?}, tables in texels: {texels}"),
            entry: "probe",
            kernel,
            agrees: Box::new(move |pipeline, mutant| probed.differing(pipeline, mutant).is_empty()),
        }
    }
    vec![
        target::<f32>(device, Precision::F32, false),
        target::<f32>(device, Precision::F32, true),
        target::<f64>(device, Precision::F64, false),
    ]
}

#[test]
fn every_probe_on_the_gpu_is_bit_identical_to_its_twin() {
    let device = device(true);
    for texels in [false, true] {
        assert_eq!(wrong::<f32>(&device, Precision::F32, texels, &probes()), [], "in f32, tables in texels: {texels}");
    }
    assert_eq!(wrong::<f64>(&device, Precision::F64, false, &probes()), [], "in f64");
}
