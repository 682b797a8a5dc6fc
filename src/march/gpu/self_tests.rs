//! Self-tests of a device: rounding of the operations that kernels use, and long loops.

use super::correct_rounding::Residual;
use super::device::Device;
use super::shader;
use crate::march::{MarchError, Precision};
use crate::physics::Real;
use crate::physics::compensated::two_sum;
use bytemuck::Pod;

/// Results of the self-tests.
#[derive(Clone, Debug)]
pub struct SelfTests {
    /// Rounding in each precision; f64 where the device supports it.
    pub rounding: Vec<RoundingTest>,
    /// Completed iterations of one loop, of a million.
    pub loop_iterations: u32,
}

/// Wrongly rounded results in one precision.
#[derive(Clone, Copy, Debug)]
pub struct RoundingTest {
    /// Precision of operands and results.
    pub precision: Precision,
    /// Wrong results of the operations of the device.
    pub own: WrongRoundings,
    /// Wrong results of the quotients and square roots that kernels use: corrected where those of the device are wrong.
    pub used: WrongRoundings,
}

/// Numbers of results that are not those of IEEE 754, of [`PAIRS`] of each operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrongRoundings {
    /// Sums, or their rounding errors by error-free transformation.
    pub sums: usize,
    /// Quotients.
    pub quotients: usize,
    /// Square roots.
    pub roots: usize,
}

impl WrongRoundings {
    /// Whether quotients and square roots are those of IEEE 754.
    pub fn divides_exactly(&self) -> bool {
        self.quotients + self.roots == 0
    }
}

/// Pairs of operands in each precision.
pub const PAIRS: usize = 1 << 16;
/// Iterations of the loop.
const LOOP_ITERATIONS: u32 = 1_000_000;

impl Device {
    /// Run the self-tests.
    ///
    /// # Errors
    /// When a test kernel does not compile or the device is lost.
    pub fn self_tests(&self) -> Result<SelfTests, MarchError> {
        let precisions = [Precision::F32, Precision::F64].into_iter();
        let rounding = precisions
            .filter(|&precision| precision == Precision::F32 || self.has_f64)
            .map(|precision| {
                let own = self.wrong_roundings(precision)?;
                Ok(RoundingTest { precision, own, used: self.clone().adopt_rounding(precision)? })
            })
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
        Ok(SelfTests { rounding, loop_iterations: turned[0] })
    }

    /// Correct quotients and square roots from now on if the device does not round those of a precision correctly, by
    /// the residual that makes them exact, or leave them if none does. Returns what is then wrong.
    ///
    /// # Errors
    /// As [`self_tests`](Self::self_tests).
    pub(super) fn adopt_rounding(&mut self, precision: Precision) -> Result<WrongRoundings, MarchError> {
        let own = self.wrong_roundings(precision)?;
        if own.divides_exactly() {
            return Ok(own);
        }
        for residual in Residual::ALL {
            self.residual = Some(residual);
            let corrected = self.wrong_roundings(precision)?;
            if corrected.divides_exactly() {
                return Ok(corrected);
            }
        }
        self.residual = None;
        Ok(own)
    }

    /// How many of [`PAIRS`] sums of numbers of very different magnitude, quotients and square roots are wrong.
    pub(super) fn wrong_roundings(&self, precision: Precision) -> Result<WrongRoundings, MarchError> {
        match precision {
            Precision::F32 => self.wrong_roundings_of::<f32>(precision),
            Precision::F64 => self.wrong_roundings_of::<f64>(precision),
        }
    }

    fn wrong_roundings_of<W: Pod + Real<Scalar = W> + PartialEq>(
        &self,
        precision: Precision,
    ) -> Result<WrongRoundings, MarchError> {
        let part = |name: &str| shader::SOURCES.iter().find(|part| part.0 == name).map_or("", |part| part.1);
        let text = format!(
            "{}{}\n{}\n\
             @group(0) @binding(0) var<storage, read> ones: array<real>;\n\
             @group(0) @binding(1) var<storage, read> pairs: array<real>;\n\
             @group(0) @binding(2) var<storage, read_write> results: array<real>;\n\
             @compute @workgroup_size(64) fn round(@builtin(global_invocation_id) id: vec3<u32>) {{\n\
             one = ones[0];\n\
             let a = pairs[2u * id.x];\n\
             let b = pairs[2u * id.x + 1u];\n\
             let sum = two_sum(a, b);\n\
             results[{RESULTS}u * id.x] = sum.high; results[{RESULTS}u * id.x + 1u] = sum.low;\n\
             results[{RESULTS}u * id.x + 2u] = a / b; results[{RESULTS}u * id.x + 3u] = sqrt(a); }}",
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
        let ones = self.upload("ones", &[W::scalar(1.0); 4]);
        let (operands, results) =
            (self.upload("pairs", &pairs), self.storage("results", (RESULTS * PAIRS * size_of::<W>()) as u64));
        let bound = [&ones, &operands, &results].map(wgpu::Buffer::as_entire_binding);
        let groups = (PAIRS / 64) as u32;
        let results: Vec<W> = self.probe(&self.kernel(text)?, "round", groups, (0..).zip(bound), &results)?;
        Ok(count_wrong(&pairs, &results))
    }
}

/// Results of a pair: sum, its rounding error, quotient, and root of the first.
const RESULTS: usize = 4;

/// Numbers of results that differ from the CPU's.
fn count_wrong<R: Real + PartialEq>(pairs: &[R], results: &[R]) -> WrongRoundings {
    let mut wrong = WrongRoundings { sums: 0, quotients: 0, roots: 0 };
    for (pair, result) in pairs.chunks_exact(2).zip(results.chunks_exact(RESULTS)) {
        wrong.sums += usize::from(two_sum(pair[0], pair[1])[..] != result[..2]);
        wrong.quotients += usize::from(pair[0] / pair[1] != result[2]);
        wrong.roots += usize::from(pair[0].sqrt() != result[3]);
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::super::Gpu;
    use super::super::tests::device;
    use super::*;
    use crate::march::March;

    const EXACT: WrongRoundings = WrongRoundings { sums: 0, quotients: 0, roots: 0 };
    const PRECISIONS: [Precision; 2] = [Precision::F32, Precision::F64];

    /// Where the device's multiply-add rounds twice, the test notices it, and kernels take products of halves.
    #[test]
    fn quotients_by_reciprocals_are_noticed_and_corrected_to_those_of_ieee_754() {
        for precision in PRECISIONS {
            let mut device = device(false);
            device.multiplies_by_reciprocals = true;
            let own = device.wrong_roundings(precision).expect("the test runs");
            assert!(own.quotients > PAIRS / 10 && own.sums == 0, "{precision:?}: {own:?}");
            assert_eq!(device.adopt_rounding(precision).expect("the test runs"), EXACT, "{precision:?}");
            assert!(device.residual.is_some());
            assert!(Gpu::new(device, precision).expect("sums are exact").remarks().is_empty());
        }
    }

    #[test]
    fn roots_and_quotients_corrected_by_products_of_halves_are_those_of_ieee_754() {
        let mut device = device(false);
        device.residual = Some(Residual::Halves);
        for precision in PRECISIONS {
            assert_eq!(device.wrong_roundings(precision).expect("the test runs"), EXACT, "{precision:?}");
        }
    }
}
