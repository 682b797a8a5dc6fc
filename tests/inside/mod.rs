//! Tests of private contents of plans and kernels; compiled into the library's unit tests.

mod adapt; // adaptation to a tolerance, Richardson extrapolation
mod cooperative; // cooperative kernels against the processor
mod fronts; // fronts of conversion in random layups
mod layup; // holder, extinction, contact factors, sensor sides and depth factors
mod parity; // full marches of every shipped case: GPU, SIMD lanes, one member at a time; f32 and f64
mod properties; // physical properties of every case, reproducibility of seeds
mod shaders; // naga: kernels, function names of twins, the loop limit
mod states; // conductivity factors of single states, PATO's inverse problem
mod webgpu; // every kernel through Chromium's WGSL compiler
