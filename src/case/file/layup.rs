//! `[[ply]]`, `contact_conductance` or `contact_resistance`, `[[sensor]]`, and the temperature limits of all.

use super::property::keyword;
use super::references::ReferenceResolver;
use super::spanned_toml::{TableReader, ValueReader, collect_all};
use crate::case::error::ReadResult;
use crate::case::layup::rounded_mm;
use crate::case::pyrometer_driver::ObservedFace;
use crate::case::suggestion::suggestion;
use crate::case::unit::{Dimension, parse_quantity};
use crate::case::validation::UniqueNames;
use crate::case::{Face, Layup, LimitedPart, Ply, Pyrometer, Sensor, Side, Spectrum, TemperatureLimit};
use crate::limits::{PLIES, SENSORS};

/// A ply and its key `contact_below`.
struct PlyEntry {
    ply: Ply,
    contact_below: Option<Option<f64>>,
}

/// Keys of temperature limits, which [`limits`] reads: of a ply or a sensor, and of the interface below a ply.
const LIMIT: &str = "limit";
const LIMIT_BELOW: &str = "limit_below";
const LIMIT_KEYS: [&str; 2] = [LIMIT, LIMIT_BELOW];

/// The layup from its hot face down.
pub(super) fn layup(case: &TableReader<'_>, references: &ReferenceResolver<'_>) -> ReadResult<Layup> {
    let (conductance, resistance) = (case.optional("contact_conductance"), case.optional("contact_resistance"));
    let (written, key) =
        resistance.map_or((conductance, "contact_conductance"), |_| (resistance, "contact_resistance"));
    let everywhere = match (conductance, resistance) {
        (Some(_), Some(written)) => {
            Err(written.error("expected `contact_conductance` or `contact_resistance`, not both"))
        }
        (Some(written), None) => contact_conductance(written),
        (None, Some(written)) => contact_resistance(written),
        (None, None) => Ok(None),
    };
    let reacts = case.optional("decomposition").is_some_and(|written| written.boolean().unwrap_or(true));
    let sections = case.array_of_tables("ply")?;
    if sections.is_empty() {
        return Err(case.error("no ply: expected at least one [[ply]]"));
    }
    case.require(PLIES.check(sections.len() as f64))?;
    let names = check_unique_names(&sections, "ply");
    let layers = collect_all(sections.iter().map(|section| ply_entry(section, references, reacts)));
    let (everywhere, layers, _) = (everywhere?, layers?, names?);
    let below = sections.last().and_then(|section| section.optional("contact_below"));
    if let Some(written) = below {
        return Err(written.error("`contact_below` needs a ply below: this is the last one"));
    }
    let is_taken = layers[..layers.len() - 1].iter().any(|layer| layer.contact_below.is_none());
    if let (Some(written), Some(_), false) = (written, everywhere, is_taken) {
        let why = if layers.len() == 1 { "the layup has one ply" } else { "every ply has its own `contact_below`" };
        return Err(written.error(format!("`{key}` applies to no interface: {why}")));
    }
    let contacts = layers[..layers.len() - 1].iter().map(|layer| layer.contact_below.unwrap_or(everywhere));
    Ok(Layup {
        contacts_w_m2_k: contacts.collect(),
        plies: layers.into_iter().map(|layer| layer.ply).collect(),
        origin_m: 0.0,
    })
}

/// A ply; `check_decomposition` is the key `decomposition` of the case.
fn ply_entry(section: &TableReader<'_>, references: &ReferenceResolver<'_>, reacts: bool) -> ReadResult<PlyEntry> {
    let name = section.required("name", "a name such as \"OF1\"").and_then(ValueReader::name);
    let group = section.optional("group").map(ValueReader::name).transpose();
    let thickness_m = section.positive("thickness", Dimension::Length);
    let material =
        section.required("material", "a material such as \"pyrogel3350\"").and_then(|w| references.material(w));
    let contact_below = section.optional("contact_below").map(contact).transpose();
    let decomposes = section.optional("decomposition");
    let own = decomposes.map_or(Ok(true), ValueReader::boolean);
    section.allow_keys(&LIMIT_KEYS);
    section.deny_unknown_keys();
    if let (Some(written), Ok(true), Ok(material)) = (decomposes, own, &material) {
        if material.decomposition.is_none() {
            return Err(written.error(format!("material {:?} has no [decomposition]", material.id)));
        }
        if !reacts {
            return Err(written.error("`decomposition` of a ply needs `decomposition = true` of the case"));
        }
    }
    let (name, group, own) = (name?, group?, own?);
    let ply = Ply {
        name: name.to_owned(),
        group: group.unwrap_or(name).to_owned(),
        material: if own { material? } else { material?.without_decomposition() },
        thickness_m: thickness_m?,
    };
    Ok(PlyEntry { ply, contact_below: contact_below? })
}

