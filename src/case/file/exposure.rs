//! `[hot_face]`, `[back_face]` and `[holder]`.

use super::layup::held_face_depth_m;
use super::schedule::ScheduleReader;
use super::spanned_toml::{TableReader, ValueReader};
use crate::case::error::ReadResult;
use crate::case::suggestion::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Emissivity, Face, Holder, Layup, OpenFace, Schedule, Sensor};

/// Temperature of the surroundings if the case names none, K.
const ROOM_TEMPERATURE_K: f64 = 300.0;

/// A hot face; if it is held in depth, that depth.
pub(super) struct HotFace<'a> {
    pub(super) face: Face,
    pub(super) held_depth: Option<(f64, ValueReader<'a>)>,
    /// The key `blowing`, if it is above zero.
    pub(super) blowing: Option<ValueReader<'a>>,
}

/// A back face, and its pressure if it is permeable.
pub(super) struct BackFace<'a> {
    pub(super) face: Face,
    pub(super) pressure: Option<(Schedule, ValueReader<'a>)>,
}

pub(super) fn hot_face<'a>(
    case: &TableReader<'a>,
    schedules: &ScheduleReader<'_>,
    layup: Option<&Layup>,
    sensors: Option<&[Sensor]>,
) -> ReadResult<HotFace<'a>> {
    let section = case.required("hot_face", "a table [hot_face]")?.section()?;
    let open = |face: ReadResult<OpenFace>| {
        let face = face?;
        let blowing = if face.is_blown() { section.optional("blowing") } else { None };
        Ok(HotFace { face: Face::Open(face), held_depth: None, blowing })
    };
    let face = match face_kind(&section, &["heated", "convective", "held"])? {
        "heated" => open(heated_face(&section, schedules)),
        "convective" => open(convective_face(&section, schedules)),
        _ => {
            let temperature = held_face(&section, schedules, true);
            let at = match (section.optional("at"), layup, sensors) {
                (Some(at), ..) if schedules.references.has_pyrometer() => {
                    Err(at.error("a pyrometer reads the top of the layup: expected no `at`"))
                }
                (Some(at), Some(layup), Some(sensors)) => {
                    held_face_depth_m(at, layup, sensors).map(|depth_m| Some((depth_m, at)))
                }
                _ => Ok(None),
            };
            at.and_then(|held| Ok(HotFace { face: temperature?, held_depth: held, blowing: None }))
        }
    };
    section.deny_unknown_keys();
    face
}

pub(super) fn back_face<'a>(case: &TableReader<'a>, schedules: &ScheduleReader<'_>) -> ReadResult<BackFace<'a>> {
    let Some(written) = case.optional("back_face") else {
        return Ok(BackFace { face: Face::Open(OpenFace::insulated()), pressure: None });
    };
    let section = written.section()?;
    let face = match face_kind(&section, &["insulated", "cooled", "holder", "held"])? {
        "insulated" => Ok(Face::Open(OpenFace::insulated())),
        "cooled" => cooled_face(&section, schedules).map(Face::Open),
        "holder" => holder_face(&section, schedules).map(Face::Open),
        _ => held_face(&section, schedules, false),
    };
    let pressure = section.optional("pressure").map(|written| Ok((pressure(written, schedules)?, written))).transpose();
    section.deny_unknown_keys();
    Ok(BackFace { face: face?, pressure: pressure? })
}

/// A pressure schedule, above zero.
pub(super) fn pressure(written: ValueReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<Schedule> {
    let schedule = schedules.read(written, Dimension::Pressure)?;
    written.require(schedule.check_pressure()).map(|()| schedule)
}

/// `[holder]`: lateral heat loss.
pub(super) fn lateral_holder(case: &TableReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<Option<Holder>> {
    let Some(written) = case.optional("holder") else {
        return Ok(None);
    };
    let section = written.section()?;
    let conductance_w_m3_k = section.positive("conductance", Dimension::VolumeConductance);
    let temperature = section.required("temperature", Dimension::Temperature.name_and_example());
    let temperature_k = temperature.and_then(|written| schedules.read(written, Dimension::Temperature));
    section.deny_unknown_keys();
    Ok(Some(Holder { conductance_w_m3_k: conductance_w_m3_k?, temperature_k: temperature_k? }))
}

/// The kind of a face. With an unknown kind the other keys are not read, as their meaning is unknown.
fn face_kind<'a>(section: &TableReader<'a>, known: &[&str]) -> ReadResult<&'a str> {
    let written = section.required("kind", &known.join(", "))?;
    let kind = written.text()?;
    if known.contains(&kind) {
        return Ok(kind);
    }
    Err(written.error(format!("unknown kind {kind:?}{}", suggestion(kind, known.iter().copied()))))
}

