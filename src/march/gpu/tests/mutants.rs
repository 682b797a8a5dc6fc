//! Mutants of a kernel, as mutant schemata (R. Untch, J. Offutt, M. J. Harrold, 1993): one module computes every
//! mutated operation both ways, and the variable `mutant` selects one at run time. One compilation serves hundreds of
//! mutants.

use super::super::spirv::Kernel;
use super::super::unused_code::remove_unused;
use naga::{
    Arena, BinaryOperator, Block, Expression, Function, GlobalVariable, Handle, Literal, MathFunction, Module, Range,
    ScalarKind, Span, Statement, SwitchCase, Type, TypeInner, UnaryOperator,
};
use std::collections::{HashMap, HashSet};

/// The variable of a kernel with the number of the active mutant; zero: none.
pub(super) const VARIABLE: &str = "mutant";

/// The change of a mutant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Change {
    /// The function returns zero at once.
    Skip,
    /// Another operator.
    Operator(BinaryOperator),
    /// Exchanged operands of a difference or a quotient.
    Exchange,
    /// A negated comparison, or a negated condition of a `select`.
    Negate,
    /// Minimum for maximum, or the reverse.
    Extreme(MathFunction),
    /// A constant changed by a relative 1e-6.
    Nudge,
}

/// One change of one function of a kernel.
#[derive(Clone, Debug)]
pub(super) struct Mutant {
    /// The part of `shaders/` and the function.
    pub(super) file: String,
    pub(super) function: String,
    pub(super) change: Change,
    /// The text of the operation, and its number among those with the same text in the function.
    excerpt: String,
    ordinal: usize,
    /// Whether the entry point of the kernel reaches the function.
    pub(super) is_reached: bool,
    at: (Handle<Function>, Option<Handle<Expression>>),
}

impl Mutant {
    /// Identifies a mutant across kernels.
    pub(super) fn key(&self) -> String {
        let Self { file, function, change, excerpt, ordinal, .. } = self;
        match change {
            Change::Skip => format!("{file} {function}: {change:?}"),
            _ => format!("{file} {function}: {change:?} `{excerpt}` {ordinal}"),
        }
    }
}

/// The parts of a kernel's text: start and name.
fn parts(text: &str) -> Vec<(usize, &str)> {
    let marked = text.match_indices("// shaders/").filter_map(|(place, _)| {
        let line = text[place..].lines().next()?;
        Some((place + line.len() + 1, line.strip_prefix("// shaders/")?.strip_suffix(".wgsl")?))
    });
    std::iter::once((0, "generated")).chain(marked).collect()
}

/// All mutants of the functions of a kernel.
pub(super) fn mutants(kernel: &Kernel) -> Vec<Mutant> {
    let (module, text) = (&kernel.module, kernel.source.as_str());
    let (parts, reached) = (parts(text), reached(kernel));
    let mut found: Vec<Mutant> = vec![];
    for (handle, function) in module.functions.iter() {
        let start = module.functions.get_span(handle).to_range().map_or(0, |range| range.start);
        let &(_, file) = parts.iter().rev().find(|(begin, _)| *begin <= start).expect("the first begins at zero");
        let name = function.name.clone().unwrap_or_default();
        let fixed: HashSet<_> = initial(function).union(&thresholds(&kernel.module, function)).copied().collect();
        let is_reached = reached.contains(&handle);
        let mut push = |expression: Option<Handle<Expression>>, change: Change| {
            let range = expression.and_then(|expression| function.expressions.get_span(expression).to_range());
            let range = range.unwrap_or(start..start);
            let excerpt = text[range.clone()].split_whitespace().collect::<Vec<_>>().join(" ");
            let is_same = |known: &&Mutant| known.at.0 == handle && known.change == change && known.excerpt == excerpt;
            let ordinal = found.iter().filter(is_same).count();
            let (file, function) = (file.to_owned(), name.clone());
            found.push(Mutant { file, function, change, excerpt, ordinal, is_reached, at: (handle, expression) });
        };
        push(None, Change::Skip);
        for (expression, kind) in function.expressions.iter().filter(|(expression, _)| !fixed.contains(expression)) {
            let TypeInner::Scalar(scalar) = kernel.info[handle][expression].ty.inner_with(&module.types) else {
                continue;
            };
            let is_real = scalar.kind == ScalarKind::Float;
            let is_zero = |operand: &Handle<Expression>| {
                matches!(function.expressions[*operand], Expression::Literal(Literal::U32(0)))
            };
            // Adding or subtracting zero changes nothing.
            if matches!(kind, Expression::Binary { right, .. } if is_zero(right)) && !is_comparison(kind) {
                continue;
            }
            for change in changes(kind, is_real) {
                push(Some(expression), change);
            }
        }
    }
    found
}

