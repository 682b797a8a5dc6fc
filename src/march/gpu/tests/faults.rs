//! Errors of the driver: reported, not panics; exhausted memory halves the batch.

use super::device;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::gpu::Gpu;
use crate::march::gpu::device::injection::provoke_validation_error;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;

#[test]
fn a_buffer_beyond_the_limits_of_the_device_is_an_error_of_the_next_check() {
    let device = device(true);
    assert!(device.check().is_ok());
    let bytes = device.limits.max_storage_buffer_binding_size + 8;
    device.storage("too large", bytes);
    let found = device.check().expect_err("above the limit of a binding");
    assert!(matches!(found, MarchError::TooLarge { what: "too large", needed, .. } if needed == bytes), "{found}");
    assert!(device.check().is_ok(), "an error is reported once");
}

#[test]
fn a_validation_error_of_the_driver_does_not_panic() {
    let device = device(true);
    provoke_validation_error(&device);
    let found = device.check().expect_err("wgpu refuses the buffer");
    assert!(matches!(&found, MarchError::Device { message, .. } if message.contains("too large")), "{found}");
    assert!(device.wait().is_ok());
}

#[test]
fn exhausted_memory_halves_the_batch_and_changes_no_bit() {
    let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
    let mut builder = case.to_builder();
    builder.resolution.cells = 8;
    builder.resolution.max_step_s = 10.0;
    builder.resolution.step_growth = 1.0;
    let case = builder.build().expect("a valid case");
    let plan = Plan::new(&case);
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: 1 };
    let ensemble = Ensemble::sample(case.factors(), Bounds::Small, &sampling, 6);
    let exhausted = || MarchError::OutOfMemory { device: "test".to_owned() };
    let mut gpu = Gpu::new(device(false), Precision::F32).expect("the device passes its self-tests");
    let whole = gpu.march(&plan, &ensemble, 0..6).expect("it marches");
    gpu.device.store(exhausted());
    let halves = gpu.march(&plan, &ensemble, 0..6).expect("smaller batches fit");
    assert_eq!((halves.first, halves.members()), (0, 6));
    assert_eq!(halves.temperatures_k, whole.temperatures_k);
    assert_eq!(gpu.capacity(&plan), 3);
    assert!(gpu.remarks().iter().all(|remark| remark.contains("at most 3 members")) && gpu.remarks().len() == 1);
    // One member cannot be divided.
    gpu.device.store(exhausted());
    assert!(matches!(gpu.march(&plan, &ensemble, 0..1), Err(MarchError::OutOfMemory { .. })));
    // Another error is not tried again.
    gpu.device.store(gpu.device.error("internal"));
    assert!(matches!(gpu.march(&plan, &ensemble, 0..6), Err(MarchError::Device { .. })));
}
