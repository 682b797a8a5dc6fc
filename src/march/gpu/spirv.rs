//! Compilation of a kernel's source to SPIR-V, without initialising its columns.
//!
//! WGSL initialises every private variable, and drivers unroll this element by element: with 320 cells a software
//! device compiled for three minutes, without initialisers for seconds. wgpu has no option for it, so kernels that
//! [clear](super::shader::MARCH) their columns themselves are compiled here and passed through to the driver. Every
//! operation is decorated `NoContraction`: otherwise drivers fuse, reorder and move constants, each differently, and no
//! two marches are bit-identical.

use super::correct_rounding::{FMA, Residual, with_correct_rounding};
use super::differentiate::differentiate;
use super::spirv_words::{HEADER_WORDS, instructions, push};
use super::unused_code::remove_unused;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Module};
use std::collections::HashMap;

/// Longest array that is initialised: columns over the cells are longer, other arrays shorter.
pub const MAX_INITIALISED_LENGTH: u32 = 32;

/// A kernel as parsed and validated by naga.
pub struct Kernel {
    pub(super) source: String,
    pub module: Module,
    pub(super) info: ModuleInfo,
}

impl Kernel {
    /// Parse and validate a source.
    ///
    /// # Errors
    /// When the source does not compile, with the compiler's excerpt.
    #[cfg(test)]
    pub fn parse(text: String) -> Result<Self, String> {
        let module = parsed(&text)?;
        Self::validate(text, module)
    }

    /// Parse and validate the part of a source that its entry points use.
    ///
    /// # Errors
    /// When the source does not compile, with the compiler's excerpt.
    pub fn parse_used(text: String) -> Result<Self, String> {
        let mut module = parsed(&text)?;
        remove_unused(&mut module);
        Self::validate(text, module)
    }

    /// The kernel that also computes the directional derivative (forward mode) of everything it stores, with the seeds
    /// in a copy of the buffer `by`. Every active buffer, `by` among them, gets a buffer of the same shape for its
    /// derivative; these are bound after all others, in the same order.
    ///
    /// # Errors
    /// When there is no such buffer, or an active operation has no differentiation rule.
    pub fn differentiated(&self, by: &str) -> Result<Self, String> {
        Self::validate(self.source.clone(), differentiate(&self.module, &self.info, by)?)
    }

    /// Bytes of the private variables of a thread.
    pub fn private_bytes(&self) -> u32 {
        let owned = self.module.global_variables.iter().filter(|(_, known)| known.space == AddressSpace::Private);
        owned.map(|(_, variable)| self.module.types[variable.ty].inner.size(self.module.to_ctx())).sum()
    }

    /// Bytes of the workgroup variables, each rounded up to 16 as WebGPU counts them
    /// (`maxComputeWorkgroupStorageSize`).
    pub fn workgroup_bytes(&self) -> u32 {
        let shared = self.module.global_variables.iter().filter(|(_, known)| known.space == AddressSpace::WorkGroup);
        let bytes = |known: &naga::GlobalVariable| self.module.types[known.ty].inner.size(self.module.to_ctx());
        shared.map(|(_, variable)| bytes(variable).next_multiple_of(16)).sum()
    }

    pub(super) fn validate(text: String, module: Module) -> Result<Self, String> {
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::FLOAT64);
        let info = validator.validate(&module).map_err(|error| error.emit_to_string(&text))?;
        Ok(Self { source: text, module, info })
    }
}

fn parsed(text: &str) -> Result<Module, String> {
    naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))
}

/// SPIR-V words of a kernel, and its bindings: numbered as in the source; in the words, by position in this list.
pub struct Compiled {
    pub words: Vec<u32>,
    pub bindings: Vec<(u32, wgpu::BindingType)>,
}

#[cfg(test)]
impl Compiled {
    /// Each quotient replaced by the product with a reciprocal, which is rounded twice.
    pub(super) fn with_reciprocals(self) -> Self {
        const TYPE_FLOAT: u32 = 22;
        const CONSTANT: u32 = 43;
        const MULTIPLY: u32 = 133;
        const DIVIDE: u32 = 136;
        let mut next = self.words[3];
        let mut ones = HashMap::new();
        let mut words = self.words[..HEADER_WORDS].to_vec();
        for (code, operands) in instructions(&self.words) {
            match (code, operands) {
                (TYPE_FLOAT, &[ty, width, ..]) => {
                    push(&mut words, code, operands);
                    ones.insert(ty, next);
                    let long = [ty, next, 0, (1.0_f64.to_bits() >> 32) as u32];
                    let short = [ty, next, 1.0_f32.to_bits()];
                    push(&mut words, CONSTANT, if width == 64 { &long } else { &short });
                }
                (DIVIDE, &[ty, result, numerator, divisor]) => {
                    push(&mut words, DIVIDE, &[ty, next, ones[&ty], divisor]);
                    push(&mut words, MULTIPLY, &[ty, result, numerator, next]);
                }
                _ => {
                    push(&mut words, code, operands);
                    continue;
                }
            }
            next += 1;
        }
        words[3] = next;
        Self { words, ..self }
    }
}