/// All functions that the entry point of a kernel reaches.
fn reached(kernel: &Kernel) -> HashSet<Handle<Function>> {
    fn calls(block: &Block, into: &mut Vec<Handle<Function>>) {
        for statement in block.iter() {
            match statement {
                Statement::Call { function, .. } => into.push(*function),
                Statement::Block(block) => calls(block, into),
                Statement::If { accept, reject, .. } => {
                    [accept, reject].into_iter().for_each(|block| calls(block, into));
                }
                Statement::Switch { cases, .. } => cases.iter().for_each(|case| calls(&case.body, into)),
                Statement::Loop { body, continuing, .. } => {
                    [body, continuing].into_iter().for_each(|block| calls(block, into));
                }
                _ => {}
            }
        }
    }
    let (mut found, mut next) = (HashSet::new(), vec![]);
    kernel.module.entry_points.iter().for_each(|point| calls(&point.function.body, &mut next));
    while let Some(function) = next.pop() {
        if found.insert(function) {
            calls(&kernel.module.functions[function].body, &mut next);
        }
    }
    found
}

/// Possible changes of an operation.
fn changes(expression: &Expression, is_real: bool) -> Vec<Change> {
    use BinaryOperator as Op;
    match expression {
        Expression::Binary { op, .. } => match op {
            Op::Add => vec![Change::Operator(Op::Subtract)],
            Op::Subtract if is_real => vec![Change::Operator(Op::Add), Change::Exchange],
            Op::Subtract => vec![Change::Operator(Op::Add)],
            Op::Multiply if is_real => vec![Change::Operator(Op::Divide)],
            Op::Multiply => vec![Change::Operator(Op::Add)],
            Op::Divide if is_real => vec![Change::Operator(Op::Multiply), Change::Exchange],
            Op::Divide | Op::Modulo => vec![Change::Operator(Op::Multiply)],
            Op::Equal | Op::NotEqual | Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual => {
                vec![Change::Negate]
            }
            _ => vec![],
        },
        Expression::Select { .. } => vec![Change::Negate],
        Expression::Math { fun: MathFunction::Max, .. } => vec![Change::Extreme(MathFunction::Min)],
        Expression::Math { fun: MathFunction::Min, .. } => vec![Change::Extreme(MathFunction::Max)],
        Expression::Literal(Literal::F32(value)) if *value != 0.0 => vec![Change::Nudge],
        Expression::Literal(Literal::F64(value)) if *value != 0.0 => vec![Change::Nudge],
        _ => vec![],
    }
}

/// Constants that only bound or compare a number: changing them by 1e-6 rarely decides anything. Their comparisons,
/// minima and maxima are mutated.
fn thresholds(module: &Module, function: &Function) -> HashSet<Handle<Expression>> {
    fn used(module: &Module, block: &Block, elsewhere: &mut Vec<Handle<Expression>>) {
        for statement in block.iter() {
            match statement {
                Statement::Call { function, arguments, .. } => {
                    let is_threshold = module.functions[*function].name.as_deref() == Some("ge_mask");
                    elsewhere.extend(arguments.iter().filter(|_| !is_threshold));
                }
                Statement::Store { value, .. } => elsewhere.push(*value),
                Statement::Return { value } => elsewhere.extend(*value),
                Statement::Block(block) => used(module, block, elsewhere),
                Statement::If { accept, reject, .. } => {
                    [accept, reject].into_iter().for_each(|block| used(module, block, elsewhere));
                }
                Statement::Switch { cases, .. } => cases.iter().for_each(|case| used(module, &case.body, elsewhere)),
                Statement::Loop { body, continuing, .. } => {
                    [body, continuing].into_iter().for_each(|block| used(module, block, elsewhere));
                }
                _ => {}
            }
        }
    }
    let mut elsewhere = vec![];
    used(module, &function.body, &mut elsewhere);
    for (_, expression) in function.expressions.iter() {
        let is_bound = matches!(
            expression,
            Expression::Math { fun: MathFunction::Min | MathFunction::Max | MathFunction::Clamp, .. }
        );
        if !is_bound && !is_comparison(expression) {
            operands(&mut expression.clone(), &mut |operand| {
                elsewhere.push(operand);
                operand
            });
        }
    }
    let constants = function.expressions.iter().filter(|(_, kind)| matches!(kind, Expression::Literal(_)));
    constants.map(|(literal, _)| literal).filter(|literal| !elsewhere.contains(literal)).collect()
}

