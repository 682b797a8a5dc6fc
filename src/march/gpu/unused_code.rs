//! Removal of code that a kernel never runs.
//!
//! One source serves plans with gas and without, and constants choose between them. Drivers may inline all functions
//! before they drop the branches that are not taken, also for a kernel that they compiled earlier: on lavapipe
//! this took nearly half of the time of a prediction of `lcat-2259`.

use naga::compact::{KeepUnused, compact};
use naga::{Arena, Block, Constant, Expression, Function, Handle, Literal, Module, Statement};

/// Remove the branches of constant conditions that are never taken, and all that the entry points do not use then. The
/// module must be valid.
pub(super) fn remove_unused(module: &mut Module) {
    let Module { functions, entry_points, constants, global_expressions, .. } = module;
    let constants = Constants { constants, global_expressions };
    let entries = entry_points.iter_mut().map(|point| &mut point.function);
    for function in functions.iter_mut().map(|(_, function)| function).chain(entries) {
        let body = std::mem::take(&mut function.body);
        function.body = constants.resolve(body, function);
        // An expression with a name counts as used.
        function.named_expressions.clear();
    }
    compact(module, KeepUnused::No);
}

/// Constants of a module, and their values.
struct Constants<'a> {
    constants: &'a Arena<Constant>,
    global_expressions: &'a Arena<Expression>,
}

impl Constants<'_> {
    /// The value of a constant condition.
    fn condition(&self, function: &Function, condition: Handle<Expression>) -> Option<bool> {
        let value = match function.expressions[condition] {
            Expression::Constant(constant) => &self.global_expressions[self.constants[constant].init],
            ref value => value,
        };
        match value {
            Expression::Literal(Literal::Bool(value)) => Some(*value),
            _ => None,
        }
    }

    /// A block with the branches of constant conditions in place of the conditions.
    fn resolve(&self, block: Block, function: &Function) -> Block {
        let mut resolved = Block::with_capacity(block.len());
        for (statement, span) in block.span_into_iter() {
            let statement = match statement {
                Statement::If { condition, accept, reject } => match self.condition(function, condition) {
                    Some(is_true) => {
                        resolved.extend_block(self.resolve(if is_true { accept } else { reject }, function));
                        if resolved.last().is_some_and(Statement::is_terminator) {
                            return resolved;
                        }
                        continue;
                    }
                    None => {
                        let [accept, reject] = [accept, reject].map(|block| self.resolve(block, function));
                        Statement::If { condition, accept, reject }
                    }
                },
                Statement::Block(block) => Statement::Block(self.resolve(block, function)),
                Statement::Loop { body, continuing, break_if } => {
                    let [body, continuing] = [body, continuing].map(|block| self.resolve(block, function));
                    Statement::Loop { body, continuing, break_if }
                }
                other => other,
            };
            resolved.push(statement, span);
        }
        resolved
    }
}

#[cfg(test)]
mod tests {
    use super::super::shader::{MARCH, kernel};
    use super::super::spirv::Kernel;
    use crate::case::Case;
    use crate::march::Precision;
    use crate::plan::Plan;
    use std::path::Path;

    fn functions(text: &str) -> Vec<String> {
        let kernel = Kernel::parse_used(text.to_owned()).expect("the source is valid");
        kernel.module.functions.iter().filter_map(|(_, function)| function.name.clone()).collect()
    }

    #[test]
    fn only_functions_of_branches_that_can_be_taken_are_kept() {
        let text = |constant: &str| {
            format!(
                "const CONSTANT = {constant};
                @group(0) @binding(0) var<storage, read_write> y: array<f32>;
                fn first() -> f32 {{ return 1.0; }}
                fn second() -> f32 {{ return 2.0; }}
                fn third() -> f32 {{ return 3.0; }}
                fn inner() {{ if !CONSTANT {{ let unused = third(); y[2] = unused; }} }}
                @compute @workgroup_size(1) fn probe() {{
                    inner();
                    for (var i = 0u; i < 4u; i++) {{
                        if CONSTANT {{ y[0] = first(); continue; }}
                        if y[1] > 0.0 {{ y[1] = second(); }}
                    }}
                }}"
            )
        };
        assert_eq!(functions(&text("true")), ["first", "inner"]);
        assert_eq!(functions(&text("false")), ["second", "third", "inner"]);
    }

    #[test]
    fn kernels_have_functions_of_gas_and_of_darcy_flow_only_where_the_plan_has_them() {
        let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
        let expected =
            [("lcat-2259", [false, false]), ("lcat-2259-pyrolysis", [true, false]), ("permeation", [true, true])];
        for (name, has) in expected {
            let plan = Plan::new(&Case::load(&cases.join(name)).expect("a shipped case loads"));
            let kept = functions(&kernel(&plan, Precision::F32, false, 1, MARCH));
            assert_eq!(
                ["update_gas_flow", "update_pores"].map(|name| kept.iter().any(|kept| kept == name)),
                has,
                "{name}"
            );
        }
    }
}