/// Compile the entry point `entry` of a kernel. `checks` adds bounds checks, bounded loops and initialised memory;
/// `residual` corrects quotients and roots.
///
/// # Errors
/// When there is no such entry point, or naga cannot write it.
pub fn compile(kernel: &Kernel, entry: &str, checks: bool, residual: Option<Residual>) -> Result<Compiled, String> {
    let Kernel { module, info, .. } = kernel;
    let named = |point: &naga::EntryPoint| point.name == entry;
    let place = module.entry_points.iter().position(named).ok_or_else(|| format!("no entry point {entry:?}"))?;
    let mut bound: Vec<_> = module
        .global_variables
        .iter()
        .filter(|(variable, _)| !info.get_entry_point(place)[*variable].is_empty())
        .filter_map(|(_, variable)| Some((variable.binding?, binding(variable.space)?)))
        .collect();
    bound.sort_by_key(|(binding, _)| binding.binding);
    // The driver's layout numbers bindings consecutively, in their order.
    let at =
        |(binding, place)| (binding, spv::BindingInfo { descriptor_set: 0, binding: place, binding_array_size: None });
    let policy = if checks { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked };
    let options = spv::Options {
        flags: spv::WriterFlags::empty(),
        binding_map: bound.iter().map(|(binding, _)| *binding).zip(0..).map(at).collect(),
        bounds_check_policies: BoundsCheckPolicies {
            index: policy,
            buffer: policy,
            image_load: policy,
            binding_array: policy,
        },
        force_loop_bounding: checks,
        zero_initialize_workgroup_memory: if checks {
            spv::ZeroInitializeWorkgroupMemoryMode::Polyfill
        } else {
            spv::ZeroInitializeWorkgroupMemoryMode::None
        },
        ..spv::Options::default()
    };
    let pipeline = spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: entry.to_owned() };
    let words = spv::write_vec(module, info, &options, Some(&pipeline)).map_err(|error| error.to_string())?;
    let bindings = bound.into_iter().map(|(binding, kind)| (binding.binding, kind)).collect();
    let words = if checks { words } else { without_initialisers(&words) };
    let words = match residual {
        Some(residual) => with_correct_rounding(&words, residual)?,
        None => words,
    };
    let words = without_contraction(&words);
    Ok(Compiled { words, bindings })
}

fn binding(space: AddressSpace) -> Option<wgpu::BindingType> {
    let ty = match space {
        AddressSpace::Uniform => wgpu::BufferBindingType::Uniform,
        AddressSpace::Storage { access } => {
            let read_only = !access.contains(naga::StorageAccess::STORE);
            wgpu::BufferBindingType::Storage { read_only }
        }
        // Textures: a kernel has only one kind.
        AddressSpace::Handle => return Some(TEXEL_BINDING),
        _ => return None,
    };
    Some(wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None })
}

/// A read-only storage texture of four f32 a texel.
const TEXEL_BINDING: wgpu::BindingType = wgpu::BindingType::StorageTexture {
    access: wgpu::StorageTextureAccess::ReadOnly,
    format: wgpu::TextureFormat::Rgba32Float,
    view_dimension: wgpu::TextureViewDimension::D2,
};

/// Removes the initialisers of private arrays of more than [`MAX_INITIALISED_LENGTH`] elements; types precede the
/// variables that use them.
fn without_initialisers(words: &[u32]) -> Vec<u32> {
    const CONSTANT: u32 = 43;
    const TYPE_ARRAY: u32 = 28;
    const TYPE_POINTER: u32 = 32;
    const VARIABLE: u32 = 59;
    const PRIVATE: u32 = 6;
    let (mut lengths, mut long, mut written) = (HashMap::new(), HashMap::new(), words[..HEADER_WORDS].to_vec());
    for (code, operands) in instructions(words) {
        match (code, operands) {
            (CONSTANT, &[_, id, value]) => {
                lengths.insert(id, value);
            }
            (TYPE_ARRAY, &[id, _, length]) => {
                long.insert(id, lengths.get(&length).is_some_and(|&length| length > MAX_INITIALISED_LENGTH));
            }
            (TYPE_POINTER, &[id, _, pointed]) => {
                long.insert(id, long.get(&pointed) == Some(&true));
            }
            (VARIABLE, &[kind, id, PRIVATE, _zeros]) if long.get(&kind) == Some(&true) => {
                push(&mut written, VARIABLE, &[kind, id, PRIVATE]);
                continue;
            }
            _ => {}
        }
        push(&mut written, code, operands);
    }
    written
}