fn is_comparison(expression: &Expression) -> bool {
    matches!(expression, Expression::Binary { .. }) && changes(expression, false) == [Change::Negate]
}

/// The expressions that initialise local variables, which are constants.
fn initial(function: &Function) -> HashSet<Handle<Expression>> {
    let mut found = HashSet::new();
    let mut next: Vec<_> = function.local_variables.iter().filter_map(|(_, variable)| variable.init).collect();
    while let Some(expression) = next.pop() {
        if found.insert(expression) {
            operands(&mut function.expressions[expression].clone(), &mut |operand| {
                next.push(operand);
                operand
            });
        }
    }
    found
}

/// Maps the operands of an expression.
fn operands(expression: &mut Expression, map: &mut dyn FnMut(Handle<Expression>) -> Handle<Expression>) {
    let mut each = |operands: &mut [&mut Handle<Expression>]| {
        operands.iter_mut().for_each(|operand| **operand = map(**operand));
    };
    match expression {
        Expression::Compose { components, .. } => each(&mut components.iter_mut().collect::<Vec<_>>()),
        Expression::Access { base, index } => each(&mut [base, index]),
        Expression::AccessIndex { base, .. } => each(&mut [base]),
        Expression::Splat { value, .. } => each(&mut [value]),
        Expression::Swizzle { vector, .. } => each(&mut [vector]),
        Expression::Load { pointer } => each(&mut [pointer]),
        Expression::ImageLoad { image, coordinate, array_index, sample, level } => {
            each(&mut [image, coordinate]);
            [array_index, sample, level].into_iter().flatten().for_each(|operand| each(&mut [operand]));
        }
        Expression::Unary { expr, .. } | Expression::As { expr, .. } => each(&mut [expr]),
        Expression::Binary { left, right, .. } => each(&mut [left, right]),
        Expression::Select { condition, accept, reject } => each(&mut [condition, accept, reject]),
        Expression::Relational { argument, .. } => each(&mut [argument]),
        Expression::Math { arg, arg1, arg2, arg3, .. } => {
            each(&mut [arg]);
            [arg1, arg2, arg3].into_iter().flatten().for_each(|operand| each(&mut [operand]));
        }
        Expression::Literal(_)
        | Expression::Constant(_)
        | Expression::ZeroValue(_)
        | Expression::FunctionArgument(_)
        | Expression::GlobalVariable(_)
        | Expression::LocalVariable(_)
        | Expression::CallResult(_)
        | Expression::WorkGroupUniformLoadResult { .. } => {}
        other => panic!("no kernel has {other:?}"),
    }
}

/// A kernel with numbered mutants.
pub(super) fn mutated(kernel: &Kernel, mutants: &[(u32, Mutant)]) -> Kernel {
    let mut module = kernel.module.clone();
    let named = |(_, variable): &(_, &GlobalVariable)| variable.name.as_deref() == Some(VARIABLE);
    let (variable, _) = module.global_variables.iter().find(named).expect("the kernel holds the number of the mutant");
    for (handle, source) in kernel.module.functions.iter() {
        let own: Vec<&(u32, Mutant)> = mutants.iter().filter(|(_, mutant)| mutant.at.0 == handle).collect();
        if !own.is_empty() {
            module.functions[handle] = Rewrite::new(source, variable).of(&own);
        }
    }
    remove_unused(&mut module);
    Kernel::validate(kernel.source.clone(), module).unwrap_or_else(|error| panic!("{error}"))
}