/// A conductance, a resistance, or `"perfect"`.
fn contact(written: ValueReader<'_>) -> ReadResult<Option<f64>> {
    let is_resistance = written.is_text() && parse_quantity(written.text()?, Dimension::ContactResistance).is_ok();
    if is_resistance { contact_resistance(written) } else { contact_conductance(written) }
}

/// The conductance of a resistance.
fn contact_resistance(written: ValueReader<'_>) -> ReadResult<Option<f64>> {
    Ok(Some(1.0 / written.positive(Dimension::ContactResistance)?))
}

/// A conductance, or `"perfect"`.
fn contact_conductance(written: ValueReader<'_>) -> ReadResult<Option<f64>> {
    if written.is_text() && written.text()? == "perfect" {
        return Ok(None);
    }
    written.positive(Dimension::Conductance).map(Some)
}

/// Require different names in a list of tables.
pub(super) fn check_unique_names(sections: &[TableReader<'_>], noun: &'static str) -> ReadResult<()> {
    let mut names = UniqueNames::new(noun);
    let named = sections.iter().filter_map(|section| section.optional("name")).filter(|written| written.is_text());
    collect_all(named.map(|written| written.require(names.insert(written.text()?)))).map(drop)
}

/// The sensors in the order of the file. Without a valid layup only the keys are read.
pub(super) fn sensors(case: &TableReader<'_>, layup: Option<&Layup>) -> ReadResult<Vec<Sensor>> {
    let sections = case.array_of_tables("sensor")?;
    if sections.is_empty() {
        return Err(case.error("no sensor: expected at least one [[sensor]]"));
    }
    case.require(SENSORS.check(sections.len() as f64))?;
    let names = check_unique_names(&sections, "sensor");
    let sensors = collect_all(sections.iter().map(|section| sensor(section, layup)));
    names.and(sensors)
}

fn sensor(section: &TableReader<'_>, layup: Option<&Layup>) -> ReadResult<Sensor> {
    let name = section.required("name", "a name such as \"TC1\"").and_then(sensor_name);
    if keyword(section, "kind", &[("thermocouple", false), ("pyrometer", true)])? {
        let pyrometer = pyrometer(section);
        section.deny_unknown_keys();
        return Ok(Sensor {
            name: name?,
            depth_m: 0.0,
            side: Side::Both,
            time_constant_s: 0.0,
            pyrometer: Some(pyrometer?),
        });
    }
    let time_constant_s =
        section.optional("time_constant").map_or(Ok(0.0), |written| written.not_negative(Dimension::Time));
    let depth_m = match (section.optional("below"), section.optional("depth")) {
        (Some(below), None) => depth_below_ply_m(below, layup),
        (None, Some(depth)) => {
            depth.not_negative(Dimension::Length).and_then(|depth_m| snapped_depth_m(depth_m, depth, layup))
        }
        (Some(_), Some(depth)) => Err(depth.error("expected `below` or `depth`, not both")),
        (None, None) => Err(section.error("a sensor needs `below = \"OF1\"` or `depth = \"5.72 mm\"`")),
    };
    let side = section.optional("side").map_or(Ok(Side::Both), |written| {
        let side = side(written)?;
        match (layup, depth_m) {
            (Some(layup), Ok(depth_m)) => written.require(Sensor::checked_side(side, depth_m, layup)),
            _ => Ok(side),
        }
    });
    section.allow_keys(&[LIMIT]);
    section.deny_unknown_keys();
    Ok(Sensor { name: name?, depth_m: depth_m?, side: side?, time_constant_s: time_constant_s?, pyrometer: None })
}

fn pyrometer(section: &TableReader<'_>) -> ReadResult<Pyrometer> {
    let spectrum = match (section.optional("wavelength"), section.optional("band")) {
        (Some(written), None) => {
            let wavelength_m = written.quantity(Dimension::Length);
            wavelength_m
                .and_then(|wavelength_m| written.require(Spectrum::checked_wavelength_m(wavelength_m)))
                .map(Spectrum::Wavelength)
        }
        (None, Some(written)) => written.pair().and_then(|[shorter, longer]| {
            let (shorter_m, longer_m) = (shorter.quantity(Dimension::Length), longer.quantity(Dimension::Length));
            written.require(Spectrum::checked_band(shorter_m?, longer_m?))
        }),
        (Some(_), Some(written)) => Err(written.error("expected `wavelength` or `band`, not both")),
        (None, None) => {
            Err(section.error("a pyrometer needs `wavelength = \"0.9 um\"` or `band = [\"8 um\", \"14 um\"]`"))
        }
    };
    let emissivity = section.required("emissivity", "the emissivity that it is set to, such as 0.85");
    let emissivity = emissivity
        .and_then(|written| written.require(Pyrometer::checked_emissivity(written.quantity(Dimension::Fraction)?)));
    Ok(Pyrometer { spectrum: spectrum?, emissivity: emissivity? })
}

/// The pyrometer whose readings hold the hot face, and the emissivity of the face.
pub(super) fn observed_face(written: ValueReader<'_>, is_hot_face: bool) -> ReadResult<ObservedFace> {
    let section = written.section()?;
    let pyrometer = pyrometer(&section);
    let emissivity = section.required("face_emissivity", "the emissivity of the face, such as 0.8");
    let emissivity = emissivity.and_then(|written| written.quantity(Dimension::Fraction));
    let deviation = section.required("face_emissivity_deviation", "the standard deviation of it, such as 0.03");
    let deviation = deviation.and_then(|written| written.quantity(Dimension::Fraction));
    let surroundings = section.optional("surroundings");
    let surroundings_k = surroundings.map_or(Ok(300.0), |written| written.quantity(Dimension::Surroundings));
    section.deny_unknown_keys();
    let (pyrometer, emissivity, deviation) = (pyrometer?, emissivity?, deviation?);
    written.require(ObservedFace::check(emissivity, deviation))?;
    if !is_hot_face {
        return Err(written.error("a pyrometer looks at the hot face: found one at the back face"));
    }
    Ok(ObservedFace { pyrometer, emissivity, deviation, surroundings_k: surroundings_k? })
}

/// Require a hot face that the pyrometers can read; errors are at the tables of the sensors.
pub(super) fn check_pyrometers(
    case: &TableReader<'_>,
    layup: &Layup,
    sensors: &[Sensor],
    hot_face: &Face,
) -> ReadResult<()> {
    let ply = &layup.plies[0];
    let sections = case.array_of_tables("sensor")?;
    let pyrometers = sections.iter().zip(sensors).filter(|(_, sensor)| sensor.pyrometer.is_some());
    collect_all(
        pyrometers.map(|(section, _)| section.require(Pyrometer::check_face(hot_face, &ply.name, &ply.material))),
    )
    .map(drop)
}

fn side(written: ValueReader<'_>) -> ReadResult<Side> {
    match written.text()? {
        "above" => Ok(Side::Above),
        "below" => Ok(Side::Below),
        "both" => Ok(Side::Both),
        other => Err(written.error(format!("expected above, below or both, found {other:?}"))),
    }
}

fn sensor_name(written: ValueReader<'_>) -> ReadResult<String> {
    written.require(Sensor::checked_name(written.text()?)).map(str::to_owned)
}

fn depth_below_ply_m(written: ValueReader<'_>, layup: Option<&Layup>) -> ReadResult<f64> {
    let name = written.text()?;
    let Some(layup) = layup else {
        return Ok(0.0);
    };
    let found = layup.plies.iter().position(|ply| ply.name == name);
    let known = layup.plies.iter().map(|ply| ply.name.as_str());
    let ply = found.ok_or_else(|| written.error(format!("unknown ply {name:?}{}", suggestion(name, known))))?;
    Ok(layup.faces_m()[ply])
}

/// A depth within the layup, moved onto a close face.
fn snapped_depth_m(depth_m: f64, written: ValueReader<'_>, layup: Option<&Layup>) -> ReadResult<f64> {
    layup.map_or(Ok(depth_m), |layup| written.require(layup.checked_depth_m(depth_m)))
}

/// The depth of a held face, given by a sensor or as a depth.
pub(super) fn held_face_depth_m(written: ValueReader<'_>, layup: &Layup, sensors: &[Sensor]) -> ReadResult<f64> {
    let text = written.text()?;
    let depth_m = if let Some(sensor) = sensors.iter().find(|sensor| sensor.name == text) {
        sensor.depth_m
    } else if text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        snapped_depth_m(written.not_negative(Dimension::Length)?, written, Some(layup))?
    } else {
        let known = sensors.iter().map(|sensor| sensor.name.as_str());
        let hint = suggestion(text, known);
        return Err(written.error(format!("expected a sensor or a depth, found {text:?}{hint}")));
    };
    if depth_m >= layup.back_m() - layup.close_to_back_m() {
        let [depth, back] = [depth_m, layup.back_m()].map(rounded_mm);
        return Err(written.error(format!("expected a depth above the back face at {back} mm, found {depth} mm")));
    }
    Ok(depth_m)
}

