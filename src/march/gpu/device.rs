//! Vulkan devices: adapters, limits, buffers and pipelines.

#[cfg(test)]
pub(super) mod injection;

use super::cache::DriverCache;
use super::correct_rounding::Residual;
use super::shader;
use super::spirv::{self, Kernel};
use crate::march::MarchError;
use crate::physics::layout::COLUMNS_PER_LOAD;
use crate::user_cache;
use bytemuck::Pod;
#[cfg(test)]
use injection::Injection;
use std::env;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, mpsc};

/// Remedy where no driver is found.
const REMEDY: &str = "install a Vulkan driver: a vendor's for its hardware, or the software rasteriser \
                      (Debian, Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)";

/// The variable that names a folder for the source of every kernel, to which messages of compilers refer.
const KERNEL_FOLDER: &str = "BONDLINE_KERNELS";

/// Most bytes of the private variables of a thread on hardware, which Vulkan does not tell. Drivers reserve them for
/// every thread that can be resident: on an H200, 132 multiprocessors of 2,048 threads, in at most 4 GiB. There 15,840
/// bytes compiled, and 15,888 lost the device.
const MAX_PRIVATE_BYTES: u32 = ((1_u64 << 32) / (132 * 2048)) as u32;

/// A device as described by its driver.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// Name reported by the driver.
    pub name: String,
    /// The driver and its version.
    pub driver: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    pub(crate) limits: wgpu::Limits,
    /// Whether its shaders support f64.
    pub has_f64: bool,
    inner: wgpu::Adapter,
}

impl Adapter {
    /// Whether the device is a software rasteriser, which runs on the CPU and uses it less well than the CPU backend.
    pub fn is_software(&self) -> bool {
        self.kind == "software"
    }

    /// Most bytes of one binding.
    pub fn binding_bytes(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size
    }

    /// Most bytes of one buffer.
    pub fn buffer_bytes(&self) -> u64 {
        self.limits.max_buffer_size
    }
}

/// Whether hardware can exist: without a render node there is none. Loading the drivers takes a moment, and without a
/// display some print messages on standard error.
pub fn hardware_may_exist() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let nodes = ["/dev/dri", "/dev/nvidiactl", "/dev/dxg", "/dev/mali0", "/dev/kgsl-3d0"];
    nodes.iter().any(|node| Path::new(node).exists())
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

/// The first adapter whose name contains `name` (ignoring case), or the first of all.
///
/// # Errors
/// When there is none; the message names the package to install.
pub fn find(name: Option<&str>) -> Result<Adapter, MarchError> {
    let found = adapters();
    let names: Vec<String> = found.iter().map(|adapter| format!("{:?}", adapter.name)).collect();
    let pattern = name.map(str::to_lowercase);
    found
        .into_iter()
        .find(|adapter| pattern.as_ref().is_none_or(|pattern| adapter.name.to_lowercase().contains(pattern)))
        .ok_or_else(|| match name {
            Some(name) if !names.is_empty() => MarchError::NoDevice {
                reason: format!("no device is called {name:?}"),
                remedy: format!("available: {}", names.join(", ")),
            },
            _ => MarchError::NoDevice { reason: "no adapter found".to_owned(), remedy: REMEDY.to_owned() },
        })
}

/// An open device; a clone is another handle of it.
#[derive(Clone)]
pub struct Device {
    /// Name reported by the driver.
    pub name: String,
    /// The driver and its version.
    pub driver: String,
    /// Whether it runs on the CPU.
    pub is_software: bool,
    pub(crate) limits: wgpu::Limits,
    /// Whether its shaders support f64.
    pub has_f64: bool,
    /// Most bytes of the private variables of a thread.
    pub(crate) max_private_bytes: u32,
    pub(super) checks: bool,
    /// How kernels correct quotients and square roots, if they do.
    pub(super) residual: Option<Residual>,
    cache: Option<DriverCache>,
    /// The first error since the last check.
    fault: Arc<Mutex<Option<MarchError>>>,
    pub(super) device: wgpu::Device,
    queue: wgpu::Queue,
    #[cfg(test)]
    pub(super) injection: Arc<Injection>,
    /// Whether quotients are products with reciprocals, as on some hardware.
    #[cfg(test)]
    pub(super) multiplies_by_reciprocals: bool,
}

