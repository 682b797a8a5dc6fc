//! Selection of the backend for a march.

use super::cpu::Cpu;
use super::extrapolated::Extrapolated;
#[cfg(feature = "gpu")]
use super::gpu::{
    Gpu,
    device::{self, Adapter, Device},
};
use super::{March, MarchError, Precision};
use crate::plan::Plan;

/// The backend options of a run.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// CPU, GPU or automatic.
    pub kind: Kind,
    /// `None`: f64 on the CPU, f32 on a GPU.
    pub precision: Option<Precision>,
    /// Part of the name of a Vulkan device.
    pub device: Option<String>,
}

/// Kind of backend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// A hardware GPU if there is one and the work exceeds a threshold, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// A Vulkan device.
    Gpu,
}

/// Cell-steps above which a GPU saves more time than opening it and compiling its kernel take: about a second on the
/// CPU.
const WORTH_A_DEVICE: f64 = 3e8;

/// Open a backend. [`BackendKind::Auto`] takes a hardware GPU that passes its self-tests if the work is worth it, else
/// the CPU. A software device is opened only on request: it runs on the CPU and uses it less well.
///
/// # Errors
/// When a GPU is requested and none is found, can be opened, or passes its self-tests.
pub fn open(options: &Choice, plan: &Plan, members: usize) -> Result<Box<dyn March>, MarchError> {
    match options.kind {
        Kind::Gpu => on_device(options),
        Kind::Auto if options.device.is_some() => on_device(options),
        Kind::Auto if seeks_hardware(options, plan, members) => {
            Ok(on_hardware(options).unwrap_or_else(|| on_cpu(options)))
        }
        Kind::Auto | Kind::Cpu => Ok(on_cpu(options)),
    }
}

/// The requested GPU.
#[cfg(feature = "gpu")]
fn on_device(options: &Choice) -> Result<Box<dyn March>, MarchError> {
    on_adapter(options, device::find(options.device.as_deref())?)
}

#[cfg(not(feature = "gpu"))]
fn on_device(_options: &Choice) -> Result<Box<dyn March>, MarchError> {
    let reason = "this build supports the CPU only".to_owned();
    Err(MarchError::NoDevice { reason, remedy: "build with the feature `gpu`".to_owned() })
}

/// A hardware GPU, if there is one. A failed self-test is no error here, as the user did not request a GPU.
#[cfg(feature = "gpu")]
fn on_hardware(options: &Choice) -> Option<Box<dyn March>> {
    let may_exist = device::hardware_may_exist();
    let adapters = may_exist.then(device::adapters).into_iter().flatten();
    let hardware = adapters.into_iter().find(|adapter| !adapter.is_software())?;
    on_adapter(options, hardware).ok()
}

#[cfg(not(feature = "gpu"))]
fn on_hardware(_options: &Choice) -> Option<Box<dyn March>> {
    None
}

#[cfg(feature = "gpu")]
fn on_adapter(options: &Choice, adapter: Adapter) -> Result<Box<dyn March>, MarchError> {
    let device = Device::open(adapter, false)?;
    Ok(Box::new(Gpu::new(device, options.precision.unwrap_or(Precision::F32))?))
}

/// [`open`], with Richardson extrapolation over both resolutions of a plan.
///
/// # Errors
/// As [`open`].
pub fn open_extrapolated(options: &Choice, plan: &Plan, members: usize) -> Result<Box<dyn March>, MarchError> {
    Ok(Box::new(Extrapolated::new(open(options, plan, members)?)))
}

/// Whether [`open`] looks for a hardware GPU because of the amount of work.
pub fn seeks_hardware(options: &Choice, plan: &Plan, members: usize) -> bool {
    options.kind == Kind::Auto && options.device.is_none() && is_worth_a_device(plan, members)
}

fn on_cpu(options: &Choice) -> Box<dyn March> {
    Box::new(Cpu::new(options.precision.unwrap_or(Precision::F64)))
}

fn is_worth_a_device(plan: &Plan, members: usize) -> bool {
    (plan.cells() * plan.steps()) as f64 * members as f64 >= WORTH_A_DEVICE
}