/// Rewrites a function with its mutants.
struct Rewrite<'a> {
    source: &'a Function,
    variable: Handle<GlobalVariable>,
    expressions: Arena<Expression>,
    /// The replacement of each source expression, and the one where a constant is required.
    values: HashMap<Handle<Expression>, Handle<Expression>>,
    constants: HashMap<Handle<Expression>, Handle<Expression>>,
    /// First and last expression generated for each source expression.
    bounds: HashMap<Handle<Expression>, (Handle<Expression>, Handle<Expression>)>,
}

impl<'a> Rewrite<'a> {
    fn new(source: &'a Function, variable: Handle<GlobalVariable>) -> Self {
        let (values, constants, bounds) = (HashMap::new(), HashMap::new(), HashMap::new());
        Self { source, variable, expressions: Arena::new(), values, constants, bounds }
    }

    fn append(&mut self, expression: Expression) -> Handle<Expression> {
        self.expressions.append(expression, Span::UNDEFINED)
    }

    fn select(
        &mut self,
        is_active: Handle<Expression>,
        accept: Handle<Expression>,
        reject: Handle<Expression>,
    ) -> Handle<Expression> {
        self.append(Expression::Select { condition: is_active, accept, reject })
    }

    fn of(mut self, mutants: &[&(u32, Mutant)]) -> Function {
        // Constants first, as they are not computed; then the active mutant and the mutated constants.
        let pointer = self.append(Expression::GlobalVariable(self.variable));
        let numbers: Vec<_> =
            mutants.iter().map(|(number, _)| self.append(Expression::Literal(Literal::U32(*number)))).collect();
        let mut nudged = vec![];
        for (place, (_, mutant)) in mutants.iter().enumerate() {
            if let (Change::Nudge, (_, Some(literal))) = (mutant.change, mutant.at) {
                let (plain, changed) = match self.source.expressions[literal] {
                    Expression::Literal(Literal::F32(value)) => {
                        (Literal::F32(value), Literal::F32((f64::from(value) * (1.0 + 1e-6)) as f32))
                    }
                    Expression::Literal(Literal::F64(value)) => {
                        (Literal::F64(value), Literal::F64(value * (1.0 + 1e-6)))
                    }
                    ref other => panic!("{other:?} is no constant"),
                };
                let [plain, changed] = [plain, changed].map(|value| self.append(Expression::Literal(value)));
                nudged.push((place, literal, plain, changed));
            }
        }
        let zero = self.source.result.as_ref().map(|result| result.ty);
        let zero = zero.map(|ty: Handle<Type>| self.append(Expression::ZeroValue(ty)));
        let number = self.append(Expression::Load { pointer });
        let active: Vec<_> = numbers
            .into_iter()
            .map(|right| self.append(Expression::Binary { op: BinaryOperator::Equal, left: number, right }))
            .collect();
        let mut last = active[active.len() - 1];
        for (place, literal, plain, changed) in nudged {
            last = self.select(active[place], changed, plain);
            self.values.insert(literal, last);
            self.constants.insert(literal, plain);
        }
        let mut body = Block::new();
        body.push(Statement::Emit(Range::new_from_bounds(number, last)), Span::UNDEFINED);
        for (place, (_, mutant)) in mutants.iter().enumerate() {
            if mutant.change == Change::Skip {
                let accept = Block::from_vec(vec![Statement::Return { value: zero }]);
                body.push(Statement::If { condition: active[place], accept, reject: Block::new() }, Span::UNDEFINED);
            }
        }
        for (handle, expression) in self.source.expressions.iter() {
            if self.values.contains_key(&handle) {
                continue;
            }
            self.expression(handle, expression, mutants, &active);
        }
        for (statement, span) in self.block(&self.source.body).span_into_iter() {
            body.push(statement, span);
        }
        let mut local_variables = self.source.local_variables.clone();
        for (_, variable) in local_variables.iter_mut() {
            variable.init = variable.init.map(|init| self.constant(init));
        }
        let (name, arguments, result) =
            (self.source.name.clone(), self.source.arguments.clone(), self.source.result.clone());
        let expressions = self.expressions;
        Function { name, arguments, result, local_variables, expressions, body, ..Function::default() }
    }

