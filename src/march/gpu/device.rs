//! The one place that knows devices: adapters, limits and self-tests.

use super::shader;
use super::spirv::{self, Kernel};
use crate::march::{MarchError, Precision};
use crate::physics::Real;
use crate::physics::compensated::two_sum;
use bytemuck::Pod;
use std::borrow::Cow;
use std::sync::mpsc;

/// What to install where no driver is found.
const REMEDY: &str = "install a Vulkan driver: a vendor's for its hardware, or the software rasteriser \
                      (Debian, Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)";

/// A device as its driver describes it.
#[derive(Clone, Debug)]
pub struct Adapter {
    pub name: String,
    pub driver: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    pub limits: wgpu::Limits,
    pub has_f64: bool,
    inner: wgpu::Adapter,
}

impl Adapter {
    /// A software rasteriser runs on the processor that the vectorised path uses better.
    pub fn is_software(&self) -> bool {
        self.kind == "software"
    }
}

/// Whether looking for hardware can find any. Loading the drivers takes a moment, and without a display some
/// of them complain on standard error; where the system has no render node nobody need ask.
pub fn hardware_may_exist() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let nodes = ["/dev/dri", "/dev/nvidiactl", "/dev/dxg", "/dev/mali0", "/dev/kgsl-3d0"];
    nodes.iter().any(|node| std::path::Path::new(node).exists())
}

/// All Vulkan adapters, hardware first.
pub fn adapters() -> Vec<Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let mut found: Vec<Adapter> = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN))
        .into_iter()
        .map(|inner| {
            let info = inner.get_info();
            let kind = match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete",
                wgpu::DeviceType::IntegratedGpu => "integrated",
                wgpu::DeviceType::VirtualGpu => "virtual",
                wgpu::DeviceType::Cpu => "software",
                wgpu::DeviceType::Other => "other",
            };
            Adapter {
                name: info.name,
                driver: format!("{} {}", info.driver, info.driver_info),
                kind,
                limits: inner.limits(),
                has_f64: inner.features().contains(wgpu::Features::SHADER_F64),
                inner,
            }
        })
        .collect();
    let order = ["discrete", "integrated", "virtual", "other", "software"];
    found.sort_by_key(|adapter| order.iter().position(|kind| *kind == adapter.kind));
    found
}

/// The first adapter whose name contains `name` (any case), or simply the first.
///
/// # Errors
/// When there is none; the message names the package to install.
pub fn find(name: Option<&str>) -> Result<Adapter, MarchError> {
    let found = adapters();
    let names: Vec<String> = found.iter().map(|adapter| format!("{:?}", adapter.name)).collect();
    let wanted = name.map(str::to_lowercase);
    found
        .into_iter()
        .find(|adapter| wanted.as_ref().is_none_or(|wanted| adapter.name.to_lowercase().contains(wanted)))
        .ok_or_else(|| match name {
            Some(name) if !names.is_empty() => MarchError::NoDevice {
                reason: format!("none is called {name:?}"),
                remedy: format!("there are {}", names.join(", ")),
            },
            _ => MarchError::NoDevice { reason: "no adapter found".to_owned(), remedy: REMEDY.to_owned() },
        })
}

/// A device ready to march.
pub struct Device {
    pub name: String,
    pub is_software: bool,
    pub limits: wgpu::Limits,
    pub has_f64: bool,
    checks: bool,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

/// What a device showed when tested.
#[derive(Clone, Debug)]
pub struct SelfTests {
    /// Sums whose rounding error came back wrong, of all tried; in f64 too where the device has it.
    pub transforms: Vec<(Precision, usize, usize)>,
    /// Turns of one loop, of a million asked for.
    pub loop_turns: u32,
}

/// Pairs summed, and loop turns asked for, by the self-tests.
const PAIRS: usize = 4096;
const TURNS: u32 = 1_000_000;

impl Device {
    /// Open an adapter with all the room it has. `checks` keeps the runtime's bounds and loop checks in the
    /// shaders.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn open(adapter: Adapter, checks: bool) -> Result<Self, MarchError> {
        let mut features = wgpu::Features::PASSTHROUGH_SHADERS;
        features.set(wgpu::Features::SHADER_F64, adapter.has_f64);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("bondline"),
            required_features: features,
            required_limits: adapter.limits.clone(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.inner.request_device(&descriptor))
            .map_err(|error| MarchError::Device { device: adapter.name.clone(), message: error.to_string() })?;
        let is_software = adapter.is_software();
        let Adapter { name, limits, has_f64, .. } = adapter;
        Ok(Self { name, is_software, limits, has_f64, checks, device, queue })
    }

