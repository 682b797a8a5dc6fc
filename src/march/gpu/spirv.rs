//! A kernel's text as words of SPIR-V, without the zeros of its columns.
//!
//! WGSL gives every private variable zeros to begin with, and drivers write them out element by element: with 320 cells
//! a software device compiled for three minutes, without them for seconds. wgpu has no switch for it, so kernels that
//! [clear](super::shader::MARCH) what they lean on are compiled here, and the words handed to the driver as they are. Every operation stands alone in them
//! (`NoContraction`): left to themselves drivers join, reorder and move constants, each in its own way, and no two marches have the same bits.

use super::differentiate::differentiate;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Module};
use std::collections::HashMap;

/// Arrays of more elements than this begin as they may: a kernel's cells are more, what it keeps by the handful is less.
pub const SHORT: u32 = 32;

/// A kernel as naga reads its text: sound.
pub struct Kernel {
    pub(super) text: String,
    pub module: Module,
    pub(super) info: ModuleInfo,
}

impl Kernel {
    /// The kernel of a text.
    ///
    /// # Errors
    /// When the text does not compile, with the compiler's excerpt.
    pub fn of(text: String) -> Result<Self, String> {
        let module = naga::front::wgsl::parse_str(&text).map_err(|error| error.emit_to_string(&text))?;
        Self::sound(text, module)
    }

    /// The kernel that tells, beside all that this one stores, how that changes with what the buffer `by` holds. To each buffer that changes, `by` among them, belongs one of
    /// the same shape for the change; these are bound behind all others, in the order of the first.
    ///
    /// # Errors
    /// When there is no such buffer, or the kernel does something with a change that there is no rule for.
    pub fn differentiated(&self, by: &str) -> Result<Self, String> {
        Self::sound(self.text.clone(), differentiate(&self.module, &self.info, by)?)
    }

    /// Bytes of the variables that a workgroup shares, each rounded up to 16 as WebGPU counts them
    /// (`maxComputeWorkgroupStorageSize`).
    pub fn workgroup_bytes(&self) -> u32 {
        let shared = self.module.global_variables.iter().filter(|(_, known)| known.space == AddressSpace::WorkGroup);
        let bytes = |known: &naga::GlobalVariable| self.module.types[known.ty].inner.size(self.module.to_ctx());
        shared.map(|(_, variable)| bytes(variable).next_multiple_of(16)).sum()
    }

    pub(super) fn sound(text: String, module: Module) -> Result<Self, String> {
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::FLOAT64);
        let info = validator.validate(&module).map_err(|error| error.emit_to_string(&text))?;
        Ok(Self { text, module, info })
    }
}

/// Words of a kernel, and how each thing of the host's is bound: by the number in the text, and in the words by its place here.
pub struct Compiled {
    pub words: Vec<u32>,
    pub bindings: Vec<(u32, wgpu::BindingType)>,
}

/// The words of the entry point `entry` of a kernel; with checks of bounds, an end to every loop, and zeros to begin with, or without.
///
/// # Errors
/// When there is no such entry point, or naga cannot write it.
pub fn compile(kernel: &Kernel, entry: &str, checks: bool) -> Result<Compiled, String> {
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
    // The driver's layout numbers bindings without gaps, in their order.
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
    let words = exact(&if checks { words } else { without_zeros(&words) });
    Ok(Compiled { words, bindings })
}

fn binding(space: AddressSpace) -> Option<wgpu::BindingType> {
    let ty = match space {
        AddressSpace::Uniform => wgpu::BufferBindingType::Uniform,
        AddressSpace::Storage { access } => {
            let read_only = !access.contains(naga::StorageAccess::STORE);
            wgpu::BufferBindingType::Storage { read_only }
        }
        // Textures: of all kinds a kernel has but one.
        AddressSpace::Handle => return Some(TEXELS),
        _ => return None,
    };
    Some(wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None })
}

/// A texture of numbers that are read one by one.
const TEXELS: wgpu::BindingType = wgpu::BindingType::StorageTexture {
    access: wgpu::StorageTextureAccess::ReadOnly,
    format: wgpu::TextureFormat::Rgba32Float,
    view_dimension: wgpu::TextureViewDimension::D2,
};

/// Words of the header of SPIR-V.
const HEADER: usize = 5;

/// Each instruction's code and words, the first left out. By the specification of SPIR-V an instruction's first word is its length in words above
/// its code.
fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = &words[HEADER..];
    std::iter::from_fn(move || {
        let &first = rest.first()?;
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        Some((first & 0xffff, &instruction[1..]))
    })
}

fn push(words: &mut Vec<u32>, code: u32, operands: &[u32]) {
    words.push((operands.len() as u32 + 1) << 16 | code);
    words.extend(operands);
}

