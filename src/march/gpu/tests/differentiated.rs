//! Differentiated kernels: each rule of differentiation against dual numbers on the processor, bit for bit.

use super::{Uniform, device, every_call};
use crate::case::Bounds;
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::cpu::Cpu;
use crate::march::gpu::Gpu;
use crate::march::gpu::device::Device;
use crate::march::gpu::shader;
use crate::march::gpu::spirv::Kernel;
use crate::march::{March, Precision};
use crate::physics::Real;
use crate::physics::compensated::{add_compensated, difference};
use crate::physics::double_word::DoubleWord;
use crate::physics::dual::Dual;
use crate::physics::exponential::{decay, exponential, logarithm, power};
use crate::physics::lanes::{F32Lanes, F64Lanes};
use crate::physics::tridiagonal::flush_tiny;
use crate::plan::Plan;
use bytemuck::Pod;
use simdeez::engines::scalar::Scalar;

/// A value and its tangent in one direction.
type Single = Dual<f32, F32Lanes<Scalar>>;
type Double = Dual<f64, F64Lanes<Scalar>>;

const SAMPLES: usize = 1024;
/// Inputs of a kernel, each with its tangent.
const INPUTS: usize = 4;

/// An expression of `x` in WGSL, and the same on dual numbers.
type Rule<R> = (&'static str, fn(&[R]) -> R);

fn rules<R: Real>() -> Vec<Rule<R>> {
    vec![
        ("x[0] * x[1] - 2.0 * x[0]", |x| x[0] * x[1] - R::from_f64(2.0) * x[0]),
        ("x[0] / x[1]", |x| x[0] / x[1]),
        ("3.0 / x[1] + x[0] / 7.0", |x| R::from_f64(3.0) / x[1] + x[0] / R::from_f64(7.0)),
        ("sqrt(x[0]) + -x[1]", |x| x[0].sqrt() + -x[1]),
        ("max(x[0], x[1])", |x| x[0].max(x[1])),
        ("min(x[0], x[1])", |x| x[0].min(x[1])),
        ("min(x[0], 1.5) + max(1.5, x[1])", |x| x[0].min(R::from_f64(1.5)) + R::from_f64(1.5).max(x[1])),
        ("clamp(x[0], 1.0, 2.0)", |x| x[0].max(R::from_f64(1.0)).min(R::from_f64(2.0))),
        ("select(x[0] * x[1], x[2], x[0] > x[1])", |x| if x[0].lane(0) > x[1].lane(0) { x[2] } else { x[0] * x[1] }),
        ("real(u32(x[0])) * x[1]", |x| x[1] * x[0].floor_clamped(9)),
        ("ge_mask(x[0], x[1]) * x[2]", |x| x[0].ge_mask(x[1]) * x[2]),
        ("flush_tiny(x[0] * real(1e-26)) + flush_tiny(x[1])", |x| {
            flush_tiny(x[0] * R::from_f64(1e-26)) + flush_tiny(x[1])
        }),
        ("exponential(x[0] - x[1])", |x| exponential(x[0] - x[1])),
        ("decay(x[0])", |x| decay(x[0])),
        ("logarithm(x[0])", |x| logarithm(x[0])),
        ("power(x[0], x[1])", |x| power(x[0], x[1])),
        ("to_power(x[0], u32(x[2]))", |x| (0..x[2].lane(0) as u32).fold(R::from_f64(1.0), |power, _| power * x[0])),
        ("hold(&held, 1u, x[0]) * held[1].high + hold(&held, 2u, x[1])", |x| {
            (x[0] * x[0] + x[0]) * x[0] + R::from_f64(1.0)
        }),
        ("difference(DoubleWord(x[0], x[1]), DoubleWord(x[2], x[3]))", |x| {
            difference(DoubleWord::new(x[0], x[1]), DoubleWord::new(x[2], x[3]))
        }),
        // The second word is zero in f64.
        ("add_compensated(DoubleWord(x[0], select(real(1e-6) * x[1], 0.0, MANTISSA_BITS > 23u)), x[2]).low", |x| {
            add_compensated(DoubleWord::new(x[0], R::from_f64(1e-6) * x[1]), x[2]).low()
        }),
        ("turned(vec2<real>(x[0], x[1])).y", |x| x[0] * R::from_f64(2.0) + x[1]),
    ]
}

/// Functions called by the rules: a loop, a struct in a private array behind a pointer, an early return, a vector.
const CALLED: &str = "
struct Held { high: real, count: u32, low: real }
var<private> held: array<Held, 3>;
fn hold(into: ptr<private, array<Held, 3>>, i: u32, value: real) -> real {
    if i == 2u { return 1.0; }
    (*into)[i] = Held(value, i, value * value);
    return (*into)[i].low + value;
}
fn to_power(x: real, times: u32) -> real {
    var power = real(1.0);
    for (var i = 0u; i < times; i++) { power = power * x; }
    return power;
}
fn turned(two: vec2<real>) -> vec2<real> { return two.yx * 2.0 + two; }
";

fn text(precision: Precision, expressions: &[&str]) -> String {
    let parts = ["prelude", "compensated", "exponential", "tridiagonal"];
    let parts = shader::SOURCES.iter().filter(|(name, _)| parts.contains(name)).map(|(_, part)| *part);
    let places = expressions.iter().zip(0..).map(|(expression, place)| format!("y[{place}] = {expression};\n"));
    format!(
        "{}const CELLS = 2u;\n{}{CALLED}
         @group(0) @binding(0) var<storage, read> ones: array<real>;
         @group(0) @binding(1) var<storage, read> inputs: array<real>;
         @group(0) @binding(2) var<storage, read_write> outputs: array<real>;
         @compute @workgroup_size(64) fn probe(@builtin(global_invocation_id) id: vec3<u32>) {{
             one = ones[0];
             var x: array<real, {INPUTS}>;
             for (var i = 0u; i < {INPUTS}u; i++) {{ x[i] = inputs[id.x * {INPUTS}u + i]; }}
             var y: array<real, {outs}>;
             {}
             for (var i = 0u; i < {outs}u; i++) {{ outputs[id.x * {outs}u + i] = y[i]; }}
         }}",
        shader::preamble(precision),
        parts.collect::<String>(),
        places.collect::<String>(),
        outs = expressions.len(),
    )
}

fn sound(precision: Precision, expressions: &[&str]) -> Kernel {
    Kernel::parse(text(precision, expressions)).expect("the text is sound")
}

fn kernel(precision: Precision, expressions: &[&str]) -> Result<Kernel, String> {
    sound(precision, expressions).differentiated("inputs")
}

/// The rules whose tangents differ from those of dual numbers, with the number of differences.
fn wrong<W, R>(device: &Device, precision: Precision, rules: &[Rule<R>]) -> Vec<(&'static str, usize)>
where
    W: Pod + Real<Scalar = W> + PartialEq,
    R: Real<Scalar = W>,
{
    let expressions: Vec<&str> = rules.iter().map(|(expression, _)| *expression).collect();
    let kernel = kernel(precision, &expressions).expect("each operation has a rule");
    let mut uniform = Uniform::new(2026);
    let mut drawn = |low, high| (0..SAMPLES * INPUTS).map(|_| uniform.between(low, high)).collect::<Vec<f64>>();
    let (mut values, changes) = (drawn(0.5, 4.0), drawn(-1.0, 1.0));
    // Equal values, and values equal to constants of the rules: minima and maxima take the mean of both tangents.
    values.chunks_exact_mut(8 * INPUTS).zip([1.0, 1.5, 2.0].iter().cycle()).for_each(|(inputs, &constant)| {
        inputs[1] = inputs[0];
        inputs[INPUTS] = constant;
        inputs[2 * INPUTS + 1] = constant;
    });
    let words = |numbers: &[f64]| numbers.iter().map(|&number| W::scalar(number)).collect::<Vec<W>>();
    let none = vec![W::scalar(0.0); SAMPLES * rules.len()];
    let buffers = [
        device.upload("ones", &[W::scalar(1.0); 4]),
        device.upload("inputs", &words(&values)),
        device.upload("outputs", &none),
        device.upload("changes of inputs", &words(&changes)),
        device.upload("changes of outputs", &none),
    ];
    let bound = (0..).zip(buffers.iter().map(wgpu::Buffer::as_entire_binding));
    let groups = (SAMPLES / 64) as u32;
    let found: Vec<W> = device.probe(&kernel, "probe", groups, bound, &buffers[4]).expect("the probe runs");
    let mut wrong: Vec<(&str, usize)> = expressions.iter().map(|expression| (*expression, 0)).collect();
    let points = values.chunks_exact(INPUTS).zip(changes.chunks_exact(INPUTS));
    for ((values, changes), found) in points.zip(found.chunks_exact(rules.len())) {
        let x: Vec<R> = values
            .iter()
            .zip(changes)
            .map(|(&value, &change)| R::from_lanes(|lane| if lane == 0 { value } else { change }))
            .collect();
        for (place, (_, rule)) in rules.iter().enumerate() {
            wrong[place].1 += usize::from(rule(&x).lane(1) != found[place].lane(0));
        }
    }
    wrong.retain(|(_, times)| *times > 0);
    wrong
}

#[test]
fn every_rule_on_the_gpu_is_bit_identical_to_dual_numbers() {
    let device = device(false);
    assert_eq!(wrong::<f32, Single>(&device, Precision::F32, &rules()), [], "in f32");
    assert_eq!(wrong::<f64, Double>(&device, Precision::F64, &rules()), [], "in f64");
}

#[test]
fn a_wrong_rule_is_caught() {
    let wrong_rules: [Rule<Double>; 3] = [
        ("x[0] * x[1]", |x| x[0] * x[0]),
        ("ge_mask(x[0], x[1])", |x| x[0]),
        // For equal values, the tangent of the second only.
        ("max(x[0], x[1])", |x| if x[0].lane(0) > x[1].lane(0) { x[0] } else { x[1] }),
    ];
    assert_eq!(wrong::<f64, Double>(&device(true), Precision::F64, &wrong_rules).len(), 3);
}

#[test]
fn an_operation_without_a_rule_is_refused_by_its_name() {
    for (expression, named) in [("exp(x[0])", "Exp"), ("x[0] % x[1]", "Modulo"), ("x[0] + abs(x[1])", "Abs")] {
        let refused = kernel(Precision::F32, &[expression]).err().expect("the operation has no rule");
        assert!(refused.contains(named) && refused.contains("probe"), "{refused}");
    }
    let unknown = sound(Precision::F32, &["x[0]"]).differentiated("exits").err();
    assert!(unknown.is_some_and(|refused| refused.contains("exits")));
}

#[test]
fn variables_independent_of_the_input_have_no_tangent() {
    let kernel = kernel(Precision::F32, &["hold(&held, 1u, x[0])"]).expect("each operation has a rule");
    let names = kernel.module.global_variables.iter().filter_map(|(_, variable)| variable.name.as_deref());
    let changes: Vec<&str> = names.filter(|name| name.ends_with("_change")).collect();
    assert_eq!(changes, ["held_change", "inputs_change", "outputs_change", "hold_change"]);
}

#[test]
fn tangents_are_bound_in_the_order_of_their_buffers() {
    let text = "
        fn keep_first() { outputs[1] = 1.0; }
        @group(0) @binding(4) var<storage, read_write> outputs: array<f32>;
        @group(0) @binding(2) var<storage, read> inputs: array<f32>;
        @compute @workgroup_size(1) fn probe() { keep_first(); outputs[0] = inputs[0]; }";
    let sound = Kernel::parse(text.to_owned()).expect("the text is sound");
    let kernel = sound.differentiated("inputs").expect("each operation has a rule");
    let bound = kernel.module.global_variables.iter().filter_map(|(_, variable)| {
        Some((variable.name.clone().filter(|name| name.ends_with("_change"))?, variable.binding?.binding))
    });
    let expected = [("inputs_change", 5), ("outputs_change", 6)].map(|(name, binding)| (name.to_owned(), binding));
    assert_eq!(bound.collect::<Vec<_>>(), expected);
    let first = sound.module.global_variables.iter().next().and_then(|(_, variable)| variable.name.as_deref());
    assert_eq!(first, Some("outputs"), "naga lists variables in order of use");
}

/// Batches of three invocations: the two directions of a point may lie in two of them.
#[test]
fn the_directions_of_a_point_in_several_batches_keep_their_order() {
    const POINTS: usize = 5;
    let case = every_call::case();
    let (plan, sampling) = (Plan::new(&case), Sampling { kind: SamplingKind::Uniform, seed: 1 });
    let points = Ensemble::sample(case.factors(), Bounds::Small, &sampling, POINTS);
    let mut gpu = Gpu::untested(device(false), Precision::F32, 3);
    for factors in [&[0, 1][..], &[]] {
        let marches: [&mut dyn March; 2] = [&mut gpu, &mut Cpu::new(Precision::F32)];
        let [found, expected] = marches.map(|march| march.tangents(&plan, &points, factors));
        let found = found.expect("the device marches").expect("devices have derivatives");
        let expected = expected.expect("the processor marches").expect("it has derivatives");
        assert_eq!(found.members(), POINTS * (1 + factors.len()));
        assert_eq!(found.temperatures_k, expected.temperatures_k, "directions {factors:?}");
        assert_eq!(found.statuses, expected.statuses);
        assert!((1..found.members()).all(|member| found.member(member) != found.member(member - 1)), "all are alike");
    }
}
