//! All integration tests in one binary, so that the crate is linked once.

mod cli; // the built binary from outside: exit codes, messages, files
mod fit; // least squares against certified answers, bounds, identification
mod shaders; // naga: kernels, layouts, twins of names
mod support; // tolerances with their reasons, cases
mod twins; // each WGSL function against its Rust twin, on the device
mod verification; // every row of the verification suite, and that a row can fail
