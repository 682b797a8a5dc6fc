//! Self-tests of a device: error-free transformations and long loops.

use super::device::Device;
use super::shader;
use crate::march::{MarchError, Precision};
use crate::physics::Real;
use crate::physics::compensated::two_sum;
use bytemuck::Pod;

/// Results of the self-tests.
#[derive(Clone, Debug)]
pub struct SelfTests {
    /// Precision, sums with a wrong rounding error, and sums tried; f64 where the device supports it.
    pub error_free_transformations: Vec<(Precision, usize, usize)>,
    /// Completed iterations of one loop, of a million.
    pub loop_iterations: u32,
}

/// Pairs summed in each precision.
pub(super) const PAIRS: usize = 4096;
/// Iterations of the loop.
const LOOP_ITERATIONS: u32 = 1_000_000;

impl Device {
    /// Run the self-tests.
    ///
    /// # Errors
    /// When a test kernel does not compile or the device is lost.
    pub fn self_tests(&self) -> Result<SelfTests, MarchError> {
        let precisions = [Precision::F32, Precision::F64];
        let error_free_transformations = precisions
            .into_iter()
            .filter(|&precision| precision == Precision::F32 || self.has_f64)
            .map(|precision| Ok((precision, self.wrong_sums(precision)?, PAIRS)))
            .collect::<Result<_, MarchError>>()?;
        let text = "@group(0) @binding(0) var<storage, read> iterations: array<u32>;\n\
             @group(0) @binding(1) var<storage, read_write> turned: array<u32>;\n\
             @compute @workgroup_size(1) fn turns() {\n\
             var value = 1u; var count = 0u;\n\
             for (var i = 0u; i < iterations[0]; i++) { value = value * 1664525u + 1013904223u; count++; }\n\
             turned[0] = count; turned[1] = value; }"
            .to_string();
        let (iterations, turned) = (self.upload("iterations", &[LOOP_ITERATIONS; 4]), self.storage("turned", 16));
        let bound = [(0, iterations.as_entire_binding()), (1, turned.as_entire_binding())];
        let turned: Vec<u32> = self.probe(&self.kernel(text)?, "turns", 1, bound, &turned)?;
        Ok(SelfTests { error_free_transformations, loop_iterations: turned[0] })
    }

    /// How many of [`PAIRS`] sums of numbers of very different magnitude have a wrong rounding error.
    pub(super) fn wrong_sums(&self, precision: Precision) -> Result<usize, MarchError> {
        match precision {
            Precision::F32 => self.wrong_sums_of::<f32>(precision),
            Precision::F64 => self.wrong_sums_of::<f64>(precision),
        }
    }

    fn wrong_sums_of<W: Pod + Real<Scalar = W> + PartialEq>(&self, precision: Precision) -> Result<usize, MarchError> {
        let part = |name: &str| shader::SOURCES.iter().find(|part| part.0 == name).map_or("", |part| part.1);
        let text = format!(
            "{}{}\n{}\n\
             @group(0) @binding(0) var<storage, read> ones: array<real>;\n\
             @group(0) @binding(1) var<storage, read> pairs: array<real>;\n\
             @group(0) @binding(2) var<storage, read_write> sums: array<real>;\n\
             @compute @workgroup_size(64) fn transforms(@builtin(global_invocation_id) id: vec3<u32>) {{\n\
             one = ones[0];\n\
             let sum = two_sum(pairs[2u * id.x], pairs[2u * id.x + 1u]);\n\
             sums[2u * id.x] = sum.high; sums[2u * id.x + 1u] = sum.low; }}",
            shader::preamble(precision),
            part("prelude"),
            part("compensated"),
        );
        // A linear congruential generator is random enough to give every pair its own rounding error.
        let mut seed = 12_345_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let pairs: Vec<W> = (0..PAIRS)
            .flat_map(|_| [300.0 + 1500.0 * next(), (next() - 0.5) * 10_f64.powf(-6.0 * next())])
            .map(W::scalar)
            .collect();
        let buffers = [("ones", &[W::scalar(1.0); 4][..]), ("pairs", &pairs), ("sums", &pairs)]
            .map(|(label, rows)| self.upload(label, rows));
        let bound = (0..).zip(buffers.iter().map(wgpu::Buffer::as_entire_binding));
        let sums: Vec<W> = self.probe(&self.kernel(text)?, "transforms", (PAIRS / 64) as u32, bound, &buffers[2])?;
        Ok(count_wrong_sums(&pairs, &sums))
    }
}

/// Number of pairs whose sum or error term differs from the CPU's.
fn count_wrong_sums<R: Real + PartialEq>(pairs: &[R], sums: &[R]) -> usize {
    pairs.chunks_exact(2).zip(sums.chunks_exact(2)).filter(|(pair, sum)| two_sum(pair[0], pair[1])[..] != **sum).count()
}