    /// An error of this device.
    pub fn error(&self, message: impl ToString) -> MarchError {
        MarchError::Device { device: self.name.clone(), message: message.to_string() }
    }

    /// The kernel of a text.
    ///
    /// # Errors
    /// When the text does not compile, with the compiler's excerpt.
    pub fn kernel(&self, text: String) -> Result<Kernel, MarchError> {
        Kernel::of(text).map_err(|why| self.error(why))
    }

    /// A pipeline of a kernel. Private arrays of more than [`spirv::SHORT`] elements begin as they may.
    ///
    /// # Errors
    /// When the kernel has no such entry point, or the driver refuses it.
    pub fn pipeline(&self, kernel: &Kernel, entry: &str) -> Result<wgpu::ComputePipeline, MarchError> {
        if self.checks {
            let source = wgpu::ShaderSource::Naga(Cow::Owned(kernel.module.clone()));
            let descriptor = wgpu::ShaderModuleDescriptor { label: Some(entry), source };
            return self.assembled(entry, None, |device| device.create_shader_module(descriptor));
        }
        let compiled = spirv::compile(kernel, entry).map_err(|why| self.error(why))?;
        let buffer = |&(binding, ty): &(u32, wgpu::BufferBindingType)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let entries: Vec<_> = compiled.bindings.iter().map(buffer).collect();
        let group = wgpu::BindGroupLayoutDescriptor { label: Some(entry), entries: &entries };
        let group = self.device.create_bind_group_layout(&group);
        let layout = wgpu::PipelineLayoutDescriptor {
            label: Some(entry),
            bind_group_layouts: &[Some(&group)],
            ..Default::default()
        };
        let layout = self.device.create_pipeline_layout(&layout);
        self.assembled(entry, Some(&layout), |device| unchecked(device, entry, &compiled.words))
    }