    fn expression(
        &mut self,
        handle: Handle<Expression>,
        expression: &Expression,
        mutants: &[&(u32, Mutant)],
        active: &[Handle<Expression>],
    ) {
        let mut plain = expression.clone();
        operands(&mut plain, &mut |operand| self.values[&operand]);
        let first = self.append(plain.clone());
        let mut value = first;
        for (place, (_, mutant)) in mutants.iter().enumerate().filter(|(_, (_, mutant))| mutant.at.1 == Some(handle)) {
            let changed = match (mutant.change, plain.clone()) {
                (Change::Operator(op), Expression::Binary { left, right, .. }) => {
                    Expression::Binary { op, left, right }
                }
                (Change::Exchange, Expression::Binary { op, left, right }) => {
                    Expression::Binary { op, left: right, right: left }
                }
                (Change::Negate, Expression::Binary { .. }) => {
                    Expression::Unary { op: UnaryOperator::LogicalNot, expr: first }
                }
                (Change::Negate, Expression::Select { condition, accept, reject }) => {
                    Expression::Select { condition, accept: reject, reject: accept }
                }
                (Change::Extreme(fun), Expression::Math { arg, arg1, arg2, arg3, .. }) => {
                    Expression::Math { fun, arg, arg1, arg2, arg3 }
                }
                (change, other) => panic!("{change:?} of {other:?}"),
            };
            let changed = self.append(changed);
            value = self.select(active[place], changed, value);
        }
        self.values.insert(handle, value);
        self.bounds.insert(handle, (first, value));
    }

    fn constant(&self, handle: Handle<Expression>) -> Handle<Expression> {
        self.constants.get(&handle).copied().unwrap_or(self.values[&handle])
    }

    fn block(&self, block: &Block) -> Block {
        let mut mapped = Block::new();
        for (statement, &span) in block.span_iter() {
            mapped.push(self.statement(statement), span);
        }
        mapped
    }

    fn statement(&self, statement: &Statement) -> Statement {
        let of = |handle: &Handle<Expression>| self.values[handle];
        match statement {
            Statement::Emit(range) => {
                let all: Vec<_> = range.clone().map(|expression| self.bounds[&expression]).collect();
                let [(first, _), .., (_, last)] = all[..] else {
                    let (first, last) = all[0];
                    return Statement::Emit(Range::new_from_bounds(first, last));
                };
                Statement::Emit(Range::new_from_bounds(first, last))
            }
            Statement::Block(block) => Statement::Block(self.block(block)),
            Statement::If { condition, accept, reject } => {
                Statement::If { condition: of(condition), accept: self.block(accept), reject: self.block(reject) }
            }
            Statement::Switch { selector, cases } => {
                let case = |case: &SwitchCase| SwitchCase { body: self.block(&case.body), ..case.clone() };
                Statement::Switch { selector: of(selector), cases: cases.iter().map(case).collect() }
            }
            Statement::Loop { body, continuing, break_if } => Statement::Loop {
                body: self.block(body),
                continuing: self.block(continuing),
                break_if: break_if.as_ref().map(of),
            },
            Statement::Return { value } => Statement::Return { value: value.as_ref().map(of) },
            Statement::Store { pointer, value } => Statement::Store { pointer: of(pointer), value: of(value) },
            Statement::Call { function, arguments, result } => Statement::Call {
                function: *function,
                arguments: arguments.iter().map(of).collect(),
                result: result.as_ref().map(of),
            },
            Statement::WorkGroupUniformLoad { pointer, result } => {
                Statement::WorkGroupUniformLoad { pointer: of(pointer), result: of(result) }
            }
            Statement::Break | Statement::Continue | Statement::ControlBarrier(_) | Statement::MemoryBarrier(_) => {
                statement.clone()
            }
            other => panic!("no kernel has {other:?}"),
        }
    }
}
