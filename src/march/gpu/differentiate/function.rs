//! Transformation of one function: its operations, each followed by its tangent.

use super::{Place, Rule, changed, named, rule};
use naga::proc::{Emitter, TypeResolution};
use naga::valid::FunctionInfo;
use naga::{
    BinaryOperator, Block, Expression, Function, FunctionArgument, GlobalVariable, Handle, Literal, LocalVariable,
    Module, Span, Statement, SwitchCase, Type, TypeInner, UniqueArena,
};
use std::collections::{HashMap, HashSet};
use std::mem;

pub(super) type Value = Handle<Expression>;

/// A function being transformed.
pub(super) struct Body<'a> {
    pub(super) module: &'a Module,
    types: &'a mut UniqueArena<Type>,
    /// Tangent variables of globals and of results.
    kept: &'a HashMap<Place, Handle<GlobalVariable>>,
    changing: &'a mut HashSet<Place>,
    handle: Option<Handle<Function>>,
    pub(super) source: &'a Function,
    pub(super) info: &'a FunctionInfo,
    function: Function,
    /// The tangent of each value; for a pointer, the pointer to the tangent.
    changes: HashMap<Value, Value>,
    emitter: Emitter,
    block: Block,
    span: Span,
}

impl<'a> Body<'a> {
    pub(super) fn new(
        module: &'a Module,
        types: &'a mut UniqueArena<Type>,
        kept: &'a HashMap<Place, Handle<GlobalVariable>>,
        changing: &'a mut HashSet<Place>,
        handle: Option<Handle<Function>>,
        source: &'a Function,
        info: &'a FunctionInfo,
    ) -> Self {
        let mut function = source.clone();
        let mut changes = HashMap::new();
        let mut locals = HashMap::new();
        for (local, variable) in source.local_variables.iter() {
            if changing.contains(&Place::Local(handle, local)) {
                let tangent = LocalVariable { name: changed(variable.name.as_ref()), ty: variable.ty, init: None };
                locals.insert(local, function.local_variables.append(tangent, Span::UNDEFINED));
            }
        }
        let mut arguments = HashMap::new();
        for (place, argument) in (0..).zip(&source.arguments) {
            if changing.contains(&Place::Argument(handle, place)) {
                arguments.insert(place, function.arguments.len() as u32);
                let name = changed(argument.name.as_ref());
                function.arguments.push(FunctionArgument { name, ty: argument.ty, binding: None });
            }
        }
        for (value, expression) in source.expressions.iter() {
            let tangent = match expression {
                Expression::GlobalVariable(global) => {
                    kept.get(&Place::Global(*global)).copied().map(Expression::GlobalVariable)
                }
                Expression::LocalVariable(local) => locals.get(local).copied().map(Expression::LocalVariable),
                Expression::FunctionArgument(place) => arguments.get(place).copied().map(Expression::FunctionArgument),
                _ => None,
            };
            if let Some(tangent) = tangent {
                changes.insert(value, function.expressions.append(tangent, Span::UNDEFINED));
            }
        }
        let (emitter, block, span) = (Emitter::default(), Block::new(), Span::UNDEFINED);
        Self { module, types, kept, changing, handle, source, info, function, changes, emitter, block, span }
    }

    /// The transformed function.
    pub(super) fn told(mut self) -> Result<Function, String> {
        self.function.body = self.block(&self.source.body)?;
        Ok(self.function)
    }

    fn block(&mut self, source: &Block) -> Result<Block, String> {
        let outer = mem::take(&mut self.block);
        for (statement, &span) in source.span_iter() {
            self.span = span;
            self.statement(statement)?;
        }
        Ok(mem::replace(&mut self.block, outer))
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), String> {
        let as_it_is = statement.clone();
        match statement {
            Statement::Emit(values) => {
                self.push(as_it_is);
                self.emitter.start(&self.function.expressions);
                for value in values.clone() {
                    self.span = self.source.expressions.get_span(value);
                    if let Some(tangent) = self.change(value)? {
                        self.changes.insert(value, tangent);
                    }
                }
                self.block.extend(self.emitter.finish(&self.function.expressions));
            }
            Statement::Store { pointer, value } => {
                self.push(as_it_is);
                match (self.of(*pointer), self.of(*value)) {
                    (Some(place), _) => self.store(place, *value),
                    (None, Some(_)) => self.must_change(*pointer)?,
                    (None, None) => {}
                }
            }
            Statement::Return { value } => {
                if let (Some(value), Some(handle)) = (*value, self.handle) {
                    let result = Place::Result(handle);
                    if let Some(&variable) = self.kept.get(&result) {
                        let place = self.append(Expression::GlobalVariable(variable));
                        self.store(place, value);
                    } else if self.of(value).is_some() {
                        self.changing.insert(result);
                    }
                }
                self.push(as_it_is);
            }
            Statement::Call { function, arguments, result } => self.call(*function, arguments, *result)?,
            Statement::Block(block) => {
                let block = self.block(block)?;
                self.push(Statement::Block(block));
            }
            Statement::If { condition, accept, reject } => {
                let (accept, reject) = (self.block(accept)?, self.block(reject)?);
                self.push(Statement::If { condition: *condition, accept, reject });
            }
            Statement::Switch { selector, cases } => {
                let mut transformed = Vec::with_capacity(cases.len());
                for case in cases {
                    transformed.push(SwitchCase { body: self.block(&case.body)?, ..case.clone() });
                }
                self.push(Statement::Switch { selector: *selector, cases: transformed });
            }
            Statement::Loop { body, continuing, break_if } => {
                let (body, continuing) = (self.block(body)?, self.block(continuing)?);
                self.push(Statement::Loop { body, continuing, break_if: *break_if });
            }
            Statement::Break | Statement::Continue => self.push(as_it_is),
            _ => return Err(format!("{}: no differentiation rule for {statement:?}", self.name())),
        }
        Ok(())
    }

