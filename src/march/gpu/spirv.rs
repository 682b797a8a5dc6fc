//! A kernel's text as words of SPIR-V, without the zeros of its columns.
//!
//! WGSL gives every private variable zeros to begin with, and drivers write them out element by element: with 320 cells
//! a software device compiled for three minutes, without them for seconds. wgpu has no switch for it, so kernels that
//! [clear](super::shader::MARCH) what they lean on are compiled here, and the words handed to the driver as they are.

use naga::AddressSpace;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::collections::HashMap;

/// Arrays of more elements than this begin as they may: a kernel's cells are more, what it keeps by the handful is less.
pub const SHORT: u32 = 32;

/// Words of a kernel, and how each thing of the host's is bound: by the number in the text, and in the words by its place here.
pub struct Compiled {
    pub words: Vec<u32>,
    pub bindings: Vec<(u32, wgpu::BindingType)>,
}

/// The words of the entry point `entry` of a text, without checks of bounds.
///
/// # Errors
/// When the text does not compile, with the compiler's excerpt.
pub fn compile(text: &str, entry: &str) -> Result<Compiled, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::FLOAT64);
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
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
    let options = spv::Options {
        flags: spv::WriterFlags::empty(),
        binding_map: bound.iter().map(|(binding, _)| *binding).zip(0..).map(at).collect(),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Unchecked,
            buffer: BoundsCheckPolicy::Unchecked,
            image_load: BoundsCheckPolicy::Unchecked,
            binding_array: BoundsCheckPolicy::Unchecked,
        },
        force_loop_bounding: false,
        ..spv::Options::default()
    };
    let pipeline = spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: entry.to_owned() };
    let words = spv::write_vec(&module, &info, &options, Some(&pipeline)).map_err(|error| error.to_string())?;
    let bindings = bound.into_iter().map(|(binding, kind)| (binding.binding, kind)).collect();
    Ok(Compiled { words: without_zeros(&words), bindings })
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

/// Words without the initial values of private arrays of more than [`SHORT`] elements. By the specification of SPIR-V
/// an instruction's first word is its length in words above its code; variables follow the types they are of.
fn without_zeros(words: &[u32]) -> Vec<u32> {
    const HEADER: usize = 5;
    const CONSTANT: u32 = 43;
    const TYPE_ARRAY: u32 = 28;
    const TYPE_POINTER: u32 = 32;
    const VARIABLE: u32 = 59;
    const PRIVATE: u32 = 6;
    let (mut lengths, mut long, mut kept) = (HashMap::new(), HashMap::new(), words[..HEADER].to_vec());
    let mut rest = &words[HEADER..];
    while let Some(&first) = rest.first() {
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        rest = after;
        match (first & 0xffff, &instruction[1..]) {
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
                kept.extend([4 << 16 | VARIABLE, kind, id, PRIVATE]);
                continue;
            }
            _ => {}
        }
        kept.extend(instruction);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(words: &[u32]) -> Vec<usize> {
        let mut lengths = Vec::new();
        let mut rest = &words[5..];
        while let Some(&first) = rest.first() {
            let (instruction, after) = rest.split_at((first >> 16) as usize);
            if first & 0xffff == 59 && instruction[3] == 6 {
                lengths.push(instruction.len());
            }
            rest = after;
        }
        lengths
    }

    #[test]
    fn long_private_arrays_lose_their_zeros_and_nothing_else_does() {
        let text = "var<private> long: array<f32, 33>; var<private> short: array<f32, 32>; var<private> alone: f32;
            @group(0) @binding(4) var<storage, read_write> out: array<f32>;
            @group(0) @binding(2) var<storage, read> into: array<f32>;
            @group(0) @binding(3) var<storage, read> unused: array<f32>;
            @compute @workgroup_size(1) fn probe() { out[0] = into[0] + long[7] + short[7] + alone; }";
        let compiled = compile(text, "probe").expect("the text is sound");
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
    fn a_text_that_is_wrong_is_refused_with_an_excerpt() {
        let refused = compile("@compute @workgroup_size(1) fn probe() { lost = 1; }", "probe").err();
        assert!(refused.is_some_and(|why| why.contains("lost")), "names what is not known");
        assert!(compile("fn probe() {}", "probe").is_err(), "no entry point");
    }
}
