//! A kernel that tells, beside all that it computes, how that changes along one direction: made of the kernel itself.
//!
//! WGSL knows no numbers of one's own making, so that a [`Dual`](crate::physics::dual::Dual) cannot be put where a real number stands; and every formula
//! of `shaders/` a second time is a text to be kept true by hand. What naga reads of a kernel is a list of operations, though, and to each belongs one rule
//! of differentiation. So nothing of a kernel is changed, and its values keep their bits: what changes along the direction gets a *change* beside it, an operation
//! behind the one that it belongs to, a variable, an argument. A function leaves the change of its result in a variable of its own, as WGSL returns one thing. Each rule does what
//! the dual number does on the processor, operation for operation, so that changes too are the processor's, bit for bit, where a device rounds as IEEE 754 says.
//!
//! What the direction cannot reach stays as it is: rows, tables, and all that is made of them alone. That is found by trying: at first only the
//! buffer that is differentiated by has a change, and whatever a change is then stored in, passed to or returned from has one on the next round, until none is added.

mod function;
mod rules;

use function::Body;
use naga::valid::ModuleInfo;
use naga::{
    AddressSpace, Expression, Function, GlobalVariable, Handle, LocalVariable, Module, ResourceBinding, Span, Type,
    TypeInner, UniqueArena,
};
use std::collections::{HashMap, HashSet};

/// Where a number that changes may be kept; a function is `None` where it is an entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Place {
    Global(Handle<GlobalVariable>),
    Local(Option<Handle<Function>>, Handle<LocalVariable>),
    Argument(Option<Handle<Function>>, u32),
    Result(Handle<Function>),
}

/// How the result of a function changes that takes bits apart, where what its operations say is not so.
#[derive(Clone, Copy)]
enum Rule {
    /// Not at all: it is a whole number.
    Still,
    /// As the function of the change.
    Alike,
    /// In proportion to what it is of.
    InProportion,
}

/// Functions of one number that go by a rule of their own and stay as they are, which is why they call none but each other: those of [`Real`](crate::physics::Real)
/// that a [`Dual`](crate::physics::dual::Dual) writes out as well, and what keeps a value from the compiler. The others that round or take bits apart, `two_to`, `twos_of` and
/// `reached`, say themselves that they are still: no change comes through an integer.
const RULES: &[(&str, Rule)] =
    &[("keep", Rule::Alike), ("nearest", Rule::Still), ("settled", Rule::Alike), ("mantissa_of", Rule::InProportion)];

fn rule(function: &Function) -> Option<Rule> {
    let name = function.name.as_deref()?;
    RULES.iter().find(|(known, _)| *known == name).map(|(_, rule)| *rule)
}

/// The module of a kernel that tells how all that it stores changes with what the buffer `by` holds; see `Kernel::differentiated`.
pub(super) fn differentiate(module: &Module, info: &ModuleInfo, by: &str) -> Result<Module, String> {
    let named = |(_, variable): &(_, &GlobalVariable)| variable.name.as_deref() == Some(by);
    let (by, _) = module.global_variables.iter().find(named).ok_or_else(|| format!("no buffer {by:?}"))?;
    let mut changing = HashSet::from([Place::Global(by)]);
    loop {
        let known = changing.len();
        let told = told(module, info, &mut changing)?;
        if changing.len() == known {
            return Ok(told);
        }
    }
}

/// The module with changes in the places that are known to change; those that turn out to are added.
fn told(module: &Module, info: &ModuleInfo, changing: &mut HashSet<Place>) -> Result<Module, String> {
    let mut told = module.clone();
    let kept = variables(&mut told, module, changing);
    for (handle, function) in module.functions.iter().filter(|(_, function)| rule(function).is_none()) {
        let body = Body::new(module, &mut told.types, &kept, changing, Some(handle), function, &info[handle]);
        told.functions[handle] = body.told()?;
    }
    for (place, point) in module.entry_points.iter().enumerate() {
        let info = info.get_entry_point(place);
        let body = Body::new(module, &mut told.types, &kept, changing, None, &point.function, info);
        told.entry_points[place].function = body.told()?;
    }
    Ok(told)
}

/// A variable for the change of each that changes, and of each result.
fn variables(told: &mut Module, module: &Module, changing: &HashSet<Place>) -> HashMap<Place, Handle<GlobalVariable>> {
    let mut kept = HashMap::new();
    let bound = module.global_variables.iter().filter_map(|(_, variable)| variable.binding);
    let mut free = bound.map(|bound| bound.binding + 1).max().unwrap_or(0);
    let is_changing = |(handle, _): &(_, &GlobalVariable)| changing.contains(&Place::Global(*handle));
    let mut changed_variables: Vec<_> = module.global_variables.iter().filter(is_changing).collect();
    // Changes are bound in the order of what they belong to; naga orders variables by which function names them first.
    changed_variables.sort_by_key(|(_, variable)| variable.binding.map(|bound| bound.binding));
    for (handle, variable) in changed_variables {
        let binding = variable.binding.map(|bound| {
            free += 1;
            ResourceBinding { binding: free - 1, ..bound }
        });
        let name = changed(variable.name.as_ref());
        let change = GlobalVariable { name, binding, init: None, ..variable.clone() };
        kept.insert(Place::Global(handle), told.global_variables.append(change, Span::UNDEFINED));
    }
    for (handle, function) in module.functions.iter() {
        let place = Place::Result(handle);
        if let Some(result) = function.result.as_ref().filter(|_| changing.contains(&place)) {
            let change = GlobalVariable {
                name: changed(function.name.as_ref()),
                space: AddressSpace::Private,
                binding: None,
                ty: result.ty,
                init: None,
                memory_decorations: naga::MemoryDecorations::empty(),
            };
            kept.insert(place, told.global_variables.append(change, Span::UNDEFINED));
        }
    }
    kept
}

fn changed(name: Option<&String>) -> Option<String> {
    name.map(|name| format!("{name}_change"))
}

/// Whether there are real numbers in a type, or where one of it points.
fn is_real(inner: &TypeInner, types: &UniqueArena<Type>) -> bool {
    match inner {
        TypeInner::Scalar(scalar)
        | TypeInner::Vector { scalar, .. }
        | TypeInner::Matrix { scalar, .. }
        | TypeInner::ValuePointer { scalar, .. } => scalar.kind == naga::ScalarKind::Float,
        TypeInner::Array { base, .. } | TypeInner::Pointer { base, .. } => is_real(&types[*base].inner, types),
        TypeInner::Struct { members, .. } => members.iter().any(|member| is_real(&types[member.ty].inner, types)),
        _ => false,
    }
}

/// What an expression is told by in an error: its operation, without its operands.
fn named(expression: &Expression) -> String {
    let words = format!("{expression:?}");
    match expression {
        Expression::Math { fun, .. } => format!("{fun:?}"),
        Expression::Binary { op, .. } => format!("{op:?}"),
        _ => words.split([' ', '(', '{']).next().unwrap_or_default().to_owned(),
    }
}