/// Decorates every addition, subtraction, multiplication, division, negation and fused multiply-add with
/// `NoContraction`: drivers otherwise factor sums and move constants into products. Decorations precede the first type.
fn without_contraction(words: &[u32]) -> Vec<u32> {
    const DECORATE: u32 = 71;
    const NO_CONTRACTION: u32 = 42;
    const EXTENDED: u32 = 12;
    const ARITHMETIC: [u32; 5] = [127, 129, 131, 133, 136];
    const TYPES: std::ops::RangeInclusive<u32> = 19..=39;
    let mut written = words[..HEADER_WORDS].to_vec();
    let mut decorated = false;
    for (code, operands) in instructions(words) {
        if TYPES.contains(&code) && !decorated {
            decorated = true;
            let is_decorated =
                |(code, of): &(u32, &[u32])| ARITHMETIC.contains(code) || (*code == EXTENDED && of[3] == FMA);
            for (_, of) in instructions(words).filter(is_decorated) {
                push(&mut written, DECORATE, &[of[1], NO_CONTRACTION]);
            }
        }
        push(&mut written, code, operands);
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(words: &[u32]) -> Vec<usize> {
        let private = |(code, operands): &(u32, &[u32])| *code == 59 && operands[2] == 6;
        instructions(words).filter(private).map(|(_, operands)| operands.len() + 1).collect()
    }

    #[test]
    fn only_long_private_arrays_lose_their_initialisers() {
        let text = "var<private> long: array<f32, 33>; var<private> short: array<f32, 32>; var<private> alone: f32;
            @group(0) @binding(4) var<storage, read_write> out: array<f32>;
            @group(0) @binding(2) var<storage, read> into: array<f32>;
            @group(0) @binding(3) var<storage, read> unused: array<f32>;
            @compute @workgroup_size(1) fn probe() { out[0] = into[0] + long[7] + short[7] + alone; }";
        let kernel = Kernel::parse(text.to_owned()).expect("the source is valid");
        let compiled = compile(&kernel, "probe", false, None).expect("it has the entry point");
        let mut lengths = variables(&compiled.words);
        lengths.sort_unstable();
        assert_eq!(lengths, [4, 5, 5]);
        let storage = |read_only| wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        assert_eq!(compiled.bindings, [(2, storage(true)), (4, storage(false))]);
    }

    #[test]
    fn workgroup_variables_are_rounded_up_to_sixteen_bytes() {
        let text = "var<workgroup> one: f32; var<workgroup> some: array<f32, 5>; var<private> own: array<f32, 64>;
            @compute @workgroup_size(1) fn probe() { some[1] = one + own[0]; }";
        assert_eq!(Kernel::parse(text.to_owned()).expect("the source is valid").workgroup_bytes(), 16 + 32);
    }

    #[test]
    fn an_invalid_source_is_rejected_with_an_excerpt() {
        let refused = Kernel::parse("@compute @workgroup_size(1) fn probe() { lost = 1; }".to_owned()).err();
        assert!(refused.is_some_and(|why| why.contains("lost")), "the error names the unknown identifier");
        let without = Kernel::parse("fn probe() {}".to_owned()).expect("the source is valid");
        assert!(compile(&without, "probe", false, None).is_err(), "no entry point");
    }

    #[test]
    fn every_operation_of_a_kernel_is_decorated_no_contraction() {
        let text = "@group(0) @binding(0) var<storage, read> x: array<f32>;
            @group(0) @binding(1) var<storage, read_write> y: array<f32>;
            @compute @workgroup_size(1) fn probe() { y[0] = x[0] * x[1] - x[2]; }";
        let kernel = Kernel::parse(text.to_owned()).expect("the source is valid");
        let alone = |kernel: &Kernel| {
            let words = compile(kernel, "probe", false, None).expect("it has the entry point").words;
            instructions(&words).filter(|(code, operands)| *code == 71 && operands[1] == 42).count()
        };
        assert_eq!(alone(&kernel), 2);
        // x·y − z and its derivative: two products, their sum, and a difference.
        assert_eq!(alone(&kernel.differentiated("x").expect("every operation has a rule")), 2 + 4);
    }
}