/// A call of the driver that can fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum DriverCall {
    Pipeline,
    Buffer,
    Texture,
    Write,
    Bind,
    Submit,
    Poll,
    Map,
    Read,
}

#[cfg(test)]
impl DriverCall {
    pub(super) const ALL: [Self; 9] = [
        Self::Pipeline,
        Self::Buffer,
        Self::Texture,
        Self::Write,
        Self::Bind,
        Self::Submit,
        Self::Poll,
        Self::Map,
        Self::Read,
    ];
}

/// A pending copy of a buffer to the host.
pub(crate) struct Readback {
    buffer: wgpu::Buffer,
    bytes: u64,
    submitted: wgpu::SubmissionIndex,
    mapped: mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Device {
    /// Open an adapter with its full limits and its pipeline cache. `checks` keeps the runtime's bounds and loop checks
    /// in the shaders.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn open(adapter: Adapter, checks: bool) -> Result<Self, MarchError> {
        Self::open_with(adapter, checks, user_cache::folder().as_deref())
    }

    /// As [`open`](Self::open), with the pipeline cache in a given folder, or without one.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(adapter: Adapter, checks: bool, compiled: Option<&Path>) -> Result<Self, MarchError> {
        let mut features = wgpu::Features::PASSTHROUGH_SHADERS;
        features.set(wgpu::Features::SHADER_F64, adapter.has_f64);
        features |= adapter.inner.features() & wgpu::Features::PIPELINE_CACHE;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("bondline"),
            required_features: features,
            required_limits: adapter.limits.clone(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.inner.request_device(&descriptor))
            .map_err(|error| MarchError::Device { device: adapter.name.clone(), message: error.to_string() })?;
        let cache = compiled.and_then(|folder| DriverCache::open(&device, &adapter.inner.get_info(), folder));
        let is_software = adapter.is_software();
        let Adapter { name, driver, limits, has_f64, .. } = adapter;
        let fault = Arc::default();
        let opened = Self {
            name,
            driver,
            is_software,
            limits,
            has_f64,
            max_private_bytes: if is_software { u32::MAX } else { MAX_PRIVATE_BYTES },
            checks,
            residual: None,
            cache,
            fault,
            device,
            queue,
            #[cfg(test)]
            injection: Injection::planned(),
            #[cfg(test)]
            multiplies_by_reciprocals: false,
        };
        opened.collect_errors();
        Ok(opened)
    }

    /// Store what wgpu reports, validation errors, exhausted memory, internal errors and the loss of the device, for
    /// the next [`check`](Self::check). By default wgpu panics.
    fn collect_errors(&self) {
        let (name, fault) = (self.name.clone(), Arc::clone(&self.fault));
        self.device.on_uncaptured_error(Arc::new(move |error| {
            let device = name.clone();
            store_first(
                &fault,
                match error {
                    wgpu::Error::OutOfMemory { .. } => MarchError::OutOfMemory { device },
                    other => MarchError::Device { device, message: other.to_string() },
                },
            );
        }));
        let (name, fault) = (self.name.clone(), Arc::clone(&self.fault));
        self.device.set_device_lost_callback(move |_, message| {
            store_first(&fault, MarchError::Device { device: name.clone(), message: format!("lost: {message}") });
        });
    }

    /// # Errors
    /// The first error since the last check.
    pub(crate) fn check(&self) -> Result<(), MarchError> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }

    /// Let the next check find an error.
    pub(crate) fn store(&self, error: MarchError) {
        store_first(&self.fault, error);
    }

    /// Whether a test lets this call fail.
    #[cfg(test)]
    fn is_failing(&self, call: DriverCall) -> bool {
        self.injection.is_failing(self, call)
    }

    #[cfg(not(test))]
    const fn is_failing(&self, _call: DriverCall) -> bool {
        false
    }

    /// Save the pipeline cache.
    pub fn save_cache(&self) {
        self.cache.iter().for_each(DriverCache::save);
    }

    /// Wait until all submitted work is done.
    ///
    /// # Errors
    /// When the device is lost.
    pub(crate) fn wait(&self) -> Result<(), MarchError> {
        self.poll(wgpu::PollType::wait_indefinitely())?;
        self.check()
    }

    /// Poll the device. wgpu panics when it is lost meanwhile, after it has reported the loss.
    fn poll(&self, until: wgpu::PollType) -> Result<(), MarchError> {
        let polled = catch_unwind(AssertUnwindSafe(|| {
            if self.is_failing(DriverCall::Poll) {
                resume_unwind(Box::new("a test"));
            }
            self.device.poll(until)
        }));
        match polled {
            Ok(polled) => polled.map(|_| ()).map_err(|error| self.error(error)),
            Err(_) => self.check().and_then(|()| Err(self.error("failed while its work was waited for"))),
        }
    }

    /// An error of this device.
    pub(crate) fn error(&self, message: impl ToString) -> MarchError {
        MarchError::Device { device: self.name.clone(), message: message.to_string() }
    }

    /// Parse and validate the part of a kernel's source that it uses. The folder of [`KERNEL_FOLDER`], if it is set,
    /// gets the source.
    ///
    /// # Errors
    /// When the source does not compile, with the compiler's excerpt, or cannot be written.
    pub(crate) fn kernel(&self, text: String) -> Result<Kernel, MarchError> {
        if let Some(folder) = env::var_os(KERNEL_FOLDER) {
            let mut hasher = DefaultHasher::new();
            text.hash(&mut hasher);
            let file = Path::new(&folder).join(format!("{:016x}.wgsl", hasher.finish()));
            let written = user_cache::replace(&file, text.as_bytes());
            written
                .map_err(|why| self.error(format!("{KERNEL_FOLDER}: {} cannot be written: {why}", file.display())))?;
        }
        Kernel::parse_used(text).map_err(|why| self.error(why))
    }

    /// Compile a kernel. Private arrays of more than [`spirv::MAX_INITIALISED_LENGTH`] elements are left uninitialised.
    ///
    /// # Errors
    /// When the kernel has no such entry point, or the driver rejects it.
    pub(crate) fn pipeline(&self, kernel: &Kernel, entry: &str) -> Result<wgpu::ComputePipeline, MarchError> {
        let compiled = spirv::compile(kernel, entry, self.checks, self.residual).map_err(|why| self.error(why))?;
        #[cfg(test)]
        let compiled = if self.multiplies_by_reciprocals { compiled.with_reciprocals() } else { compiled };
        let entry_of = |&(binding, ty): &(u32, wgpu::BindingType)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let entries: Vec<_> = compiled.bindings.iter().map(entry_of).collect();
        let group = wgpu::BindGroupLayoutDescriptor { label: Some(entry), entries: &entries };
        let group = self.device.create_bind_group_layout(&group);
        let layout = wgpu::PipelineLayoutDescriptor {
            label: Some(entry),
            bind_group_layouts: &[Some(&group)],
            ..Default::default()
        };
        let layout = self.device.create_pipeline_layout(&layout);
        let cache = self.cache.as_ref().map(DriverCache::compiled);
        let entry_point = if self.is_failing(DriverCall::Pipeline) { "" } else { entry };
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&layout),
            module: &passthrough_module(&self.device, entry, &compiled.words),
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache,
        });
        self.check().map(|()| pipeline)
    }

    /// A storage buffer that holds `rows`; an empty one if they exceed the limit of a binding, which the next check
    /// reports.
    pub(crate) fn upload<T: Pod>(&self, label: &'static str, rows: &[T]) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        let buffer = self.storage(label, bytes.len() as u64);
        if bytes.len() as u64 <= buffer.size() {
            self.write(&buffer, bytes);
        }
        buffer
    }

    /// Write the first bytes of a buffer.
    pub(super) fn write(&self, buffer: &wgpu::Buffer, bytes: &[u8]) {
        if !self.is_failing(DriverCall::Write) {
            self.queue.write_buffer(buffer, 0, bytes);
        }
    }

    /// A storage buffer of zeros; an empty one beyond the limit of a binding, as for [`upload`](Self::upload).
    pub(crate) fn storage(&self, label: &'static str, bytes: u64) -> wgpu::Buffer {
        let limit = self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size);
        let is_too_large = bytes > limit;
        if is_too_large {
            self.store(MarchError::TooLarge { device: self.name.clone(), limit, what: label, needed: bytes });
        }
        let bytes = if is_too_large { 0 } else { bytes };
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.buffer(label, bytes, usage)
    }

    /// A uniform buffer that holds `rows`.
    ///
    /// # Errors
    /// When `rows` exceed the limit of a uniform binding.
    pub(crate) fn uniform<T: Pod>(&self, label: &'static str, rows: &[T]) -> Result<wgpu::Buffer, MarchError> {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        let (needed, limit) = (bytes.len() as u64, self.limits.max_uniform_buffer_binding_size);
        if needed > limit {
            return Err(MarchError::TooLarge { device: self.name.clone(), limit, what: label, needed });
        }
        let buffer = self.buffer(label, needed, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        self.write(&buffer, bytes);
        Ok(buffer)
    }

    fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let bytes = if self.is_failing(DriverCall::Buffer) { 0 } else { bytes };
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(32).next_multiple_of(8),
            usage,
            mapped_at_creation: false,
        })
    }

    /// Whether `words` words of tables are read faster from a texture: a software device fetches four of them for all
    /// its lanes at once, but gathers storage lane by lane. Hardware caches both.
    pub(crate) fn prefers_texels(&self, words: usize) -> bool {
        let rows = words.div_ceil(COLUMNS_PER_LOAD).div_ceil(shader::TEXELS_PER_ROW as usize);
        self.is_software && rows <= self.limits.max_texture_dimension_2d as usize
    }

    /// A storage texture that holds `words`, four a texel; one row of zeros if there are none. A sampled texture has
    /// mip levels, which a software device looks up for every lane: 20 % of the march.
    pub(crate) fn texels(&self, label: &str, words: &[f32]) -> wgpu::TextureView {
        let texels = words.len().div_ceil(COLUMNS_PER_LOAD).max(1) as u32;
        let width = shader::TEXELS_PER_ROW;
        let size = wgpu::Extent3d { width, height: texels.div_ceil(width), depth_or_array_layers: 1 };
        let is_failing = self.is_failing(DriverCall::Texture);
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: if is_failing { wgpu::Extent3d::default() } else { size },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let mut filled = words.to_vec();
        filled.resize(COLUMNS_PER_LOAD * (size.width * size.height) as usize, 0.0);
        let bytes_per_row = Some(size_of::<[f32; COLUMNS_PER_LOAD]>() as u32 * width);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        if !self.is_failing(DriverCall::Write) {
            self.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&filled), layout, size);
        }
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Copy the bytes of a buffer from `start` to the host, after all submitted work.
    pub(crate) fn read_back(&self, buffer: &wgpu::Buffer, start: u64, bytes: u64) -> Readback {
        let readback = self.buffer("readback", bytes, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let submitted = self.submit(|encoder| encoder.copy_buffer_to_buffer(buffer, start, &readback, 0, bytes));
        let (sender, mapped) = mpsc::channel();
        if self.is_failing(DriverCall::Map) {
            readback.destroy();
        }
        readback.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is dropped only after polling failed.
            let _ = sender.send(result);
        });
        Readback { buffer: readback, bytes, submitted, mapped }
    }

    /// Submit what `record` records.
    fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> wgpu::SubmissionIndex {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if !self.is_failing(DriverCall::Submit) {
            record(&mut encoder);
        }
        self.queue.submit([encoder.finish()])
    }

    /// Submit one dispatch of a pipeline.
    pub(super) fn dispatch(&self, pipeline: &wgpu::ComputePipeline, group: &wgpu::BindGroup, groups: u32) {
        self.submit(|encoder| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        });
    }

    /// Wait for a readback and return its data.
    ///
    /// # Errors
    /// When the device is lost.
    pub(crate) fn finish_readback<T: Pod>(&self, readback: Readback) -> Result<Vec<T>, MarchError> {
        let Readback { buffer, bytes, submitted, mapped } = readback;
        self.check()?;
        self.poll(wgpu::PollType::Wait { submission_index: Some(submitted), timeout: None })?;
        mapped.recv().map_err(|error| self.error(error))?.map_err(|error| self.error(error))?;
        if self.is_failing(DriverCall::Read) {
            buffer.unmap();
        }
        let range = buffer.get_mapped_range(..).map_err(|error| self.error(error))?;
        // Copied bytewise, as the mapping need not be aligned for T.
        let mut rows = bytemuck::pod_collect_to_vec(&range);
        rows.truncate(bytes as usize / size_of::<T>());
        // An error reported in the meantime may be due to this work.
        self.check().map(|()| rows)
    }

    /// Bind group of a pipeline: binding numbers with their resources.
    pub(crate) fn bind<'a>(
        &self,
        pipeline: &wgpu::ComputePipeline,
        bound: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
    ) -> wgpu::BindGroup {
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let mut entries: Vec<wgpu::BindGroupEntry<'_>> = bound.into_iter().map(entry).collect();
        if self.is_failing(DriverCall::Bind) {
            entries.clear();
        }
        let layout = &pipeline.get_bind_group_layout(0);
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// Compile and run one small kernel, and read back the buffer `written`.
    ///
    /// # Errors
    /// As [`pipeline`](Self::pipeline), or when the device is lost.
    pub(crate) fn probe<'a, T: Pod>(
        &self,
        kernel: &Kernel,
        entry: &str,
        groups: u32,
        bound: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
        written: &wgpu::Buffer,
    ) -> Result<Vec<T>, MarchError> {
        self.run(&self.pipeline(kernel, entry)?, groups, bound, written)
    }

    /// Run a pipeline once, and read back the buffer `written`.
    ///
    /// # Errors
    /// When the device is lost.
    pub(crate) fn run<'a, T: Pod>(
        &self,
        pipeline: &wgpu::ComputePipeline,
        groups: u32,
        bound: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
        written: &wgpu::Buffer,
    ) -> Result<Vec<T>, MarchError> {
        let group = self.bind(pipeline, bound);
        self.dispatch(pipeline, &group, groups);
        self.finish_readback(self.read_back(written, 0, written.size()))
    }
}