    fn assembled(
        &self,
        entry: &str,
        layout: Option<&wgpu::PipelineLayout>,
        module: impl FnOnce(&wgpu::Device) -> wgpu::ShaderModule,
    ) -> Result<wgpu::ComputePipeline, MarchError> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout,
            module: &module(&self.device),
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(self.error(error)),
            None => Ok(pipeline),
        }
    }

    /// A storage buffer that holds `rows`.
    pub fn upload<T: Pod>(&self, label: &str, rows: &[T]) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        let buffer = self.storage(label, bytes.len() as u64);
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// A storage buffer of zeros.
    pub fn storage(&self, label: &str, bytes: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(16).next_multiple_of(8),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    }

    /// The rows of a buffer from byte `start` on, once all submitted work is done.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn download<T: Pod>(&self, buffer: &wgpu::Buffer, start: u64, bytes: u64) -> Result<Vec<T>, MarchError> {
        let landing = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("landing"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, start, &landing, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        landing.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone only where polling has failed already.
            let _ = sender.send(result);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| self.error(error))?;
        receiver.recv().map_err(|error| self.error(error))?.map_err(|error| self.error(error))?;
        let range = landing.get_mapped_range(..).map_err(|error| self.error(error))?;
        // Copied byte by byte, as the mapping promises no alignment for T.
        let rows = bytemuck::pod_collect_to_vec(&range);
        Ok(rows)
    }

    /// Run one small kernel over buffers at their bindings, and hand back the last.
    ///
    /// # Errors
    /// As [`pipeline`](Self::pipeline), or when the device is lost.
    pub fn probe<T: Pod>(
        &self,
        kernel: &Kernel,
        entry: &str,
        groups: u32,
        buffers: &[(u32, wgpu::Buffer)],
    ) -> Result<Vec<T>, MarchError> {
        let pipeline = self.pipeline(kernel, entry)?;
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding: *binding, resource: buffer.as_entire_binding() })
            .collect();
        let bind_group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(entry),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        self.queue.submit([encoder.finish()]);
        let (_, last) = buffers.last().ok_or_else(|| self.error("a probe has no buffers"))?;
        self.download(last, 0, last.size())
    }

    /// Test what the march leans on.
    ///
    /// # Errors
    /// When a test kernel does not compile or the device is lost.
    pub fn self_tests(&self) -> Result<SelfTests, MarchError> {
        let mut transforms = vec![(Precision::F32, self.test_transforms::<f32>(Precision::F32)?, PAIRS)];
        if self.has_f64 {
            transforms.push((Precision::F64, self.test_transforms::<f64>(Precision::F64)?, PAIRS));
        }
        let text = "@group(0) @binding(0) var<storage, read> asked: array<u32>;\n\
             @group(0) @binding(1) var<storage, read_write> turned: array<u32>;\n\
             @compute @workgroup_size(1) fn turns() {\n\
             var value = 1u; var count = 0u;\n\
             for (var i = 0u; i < asked[0]; i++) { value = value * 1664525u + 1013904223u; count++; }\n\
             turned[0] = count; turned[1] = value; }"
            .to_string();
        let buffers = [(0, self.upload("asked", &[TURNS; 4])), (1, self.storage("turned", 16))];
        let turned: Vec<u32> = self.probe(&self.kernel(text)?, "turns", 1, &buffers)?;
        Ok(SelfTests { transforms, loop_turns: turned[0] })
    }

    /// Sum pairs of very different sizes and count the error terms that are not exact.
    fn test_transforms<W: Pod + Real<Scalar = W> + PartialEq>(
        &self,
        precision: Precision,
    ) -> Result<usize, MarchError> {
        let part = |name: &str| shader::PARTS.iter().find(|part| part.0 == name).map_or("", |part| part.1);
        let text = format!(
            "{}{}\n{}\n\
             @group(0) @binding(0) var<storage, read> ones: array<real>;\n\
             @group(0) @binding(1) var<storage, read> pairs: array<real>;\n\
             @group(0) @binding(2) var<storage, read_write> sums: array<real>;\n\
             @compute @workgroup_size(64) fn transforms(@builtin(global_invocation_id) id: vec3<u32>) {{\n\
             one = ones[0];\n\
             let sum = two_sum(pairs[2u * id.x], pairs[2u * id.x + 1u]);\n\
             sums[2u * id.x] = sum.high; sums[2u * id.x + 1u] = sum.low; }}",
            shader::head(precision),
            part("prelude"),
            part("compensated"),
        );
        // A multiplicative congruence is random enough to give every pair a rounding error of its own.
        let mut seed = 12_345_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let pairs: Vec<W> = (0..PAIRS)
            .flat_map(|_| [300.0 + 1500.0 * next(), (next() - 0.5) * 10_f64.powf(-6.0 * next())])
            .map(W::scalar)
            .collect();
        let buffers = [
            (0, self.upload("ones", &[W::scalar(1.0); 4])),
            (1, self.upload("pairs", &pairs)),
            (2, self.upload("sums", &pairs)),
        ];
        let sums: Vec<W> = self.probe(&self.kernel(text)?, "transforms", (PAIRS / 64) as u32, &buffers)?;
        Ok(wrong_sums(&pairs, &sums))
    }
}

/// A shader of words that wgpu does not look into.
#[expect(unsafe_code, reason = "argued at the block")]
fn unchecked(device: &wgpu::Device, entry: &str, words: &[u32]) -> wgpu::ShaderModule {
    let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
        label: Some(entry),
        spirv: Some(words.into()),
        entry_points: vec![wgpu::PassthroughShaderEntryPoint { name: entry.into(), workgroup_size: (0, 0, 0) }].into(),
        ..Default::default()
    };
    // SAFETY: the words are naga's, of a module that it validated, less the zeros of arrays that our kernels clear
    // themselves; one that tells changes has the loops and indices of the one that it was made of. Every loop of theirs counts to a constant or to a length fixed before it starts; every index into
    // a private array is such a counter or a cell number that the plan bounds by CELLS; table rows are clamped
    // before use; members beyond the last return at once. Tests march shipped cases with checks on and compare bit
    // for bit. Injected loop counters cost about a tenth on a software device, and far more has been seen on hardware.
    unsafe { device.create_shader_module_passthrough(descriptor) }
}

/// Pairs whose sum or error term differs from that of the processor.
fn wrong_sums<R: Real + PartialEq>(pairs: &[R], sums: &[R]) -> usize {
    pairs
        .chunks_exact(2)
        .zip(sums.chunks_exact(2))
        .filter(|(pair, sum)| {
            let exact = two_sum(pair[0], pair[1]);
            exact.high != sum[0] || exact.low != sum[1]
        })
        .count()
}
