//! Transformation of one function: its operations, each followed by its tangent.

use super::{ActivePlace, TangentRule, operation_name, rule, tangent_name};
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
pub(super) struct FunctionTransform<'a> {
    pub(super) module: &'a Module,
    types: &'a mut UniqueArena<Type>,
    /// Tangent variables of globals and of results.
    tangent_variables: &'a HashMap<ActivePlace, Handle<GlobalVariable>>,
    active: &'a mut HashSet<ActivePlace>,
    handle: Option<Handle<Function>>,
    pub(super) source: &'a Function,
    pub(super) info: &'a FunctionInfo,
    function: Function,
    /// The tangent of each value; for a pointer, the pointer to the tangent.
    tangents: HashMap<Value, Value>,
    emitter: Emitter,
    block: Block,
    span: Span,
}

impl<'a> FunctionTransform<'a> {
    pub(super) fn new(
        module: &'a Module,
        types: &'a mut UniqueArena<Type>,
        kept: &'a HashMap<ActivePlace, Handle<GlobalVariable>>,
        changing: &'a mut HashSet<ActivePlace>,
        handle: Option<Handle<Function>>,
        source: &'a Function,
        info: &'a FunctionInfo,
    ) -> Self {
        let mut function = source.clone();
        let mut changes = HashMap::new();
        let mut locals = HashMap::new();
        for (local, variable) in source.local_variables.iter() {
            if changing.contains(&ActivePlace::Local(handle, local)) {
                let tangent = LocalVariable { name: tangent_name(variable.name.as_ref()), ty: variable.ty, init: None };
                locals.insert(local, function.local_variables.append(tangent, Span::UNDEFINED));
            }
        }
        let mut arguments = HashMap::new();
        for (place, argument) in (0..).zip(&source.arguments) {
            if changing.contains(&ActivePlace::Argument(handle, place)) {
                arguments.insert(place, function.arguments.len() as u32);
                let name = tangent_name(argument.name.as_ref());
                function.arguments.push(FunctionArgument { name, ty: argument.ty, binding: None });
            }
        }
        for (value, expression) in source.expressions.iter() {
            let tangent = match expression {
                Expression::GlobalVariable(global) => {
                    kept.get(&ActivePlace::Global(*global)).copied().map(Expression::GlobalVariable)
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
        Self {
            module,
            types,
            tangent_variables: kept,
            active: changing,
            handle,
            source,
            info,
            function,
            tangents: changes,
            emitter,
            block,
            span,
        }
    }

    /// The transformed function.
    pub(super) fn transform(mut self) -> Result<Function, String> {
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
                    if let Some(tangent) = self.tangent(value)? {
                        self.tangents.insert(value, tangent);
                    }
                }
                self.block.extend(self.emitter.finish(&self.function.expressions));
            }
            Statement::Store { pointer, value } => {
                self.push(as_it_is);
                match (self.tangent_of(*pointer), self.tangent_of(*value)) {
                    (Some(place), _) => self.store(place, *value),
                    (None, Some(_)) => self.mark_active(*pointer)?,
                    (None, None) => {}
                }
            }
            Statement::Return { value } => {
                if let (Some(value), Some(handle)) = (*value, self.handle) {
                    let result = ActivePlace::Result(handle);
                    if let Some(&variable) = self.tangent_variables.get(&result) {
                        let place = self.append(Expression::GlobalVariable(variable));
                        self.store(place, value);
                    } else if self.tangent_of(value).is_some() {
                        self.active.insert(result);
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
            let Some(tangent) = self.tangent_of(value) else { return Ok(()) };
            match rule {
                TangentRule::Zero => {}
                TangentRule::SameFunction => {
                    let alike = self.append(Expression::CallResult(callee));
                    self.push(call(vec![tangent], Some(alike)));
                    self.tangents.insert(result, alike);
                }
                TangentRule::Proportional => {
                    self.emitter.start(&self.function.expressions);
                    let share = self.binary(BinaryOperator::Divide, result, value);
                    let tangent = self.binary(BinaryOperator::Multiply, tangent, share);
                    self.block.extend(self.emitter.finish(&self.function.expressions));
                    self.tangents.insert(result, tangent);
                }
            }
            return Ok(());
        }
        let mut all = arguments.to_vec();
        for (place, &argument) in (0..).zip(arguments) {
            let passed = ActivePlace::Argument(Some(callee), place);
            match (self.active.contains(&passed), self.tangent_of(argument)) {
                (true, Some(tangent)) => all.push(tangent),
                (true, None) if self.is_pointer(argument) => self.mark_active(argument)?,
                (true, None) => all.push(self.zero(argument)),
                (false, Some(_)) => {
                    self.active.insert(passed);
                }
                (false, None) => {}
            }
        }
        self.push(call(all, result));
        if let (Some(result), Some(&variable)) = (result, self.tangent_variables.get(&ActivePlace::Result(callee))) {
            let pointer = self.append(Expression::GlobalVariable(variable));
            self.emitter.start(&self.function.expressions);
            let tangent = self.append(Expression::Load { pointer });
            self.block.extend(self.emitter.finish(&self.function.expressions));
            self.tangents.insert(result, tangent);
        }
        Ok(())
    }

    pub(super) fn binary(&mut self, op: BinaryOperator, left: Value, right: Value) -> Value {
        self.append(Expression::Binary { op, left, right })
    }

    pub(super) fn select(&mut self, condition: Value, accept: Value, reject: Value) -> Value {
        self.append(Expression::Select { condition, accept, reject })
    }

    pub(super) fn tangent_of(&self, value: Value) -> Option<Value> {
        self.tangents.get(&value).copied()
    }

    pub(super) fn tangent_or_zero(&mut self, value: Value) -> Value {
        self.tangent_of(value).unwrap_or_else(|| self.zero(value))
    }

    fn store(&mut self, pointer: Value, value: Value) {
        let value = self.tangent_or_zero(value);
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
    fn mark_active(&mut self, pointer: Value) -> Result<(), String> {
        let mut base = pointer;
        let place = loop {
            base = match self.source.expressions[base] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => base,
                Expression::GlobalVariable(variable) => break ActivePlace::Global(variable),
                Expression::LocalVariable(variable) => break ActivePlace::Local(self.handle, variable),
                Expression::FunctionArgument(place) => break ActivePlace::Argument(self.handle, place),
                _ => return Err(self.no_rule(pointer)),
            }
        };
        self.active.insert(place);
        Ok(())
    }

    fn is_pointer(&self, value: Value) -> bool {
        self.info[value].ty.inner_with(&self.module.types).pointer_space().is_some()
    }

    fn name(&self) -> &str {
        self.source.name.as_deref().unwrap_or("the entry point")
    }

    pub(super) fn no_rule(&self, value: Value) -> String {
        format!("{}: no differentiation rule for {}", self.name(), operation_name(&self.source.expressions[value]))
    }
}
