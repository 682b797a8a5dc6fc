//! Tests that read what plans and kernels hold, which is not public. They are compiled into the library's unit tests.

mod layup; // what a layup has beside its plies
mod parity; // whole marches of every shipped case: device, lanes, one at a time; f32 and f64
mod pilot; // cells and steps for an error that was asked for, and what two resolutions say of a third
mod properties; // truths of heat that no case may break, and what a seed promises
mod shaders; // naga: kernels, twins of names, the loop budget
mod states; // conductivities scaled state by state, and PATO's inverse problem
mod webgpu; // every kernel through a second WGSL compiler, that of Chromium
mod workgroup; // members cut into blocks of cells, a lane each, against the processor