/// The layup and its sensors below a face held at a depth. A sensor above it is an error.
pub(super) fn part_below_held_face(
    layup: Layup,
    sensors: Vec<Sensor>,
    depth_m: f64,
    face: ValueReader<'_>,
) -> ReadResult<(Layup, Vec<Sensor>)> {
    let layup = layup.part_below(depth_m);
    let sensors = collect_all(sensors.into_iter().map(|sensor| {
        if sensor.depth_m < depth_m {
            let (lies, held) = (rounded_mm(sensor.depth_m), rounded_mm(depth_m));
            let name = &sensor.name;
            return Err(face.error(format!("sensor {name:?} at {lies} mm lies above the held face at {held} mm")));
        }
        // The depths of the remaining faces are summed again and may differ in the last bit.
        Ok(Sensor { depth_m: layup.snap_to_face_m(sensor.depth_m), ..sensor })
    }))?;
    Ok((layup, sensors))
}

/// The temperature limits of plies, interfaces and sensors, in this order. Without a valid layup only the temperatures
/// are read.
pub(super) fn limits(
    case: &TableReader<'_>,
    marched: Option<(&Layup, &[Sensor])>,
) -> ReadResult<Vec<TemperatureLimit>> {
    let plies = tables(case, "ply")?;
    let of_plies = plies.iter().enumerate().flat_map(|(index, section)| {
        let written = LIMIT_KEYS.into_iter().filter_map(move |key| Some((key, section.optional(key)?)));
        written.map(move |(key, written)| (index, key == LIMIT_BELOW, written))
    });
    let of_plies = of_plies.map(|(index, is_below, written)| {
        let limit_k = written.quantity(Dimension::LayupTemperature);
        if is_below && index + 1 == plies.len() {
            return Err(written.error("`limit_below` needs a ply below: this is the last one"));
        }
        let Some((layup, _)) = marched else { return limit_k.map(|_| None) };
        // Plies above a held face drop out.
        let Some(ply) = (index + layup.plies.len()).checked_sub(plies.len()) else {
            return Err(written.error("this ply lies above the held face, so its temperature is not computed"));
        };
        let part = if is_below { LimitedPart::Interface(ply) } else { LimitedPart::Ply(ply) };
        limit_k.map(|limit_k| Some(TemperatureLimit { part, limit_k }))
    });
    let sensors = tables(case, "sensor")?;
    let of_sensors = sensors.iter().enumerate().filter_map(|(index, section)| {
        let limit_k = section.optional(LIMIT)?.quantity(Dimension::LayupTemperature);
        Some(limit_k.map(|limit_k| Some(TemperatureLimit { part: LimitedPart::Sensor(index), limit_k })))
    });
    Ok(collect_all(of_plies.chain(of_sensors))?.into_iter().flatten().collect())
}

/// The tables of a list; other values are errors of the functions that read them whole.
fn tables<'a>(case: &TableReader<'a>, key: &'static str) -> ReadResult<Vec<TableReader<'a>>> {
    let list = case.optional(key).filter(|written| written.is_list()).map_or(Ok(Vec::new()), ValueReader::list)?;
    collect_all(list.into_iter().filter(|written| written.is_table()).map(ValueReader::section))
}
