//! `[hot_face]`, `[back_face]` and `[holder]`.

use super::layup::held_at;
use super::schedule::Schedules;
use super::written::{Section, Written};
use crate::case::error::Read;
use crate::case::nearest::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Emissivity, Face, Holder, Layup, OpenFace, Schedule, Sensor};

/// Temperature of the surroundings if the case names none, K.
const ROOM_K: f64 = 300.0;

/// A hot face; if it is held in depth, that depth.
pub(super) struct HotFace<'a> {
    pub(super) face: Face,
    pub(super) held: Option<(f64, Written<'a>)>,
    /// The key `blowing`, if it is above zero.
    pub(super) blowing: Option<Written<'a>>,
}

/// A back face, and its pressure if it is permeable.
pub(super) struct BackFace<'a> {
    pub(super) face: Face,
    pub(super) pressure: Option<(Schedule, Written<'a>)>,
}

pub(super) fn hot_face<'a>(
    case: &Section<'a>,
    schedules: &Schedules<'_>,
    layup: Option<&Layup>,
    sensors: Option<&[Sensor]>,
) -> Read<HotFace<'a>> {
    let section = case.required("hot_face", "a table [hot_face]")?.section()?;
    let open = |face: Read<OpenFace>| {
        let face = face?;
        let blowing = if face.blowing > 0.0 { section.optional("blowing") } else { None };
        Ok(HotFace { face: Face::Open(face), held: None, blowing })
    };
    let face = match kind(&section, &["heated", "convective", "held"])? {
        "heated" => open(heated(&section, schedules)),
        "convective" => open(convective(&section, schedules)),
        _ => {
            let temperature = held(&section, schedules);
            let at = match (section.optional("at"), layup, sensors) {
                (Some(at), Some(layup), Some(sensors)) => {
                    held_at(at, layup, sensors).map(|depth_m| Some((depth_m, at)))
                }
                _ => Ok(None),
            };
            at.and_then(|held| Ok(HotFace { face: temperature?, held, blowing: None }))
        }
    };
    section.close();
    face
}

pub(super) fn back_face<'a>(case: &Section<'a>, schedules: &Schedules<'_>) -> Read<BackFace<'a>> {
    let Some(written) = case.optional("back_face") else {
        return Ok(BackFace { face: Face::Open(OpenFace::insulated()), pressure: None });
    };
    let section = written.section()?;
    let face = match kind(&section, &["insulated", "cooled", "holder", "held"])? {
        "insulated" => Ok(Face::Open(OpenFace::insulated())),
        "cooled" => cooled(&section, schedules).map(Face::Open),
        "holder" => holder(&section, schedules).map(Face::Open),
        _ => held(&section, schedules),
    };
    let pressure = section.optional("pressure").map(|written| Ok((pressure(written, schedules)?, written))).transpose();
    section.close();
    Ok(BackFace { face: face?, pressure: pressure? })
}

/// A pressure schedule, above zero.
pub(super) fn pressure(written: Written<'_>, schedules: &Schedules<'_>) -> Read<Schedule> {
    let schedule = schedules.read(written, Dimension::Pressure)?;
    written.require(schedule.check_pressure()).map(|()| schedule)
}

/// `[holder]`: lateral heat loss.
pub(super) fn around(case: &Section<'_>, schedules: &Schedules<'_>) -> Read<Option<Holder>> {
    let Some(written) = case.optional("holder") else {
        return Ok(None);
    };
    let section = written.section()?;
    let conductance_w_m3_k = section.positive("conductance", Dimension::VolumeConductance);
    let temperature = section.required("temperature", Dimension::Temperature.expectation());
    let temperature_k = temperature.and_then(|written| schedules.read(written, Dimension::Temperature));
    section.close();
    Ok(Some(Holder { conductance_w_m3_k: conductance_w_m3_k?, temperature_k: temperature_k? }))
}

/// The kind of a face. With an unknown kind the other keys are not read, as their meaning is unknown.
fn kind<'a>(section: &Section<'a>, known: &[&str]) -> Read<&'a str> {
    let written = section.required("kind", &known.join(", "))?;
    let kind = written.text()?;
    if known.contains(&kind) {
        return Ok(kind);
    }
    Err(written.fault(format!("unknown kind {kind:?}{}", suggestion(kind, known.iter().copied()))))
}

