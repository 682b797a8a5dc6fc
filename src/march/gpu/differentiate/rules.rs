//! Differentiation rules of the operations.
//!
//! Each performs the operations of [`physics::dual`](crate::physics::dual) in the same order, without the additions and
//! multiplications by zero tangents of constants, which change no bit.

use super::contains_reals;
use super::function::{FunctionTransform, Value};
use naga::{BinaryOperator, Expression, MathFunction, ScalarKind, UnaryOperator};

impl FunctionTransform<'_> {
    /// The tangent of a value, appended after it; `None` where it is inactive or not real.
    pub(super) fn tangent(&mut self, value: Value) -> Result<Option<Value>, String> {
        if !contains_reals(self.info[value].ty.inner_with(&self.module.types), &self.module.types) {
            return Ok(None);
        }
        let expression = &self.source.expressions[value];
        let same_operation = match *expression {
            Expression::Load { pointer } => self.tangent_of(pointer).map(|pointer| Expression::Load { pointer }),
            Expression::Access { base, index } => self.tangent_of(base).map(|base| Expression::Access { base, index }),
            Expression::AccessIndex { base, index } => {
                self.tangent_of(base).map(|base| Expression::AccessIndex { base, index })
            }
            Expression::Splat { size, value } => self.tangent_of(value).map(|value| Expression::Splat { size, value }),
            Expression::Swizzle { size, vector, pattern } => {
                self.tangent_of(vector).map(|vector| Expression::Swizzle { size, vector, pattern })
            }
            Expression::Unary { op: op @ UnaryOperator::Negate, expr } => {
                self.tangent_of(expr).map(|expr| Expression::Unary { op, expr })
            }
            Expression::As { expr, kind: kind @ ScalarKind::Float, convert: convert @ Some(_) } => {
                self.tangent_of(expr).map(|expr| Expression::As { expr, kind, convert })
            }
            Expression::Compose { ty, ref components } => {
                if components.iter().all(|&part| self.tangent_of(part).is_none()) {
                    return Ok(None);
                }
                let components = components.iter().map(|&part| self.tangent_or_zero(part)).collect();
                Some(Expression::Compose { ty, components })
            }
            Expression::Select { condition, accept, reject } => {
                return Ok(self.select_tangent(condition, accept, reject));
            }
            Expression::Binary { op, left, right } => return self.binary_tangent(value, op, left, right),
            Expression::Math { fun, arg, arg1, arg2, .. } => return self.math_tangent(value, fun, arg, arg1, arg2),
            _ => None,
        };
        Ok(same_operation.map(|same_operation| self.append(same_operation)))
    }

    /// Tangents of sums, products and quotients.
    fn binary_tangent(
        &mut self,
        value: Value,
        op: BinaryOperator,
        a: Value,
        b: Value,
    ) -> Result<Option<Value>, String> {
        let (tangent_a, tangent_b) = (self.tangent_of(a), self.tangent_of(b));
        if tangent_a.is_none() && tangent_b.is_none() {
            return Ok(None);
        }
        let tangent = match op {
            BinaryOperator::Add | BinaryOperator::Subtract => self.tangent_sum(op, tangent_a, tangent_b),
            BinaryOperator::Multiply => {
                let by_a = tangent_a.map(|tangent| self.binary(op, tangent, b));
                let by_b = tangent_b.map(|tangent| self.binary(op, a, tangent));
                self.tangent_sum(BinaryOperator::Add, by_a, by_b)
            }
            BinaryOperator::Divide => {
                let one = self.literal(value, 1.0)?;
                let inverse = self.binary(op, one, b);
                let taken = tangent_b.map(|tangent| self.binary(BinaryOperator::Multiply, value, tangent));
                let rest = self.tangent_sum(BinaryOperator::Subtract, tangent_a, taken);
                rest.map(|rest| self.binary(BinaryOperator::Multiply, rest, inverse))
            }
            _ => return Err(self.no_rule(value)),
        };
        Ok(tangent)
    }

    fn math_tangent(
        &mut self,
        value: Value,
        function: MathFunction,
        a: Value,
        b: Option<Value>,
        c: Option<Value>,
    ) -> Result<Option<Value>, String> {
        let operands = [Some(a), b, c];
        if operands.iter().flatten().all(|&operand| self.tangent_of(operand).is_none()) {
            return Ok(None);
        }
        match (function, b, c, self.tangent_of(a)) {
            (MathFunction::Max, Some(b), None, _) => self.min_max_tangent(value, BinaryOperator::Greater, a, b),
            (MathFunction::Min, Some(b), None, _) => self.min_max_tangent(value, BinaryOperator::Less, a, b),
            (MathFunction::Sqrt, None, None, Some(tangent)) => {
                let half = self.literal(value, 0.5)?;
                let slope = self.binary(BinaryOperator::Divide, half, value);
                Ok(Some(self.binary(BinaryOperator::Multiply, tangent, slope)))
            }
            // Between inactive bounds: maximum with the lower one, then minimum with the upper one.
            (MathFunction::Clamp, Some(low), Some(high), Some(tangent))
                if self.tangent_of(low).or(self.tangent_of(high)).is_none() =>
            {
                let above = self.min_max_constant_tangent(value, BinaryOperator::Greater, [a, low], tangent)?;
                Ok(Some(self.min_max_constant_tangent(value, BinaryOperator::Less, [a, high], above)?))
            }
            _ => Err(self.no_rule(value)),
        }
    }

    /// Tangent of a minimum or maximum, given the comparison that selects the first operand; for equal operands the
    /// mean of both tangents, as with dual numbers on the CPU.
    fn min_max_tangent(
        &mut self,
        value: Value,
        first: BinaryOperator,
        a: Value,
        b: Value,
    ) -> Result<Option<Value>, String> {
        let (tangent_a, tangent_b) = (self.tangent_of(a), self.tangent_of(b));
        let Some(sum) = self.tangent_sum(BinaryOperator::Add, tangent_a, tangent_b) else { return Ok(None) };
        let half = self.literal(value, 0.5)?;
        let mean = self.binary(BinaryOperator::Multiply, sum, half);
        let (is_first, is_second) = (self.binary(first, a, b), self.binary(first, b, a));
        let (tangent_a, tangent_b) = (self.tangent_or_zero(a), self.tangent_or_zero(b));
        let others = self.select(is_second, tangent_b, mean);
        Ok(Some(self.select(is_first, tangent_a, others)))
    }

    /// Tangent of the minimum or maximum of a value and a constant, given the comparison that selects the value.
    fn min_max_constant_tangent(
        &mut self,
        value: Value,
        first: BinaryOperator,
        [a, bound]: [Value; 2],
        tangent: Value,
    ) -> Result<Value, String> {
        let (zero, half) = (self.zero(value), self.literal(value, 0.5)?);
        let mean = self.binary(BinaryOperator::Multiply, tangent, half);
        let (is_first, is_second) = (self.binary(first, a, bound), self.binary(first, bound, a));
        let others = self.select(is_second, zero, mean);
        Ok(self.select(is_first, tangent, others))
    }

    /// Tangent of a selection.
    fn select_tangent(&mut self, condition: Value, accept: Value, reject: Value) -> Option<Value> {
        if self.tangent_of(accept).is_none() && self.tangent_of(reject).is_none() {
            return None;
        }
        let (accept, reject) = (self.tangent_or_zero(accept), self.tangent_or_zero(reject));
        Some(self.select(condition, accept, reject))
    }

    /// A sum or difference of tangents, either of which may be absent.
    fn tangent_sum(&mut self, op: BinaryOperator, a: Option<Value>, b: Option<Value>) -> Option<Value> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.binary(op, a, b)),
            (None, Some(expr)) if op == BinaryOperator::Subtract => {
                Some(self.append(Expression::Unary { op: UnaryOperator::Negate, expr }))
            }
            (one, other) => one.or(other),
        }
    }
}
