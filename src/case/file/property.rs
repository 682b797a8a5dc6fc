//! Keys that material and gas files share: tables over temperature and pressure, pores, provenance.

use super::spanned_toml::{TableReader, ValueReader, collect_all};
use crate::case::error::ReadResult;
use crate::case::suggestion::suggestion;
use crate::case::unit::{Dimension, unit_conversion};
use crate::case::{Conductivity, OutOfRange, Pores, Provenance, SourceKind, Table, ThreePartConductivity};

/// Klinkenberg slip of air, `b r/T` with `b = 4 λp/r`, Pa m/K, and λ from
/// [`air_mean_free_path_m`](crate::case::air::air_mean_free_path_m).
const SLIP_COEFFICIENT_PA_M_K: f64 = 9.332e-5;

/// A table, a table per pressure, or three parts; the density converts a specific extinction.
pub(super) fn conductivity(section: &TableReader<'_>, density_kg_m3: f64) -> ReadResult<Conductivity> {
    if let Some(written) = section.optional("at") {
        tables_by_pressure(written).map(Conductivity::Tables)
    } else if section.optional("solid").is_some() {
        three_part_conductivity(section, density_kg_m3).map(Conductivity::ThreePart)
    } else {
        // A single table holds at all pressures: the value of its pressure has no effect.
        table(section, Dimension::Conductivity).map(|table| Conductivity::Tables(vec![(101_325.0, table)]))
    }
}

/// `[[conductivity.at]]`: a table per pressure.
fn tables_by_pressure(written: ValueReader<'_>) -> ReadResult<Vec<(f64, Table)>> {
    let mut last_pa = 0.0;
    collect_all(written.list()?.into_iter().map(|written| {
        let section = written.section()?;
        let pressure_pa = section.positive("pressure", Dimension::Pressure);
        let table = table(&section, Dimension::Conductivity);
        section.deny_unknown_keys();
        last_pa = section.require(Conductivity::checked_next_pressure_pa(last_pa, pressure_pa?))?;
        Ok((last_pa, table?))
    }))
}

fn three_part_conductivity(section: &TableReader<'_>, density_kg_m3: f64) -> ReadResult<ThreePartConductivity> {
    let solid = section.required("solid", Dimension::Conductivity.name_and_example());
    let solid_w_m_k = solid.and_then(|written| written.not_negative(Dimension::Conductivity));
    let solid_exponent = section.optional("solid_exponent").map_or(Ok(0.0), ValueReader::number);
    let pores = section.array_of_tables("pores").and_then(|pores| {
        collect_all(pores.iter().map(|pore| {
            let share = pore.positive("share", Dimension::Fraction);
            let length_m = pore.positive("length", Dimension::Length);
            pore.deny_unknown_keys();
            Ok((share?, length_m?))
        }))
    });
    let extinction = section.optional("extinction").map(|written| written.positive(Dimension::Extinction));
    let specific = section.optional("specific_extinction");
    let extinction_1_m = match (extinction, specific) {
        (Some(_), Some(written)) => Err(written.error("expected `extinction` or `specific_extinction`, not both")),
        (Some(extinction), None) => extinction.map(Some),
        (None, Some(written)) => {
            written.positive(Dimension::SpecificExtinction).map(|specific| Some(specific * density_kg_m3))
        }
        (None, None) => Ok(None),
    };
    let range = section.required("range", "temperatures such as [\"250 K\", \"1400 K\"]").and_then(|written| {
        let [low, high] = written.pair()?;
        let (low, high) = (low.quantity(Dimension::Temperature)?, high.quantity(Dimension::Temperature)?);
        written.require(ThreePartConductivity::checked_range_k((low, high)))
    });
    Ok(ThreePartConductivity {
        solid_w_m_k: solid_w_m_k?,
        solid_exponent: solid_exponent?,
        pores: pores?,
        extinction_1_m: extinction_1_m?,
        extinction_follows_density: specific.is_some(),
        range_k: range?,
    })
}

