//! The SIMD instruction sets of the processor, and the kernels that each can run.

use crate::kernel::{self, Kernel};

/// A SIMD instruction set that this processor has: the only way to a kernel that needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstructionSet(Vectors);

/// Without vectors, members are marched one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Vectors {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "aarch64")]
    Neon,
}

impl InstructionSet {
    /// No SIMD.
    pub const SCALAR: Self = Self(Vectors::Scalar);

    /// The instruction sets of this processor, the widest first, no SIMD last.
    #[cfg(target_arch = "x86_64")]
    pub fn available() -> Vec<Self> {
        let has_avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq");
        let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        let supported = [(has_avx512, Vectors::Avx512), (has_avx2, Vectors::Avx2), (true, Vectors::Scalar)];
        supported.into_iter().filter_map(|(is_supported, vectors)| is_supported.then_some(Self(vectors))).collect()
    }

    /// The instruction sets of this processor, the widest first, no SIMD last.
    #[cfg(target_arch = "aarch64")]
    pub fn available() -> Vec<Self> {
        vec![Self(Vectors::Neon), Self::SCALAR]
    }

    /// The instruction sets of this processor, the widest first, no SIMD last.
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    pub fn available() -> Vec<Self> {
        vec![Self::SCALAR]
    }

    /// `avx-512`, `avx2`, `neon` or `scalar`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Vectors::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx512 => "avx-512",
            #[cfg(target_arch = "aarch64")]
            Vectors::Neon => "neon",
        }
    }

    /// The name for people: `no SIMD` for none.
    pub fn title(self) -> &'static str {
        match self.0 {
            Vectors::Scalar => "no SIMD",
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx512 => "AVX-512",
            #[cfg(target_arch = "aarch64")]
            Vectors::Neon => "NEON",
        }
    }

    /// The kernel in double precision.
    pub fn f64(self) -> &'static Kernel<f64> {
        match self.0 {
            Vectors::Scalar => &kernel::scalar_f64::KERNEL,
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => &kernel::avx2_f64::KERNEL,
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx512 => &kernel::avx512_f64::KERNEL,
            #[cfg(target_arch = "aarch64")]
            Vectors::Neon => &kernel::neon_f64::KERNEL,
        }
    }

    /// The kernel in single precision.
    pub fn f32(self) -> &'static Kernel<f32> {
        match self.0 {
            Vectors::Scalar => &kernel::scalar_f32::KERNEL,
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => &kernel::avx2_f32::KERNEL,
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx512 => &kernel::avx512_f32::KERNEL,
            #[cfg(target_arch = "aarch64")]
            Vectors::Neon => &kernel::neon_f32::KERNEL,
        }
    }

    /// The kernel with derivatives, in double precision.
    pub fn derivatives_f64(self) -> &'static Kernel<f64> {
        match self.0 {
            Vectors::Scalar => &kernel::scalar_derivatives_f64::KERNEL,
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => &kernel::avx2_derivatives_f64::KERNEL,
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx512 => &kernel::avx512_derivatives_f64::KERNEL,
            #[cfg(target_arch = "aarch64")]
            Vectors::Neon => &kernel::neon_derivatives_f64::KERNEL,
        }
    }

    /// The kernel with derivatives, in single precision: it serves to compare with devices and has no vectors.
    pub fn derivatives_f32(self) -> &'static Kernel<f32> {
        &kernel::scalar_derivatives_f32::KERNEL
    }
}
