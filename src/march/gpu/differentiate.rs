//! Forward-mode automatic differentiation of a kernel, as a source transformation of naga's intermediate
//! representation.
//!
//! WGSL has no operator overloading, so a [`Dual`](crate::physics::dual::Dual) cannot replace a real number, and a
//! second copy of every formula would have to be maintained by hand. In naga's representation a kernel is a list of
//! operations, each with one differentiation rule. The original operations and their bits are unchanged; every active
//! value, variable and argument gets a tangent, computed right after it. A function leaves the tangent of its result in
//! a private variable, as WGSL returns one value. Each rule performs the operations of the dual number on the CPU in
//! the same order, so that tangents are bit-identical on IEEE 754 devices.
//!
//! Inactive values (rows, tables and everything computed from them alone) get no tangent. Activity is found by
//! iteration: at first only the buffer `by` is active; each pass adds the places where an active value is stored,
//! passed or returned, until none is added.

mod function;
mod rules;

use function::FunctionTransform;
use naga::valid::ModuleInfo;
use naga::{
    AddressSpace, Expression, Function, GlobalVariable, Handle, LocalVariable, Module, ResourceBinding, Span, Type,
    TypeInner, UniqueArena,
};
use std::collections::{HashMap, HashSet};

/// A place that can hold an active value; the function is `None` for an entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum ActivePlace {
    Global(Handle<GlobalVariable>),
    Local(Option<Handle<Function>>, Handle<LocalVariable>),
    Argument(Option<Handle<Function>>, u32),
    Result(Handle<Function>),
}

/// Tangent rule of a function that manipulates bits, whose operations cannot be differentiated one by one.
#[derive(Clone, Copy)]
enum TangentRule {
    /// Zero: the result is an integer.
    Zero,
    /// The function applied to the tangent.
    SameFunction,
    /// Tangent × result / argument.
    Proportional,
}

/// Functions of one argument with a rule of their own. They are not transformed and call only each other. They are
/// those of [`Real`](crate::physics::Real) that [`Dual`](crate::physics::dual::Dual) implements explicitly, and the
/// optimisation barrier. Other functions that round or manipulate bits need no rule: no tangent passes through an
/// integer.
const FUNCTION_RULES: &[(&str, TangentRule)] = &[
    ("opaque", TangentRule::SameFunction),
    ("round_ties_even", TangentRule::Zero),
    ("flush_tiny", TangentRule::SameFunction),
    ("mantissa_of", TangentRule::Proportional),
];

fn rule(function: &Function) -> Option<TangentRule> {
    let name = function.name.as_deref()?;
    FUNCTION_RULES.iter().find(|(known, _)| *known == name).map(|(_, rule)| *rule)
}

/// The module that also computes the tangent of everything it stores; see `Kernel::differentiated`.
pub(super) fn differentiate(module: &Module, info: &ModuleInfo, by: &str) -> Result<Module, String> {
    let named = |(_, variable): &(_, &GlobalVariable)| variable.name.as_deref() == Some(by);
    let (by, _) = module.global_variables.iter().find(named).ok_or_else(|| format!("no buffer {by:?}"))?;
    let mut active = HashSet::from([ActivePlace::Global(by)]);
    loop {
        let known = active.len();
        let transformed = with_tangents(module, info, &mut active)?;
        if active.len() == known {
            return Ok(transformed);
        }
    }
}

/// The module with tangents for the places known to be active; adds those found to be active.
fn with_tangents(module: &Module, info: &ModuleInfo, active: &mut HashSet<ActivePlace>) -> Result<Module, String> {
    let mut transformed = module.clone();
    let tangents = add_tangent_variables(&mut transformed, module, active);
    for (handle, function) in module.functions.iter().filter(|(_, function)| rule(function).is_none()) {
        let body = FunctionTransform::new(
            module,
            &mut transformed.types,
            &tangents,
            active,
            Some(handle),
            function,
            &info[handle],
        );
        transformed.functions[handle] = body.transform()?;
    }
    for (place, point) in module.entry_points.iter().enumerate() {
        let info = info.get_entry_point(place);
        let body =
            FunctionTransform::new(module, &mut transformed.types, &tangents, active, None, &point.function, info);
        transformed.entry_points[place].function = body.transform()?;
    }
    Ok(transformed)
}

/// A tangent variable for each active variable and each active result.
fn add_tangent_variables(
    transformed: &mut Module,
    module: &Module,
    active: &HashSet<ActivePlace>,
) -> HashMap<ActivePlace, Handle<GlobalVariable>> {
    let mut tangents = HashMap::new();
    let bound = module.global_variables.iter().filter_map(|(_, variable)| variable.binding);
    let mut free = bound.map(|bound| bound.binding + 1).max().unwrap_or(0);
    let is_active = |(handle, _): &(_, &GlobalVariable)| active.contains(&ActivePlace::Global(*handle));
    let mut active_variables: Vec<_> = module.global_variables.iter().filter(is_active).collect();
    // Tangents are bound in the order of their values; naga orders variables by first use.
    active_variables.sort_by_key(|(_, variable)| variable.binding.map(|bound| bound.binding));
    for (handle, variable) in active_variables {
        let binding = variable.binding.map(|bound| {
            free += 1;
            ResourceBinding { binding: free - 1, ..bound }
        });
        let name = tangent_name(variable.name.as_ref());
        let tangent = GlobalVariable { name, binding, init: None, ..variable.clone() };
        tangents.insert(ActivePlace::Global(handle), transformed.global_variables.append(tangent, Span::UNDEFINED));
    }
    for (handle, function) in module.functions.iter() {
        let place = ActivePlace::Result(handle);
        if let Some(result) = function.result.as_ref().filter(|_| active.contains(&place)) {
            let tangent = GlobalVariable {
                name: tangent_name(function.name.as_ref()),
                space: AddressSpace::Private,
                binding: None,
                ty: result.ty,
                init: None,
                memory_decorations: naga::MemoryDecorations::empty(),
            };
            tangents.insert(place, transformed.global_variables.append(tangent, Span::UNDEFINED));
        }
    }
    tangents
}

fn tangent_name(name: Option<&String>) -> Option<String> {
    name.map(|name| format!("{name}_change"))
}

/// Whether a type contains real numbers or points to one that does.
fn contains_reals(inner: &TypeInner, types: &UniqueArena<Type>) -> bool {
    match inner {
        TypeInner::Scalar(scalar)
        | TypeInner::Vector { scalar, .. }
        | TypeInner::Matrix { scalar, .. }
        | TypeInner::ValuePointer { scalar, .. } => scalar.kind == naga::ScalarKind::Float,
        TypeInner::Array { base, .. } | TypeInner::Pointer { base, .. } => contains_reals(&types[*base].inner, types),
        TypeInner::Struct { members, .. } => {
            members.iter().any(|member| contains_reals(&types[member.ty].inner, types))
        }
        _ => false,
    }
}

/// Name of an expression in an error: its operation, without operands.
fn operation_name(expression: &Expression) -> String {
    let words = format!("{expression:?}");
    match expression {
        Expression::Math { fun, .. } => format!("{fun:?}"),
        Expression::Binary { op, .. } => format!("{op:?}"),
        _ => words.split([' ', '(', '{']).next().unwrap_or_default().to_owned(),
    }
}
