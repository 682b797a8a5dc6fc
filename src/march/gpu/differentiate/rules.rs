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
            // Of two as large the second, as with dual numbers on the processor.
            (MathFunction::Max, Some(b), None, _) => {
                let first = self.binary(BinaryOperator::Greater, a, b);
                Ok(self.chosen(first, a, b))
            }
            (MathFunction::Min, Some(b), None, _) => {
                let first = self.binary(BinaryOperator::Less, a, b);
                Ok(self.chosen(first, a, b))
            }
            (MathFunction::Sqrt, None, None, Some(change)) => {
                let half = self.literal(value, 0.5)?;
                let slope = self.binary(BinaryOperator::Divide, half, value);
                Ok(Some(self.binary(BinaryOperator::Multiply, change, slope)))
            }
            // Between marks that are still.
            (MathFunction::Clamp, Some(low), Some(high), Some(change)) if self.of(low).or(self.of(high)).is_none() => {
                let zero = self.zero(value);
                let above = self.binary(BinaryOperator::Greater, a, low);
                let below = self.binary(BinaryOperator::Less, a, high);
                let within = self.select(above, change, zero);
                Ok(Some(self.select(below, within, zero)))
            }
            _ => Err(self.no_rule(value)),
        }
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
