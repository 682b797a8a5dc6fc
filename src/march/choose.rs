//! Which backend carries the march.

use super::cpu::Cpu;
use super::extrapolated::Extrapolated;
use super::gpu::Gpu;
use super::gpu::device::{self, Adapter, Device};
use super::{March, MarchError, Precision};
use crate::plan::Plan;

/// What was asked for.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    pub kind: Kind,
    /// `None` takes f64 on the processor and f32 on a device.
    pub precision: Option<Precision>,
    /// Part of a Vulkan device's name.
    pub device: Option<String>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    #[default]
    Auto,
    Cpu,
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
    let on_gpu = |adapter: Adapter| -> Result<Box<dyn March>, MarchError> {
        let device = Device::open(adapter, false)?;
        Ok(Box::new(Gpu::new(device, choice.precision.unwrap_or(Precision::F32))?))
    };
    match choice.kind {
        Kind::Gpu => on_gpu(device::find(choice.device.as_deref())?),
        Kind::Auto if choice.device.is_some() => on_gpu(device::find(choice.device.as_deref())?),
        Kind::Auto if seeks_hardware(choice, plan, members) && device::hardware_may_exist() => {
            let hardware = device::adapters().into_iter().find(|adapter| !adapter.is_software());
            // A device that fails its self-tests is no error here: nobody asked for it.
            match hardware.map(on_gpu) {
                Some(Ok(march)) => Ok(march),
                Some(Err(_)) | None => Ok(on_cpu(choice)),
            }
        }
        Kind::Auto | Kind::Cpu => Ok(on_cpu(choice)),
    }
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
