//! The rules: how what an operation yields changes with what it is of.
//!
//! Each in the order of [`physics::dual`](crate::physics::dual), less what a dual number adds and multiplies by the zeros of constants, which moves no bit.

use super::function::{Body, Value};
use super::is_real;
use naga::{BinaryOperator, Expression, MathFunction, ScalarKind, UnaryOperator};

impl Body<'_> {
    /// The change of a value, worked out behind it; none where it is still, or where it is no real number.
    pub(super) fn change(&mut self, value: Value) -> Result<Option<Value>, String> {
        if !is_real(self.info[value].ty.inner_with(&self.module.types), &self.module.types) {
            return Ok(None);
        }
        let expression = &self.source.expressions[value];
        let alike = match *expression {
            Expression::Load { pointer } => self.of(pointer).map(|pointer| Expression::Load { pointer }),
            Expression::Access { base, index } => self.of(base).map(|base| Expression::Access { base, index }),
            Expression::AccessIndex { base, index } => {
                self.of(base).map(|base| Expression::AccessIndex { base, index })
            }
            Expression::Splat { size, value } => self.of(value).map(|value| Expression::Splat { size, value }),
            Expression::Swizzle { size, vector, pattern } => {
                self.of(vector).map(|vector| Expression::Swizzle { size, vector, pattern })
            }
            Expression::Unary { op: op @ UnaryOperator::Negate, expr } => {
                self.of(expr).map(|expr| Expression::Unary { op, expr })
            }
            Expression::As { expr, kind: kind @ ScalarKind::Float, convert: convert @ Some(_) } => {
                self.of(expr).map(|expr| Expression::As { expr, kind, convert })
            }
            Expression::Compose { ty, ref components } => {
                if components.iter().all(|&part| self.of(part).is_none()) {
                    return Ok(None);
                }
                let components = components.iter().map(|&part| self.change_or_zero(part)).collect();
                Some(Expression::Compose { ty, components })
            }
            Expression::Select { condition, accept, reject } => return Ok(self.chosen(condition, accept, reject)),
            Expression::Binary { op, left, right } => return self.of_two(value, op, left, right),
            Expression::Math { fun, arg, arg1, arg2, .. } => return self.of_function(value, fun, arg, arg1, arg2),
            _ => None,
        };
        Ok(alike.map(|alike| self.append(alike)))
    }

    /// Sums, products and quotients.
    fn of_two(&mut self, value: Value, op: BinaryOperator, a: Value, b: Value) -> Result<Option<Value>, String> {
        let (change_a, change_b) = (self.of(a), self.of(b));
        if change_a.is_none() && change_b.is_none() {
            return Ok(None);
        }
        let told = match op {
            BinaryOperator::Add | BinaryOperator::Subtract => self.sum(op, change_a, change_b),
            BinaryOperator::Multiply => {
                let by_a = change_a.map(|change| self.binary(op, change, b));
                let by_b = change_b.map(|change| self.binary(op, a, change));
                self.sum(BinaryOperator::Add, by_a, by_b)
            }
            BinaryOperator::Divide => {
                let one = self.literal(value, 1.0)?;
                let inverse = self.binary(op, one, b);
                let taken = change_b.map(|change| self.binary(BinaryOperator::Multiply, value, change));
                let rest = self.sum(BinaryOperator::Subtract, change_a, taken);
                rest.map(|rest| self.binary(BinaryOperator::Multiply, rest, inverse))
            }
            _ => return Err(self.no_rule(value)),
        };
        Ok(told)
    }

    fn of_function(
        &mut self,
        value: Value,
        function: MathFunction,
        a: Value,
        b: Option<Value>,
        c: Option<Value>,
    ) -> Result<Option<Value>, String> {
        let operands = [Some(a), b, c];
        if operands.iter().flatten().all(|&operand| self.of(operand).is_none()) {
            return Ok(None);
        }
        match (function, b, c, self.of(a)) {
            (MathFunction::Max, Some(b), None, _) => self.extreme(value, BinaryOperator::Greater, a, b),
            (MathFunction::Min, Some(b), None, _) => self.extreme(value, BinaryOperator::Less, a, b),
            (MathFunction::Sqrt, None, None, Some(change)) => {
                let half = self.literal(value, 0.5)?;
                let slope = self.binary(BinaryOperator::Divide, half, value);
                Ok(Some(self.binary(BinaryOperator::Multiply, change, slope)))
            }
            // Between bounds that do not change: the maximum with the lower one, then the minimum with the upper one.
            (MathFunction::Clamp, Some(low), Some(high), Some(change)) if self.of(low).or(self.of(high)).is_none() => {
                let above = self.half_at_equal(value, BinaryOperator::Greater, [a, low], change)?;
                Ok(Some(self.half_at_equal(value, BinaryOperator::Less, [a, high], above)?))
            }
            _ => Err(self.no_rule(value)),
        }
    }

    /// The minimum or maximum of two values, given the comparison by which it is the first: of equal ones the mean of
    /// both changes, as with dual numbers on the processor.
    fn extreme(&mut self, value: Value, first: BinaryOperator, a: Value, b: Value) -> Result<Option<Value>, String> {
        let (change_a, change_b) = (self.of(a), self.of(b));
        let Some(sum) = self.sum(BinaryOperator::Add, change_a, change_b) else { return Ok(None) };
        let half = self.literal(value, 0.5)?;
        let mean = self.binary(BinaryOperator::Multiply, sum, half);
        let (is_first, is_second) = (self.binary(first, a, b), self.binary(first, b, a));
        let (change_a, change_b) = (self.change_or_zero(a), self.change_or_zero(b));
        let others = self.select(is_second, change_b, mean);
        Ok(Some(self.select(is_first, change_a, others)))
    }

    /// The change of the minimum or maximum of a value and a constant, given the comparison by which it is the value.
    fn half_at_equal(
        &mut self,
        value: Value,
        first: BinaryOperator,
        [a, bound]: [Value; 2],
        change: Value,
    ) -> Result<Value, String> {
        let (zero, half) = (self.zero(value), self.literal(value, 0.5)?);
        let mean = self.binary(BinaryOperator::Multiply, change, half);
        let (is_first, is_second) = (self.binary(first, a, bound), self.binary(first, bound, a));
        let others = self.select(is_second, zero, mean);
        Ok(self.select(is_first, change, others))
    }

    /// The change of one of two values.
    fn chosen(&mut self, condition: Value, accept: Value, reject: Value) -> Option<Value> {
        if self.of(accept).is_none() && self.of(reject).is_none() {
            return None;
        }
        let (accept, reject) = (self.change_or_zero(accept), self.change_or_zero(reject));
        Some(self.select(condition, accept, reject))
    }

    /// A sum or a difference, of which either may be nothing.
    fn sum(&mut self, op: BinaryOperator, a: Option<Value>, b: Option<Value>) -> Option<Value> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.binary(op, a, b)),
            (None, Some(expr)) if op == BinaryOperator::Subtract => {
                Some(self.append(Expression::Unary { op: UnaryOperator::Negate, expr }))
            }
            (one, other) => one.or(other),
        }
    }
}
