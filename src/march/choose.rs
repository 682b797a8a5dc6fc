//! Which backend carries the march.

use super::cpu::Cpu;
use super::extrapolated::Extrapolated;
#[cfg(feature = "gpu")]
use super::gpu::{
    Gpu,
    device::{self, Adapter, Device},
};
use super::{March, MarchError, Precision};
use crate::plan::Plan;

/// What was asked for.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Processor, device, or whichever suits the work.
    pub kind: Kind,
    /// `None` takes f64 on the processor and f32 on a device.
    pub precision: Option<Precision>,
    /// Part of a Vulkan device's name.
    pub device: Option<String>,
}

/// Which kind of device marches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// A hardware device where there is one and the work is worth it, else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// A Vulkan device.
    Gpu,
}

/// Cell-steps from which a device earns the time to open it and compile for it: about a second of the processor.
const WORTH_A_DEVICE: f64 = 3e8;

/// Open the backend asked for; `auto` takes hardware where there is some that passes its self-tests and the
/// work is worth it, else the processor. A software device runs only when asked for: it is the processor, and
/// uses it less well.
///
/// # Errors
/// When a device was asked for and none is found, opens, or passes its self-tests.
pub fn open(choice: &Choice, plan: &Plan, members: usize) -> Result<Box<dyn March>, MarchError> {
    match choice.kind {
        Kind::Gpu => on_device(choice),
        Kind::Auto if choice.device.is_some() => on_device(choice),
        Kind::Auto if seeks_hardware(choice, plan, members) => {
            Ok(on_hardware(choice).unwrap_or_else(|| on_cpu(choice)))
        }
        Kind::Auto | Kind::Cpu => Ok(on_cpu(choice)),
    }
}

/// The device that was asked for.
#[cfg(feature = "gpu")]
fn on_device(choice: &Choice) -> Result<Box<dyn March>, MarchError> {
    on_adapter(choice, device::find(choice.device.as_deref())?)
}

#[cfg(not(feature = "gpu"))]
fn on_device(_choice: &Choice) -> Result<Box<dyn March>, MarchError> {
    let reason = "this build marches on the processor alone".to_owned();
    Err(MarchError::NoDevice { reason, remedy: "build it with the feature `gpu`".to_owned() })
}

/// A hardware device, where there is one. One that fails its self-tests is no error here: nobody asked for it.
#[cfg(feature = "gpu")]
fn on_hardware(choice: &Choice) -> Option<Box<dyn March>> {
    let may_exist = device::hardware_may_exist();
    let adapters = may_exist.then(device::adapters).into_iter().flatten();
    let hardware = adapters.into_iter().find(|adapter| !adapter.is_software())?;
    on_adapter(choice, hardware).ok()
}

#[cfg(not(feature = "gpu"))]
fn on_hardware(_choice: &Choice) -> Option<Box<dyn March>> {
    None
}

#[cfg(feature = "gpu")]
fn on_adapter(choice: &Choice, adapter: Adapter) -> Result<Box<dyn March>, MarchError> {
    let device = Device::open(adapter, false)?;
    Ok(Box::new(Gpu::new(device, choice.precision.unwrap_or(Precision::F32))?))
}

/// What [`open`] opens, marched at both resolutions of a plan.
///
/// # Errors
/// As [`open`].
pub fn open_extrapolated(choice: &Choice, plan: &Plan, members: usize) -> Result<Box<dyn March>, MarchError> {
    Ok(Box::new(Extrapolated::new(open(choice, plan, members)?)))
}

/// Whether [`open`] looks for a hardware device because the work is worth one.
pub fn seeks_hardware(choice: &Choice, plan: &Plan, members: usize) -> bool {
    choice.kind == Kind::Auto && choice.device.is_none() && is_worth_a_device(plan, members)
}

fn on_cpu(choice: &Choice) -> Box<dyn March> {
    Box::new(Cpu::new(choice.precision.unwrap_or(Precision::F64)))
}

fn is_worth_a_device(plan: &Plan, members: usize) -> bool {
    (plan.cells() * plan.steps()) as f64 * members as f64 >= WORTH_A_DEVICE
}
