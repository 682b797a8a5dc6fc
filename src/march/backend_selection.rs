//! Selection of the backend for a march.

use super::cpu::{Cpu, InstructionSet};
use super::fallback::FallbackMarch;
#[cfg(feature = "gpu")]
use super::gpu::{
    Gpu,
    device::{self, Adapter, Device},
};
use super::richardson::RichardsonMarch;
use super::{Backend, March, MarchError, Precision};
use crate::plan::Plan;

/// The backend options of a run.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct BackendOptions {
    /// Device that integrates the members in time
    #[cfg_attr(feature = "command", arg(long, value_enum, default_value_t))]
    pub backend: BackendKind,
    /// Floating-point precision [default: f64 on the CPU, f32 on a GPU]
    #[cfg_attr(feature = "command", arg(long, value_enum))]
    pub precision: Option<Precision>,
    /// Part of the name of the Vulkan device to use
    #[cfg_attr(feature = "command", arg(long))]
    pub device: Option<String>,
    /// SIMD instruction set of the CPU: avx-512, avx2, neon or scalar, for tests and measurements
    ///
    /// `None`: the widest.
    #[cfg_attr(feature = "command", arg(long, value_name = "NAME", hide = true))]
    #[serde(skip)]
    pub instruction_set: Option<InstructionSet>,
}

/// Kind of backend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum BackendKind {
    /// A hardware GPU if there is one and the run is long enough to pay for opening it, otherwise the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// Any Vulkan device, including software.
    Gpu,
}

/// Cell-steps above which a GPU saves more time than opening it and compiling its kernel take: about a second on the
/// CPU.
const MIN_GPU_CELL_STEPS: f64 = 3e8;

/// Open a backend. [`BackendKind::Auto`] takes a hardware GPU that passes its self-tests if the work is worth it, else
/// the CPU. A software device is opened only on request: it runs on the CPU and uses it less well.
///
/// # Errors
/// When a GPU is requested and none is found, can be opened, or passes its self-tests.
pub fn open(options: &BackendOptions, plan: &Plan, members: usize) -> Result<Box<dyn March>, MarchError> {
    match options.backend {
        BackendKind::Gpu => open_requested_gpu(options),
        BackendKind::Auto if options.device.is_some() => open_requested_gpu(options),
        BackendKind::Auto if considers_gpu(options, plan, members) => {
            Ok(open_hardware_gpu(options).unwrap_or_else(|| open_cpu(options)))
        }
        BackendKind::Auto | BackendKind::Cpu => Ok(open_cpu(options)),
    }
}

/// The requested GPU.
#[cfg(feature = "gpu")]
fn open_requested_gpu(options: &BackendOptions) -> Result<Box<dyn March>, MarchError> {
    open_adapter(options, device::find(options.device.as_deref())?)
}

#[cfg(not(feature = "gpu"))]
fn open_requested_gpu(_options: &BackendOptions) -> Result<Box<dyn March>, MarchError> {
    let reason = "this build supports the CPU only".to_owned();
    Err(MarchError::NoDevice { reason, remedy: "build with the feature `gpu`".to_owned() })
}

/// A hardware GPU, if there is one. A failed self-test is no error here, as the user did not request a GPU.
#[cfg(feature = "gpu")]
fn open_hardware_gpu(options: &BackendOptions) -> Option<Box<dyn March>> {
    let may_exist = device::hardware_may_exist();
    let adapters = may_exist.then(device::adapters).into_iter().flatten();
    let hardware = adapters.into_iter().find(|adapter| !adapter.is_software())?;
    open_adapter(options, hardware).ok()
}

#[cfg(not(feature = "gpu"))]
fn open_hardware_gpu(_options: &BackendOptions) -> Option<Box<dyn March>> {
    None
}

#[cfg(feature = "gpu")]
fn open_adapter(options: &BackendOptions, adapter: Adapter) -> Result<Box<dyn March>, MarchError> {
    let device = Device::open(adapter, false)?;
    Ok(Box::new(Gpu::new(device, options.precision.unwrap_or(Precision::F32))?))
}

/// [`open`], with Richardson extrapolation over both resolutions of a plan. When a device fails later, the CPU takes
/// over.
///
/// # Errors
/// As [`open`].
pub fn open_extrapolated(options: &BackendOptions, plan: &Plan, members: usize) -> Result<Box<dyn March>, MarchError> {
    let march = open(options, plan, members)?;
    let Backend { kind, precision, .. } = march.backend();
    let march = Box::new(RichardsonMarch::new(march));
    if kind == "cpu" {
        return Ok(march);
    }
    let reserve = RichardsonMarch::new(Box::new(Cpu::new(precision)));
    Ok(Box::new(FallbackMarch::new(march, Box::new(reserve))))
}

/// Whether [`open`] looks for a hardware GPU because of the amount of work. Vectors of the CPU ask for the CPU.
pub fn considers_gpu(options: &BackendOptions, plan: &Plan, members: usize) -> bool {
    let is_open = options.backend == BackendKind::Auto && options.device.is_none() && options.instruction_set.is_none();
    is_open && exceeds_gpu_threshold(plan, members)
}

fn open_cpu(options: &BackendOptions) -> Box<dyn March> {
    let cpu = Cpu::new(options.precision.unwrap_or(Precision::F64));
    Box::new(match options.instruction_set {
        Some(instruction_set) => cpu.with_instruction_set(instruction_set),
        None => cpu,
    })
}

fn exceeds_gpu_threshold(plan: &Plan, members: usize) -> bool {
    (plan.cells() * plan.steps()) as f64 * members as f64 >= MIN_GPU_CELL_STEPS
}