/// Words without the initial values of private arrays of more than [`SHORT`] elements; variables follow the types they are of.
fn without_zeros(words: &[u32]) -> Vec<u32> {
    const CONSTANT: u32 = 43;
    const TYPE_ARRAY: u32 = 28;
    const TYPE_POINTER: u32 = 32;
    const VARIABLE: u32 = 59;
    const PRIVATE: u32 = 6;
    let (mut lengths, mut long, mut kept) = (HashMap::new(), HashMap::new(), words[..HEADER].to_vec());
    for (code, operands) in instructions(words) {
        match (code, operands) {
            (CONSTANT, &[_, id, value]) => {
                lengths.insert(id, value);
            }
            (TYPE_ARRAY, &[id, _, length]) => {
                long.insert(id, lengths.get(&length).is_some_and(|&length| length > SHORT));
            }
            (TYPE_POINTER, &[id, _, pointed]) => {
                long.insert(id, long.get(&pointed) == Some(&true));
            }
            (VARIABLE, &[kind, id, PRIVATE, _zeros]) if long.get(&kind) == Some(&true) => {
                push(&mut kept, VARIABLE, &[kind, id, PRIVATE]);
                continue;
            }
            _ => {}
        }
        push(&mut kept, code, operands);
    }
    kept
}

/// Words in which every sum, difference, product, quotient and change of sign stands alone (`NoContraction`): drivers otherwise take factors out of sums and move constants into
/// products. Decorations come before the first type.
fn exact(words: &[u32]) -> Vec<u32> {
    const DECORATE: u32 = 71;
    const NO_CONTRACTION: u32 = 42;
    const ARITHMETIC: [u32; 5] = [127, 129, 131, 133, 136];
    const TYPES: std::ops::RangeInclusive<u32> = 19..=39;
    let mut kept = words[..HEADER].to_vec();
    let mut decorated = false;
    for (code, operands) in instructions(words) {
        if TYPES.contains(&code) && !decorated {
            decorated = true;
            for (_, of) in instructions(words).filter(|(code, _)| ARITHMETIC.contains(code)) {
                push(&mut kept, DECORATE, &[of[1], NO_CONTRACTION]);
            }
        }
        push(&mut kept, code, operands);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(words: &[u32]) -> Vec<usize> {
        let private = |(code, operands): &(u32, &[u32])| *code == 59 && operands[2] == 6;
        instructions(words).filter(private).map(|(_, operands)| operands.len() + 1).collect()
    }

    #[test]
    fn long_private_arrays_lose_their_zeros_and_nothing_else_does() {
        let text = "var<private> long: array<f32, 33>; var<private> short: array<f32, 32>; var<private> alone: f32;
            @group(0) @binding(4) var<storage, read_write> out: array<f32>;
            @group(0) @binding(2) var<storage, read> into: array<f32>;
            @group(0) @binding(3) var<storage, read> unused: array<f32>;
            @compute @workgroup_size(1) fn probe() { out[0] = into[0] + long[7] + short[7] + alone; }";
        let kernel = Kernel::of(text.to_owned()).expect("the text is sound");
        let compiled = compile(&kernel, "probe", false).expect("it has the entry point");
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
    fn the_variables_of_a_workgroup_take_whole_multiples_of_sixteen_bytes() {
        let text = "var<workgroup> one: f32; var<workgroup> some: array<f32, 5>; var<private> own: array<f32, 64>;
            @compute @workgroup_size(1) fn probe() { some[1] = one + own[0]; }";
        assert_eq!(Kernel::of(text.to_owned()).expect("the text is sound").workgroup_bytes(), 16 + 32);
    }

    #[test]
    fn a_text_that_is_wrong_is_refused_with_an_excerpt() {
        let refused = Kernel::of("@compute @workgroup_size(1) fn probe() { lost = 1; }".to_owned()).err();
        assert!(refused.is_some_and(|why| why.contains("lost")), "names what is not known");
        let without = Kernel::of("fn probe() {}".to_owned()).expect("the text is sound");
        assert!(compile(&without, "probe", false).is_err(), "no entry point");
    }

    #[test]
    fn every_operation_of_a_kernel_stands_alone() {
        let text = "@group(0) @binding(0) var<storage, read> x: array<f32>;
            @group(0) @binding(1) var<storage, read_write> y: array<f32>;
            @compute @workgroup_size(1) fn probe() { y[0] = x[0] * x[1] - x[2]; }";
        let kernel = Kernel::of(text.to_owned()).expect("the text is sound");
        let alone = |kernel: &Kernel| {
            let words = compile(kernel, "probe", false).expect("it has the entry point").words;
            instructions(&words).filter(|(code, operands)| *code == 71 && operands[1] == 42).count()
        };
        assert_eq!(alone(&kernel), 2);
        // The difference of a product, and its change: two products, their sum, and a difference.
        assert_eq!(alone(&kernel.differentiated("x").expect("there is a rule for each")), 2 + 4);
    }
}