/// `value = "900 J/kg/K"`, or lists `temperatures_k` and `values` with a `unit`.
pub(super) fn table(section: &TableReader<'_>, dimension: Dimension) -> ReadResult<Table> {
    if let Some(written) = section.optional("value") {
        let value = written.quantity(dimension)?;
        return written.require(Table::checked_value(value, dimension)).map(Table::constant);
    }
    let temperatures_k = table_temperatures(section);
    let outside = section.required("outside", "clamp, extrapolate or error").and_then(outside);
    let scale = match section.optional("unit") {
        None if dimension == Dimension::Fraction => Ok(1.0),
        None => {
            Err(section.error(format!("missing key \"unit\": expected the unit of {}", dimension.name_and_example())))
        }
        Some(written) => {
            written.text().and_then(|unit| written.require(unit_conversion(unit, dimension).map(|(scale, _)| scale)))
        }
    };
    let listed = section.required("values", "a list of values, one per temperature");
    let values = listed.and_then(numbers);
    let (temperatures_k, outside, scale, values) = (temperatures_k?, outside?, scale?, values?);
    let si = values.iter().map(|(value, _)| value * scale).collect();
    let table = listed?.require(Table::new(temperatures_k, si, outside))?;
    collect_all(
        values.into_iter().map(|(value, written)| written.require(Table::checked_value(value * scale, dimension))),
    )?;
    Ok(table)
}

/// `temperatures_k`, or `temperatures` with their `temperature_unit`, K.
fn table_temperatures(section: &TableReader<'_>) -> ReadResult<Vec<f64>> {
    let (kelvin, other) = (section.optional("temperatures_k"), section.optional("temperatures"));
    let unit = section.optional("temperature_unit");
    match (kelvin, other, unit) {
        (Some(written), None, None) => increasing_temperatures(numbers(written)?, (1.0, 0.0)),
        (None, Some(written), Some(unit)) => {
            let conversion = unit.require(unit_conversion(unit.text()?, Dimension::Temperature))?;
            increasing_temperatures(numbers(written)?, conversion)
        }
        (None, Some(written), None) => {
            Err(written.error("`temperatures` need a key `temperature_unit` such as \"degR\": found none"))
        }
        (Some(_), Some(written), _) => Err(written.error("expected `temperatures_k` or `temperatures`, not both")),
        (_, None, Some(unit)) => Err(unit.error("`temperature_unit` needs a key `temperatures`: found none")),
        (None, None, None) => {
            Err(section.error("missing key \"temperatures_k\": expected a list of temperatures in K, or a key `value`"))
        }
    }
}

fn numbers(written: ValueReader<'_>) -> ReadResult<Vec<(f64, ValueReader<'_>)>> {
    collect_all(written.list()?.into_iter().map(|each| Ok((each.number()?, each))))
}