fn store_first(fault: &Mutex<Option<MarchError>>, error: MarchError) {
    fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

/// A shader module of SPIR-V words that wgpu passes through unchanged.
#[expect(unsafe_code, reason = "justified at the block")]
fn passthrough_module(device: &wgpu::Device, entry: &str, words: &[u32]) -> wgpu::ShaderModule {
    let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
        label: Some(entry),
        spirv: Some(words.into()),
        entry_points: vec![wgpu::PassthroughShaderEntryPoint { name: entry.into(), workgroup_size: (0, 0, 0) }].into(),
        ..Default::default()
    };
    // SAFETY: the words are naga's, of a validated module, less the initialisers of arrays that our kernels clear
    // themselves; a differentiated module has the loops and indices of its source. Every loop counts to a constant or
    // to a bound fixed before it starts. Every index into a private or workgroup array is such a counter, a thread
    // index, or a cell number below the cells of the dispatch, for which `Gpu::pipeline` checks the column lengths.
    // Table rows are clamped before use. Members beyond the last return at once. Conditions before a workgroup barrier
    // are uniform. Tests march shipped cases with the checks on and compare bit for bit. Injected loop counters cost
    // about 10 % on a software device, and far more on some hardware.
    unsafe { device.create_shader_module_passthrough(descriptor) }
}
