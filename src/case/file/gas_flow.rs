//! Gas transport: `decomposition` and `[gas]` of a case.

use super::exposure::BackFace;
use super::property::choice;
use super::references::References;
use super::written::{Section, Written};
use crate::case::error::Read;
use crate::case::gas::UNDRIVEN;
use crate::case::{GasFlow, GasPath, Layup, Ply};
use std::sync::Arc;

/// Default gas: of pyrolysis, and of a flow driven by pressure without pyrolysis.
const MADE: &str = "pyrolysis";
const BLOWN: &str = "air";

/// The layup; without `decomposition = true` all plies are inert.
pub(super) fn reacting(top: &Section<'_>, layup: Read<Layup>) -> Read<Layup> {
    let written = top.optional("decomposition");
    let reacts = written.map_or(Ok(false), Written::truth);
    let (mut layup, reacts) = (layup?, reacts?);
    if !reacts {
        layup.plies.iter_mut().for_each(|ply| ply.material = ply.material.as_made());
    } else if !layup.plies.iter().any(Ply::makes_gas) {
        let fault = |written: Written<'_>| written.fault("no ply has a material with a [decomposition]");
        return Err(written.map_or_else(|| top.fault("no ply decomposes"), fault));
    }
    Ok(layup)
}

/// Gas transport in the marched layup; `None` if no gas flows.
pub(super) fn flow(
    top: &Section<'_>,
    references: &References<'_>,
    layup: Option<&Layup>,
    back: Option<&BackFace<'_>>,
) -> Read<Option<GasFlow>> {
    let is_made = layup.is_some_and(|layup| layup.plies.iter().any(Ply::makes_gas));
    let written = top.optional("gas");
    let section = written.map(Written::section).transpose()?;
    let back_pressure = back.and_then(|back| back.pressure.as_ref());
    let Some(section) = section else {
        let back_pressure = back_pressure.map_or(Ok(()), |(_, written)| Err(written.fault(UNDRIVEN)));
        return back_pressure
            .and_then(|()| if is_made { standard(top, references, layup).map(Some) } else { Ok(None) });
    };
    let known =
        [("quasi-steady", GasPath::QuasiSteady), ("unhindered", GasPath::Unhindered), ("darcy", GasPath::Darcy)];
    let path = choice(&section, "flow", &known);
    let named = section.optional("gas");
    let gas = match named {
        Some(written) => references.gas(written),
        None => references.default_gas(if is_made { MADE } else { BLOWN }),
    };
    section.close();
    let (path, gas) = (path?, gas?);
    let Some(layup) = layup else {
        return Ok(None);
    };
    match back_pressure {
        Some((_, written)) if path != GasPath::Darcy => return Err(written.fault(UNDRIVEN)),
        _ => {}
    }
    section.require(GasFlow::check_path(path, layup, back_pressure.is_some()))?;
    let level = GasFlow::check_level(&gas, layup);
    match named {
        Some(written) => written.require(level)?,
        None => section.require(level)?,
    }
    Ok(Some(GasFlow { path, gas: Arc::new(gas) }))
}

/// Gas transport of a case with pyrolysis and without `[gas]`.
fn standard(top: &Section<'_>, references: &References<'_>, layup: Option<&Layup>) -> Read<GasFlow> {
    let gas = references.default_gas(MADE)?;
    if let Some(layup) = layup {
        let level = GasFlow::check_level(&gas, layup);
        top.require(level.map_err(|reason| format!("missing [gas]: {reason}")))?;
    }
    Ok(GasFlow { path: GasPath::QuasiSteady, gas: Arc::new(gas) })
}
