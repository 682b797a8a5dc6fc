//! `[[factor]]` and `[[correlation]]`, validated against the layup and the faces.

use super::layup::check_unique_names;
use super::spanned_toml::{TableReader, ValueReader, collect_all};
use crate::case::error::ReadResult;
use crate::case::factor_targets::{FactorTargets, GROUP_EXPECTED, GROUP_NOT_ALLOWED, STATE_NOT_ALLOWED};
use crate::case::suggestion::suggestion;
use crate::case::{Correlation, Factor, Property};
use crate::limits::FACTORS;

/// The factors in the order of the file. Without a valid layup and valid faces (`scope`) only the keys are read.
pub(super) fn factors(case: &TableReader<'_>, scope: Option<FactorTargets<'_>>) -> ReadResult<Vec<Factor>> {
    let sections = case.array_of_tables("factor")?;
    case.require(FACTORS.check(sections.len() as f64))?;
    let names = check_unique_names(&sections, "factor");
    let factors = collect_all(sections.iter().map(|section| factor(section, scope)));
    let (factors, _) = (factors?, names?);
    if let Some(scope) = scope {
        collect_all(
            factors
                .iter()
                .zip(&sections)
                .enumerate()
                .map(|(index, (factor, section))| section.require(scope.check_no_overlap(factor, &factors[..index]))),
        )?;
    }
    Ok(factors)
}

/// `[[correlation]]`: pairs of correlated factors. Without valid factors only the keys are read.
pub(super) fn correlation(case: &TableReader<'_>, factors: Option<&[Factor]>) -> ReadResult<Correlation> {
    let sections = case.array_of_tables("correlation")?;
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    collect_all(sections.iter().map(|section| {
        let read = correlated_pair(section, factors);
        section.deny_unknown_keys();
        let Some((one, other, value)) = read? else { return Ok(()) };
        section.require(Correlation::checked_pair(one, other, &pairs))?;
        pairs.push((one, other, value));
        Ok(())
    }))?;
    // An indefinite matrix is reported at the last correlation; there is one, as an empty matrix is valid.
    let last = sections.last().unwrap_or(case);
    last.require(Correlation::new(factors.map_or(0, <[Factor]>::len), &pairs))
}

fn correlated_pair(section: &TableReader<'_>, factors: Option<&[Factor]>) -> ReadResult<Option<(usize, usize, f64)>> {
    let expected = "two factors such as [\"f_k_INS\", \"f_rho_INS\"]";
    let named = section.required("factors", expected).and_then(|written| {
        let names = written.list()?;
        let known = |written: &ValueReader<'_>| -> ReadResult<usize> {
            let (name, factors) = (written.text()?, factors.unwrap_or_default());
            let hint = || suggestion(name, factors.iter().map(|factor| factor.name.as_str()));
            let found = factors.iter().position(|factor| factor.name == name);
            found.ok_or_else(|| written.error(format!("unknown factor {name:?}{}", hint())))
        };
        match (&names[..], factors) {
            (_, None) => Ok(None),
            ([one, other], _) => {
                let (one, other) = (known(one), known(other));
                let (one, other) = (one?, other?);
                written.require(Correlation::checked_pair(one, other, &[])).map(Some)
            }
            _ => Err(written.error(format!("expected {expected}, found {} names", names.len()))),
        }
    });
    let value = section
        .required("value", "a correlation such as 0.5")
        .and_then(|written| written.require(Correlation::checked_value(written.number()?)));
    let (named, value) = (named?, value?);
    Ok(named.map(|(one, other)| (one, other, value)))
}

fn factor(section: &TableReader<'_>, scope: Option<FactorTargets<'_>>) -> ReadResult<Factor> {
    let name = section.required("name", "a name such as \"f_k_INS\"").and_then(name);
    let property = section.required("property", "a property such as \"conductivity\"").and_then(property);
    let group = section.optional("group");
    let state = section.optional("state").map(|written| state(written, property, group, scope)).transpose();
    let small = section.required("small", "bounds such as [0.75, 1.25]").and_then(bounds);
    let large = section.optional("large").map_or(small, bounds);
    let nominal = section.optional("nominal");
    let number = nominal.map_or(Ok(1.0), ValueReader::number);
    let highest = large.map_or(1.0, |(_, high)| high);
    let named = state.as_ref().map_or(None, Option::as_deref);
    let scaled = property.and_then(|property| factor_group(section, property, (group, named), highest, scope));
    section.deny_unknown_keys();
    let (name, small, large, number) = (name?, small?, large?, number?);
    let large = section.require(Factor::checked_large(large, small))?;
    let checked = Factor::checked_nominal(number, small);
    let nominal = match nominal {
        Some(written) => written.require(checked)?,
        None => section.require(checked)?,
    };
    let factor = Factor { name, group: scaled?, property: property?, state: state?, nominal, small, large };
    section.require(scope.map_or(Ok(()), |scope| scope.check_depth_bounds(&factor))).map(|()| factor)
}

fn name(written: ValueReader<'_>) -> ReadResult<String> {
    written.require(Factor::checked_name(written.text()?)).map(str::to_owned)
}

fn property(written: ValueReader<'_>) -> ReadResult<Property> {
    let text = written.text()?;
    let unknown = || format!("unknown property {text:?}{}", suggestion(text, Property::keys()));
    written.require(Property::named(text).ok_or_else(unknown))
}

/// A state that every ply of the group has; the property must be a conductivity.
fn state(
    written: ValueReader<'_>,
    property: ReadResult<Property>,
    group: Option<ValueReader<'_>>,
    scope: Option<FactorTargets<'_>>,
) -> ReadResult<String> {
    let state = written.text()?;
    if property.is_ok_and(|property| !property.is_conductivity()) {
        return Err(written.error(STATE_NOT_ALLOWED));
    }
    if let (Some(group), Some(scope)) = (group.map(ValueReader::text).transpose()?, scope) {
        written.require(scope.check_state(state, group))?;
    }
    Ok(state.to_owned())
}

fn bounds(written: ValueReader<'_>) -> ReadResult<(f64, f64)> {
    let [low, high] = written.pair()?;
    let (low, high) = (low.number(), high.number());
    written.require(Factor::checked_bounds((low?, high?)))
}

/// The group of a factor with the upper bound `highest`; empty for none.
fn factor_group(
    section: &TableReader<'_>,
    property: Property,
    (group, state): (Option<ValueReader<'_>>, Option<&str>),
    highest: f64,
    scope: Option<FactorTargets<'_>>,
) -> ReadResult<String> {
    match group {
        None if property.needs_group() => Err(section.error(format!("missing key \"group\": {GROUP_EXPECTED}"))),
        None => {
            let scalable = scope.map_or(Ok(()), |scope| scope.check_target(property));
            section.require(scalable).map(|()| String::new())
        }
        Some(written) if !property.allows_group() => Err(written.error(GROUP_NOT_ALLOWED)),
        Some(written) => {
            let group = written.text()?;
            let scalable = scope.map_or(Ok(()), |scope| scope.check_group_target(group, property, state, highest));
            written.require(scalable).map(|()| group.to_owned())
        }
    }
}
