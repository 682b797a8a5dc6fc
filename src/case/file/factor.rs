//! `[[factor]]` and `[[correlation]]`, validated against the layup and the faces.

use super::layup::names;
use super::written::{Section, Written, all};
use crate::case::error::Read;
use crate::case::nearest::suggestion;
use crate::case::scope::{A_GROUP, FactorScope, NO_GROUP, NO_STATE};
use crate::case::{Correlation, Factor, Property};

/// The factors in the order of the file. Without a valid layup and valid faces (`scope`) only the keys are read.
pub(super) fn factors(case: &Section<'_>, scope: Option<FactorScope<'_>>) -> Read<Vec<Factor>> {
    let sections = case.tables("factor")?;
    let names = names(&sections, "factor");
    let factors = all(sections.iter().map(|section| factor(section, scope)));
    let (factors, _) = (factors?, names?);
    if let Some(scope) = scope {
        all(factors
            .iter()
            .zip(&sections)
            .enumerate()
            .map(|(index, (factor, section))| section.require(scope.not_scaled_before(factor, &factors[..index]))))?;
    }
    Ok(factors)
}

/// `[[correlation]]`: pairs of correlated factors. Without valid factors only the keys are read.
pub(super) fn correlation(case: &Section<'_>, factors: Option<&[Factor]>) -> Read<Correlation> {
    let sections = case.tables("correlation")?;
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    all(sections.iter().map(|section| {
        let read = pair(section, factors);
        section.close();
        let Some((one, other, value)) = read? else { return Ok(()) };
        section.require(Correlation::checked_pair(one, other, &pairs))?;
        pairs.push((one, other, value));
        Ok(())
    }))?;
    // An indefinite matrix is reported at the last correlation; there is one, as an empty matrix is valid.
    let last = sections.last().unwrap_or(case);
    last.require(Correlation::new(factors.map_or(0, <[Factor]>::len), &pairs))
}

fn pair(section: &Section<'_>, factors: Option<&[Factor]>) -> Read<Option<(usize, usize, f64)>> {
    let expected = "two factors such as [\"f_k_INS\", \"f_rho_INS\"]";
    let named = section.required("factors", expected).and_then(|written| {
        let names = written.list()?;
        let known = |written: &Written<'_>| -> Read<usize> {
            let (name, factors) = (written.text()?, factors.unwrap_or_default());
            let hint = || suggestion(name, factors.iter().map(|factor| factor.name.as_str()));
            let found = factors.iter().position(|factor| factor.name == name);
            found.ok_or_else(|| written.fault(format!("unknown factor {name:?}{}", hint())))
        };
        match (&names[..], factors) {
            (_, None) => Ok(None),
            ([one, other], _) => {
                let (one, other) = (known(one), known(other));
                let (one, other) = (one?, other?);
                written.require(Correlation::checked_pair(one, other, &[])).map(Some)
            }
            _ => Err(written.fault(format!("expected {expected}, found {} names", names.len()))),
        }
    });
    let value = section
        .required("value", "a correlation such as 0.5")
        .and_then(|written| written.require(Correlation::checked_value(written.number()?)));
    let (named, value) = (named?, value?);
    Ok(named.map(|(one, other)| (one, other, value)))
}

fn factor(section: &Section<'_>, scope: Option<FactorScope<'_>>) -> Read<Factor> {
    let name = section.required("name", "a name such as \"f_k_INS\"").and_then(name);
    let property = section.required("property", "a property such as \"conductivity\"").and_then(property);
    let group = section.optional("group");
    let state = section.optional("state").map(|written| state(written, property, group, scope)).transpose();
    let small = section.required("small", "bounds such as [0.75, 1.25]").and_then(bounds);
    let large = section.optional("large").map_or(small, bounds);
    let nominal = section.optional("nominal");
    let number = nominal.map_or(Ok(1.0), Written::number);
    let highest = large.map_or(1.0, |(_, high)| high);
    let named = state.as_ref().map_or(None, Option::as_deref);
    let scaled = property.and_then(|property| scaled(section, property, (group, named), highest, scope));
    section.close();
    let (name, small, large, number) = (name?, small?, large?, number?);
    let large = section.require(Factor::checked_large(large, small))?;
    let checked = Factor::checked_nominal(number, small);
    let nominal = match nominal {
        Some(written) => written.require(checked)?,
        None => section.require(checked)?,
    };
    let factor = Factor { name, group: scaled?, property: property?, state: state?, nominal, small, large };
    section.require(scope.map_or(Ok(()), |scope| scope.within_layup(&factor))).map(|()| factor)
}

fn name(written: Written<'_>) -> Read<String> {
    written.require(Factor::checked_name(written.text()?)).map(str::to_owned)
}

fn property(written: Written<'_>) -> Read<Property> {
    let text = written.text()?;
    let unknown = || format!("unknown property {text:?}{}", suggestion(text, Property::keys()));
    written.require(Property::named(text).ok_or_else(unknown))
}

/// A state that every ply of the group has; the property must be a conductivity.
fn state(
    written: Written<'_>,
    property: Read<Property>,
    group: Option<Written<'_>>,
    scope: Option<FactorScope<'_>>,
) -> Read<String> {
    let state = written.text()?;
    if property.is_ok_and(|property| !property.is_conductivity()) {
        return Err(written.fault(NO_STATE));
    }
    if let (Some(group), Some(scope)) = (group.map(Written::text).transpose()?, scope) {
        written.require(scope.known_state(state, group))?;
    }
    Ok(state.to_owned())
}

fn bounds(written: Written<'_>) -> Read<(f64, f64)> {
    let [low, high] = written.pair()?;
    let (low, high) = (low.number(), high.number());
    written.require(Factor::checked_bounds((low?, high?)))
}

/// The group of a factor with the upper bound `highest`; empty for none.
fn scaled(
    section: &Section<'_>,
    property: Property,
    (group, state): (Option<Written<'_>>, Option<&str>),
    highest: f64,
    scope: Option<FactorScope<'_>>,
) -> Read<String> {
    match group {
        None if property.needs_group() => Err(section.fault(format!("missing key \"group\": {A_GROUP}"))),
        None => {
            let scalable = scope.map_or(Ok(()), |scope| scope.scalable(property));
            section.require(scalable).map(|()| String::new())
        }
        Some(written) if !property.has_group() => Err(written.fault(NO_GROUP)),
        Some(written) => {
            let group = written.text()?;
            let scalable = scope.map_or(Ok(()), |scope| scope.scalable_in(group, property, state, highest));
            written.require(scalable).map(|()| group.to_owned())
        }
    }
}
