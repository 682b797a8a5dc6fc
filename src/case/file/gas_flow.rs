//! Gas transport: `decomposition` and `[gas]` of a case.

use super::exposure::BackFace;
use super::property::keyword;
use super::references::ReferenceResolver;
use super::spanned_toml::{TableReader, ValueReader};
use crate::case::error::ReadResult;
use crate::case::gas::BACK_PRESSURE_NEEDS_DARCY;
use crate::case::{GasFlow, GasFlowModel, Layup, Ply};
use std::sync::Arc;

/// Default gas: of pyrolysis, and of a flow driven by pressure without pyrolysis.
const DEFAULT_PYROLYSIS_GAS: &str = "pyrolysis";
const DEFAULT_DRIVEN_GAS: &str = "air";

/// The layup; without `decomposition = true` all plies are inert.
pub(super) fn apply_decomposition_key(top: &TableReader<'_>, layup: ReadResult<Layup>) -> ReadResult<Layup> {
    let written = top.optional("decomposition");
    let reacts = written.map_or(Ok(false), ValueReader::boolean);
    let (mut layup, reacts) = (layup?, reacts?);
    if !reacts {
        layup.plies.iter_mut().for_each(|ply| ply.material = ply.material.without_decomposition());
    } else if !layup.plies.iter().any(Ply::decomposes) {
        let fault = |written: ValueReader<'_>| written.error("no ply has a material with a [decomposition]");
        return Err(written.map_or_else(|| top.error("no ply decomposes"), fault));
    }
    Ok(layup)
}

/// Gas transport in the marched layup; `None` if no gas flows.
pub(super) fn gas_flow(
    top: &TableReader<'_>,
    references: &ReferenceResolver<'_>,
    layup: Option<&Layup>,
    back: Option<&BackFace<'_>>,
) -> ReadResult<Option<GasFlow>> {
    let is_made = layup.is_some_and(|layup| layup.plies.iter().any(Ply::decomposes));
    let written = top.optional("gas");
    let section = written.map(ValueReader::section).transpose()?;
    let back_pressure = back.and_then(|back| back.pressure.as_ref());
    let Some(section) = section else {
        let back_pressure = back_pressure.map_or(Ok(()), |(_, written)| Err(written.error(BACK_PRESSURE_NEEDS_DARCY)));
        return back_pressure
            .and_then(|()| if is_made { default_gas_flow(top, references, layup).map(Some) } else { Ok(None) });
    };
    let known = [
        ("quasi-steady", GasFlowModel::QuasiSteady),
        ("unhindered", GasFlowModel::Instantaneous),
        ("darcy", GasFlowModel::Darcy),
    ];
    let path = keyword(&section, "flow", &known);
    let named = section.optional("gas");
    let gas = match named {
        Some(written) => references.gas(written),
        None => references.default_gas(if is_made { DEFAULT_PYROLYSIS_GAS } else { DEFAULT_DRIVEN_GAS }),
    };
    section.deny_unknown_keys();
    let (path, gas) = (path?, gas?);
    let Some(layup) = layup else {
        return Ok(None);
    };
    match back_pressure {
        Some((_, written)) if path != GasFlowModel::Darcy => return Err(written.error(BACK_PRESSURE_NEEDS_DARCY)),
        _ => {}
    }
    section.require(GasFlow::check_model(path, layup, back_pressure.is_some()))?;
    let level = GasFlow::check_enthalpy_reference(&gas, layup);
    match named {
        Some(written) => written.require(level)?,
        None => section.require(level)?,
    }
    Ok(Some(GasFlow { model: path, gas: Arc::new(gas) }))
}

/// Gas transport of a case with pyrolysis and without `[gas]`.
fn default_gas_flow(
    top: &TableReader<'_>,
    references: &ReferenceResolver<'_>,
    layup: Option<&Layup>,
) -> ReadResult<GasFlow> {
    let gas = references.default_gas(DEFAULT_PYROLYSIS_GAS)?;
    if let Some(layup) = layup {
        let level = GasFlow::check_enthalpy_reference(&gas, layup);
        top.require(level.map_err(|reason| format!("missing [gas]: {reason}")))?;
    }
    Ok(GasFlow { model: GasFlowModel::QuasiSteady, gas: Arc::new(gas) })
}
