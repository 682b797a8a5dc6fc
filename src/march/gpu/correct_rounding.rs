//! Correctly rounded quotients and square roots on devices whose own are not.
//!
//! Vulkan allows a quotient in f32 to be off by 2.5 units in the last place, and a square root, the inverse of an
//! inverse root, by more. NVIDIA's is a product with an approximate reciprocal. Here every scalar quotient and root of
//! a kernel's SPIR-V gets one correction by its residual. A fused multiply-add gives the residual without rounding
//! (P. Markstein, IBM Journal of Research and Development 34, 1990, pages 111-119; J.-M. Muller and others, Handbook of
//! Floating-Point Arithmetic, 2nd edition 2018, sections 4.7 and 4.8), and so does the product of halves of both
//! factors (T. J. Dekker, Numerische Mathematik 18, 1971, pages 224-242) where a device rounds the product of its
//! multiply-add. Where the correction is no number, as for divisors of zero and infinite operands, the device's own
//! result stays. Results below the smallest normal number are not corrected.

use super::spirv_words::{HEADER_WORDS, instructions, push};

const EXTENDED_IMPORT: u32 = 11;
const EXTENDED: u32 = 12;
const TYPE_BOOL: u32 = 20;
const TYPE_FLOAT: u32 = 22;
const CONSTANT: u32 = 43;
const NEGATE: u32 = 127;
const ADD: u32 = 129;
const SUBTRACT: u32 = 131;
const MULTIPLY: u32 = 133;
const DIVIDE: u32 = 136;
const SELECT: u32 = 169;
const ORDERED_EQUAL: u32 = 180;
/// Numbers of the instructions of the set `GLSL.std.450`.
const SQRT: u32 = 31;
pub(super) const FMA: u32 = 50;

/// How residuals of quotients and square roots are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Residual {
    /// Residual by a multiply-add that rounds once.
    Fused,
    /// Residual by sums of products of half words, with the operations in the order of Dekker.
    Halves,
}

impl Residual {
    /// All kinds, in ascending order of cost.
    pub const ALL: [Self; 2] = [Self::Fused, Self::Halves];
}

/// A scalar type with the identifiers of its constants.
struct Float {
    ty: u32,
    one: u32,
    half: u32,
    /// 1 + 2ᵏ, where k is half of the bits of a mantissa, rounded up.
    splitter: u32,
}

/// The instructions that replace one.
struct Correction<'a> {
    written: &'a mut Vec<u32>,
    next: &'a mut u32,
    float: &'a Float,
    residual: Residual,
    functions: u32,
    bool_type: u32,
}