    /// A call with the tangents of its arguments appended.
    fn call(&mut self, callee: Handle<Function>, arguments: &[Value], result: Option<Value>) -> Result<(), String> {
        let function = &self.module.functions[callee];
        let call = |arguments, result| Statement::Call { function: callee, arguments, result };
        if let Some(rule) = rule(function) {
            self.push(call(arguments.to_vec(), result));
            let (Some(result), &[value]) = (result, arguments) else {
                return Err(format!("{}: a function with its own rule has one argument", self.name()));
            };
            let Some(tangent) = self.of(value) else { return Ok(()) };
            match rule {
                Rule::Still => {}
                Rule::Alike => {
                    let alike = self.append(Expression::CallResult(callee));
                    self.push(call(vec![tangent], Some(alike)));
                    self.changes.insert(result, alike);
                }
                Rule::InProportion => {
                    self.emitter.start(&self.function.expressions);
                    let share = self.binary(BinaryOperator::Divide, result, value);
                    let tangent = self.binary(BinaryOperator::Multiply, tangent, share);
                    self.block.extend(self.emitter.finish(&self.function.expressions));
                    self.changes.insert(result, tangent);
                }
            }
            return Ok(());
        }
        let mut all = arguments.to_vec();
        for (place, &argument) in (0..).zip(arguments) {
            let passed = Place::Argument(Some(callee), place);
            match (self.changing.contains(&passed), self.of(argument)) {
                (true, Some(tangent)) => all.push(tangent),
                (true, None) if self.is_pointer(argument) => self.must_change(argument)?,
                (true, None) => all.push(self.zero(argument)),
                (false, Some(_)) => {
                    self.changing.insert(passed);
                }
                (false, None) => {}
            }
        }
        self.push(call(all, result));
        if let (Some(result), Some(&variable)) = (result, self.kept.get(&Place::Result(callee))) {
            let pointer = self.append(Expression::GlobalVariable(variable));
            self.emitter.start(&self.function.expressions);
            let tangent = self.append(Expression::Load { pointer });
            self.block.extend(self.emitter.finish(&self.function.expressions));
            self.changes.insert(result, tangent);
        }
        Ok(())
    }

    pub(super) fn binary(&mut self, op: BinaryOperator, left: Value, right: Value) -> Value {
        self.append(Expression::Binary { op, left, right })
    }

    pub(super) fn select(&mut self, condition: Value, accept: Value, reject: Value) -> Value {
        self.append(Expression::Select { condition, accept, reject })
    }

    pub(super) fn of(&self, value: Value) -> Option<Value> {
        self.changes.get(&value).copied()
    }

    pub(super) fn change_or_zero(&mut self, value: Value) -> Value {
        self.of(value).unwrap_or_else(|| self.zero(value))
    }

    fn store(&mut self, pointer: Value, value: Value) {
        let value = self.change_or_zero(value);
        self.push(Statement::Store { pointer, value });
    }

    /// Zero of the type of a value.
    pub(super) fn zero(&mut self, value: Value) -> Value {
        let ty = match &self.info[value].ty {
            TypeResolution::Handle(ty) => *ty,
            TypeResolution::Value(inner) => {
                self.types.insert(Type { name: None, inner: inner.clone() }, Span::UNDEFINED)
            }
        };
        self.append(Expression::ZeroValue(ty))
    }

    /// A literal of the type of a value.
    pub(super) fn literal(&mut self, value: Value, number: f64) -> Result<Value, String> {
        let literal = match self.info[value].ty.inner_with(&self.module.types) {
            TypeInner::Scalar(naga::Scalar::F32) => Literal::F32(number as f32),
            TypeInner::Scalar(naga::Scalar::F64) => Literal::F64(number),
            _ => return Err(self.no_rule(value)),
        };
        Ok(self.append(Expression::Literal(literal)))
    }

    /// Append an expression. Expressions that are not emitted, such as constants, split the current emit range.
    pub(super) fn append(&mut self, expression: Expression) -> Value {
        let interrupts = expression.needs_pre_emit() || matches!(expression, Expression::CallResult(_));
        if !interrupts || !self.emitter.is_running() {
            return self.function.expressions.append(expression, self.span);
        }
        self.block.extend(self.emitter.finish(&self.function.expressions));
        let value = self.function.expressions.append(expression, self.span);
        self.emitter.start(&self.function.expressions);
        value
    }

    fn push(&mut self, statement: Statement) {
        self.block.push(statement, self.span);
    }

    /// Mark the place that a pointer refers to as active.
    fn must_change(&mut self, pointer: Value) -> Result<(), String> {
        let mut base = pointer;
        let place = loop {
            base = match self.source.expressions[base] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => base,
                Expression::GlobalVariable(variable) => break Place::Global(variable),
                Expression::LocalVariable(variable) => break Place::Local(self.handle, variable),
                Expression::FunctionArgument(place) => break Place::Argument(self.handle, place),
                _ => return Err(self.no_rule(pointer)),
            }
        };
        self.changing.insert(place);
        Ok(())
    }

    fn is_pointer(&self, value: Value) -> bool {
        self.info[value].ty.inner_with(&self.module.types).pointer_space().is_some()
    }

    fn name(&self) -> &str {
        self.source.name.as_deref().unwrap_or("the entry point")
    }

    pub(super) fn no_rule(&self, value: Value) -> String {
        format!("{}: no differentiation rule for {}", self.name(), named(&self.source.expressions[value]))
    }
}