fn heated_face(section: &TableReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<OpenFace> {
    let zero = || Ok(Schedule::constant(0.0));
    let flux = section.optional("flux");
    let radiant = section.optional("radiant_flux");
    let recovery = section.optional("recovery_enthalpy");
    let enthalpy_film = section.optional("enthalpy_film_coefficient");
    let complete = match (flux, enthalpy_film, recovery) {
        (None, None, None) if radiant.is_none() => {
            Err(section.error("a heated face needs a `flux`, an `enthalpy_film_coefficient` or a `radiant_flux`"))
        }
        (None, None, Some(recovery)) => {
            Err(recovery.error("`recovery_enthalpy` needs a `flux` or an `enthalpy_film_coefficient`: found none"))
        }
        (Some(_), Some(film), _) => Err(film.error("expected `flux` or `enthalpy_film_coefficient`, not both")),
        (None, Some(film), None) => {
            Err(film.error("`enthalpy_film_coefficient` needs a key `recovery_enthalpy`: found none"))
        }
        _ => Ok(()),
    };
    let flux_w_m2 = flux.map_or_else(zero, |written| schedules.read(written, Dimension::HeatFlux));
    let radiant_w_m2 = radiant.map_or_else(zero, |written| schedules.read(written, Dimension::HeatFlux));
    let enthalpy_film_kg_m2_s =
        enthalpy_film.map(|written| schedules.read_not_negative(written, Dimension::MassFlux)).transpose();
    let recovery_enthalpy_j_kg = recovery.map(|written| {
        let enthalpy_j_kg = schedules.read(written, Dimension::SpecificEnthalpy)?;
        if enthalpy_film.is_some() {
            Ok(enthalpy_j_kg)
        } else {
            written.require(OpenFace::checked_hot_wall(enthalpy_j_kg))
        }
    });
    let film = match (section.optional("heat_transfer_coefficient"), section.optional("gas")) {
        (None, None) => Ok((Schedule::constant(0.0), Schedule::constant(ROOM_TEMPERATURE_K))),
        (Some(film), Some(gas)) => {
            let film = schedules.read_not_negative(film, Dimension::Conductance);
            let gas = schedules.read(gas, Dimension::Temperature);
            film.and_then(|film| Ok((film, gas?)))
        }
        (Some(film), None) => {
            Err(film.error("`heat_transfer_coefficient` needs the gas temperature: expected a key `gas`"))
        }
        (None, Some(gas)) => Err(gas.error("`gas` needs a key `heat_transfer_coefficient`: found none")),
    };
    let emissivity = emissivity(section);
    let surroundings_k = surroundings(section, schedules);
    let blowing = section.optional("blowing").map_or(zero(), |written| {
        let lambda = schedules.read(written, Dimension::Fraction)?;
        written.require(OpenFace::checked_blowing(lambda, recovery.is_some()))
    });
    complete?;
    let (film_w_m2_k, gas_k) = film?;
    Ok(OpenFace {
        flux_w_m2: flux_w_m2?,
        recovery_enthalpy_j_kg: recovery_enthalpy_j_kg.transpose()?,
        enthalpy_film_kg_m2_s: enthalpy_film_kg_m2_s?,
        radiant_w_m2: radiant_w_m2?,
        film_w_m2_k,
        heating_scales_film: false,
        gas_k,
        emissivity: emissivity?,
        surroundings_k: surroundings_k?,
        blowing: blowing?,
    })
}

/// Temperature of the radiative surroundings; room temperature by default.
fn surroundings(section: &TableReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<Schedule> {
    let room = || Ok(Schedule::constant(ROOM_TEMPERATURE_K));
    section.optional("surroundings").map_or_else(room, |written| schedules.read(written, Dimension::Surroundings))
}

fn convective_face(section: &TableReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<OpenFace> {
    let film = section.required("heat_transfer_coefficient", Dimension::Conductance.name_and_example());
    let film_w_m2_k = film.and_then(|written| schedules.read_not_negative(written, Dimension::Conductance));
    let gas = section.required("gas", Dimension::Temperature.name_and_example());
    let gas_k = gas.and_then(|written| schedules.read(written, Dimension::Temperature));
    let emissivity = emissivity(section);
    let surroundings_k = surroundings(section, schedules);
    Ok(OpenFace {
        film_w_m2_k: film_w_m2_k?,
        heating_scales_film: true,
        gas_k: gas_k?,
        emissivity: emissivity?,
        surroundings_k: surroundings_k?,
        ..OpenFace::insulated()
    })
}

fn cooled_face(section: &TableReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<OpenFace> {
    let film = section.required("heat_transfer_coefficient", Dimension::Conductance.name_and_example());
    let film_w_m2_k = film.and_then(|written| schedules.read_not_negative(written, Dimension::Conductance));
    let ambient = section.required("ambient", Dimension::Temperature.name_and_example());
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

fn holder_face(section: &TableReader<'_>, schedules: &ScheduleReader<'_>) -> ReadResult<OpenFace> {
    let conductance = section.required("conductance", Dimension::Conductance.name_and_example());
    let film_w_m2_k =
        conductance.and_then(|written| written.not_negative(Dimension::Conductance)).map(Schedule::constant);
    let temperature = section.required("temperature", Dimension::Temperature.name_and_example());
    let gas_k = temperature.and_then(|written| schedules.read(written, Dimension::Temperature));
    Ok(OpenFace { film_w_m2_k: film_w_m2_k?, gas_k: gas_k?, ..OpenFace::insulated() })
}

fn held_face(section: &TableReader<'_>, schedules: &ScheduleReader<'_>, is_hot_face: bool) -> ReadResult<Face> {
    let temperature = section.required("temperature", Dimension::Temperature.name_and_example())?;
    schedules.driver(temperature, is_hot_face).map(Face::Held)
}

/// The emissivity of the material by default.
fn emissivity(section: &TableReader<'_>) -> ReadResult<Emissivity> {
    let Some(written) = section.optional("emissivity") else {
        return Ok(Emissivity::Material);
    };
    written.require(Emissivity::checked_constant(written.quantity(Dimension::Fraction)?))
}