impl Correction<'_> {
    fn identifier(&mut self) -> u32 {
        *self.next += 1;
        *self.next - 1
    }

    fn emit(&mut self, code: u32, operands: &[u32]) -> u32 {
        let made = self.identifier();
        push(self.written, code, &[&[self.float.ty, made], operands].concat());
        made
    }

    /// c − a·b, without rounding where a·b is close to c.
    fn residual(&mut self, a: u32, b: u32, c: u32) -> u32 {
        match self.residual {
            Residual::Fused => {
                let negative = self.emit(NEGATE, &[a]);
                self.emit(EXTENDED, &[self.functions, FMA, negative, b, c])
            }
            Residual::Halves => {
                let ([a_high, a_low], [b_high, b_low]) = (self.halves(a), self.halves(b));
                let product = self.emit(MULTIPLY, &[a, b]);
                let high = self.emit(MULTIPLY, &[a_high, b_high]);
                let mut lost = self.emit(SUBTRACT, &[high, product]);
                for (one, other) in [(a_high, b_low), (a_low, b_high), (a_low, b_low)] {
                    let part = self.emit(MULTIPLY, &[one, other]);
                    lost = self.emit(ADD, &[lost, part]);
                }
                let near = self.emit(SUBTRACT, &[c, product]);
                self.emit(SUBTRACT, &[near, lost])
            }
        }
    }

    /// Two numbers of half the bits whose sum is x.
    fn halves(&mut self, x: u32) -> [u32; 2] {
        let scaled = self.emit(MULTIPLY, &[x, self.float.splitter]);
        let rest = self.emit(SUBTRACT, &[scaled, x]);
        let high = self.emit(SUBTRACT, &[scaled, rest]);
        [high, self.emit(SUBTRACT, &[x, high])]
    }

    /// c + a·b, for a product that is small beside c.
    fn corrected(&mut self, a: u32, b: u32, c: u32) -> u32 {
        match self.residual {
            Residual::Fused => self.emit(EXTENDED, &[self.functions, FMA, a, b, c]),
            Residual::Halves => {
                let product = self.emit(MULTIPLY, &[a, b]);
                self.emit(ADD, &[c, product])
            }
        }
    }

    /// `corrected` where it is a number, else `own`, as `result`.
    fn choose(&mut self, result: u32, corrected: u32, own: u32) {
        let is_number = self.identifier();
        push(self.written, ORDERED_EQUAL, &[self.bool_type, is_number, corrected, corrected]);
        push(self.written, SELECT, &[self.float.ty, result, is_number, corrected, own]);
    }

    fn quotient(&mut self, result: u32, numerator: u32, divisor: u32) {
        let one = self.float.one;
        let approximate = self.emit(DIVIDE, &[one, divisor]);
        let error = self.residual(divisor, approximate, one);
        let reciprocal = self.corrected(error, approximate, approximate);
        let own = self.emit(MULTIPLY, &[numerator, approximate]);
        let near = self.emit(MULTIPLY, &[numerator, reciprocal]);
        let residual = self.residual(divisor, near, numerator);
        let corrected = self.corrected(residual, reciprocal, near);
        self.choose(result, corrected, own);
    }

    fn root(&mut self, result: u32, square: u32) {
        let own = self.emit(EXTENDED, &[self.functions, SQRT, square]);
        let slope = self.emit(DIVIDE, &[self.float.half, own]);
        let residual = self.residual(own, own, square);
        let corrected = self.corrected(residual, slope, own);
        self.choose(result, corrected, own);
    }
}

/// The words of a kernel with every quotient and square root correctly rounded.
///
/// # Errors
/// When a quotient or root is not of scalars.
pub(super) fn with_correct_rounding(words: &[u32], residual: Residual) -> Result<Vec<u32>, String> {
    let mut next = words[3];
    let mut floats: Vec<Float> = Vec::new();
    let (mut functions, mut bool_type) = (0, 0);
    for (code, operands) in instructions(words) {
        match code {
            EXTENDED_IMPORT => functions = operands[0],
            TYPE_BOOL => bool_type = operands[0],
            TYPE_FLOAT => {
                floats.push(Float { ty: operands[0], one: next, half: next + 1, splitter: next + 2 });
                next += 3;
            }
            _ => {}
        }
    }
    let declares_bool = bool_type == 0;
    if declares_bool {
        bool_type = next;
        next += 1;
    }
    let of = |ty: u32| {
        floats.iter().find(|float| float.ty == ty).ok_or("a quotient or root of vectors has no correction".to_owned())
    };
    let mut written = words[..HEADER_WORDS].to_vec();
    for (code, operands) in instructions(words) {
        match (code, operands) {
            (DIVIDE, &[ty, result, numerator, divisor]) => {
                Correction { written: &mut written, next: &mut next, float: of(ty)?, residual, functions, bool_type }
                    .quotient(result, numerator, divisor);
            }
            (EXTENDED, &[ty, result, set, SQRT, square]) if set == functions => {
                Correction { written: &mut written, next: &mut next, float: of(ty)?, residual, functions, bool_type }
                    .root(result, square);
            }
            (TYPE_FLOAT, &[ty, width, ..]) => {
                push(&mut written, code, operands);
                let float = of(ty)?;
                let splitter = if width == 64 { 134_217_729.0 } else { 4_097.0 };
                for (constant, value) in [(float.one, 1.0_f64), (float.half, 0.5), (float.splitter, splitter)] {
                    let bits = value.to_bits();
                    let long = [ty, constant, bits as u32, (bits >> 32) as u32];
                    let short = [ty, constant, (value as f32).to_bits()];
                    push(&mut written, CONSTANT, if width == 64 { &long } else { &short });
                }
                if declares_bool && floats[0].ty == ty {
                    push(&mut written, TYPE_BOOL, &[bool_type]);
                }
            }
            _ => push(&mut written, code, operands),
        }
    }
    written[3] = next;
    Ok(written)
}