/// Temperatures in K, each scaled and shifted, which must not decrease.
fn increasing_temperatures(
    temperatures: Vec<(f64, ValueReader<'_>)>,
    (scale, offset_k): (f64, f64),
) -> ReadResult<Vec<f64>> {
    let temperatures_k: Vec<f64> = temperatures.iter().map(|(temperature, _)| temperature * scale + offset_k).collect();
    let checks = temperatures.iter().enumerate();
    collect_all(checks.map(|(point, (_, written))| {
        written.require(Table::check_temperature(&temperatures_k, point)).map(|()| temperatures_k[point])
    }))
}

fn outside(written: ValueReader<'_>) -> ReadResult<OutOfRange> {
    match written.text()? {
        "clamp" => Ok(OutOfRange::Clamp),
        "extrapolate" => Ok(OutOfRange::Extrapolate),
        "error" => Ok(OutOfRange::Error),
        other => Err(written.error(format!("expected clamp, extrapolate or error, found {other:?}"))),
    }
}

/// `[pores]`; a residue inherits missing keys from the virgin material.
pub(super) fn pores(section: &TableReader<'_>, virgin: Option<Pores>) -> ReadResult<Pores> {
    let porosity = match (section.optional("porosity"), virgin) {
        (Some(written), _) => porosity(written),
        (None, Some(virgin)) => Ok(virgin.porosity),
        (None, None) => Err(section.error("missing key \"porosity\": expected a volume fraction such as 0.9")),
    };
    let permeability = match (section.optional("permeability"), virgin) {
        (Some(written), _) => written.not_negative(Dimension::Permeability),
        (None, Some(virgin)) => Ok(virgin.permeability_m2),
        (None, None) => section.required("permeability", Dimension::Permeability.name_and_example()).map(|_| 0.0),
    };
    let slip = section
        .optional("pore_radius")
        .map(|written| Ok(SLIP_COEFFICIENT_PA_M_K / written.positive(Dimension::Length)?));
    let inertia =
        section.optional("forchheimer_coefficient").map(|written| written.not_negative(Dimension::InertialCoefficient));
    let virgin = virgin.unwrap_or(Pores::IMPERMEABLE);
    let pores = Pores {
        porosity: porosity?,
        permeability_m2: permeability?,
        slip_pa_k: slip.unwrap_or(Ok(virgin.slip_pa_k))?,
        forchheimer_1_m: inertia.unwrap_or(Ok(virgin.forchheimer_1_m))?,
    };
    section.require(pores.check_permeable())
}

fn porosity(written: ValueReader<'_>) -> ReadResult<f64> {
    written.require(Pores::checked_porosity(written.quantity(Dimension::Fraction)?))
}

/// The value of a key with a fixed set of words; the first one by default.
pub(super) fn keyword<T: Copy>(
    section: &TableReader<'_>,
    key: &'static str,
    known: &[(&'static str, T)],
) -> ReadResult<T> {
    let Some(written) = section.optional(key) else {
        return Ok(known[0].1);
    };
    let word = written.text()?;
    let words = || known.iter().map(|(word, _)| *word);
    let found = known.iter().find(|(known, _)| *known == word).map(|&(_, value)| value);
    found.ok_or_else(|| written.error(format!("unknown {key} {word:?}{}", suggestion(word, words()))))
}

/// Provenance. `uncertainty` is the half-width of the 95 % interval in the file and one standard deviation, half of it,
/// here. Without a `mark` all keys are optional.
pub(super) fn provenance(section: &TableReader<'_>) -> ReadResult<Provenance> {
    let (mark, source, uncertainty) =
        (section.optional("mark"), section.optional("source"), section.optional("uncertainty"));
    let is_complete = if mark.is_none() {
        Ok(())
    } else if source.is_none() {
        let expected = "expected the publication, the report, the supplier, or the basis of the estimate";
        Err(section.error(format!("missing key \"source\": {expected}")))
    } else if uncertainty.is_none() {
        Err(section.error("missing key \"uncertainty\": expected a relative uncertainty such as \"30 %\""))
    } else {
        Ok(())
    };
    let kind = mark.map_or(Ok(SourceKind::NotStated), |written| {
        let mark = written.text()?;
        let known = "expected read, remembered, estimated, paper or measured";
        SourceKind::named(mark).ok_or_else(|| written.error(format!("{known}, found {mark:?}")))
    });
    let source = source.map_or(Ok(""), |written| {
        let source = written.text()?;
        written.require(Provenance::checked_source(kind.as_ref().map_or(SourceKind::NotStated, |kind| *kind), source))
    });
    let uncertainty = uncertainty.map(|written| Ok(written.not_negative(Dimension::Fraction)? / 2.0)).transpose();
    is_complete?;
    Ok(Provenance { source_kind: kind?, source: source?.to_owned(), relative_uncertainty: uncertainty? })
}