fn heated(section: &Section<'_>, schedules: &Schedules<'_>) -> Read<OpenFace> {
    let zero = || Ok(Schedule::constant(0.0));
    let flux = section.optional("flux");
    let radiant = section.optional("radiant_flux");
    let recovery = section.optional("recovery_enthalpy");
    let complete = if flux.is_none() && radiant.is_none() {
        Err(section.fault("a heated face needs a `flux` or a `radiant_flux`"))
    } else if let (None, Some(recovery)) = (flux, recovery) {
        Err(recovery.fault("`recovery_enthalpy` needs a `flux`: found none"))
    } else {
        Ok(())
    };
    let flux_w_m2 = flux.map_or_else(zero, |written| schedules.read(written, Dimension::HeatFlux));
    let radiant_w_m2 = radiant.map_or_else(zero, |written| schedules.read(written, Dimension::HeatFlux));
    let recovery_enthalpy_j_kg = recovery.map(|written| written.positive(Dimension::SpecificEnthalpy)).transpose();
    let film = match (section.optional("coefficient"), section.optional("gas")) {
        (None, None) => Ok((0.0, Schedule::constant(ROOM_K))),
        (Some(film), Some(gas)) => {
            let film = film.not_negative(Dimension::Conductance);
            let gas = schedules.read(gas, Dimension::Temperature);
            film.and_then(|film| Ok((film, gas?)))
        }
        (Some(film), None) => Err(film.fault("`coefficient` needs the gas temperature: expected a key `gas`")),
        (None, Some(gas)) => Err(gas.fault("`gas` needs a heat transfer coefficient: expected a key `coefficient`")),
    };
    let emissivity = emissivity(section);
    let surroundings_k = surroundings(section, schedules);
    let blowing = section.optional("blowing").map_or(Ok(0.0), |written| blowing(written, recovery.is_some()));
    complete?;
    let (film_w_m2_k, gas_k) = film?;
    Ok(OpenFace {
        flux_w_m2: flux_w_m2?,
        recovery_enthalpy_j_kg: recovery_enthalpy_j_kg?,
        radiant_w_m2: radiant_w_m2?,
        film_w_m2_k,
        film_heats: false,
        gas_k,
        emissivity: emissivity?,
        surroundings_k: surroundings_k?,
        blowing: blowing?,
    })
}

fn blowing(written: Written<'_>, corrected: bool) -> Read<f64> {
    written.require(OpenFace::checked_blowing(written.number()?, corrected))
}

/// Temperature of the radiative surroundings; room temperature by default.
fn surroundings(section: &Section<'_>, schedules: &Schedules<'_>) -> Read<Schedule> {
    let room = || Ok(Schedule::constant(ROOM_K));
    section.optional("surroundings").map_or_else(room, |written| schedules.read(written, Dimension::Surroundings))
}

fn convective(section: &Section<'_>, schedules: &Schedules<'_>) -> Read<OpenFace> {
    let film_w_m2_k = section.positive("coefficient", Dimension::Conductance);
    let gas = section.required("gas", Dimension::Temperature.expectation());
    let gas_k = gas.and_then(|written| schedules.read(written, Dimension::Temperature));
    let emissivity = emissivity(section);
    let surroundings_k = surroundings(section, schedules);
    Ok(OpenFace {
        film_w_m2_k: film_w_m2_k?,
        film_heats: true,
        gas_k: gas_k?,
        emissivity: emissivity?,
        surroundings_k: surroundings_k?,
        ..OpenFace::insulated()
    })
}

fn cooled(section: &Section<'_>, schedules: &Schedules<'_>) -> Read<OpenFace> {
    let film = section.required("coefficient", Dimension::Conductance.expectation());
    let film_w_m2_k = film.and_then(|written| written.not_negative(Dimension::Conductance));
    let ambient = section.required("ambient", Dimension::Temperature.expectation());
    let gas_k = ambient.and_then(|written| schedules.read(written, Dimension::Temperature));
    let emissivity = emissivity(section);
    let surroundings = section.optional("surroundings");
    let surroundings = surroundings.map(|written| schedules.read(written, Dimension::Surroundings));
    let (gas_k, surroundings) = (gas_k?, surroundings.transpose()?);
    Ok(OpenFace {
        film_w_m2_k: film_w_m2_k?,
        surroundings_k: surroundings.unwrap_or_else(|| gas_k.clone()),
        gas_k,
        emissivity: emissivity?,
        ..OpenFace::insulated()
    })
}

fn holder(section: &Section<'_>, schedules: &Schedules<'_>) -> Read<OpenFace> {
    let film_w_m2_k = section.positive("conductance", Dimension::Conductance);
    let temperature = section.required("temperature", Dimension::Temperature.expectation());
    let gas_k = temperature.and_then(|written| schedules.read(written, Dimension::Temperature));
    Ok(OpenFace { film_w_m2_k: film_w_m2_k?, gas_k: gas_k?, ..OpenFace::insulated() })
}

fn held(section: &Section<'_>, schedules: &Schedules<'_>) -> Read<Face> {
    let temperature = section.required("temperature", Dimension::Temperature.expectation())?;
    schedules.read(temperature, Dimension::Temperature).map(Face::Held)
}

/// The emissivity of the material by default.
fn emissivity(section: &Section<'_>) -> Read<Emissivity> {
    let Some(written) = section.optional("emissivity") else {
        return Ok(Emissivity::Material);
    };
    written.require(Emissivity::checked(written.quantity(Dimension::Fraction)?))
}
