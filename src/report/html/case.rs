//! The sections on the case and on the methods.

use super::table::{list, paragraph, table};
use crate::case::{Case, Conductivity, Emissivity, Face, GasFlow, GasFlowModel, Material, OpenFace, Schedule, Side};
use crate::case::{Provenance, Pyrometer, SourceKind, Spectrum};
use crate::report::{format, observations};
use crate::study::answers::Answers;

/// Layup, sensors, observations, materials, exposure and factors.
pub(super) fn case_description(case: &Case) -> String {
    layup(case) + &sensors(case) + &observations(case) + &materials(case) + &exposure(case) + &factors(case)
}

fn millimetres(length_m: f64) -> String {
    // Three decimals, or three significant digits below a tenth of a millimetre.
    let magnitude = if length_m == 0.0 { 0.0 } else { (1e3 * length_m).abs().log10().floor() };
    format::trim_zeros(format!("{:.*}", (2.0 - magnitude).clamp(3.0, 12.0) as usize, 1e3 * length_m))
}

fn layup(case: &Case) -> String {
    let depths = case.layup.faces_m();
    let rows: Vec<Vec<String>> = (case.layup.plies.iter().zip(depths).enumerate())
        .map(|(index, (ply, depth_m))| {
            let contact = case.layup.contacts_w_m2_k.get(index);
            vec![
                ply.name.clone(),
                ply.group.clone(),
                ply.material.name.clone(),
                millimetres(ply.thickness_m),
                millimetres(depth_m),
                contact.map_or("–".to_owned(), |contact| {
                    contact.map_or("perfect".to_owned(), |h| format::grouped(h, 0))
                }),
            ]
        })
        .collect();
    let head = ["Ply", "Group", "Material", "Thickness, mm", "Lower face at, mm", "Contact conductance below, W/m²/K"];
    table("Layup, from the hot face to the back face", &head, &rows)
}

fn sensors(case: &Case) -> String {
    let faces = case.layup.faces_m();
    let rows: Vec<Vec<String>> = (case.sensors.iter())
        .map(|sensor| {
            let plies = &case.layup.plies;
            let on = faces.iter().position(|face_m| *face_m == sensor.depth_m);
            let within = faces.iter().position(|face_m| *face_m > sensor.depth_m);
            let place = match (on, within) {
                (Some(above), Some(below)) => {
                    let between = format!("between {} and {}", plies[above].name, plies[below].name);
                    match sensor.side {
                        Side::Above => format!("{between}, on the upper ply"),
                        Side::Below => format!("{between}, on the lower ply"),
                        Side::Both => between,
                    }
                }
                (Some(above), None) => format!("back face of {}", plies[above].name),
                (None, Some(0)) if sensor.depth_m <= case.layup.origin_m => format!("hot face of {}", plies[0].name),
                (None, Some(ply)) => format!("within {}", plies[ply].name),
                (None, None) => String::new(),
            };
            let place =
                sensor.pyrometer.map_or(place.clone(), |pyrometer| format!("{}, {place}", pyrometer_text(pyrometer)));
            let lag = format::trim_zeros(format!("{:.3}", sensor.time_constant_s));
            vec![sensor.name.clone(), millimetres(sensor.depth_m), place, lag]
        })
        .collect();
    table("Sensors", &["Sensor", "Depth, mm", "Location", "Time constant, s"], &rows)
}

/// `pyrometer at 0.9 µm set to an emissivity of 0.85`.
fn pyrometer_text(pyrometer: Pyrometer) -> String {
    let um = |wavelength_m: f64| format::trim_zeros(format::significant(1e6 * wavelength_m, 4));
    let spectrum = match pyrometer.spectrum {
        Spectrum::Band(shorter_m, longer_m) => format!("from {} to {} µm", um(shorter_m), um(longer_m)),
        Spectrum::Wavelength(wavelength_m) => format!("at {} µm", um(wavelength_m)),
    };
    let emissivity = format::trim_zeros(format::significant(pyrometer.emissivity, 3));
    format!("pyrometer {spectrum} set to an emissivity of {emissivity}")
}

fn observations(case: &Case) -> String {
    let rows: Vec<Vec<String>> = (case.observations.iter())
        .map(|seen| {
            let (from_s, to_s) = case.window_s(seen.sensor);
            let whose = if seen.window_s.is_some() { "this sensor" } else { "all sensors" };
            let (least_k, most_k) = observations::sigma_range_k(seen);
            let least = format::temperature_difference(least_k).replace(" K", "");
            vec![
                case.sensors[seen.sensor].name.clone(),
                format::count(seen.times_s.len()),
                format!("{} to {}", format::grouped(from_s, 1), format::grouped(to_s, 1)),
                whose.to_owned(),
                if least_k == most_k {
                    least
                } else {
                    format!("{least} to {}", format::temperature_difference(most_k).replace(" K", ""))
                },
            ]
        })
        .collect();
    let head = ["Sensor", "Samples", "Data window, s", "Window of", "Standard deviation, K"];
    if rows.is_empty() { String::new() } else { table("Observations", &head, &rows) }
}

fn materials(case: &Case) -> String {
    let mut seen: Vec<&Material> = Vec::new();
    for ply in &case.layup.plies {
        if seen.iter().all(|material| material.id != ply.material.id) {
            seen.push(&ply.material);
        }
    }
    let rows: Vec<Vec<String>> = seen
        .iter()
        .flat_map(|material| {
            let range = |(low_k, high_k): (f64, f64)| {
                if low_k.is_finite() && high_k.is_finite() {
                    format!("{} to {} K", format::grouped(low_k, 0), format::grouped(high_k, 0))
                } else {
                    "constant".to_owned()
                }
            };
            let conductivity = match &material.conductivity {
                Conductivity::Tables(tables) => {
                    let known = tables.first().map_or((f64::NAN, f64::NAN), |(_, table)| table.range_k());
                    format!("{}, {}", range(known), format::counted(tables.len(), "pressure"))
                }
                Conductivity::ThreePart(parts) => format!("solid, gas and radiation; {}", range(parts.range_k)),
            };
            let density = format!("{} kg/m³", format::trim_zeros(format::significant(material.density_kg_m3, 4)));
            let pores = material.pores_provenance.as_ref().map(|provenance| {
                let known = format!(
                    "porosity {}, permeability {:.1e} m²",
                    material.pores.porosity, material.pores.permeability_m2
                );
                ("pores", known, provenance)
            });
            let decomposition = material.decomposition.as_ref().map(|decomposition| {
                let (reactions, lost) = (decomposition.reactions.len(), decomposition.mass_loss());
                let states: Vec<&str> = decomposition.residues.iter().map(|residue| residue.name.as_str()).collect();
                let known = format!(
                    "{} to {}, {} lost",
                    format::counted(reactions, "reaction"),
                    states.join(", then "),
                    format::percent(lost)
                );
                ("decomposition", known, &decomposition.provenance)
            });
            let each = [
                ("density", density, &material.density_provenance),
                ("heat capacity", range(material.heat_capacity.range_k()), &material.heat_capacity_provenance),
                ("conductivity", conductivity, &material.conductivity_provenance),
                ("emissivity", range(material.emissivity.range_k()), &material.emissivity_provenance),
            ];
            let each = each.into_iter().chain(pores).chain(decomposition);
            each.map(|(property, known, provenance)| provenance_row(&material.name, property, known, provenance))
                .collect::<Vec<_>>()
        })
        .chain(case.gas.as_ref().map(|flow| {
            let (low_k, high_k) = flow.gas.enthalpy.range_k();
            let known = format!("{} to {} K", format::grouped(low_k, 0), format::grouped(high_k, 0));
            provenance_row(&flow.gas.name, "gas", known, &flow.gas.provenance)
        }))
        .collect();
    let notes: Vec<String> = (seen.iter().map(|material| (&material.name, &material.note)))
        .chain(case.gas.as_ref().map(|flow| (&flow.gas.name, &flow.gas.note)))
        .filter(|(_, note)| !note.is_empty())
        .map(|(name, note)| format!("{name}: {note}"))
        .collect();
    let origin = |material: &&Material| {
        let from = case.material_origin(material).map_or("values", |origin| origin);
        vec![material.name.clone(), material.id.clone(), from.to_owned()]
    };
    let origins: Vec<Vec<String>> = seen.iter().map(origin).collect();
    let head = ["Material", "Property", "Value or range", "Mark", "Standard uncertainty", "Source"];
    table("Materials and sources of their properties", &head, &rows)
        + &list(&notes)
        + &table("Files of the materials", &["Material", "Id", "From"], &origins)
}

fn provenance_row(name: &str, property: &str, known: String, provenance: &Provenance) -> Vec<String> {
    let mark = match provenance.source_kind {
        SourceKind::ReadInSource => "read in a public source",
        SourceKind::Remembered => "remembered, not verified",
        SourceKind::Estimated => "estimated",
        SourceKind::Paper => "stated in the paper",
        SourceKind::Measured => "measured by us",
        SourceKind::NotStated => "provenance not stated",
    };
    vec![
        name.to_owned(),
        property.to_owned(),
        known,
        mark.to_owned(),
        provenance.relative_uncertainty.map_or("–".to_owned(), format::percent),
        provenance.source.clone(),
    ]
}

fn exposure(case: &Case) -> String {
    let exposure = &case.exposure;
    let start = match exposure.initial_k.as_slice() {
        [(_, uniform_k)] => format!("Initial temperature {}.", format::kelvin(*uniform_k)),
        points => {
            let coldest = points.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
            let hottest = points.iter().map(|point| point.1).fold(f64::NEG_INFINITY, f64::max);
            format!("Initial temperature {} to {} over depth.", format::kelvin(coldest), format::kelvin(hottest))
        }
    };
    let holder = exposure.holder.as_ref().map(|holder| {
        format!(
            "Holder at {}, conductance {} kW/m³/K.",
            range(&holder.temperature_k, 1.0, "K"),
            format::significant(1e-3 * holder.conductance_w_m3_k, 3)
        )
    });
    let pressure = |schedule: &Schedule| range(schedule, 1e-3, "kPa");
    let back = exposure.back_pressure_pa.as_ref();
    let mut text = vec![
        format!(
            "Duration {}, gas pressure {}. {start}",
            format::seconds(exposure.duration_s),
            pressure(&exposure.pressure_pa)
        ),
        format!("Hot face: {}.", face_text(&exposure.hot_face)),
        format!(
            "Back face: {}{}.",
            face_text(&exposure.back_face),
            back.map_or(String::new(), |p| format!("; permeable, gas pressure {}", pressure(p)))
        ),
    ];
    text.extend(holder);
    text.extend(case.gas.as_ref().map(|gas| gas_flow(case, gas)));
    "<h3>Exposure</h3>\n".to_owned() + &list(&text)
}

/// Decomposing plies and the model of gas flow.
fn gas_flow(case: &Case, gas: &GasFlow) -> String {
    let reacting = case.layup.plies.iter().filter(|ply| ply.material.decomposition.is_some());
    let reacting: Vec<&str> = reacting.map(|ply| ply.name.as_str()).collect();
    let path = match gas.model {
        GasFlowModel::Instantaneous => "leaves through the hot face without heat exchange",
        GasFlowModel::QuasiSteady => "flows to the hot face quasi-steadily",
        GasFlowModel::Darcy => "flows by Darcy's law with storage in the pores",
    };
    let (name, id) = (&gas.gas.name, &gas.gas.id);
    let text = format!("{name} ({id}) {path}");
    if reacting.is_empty() { format!("{text}.") } else { format!("Decomposing: {}. {text}.", format::list(&reacting)) }
}

fn face_text(face: &Face) -> String {
    let open = match face {
        Face::Held(schedule) => return format!("prescribed temperature {}", range(schedule, 1.0, "K")),
        Face::Open(open) => open,
    };
    let terms = heat_flux_terms(open);
    if terms.is_empty() { "insulated".to_owned() } else { terms.join("; ") }
}

/// The heat fluxes at an open face that are not zero.
fn heat_flux_terms(open: &OpenFace) -> Vec<String> {
    let mut terms = Vec::new();
    let enthalpy = open.recovery_enthalpy_j_kg.as_ref().map(|enthalpy| range_of_three_digits(enthalpy, 1e-6, "MJ/kg"));
    if open.flux_w_m2.acts() {
        let corrected = enthalpy.as_ref().map_or("without hot-wall correction".to_owned(), |enthalpy| {
            format!("hot-wall correction with a recovery enthalpy of {enthalpy}")
        });
        terms.push(format!("heat flux of {}, {corrected}", range(&open.flux_w_m2, 1e-4, "W/cm²")));
    }
    if let (Some(film), Some(enthalpy)) = (&open.enthalpy_film_kg_m2_s, &enthalpy) {
        let film = range(film, 1.0, "kg/m²/s");
        terms.push(format!("convection with {film} times the difference to a recovery enthalpy of {enthalpy}"));
    }
    if open.radiant_w_m2.acts() {
        terms.push(format!("radiant heat flux of {}", range(&open.radiant_w_m2, 1e-4, "W/cm²")));
    }
    if open.film_w_m2_k.acts() {
        let (film, gas) = (range_of_three_digits(&open.film_w_m2_k, 1.0, "W/m²/K"), range(&open.gas_k, 1.0, "K"));
        terms.push(format!("convection with {film} to gas at {gas}"));
    }
    let emissivity = match open.emissivity {
        Emissivity::Material => Some("the emissivity of the material".to_owned()),
        Emissivity::Constant(0.0) => None,
        Emissivity::Constant(constant) => Some(format!("an emissivity of {}", format::significant(constant, 3))),
    };
    if let Some(emissivity) = emissivity {
        terms.push(format!("radiation to {} with {emissivity}", format::kelvin(open.surroundings_k.after(0.0))));
    }
    terms
}

/// The range of a schedule: `26.7 W/cm²`, `0 to 26.7 W/cm²`.
fn range(schedule: &Schedule, scale: f64, unit: &str) -> String {
    range_as(schedule, unit, |value| format::trim_zeros(format::significant(scale * value, 4)))
}

/// The range of a schedule to three digits.
fn range_of_three_digits(schedule: &Schedule, scale: f64, unit: &str) -> String {
    range_as(schedule, unit, |value| format::significant(scale * value, 3))
}

fn range_as(schedule: &Schedule, unit: &str, text: impl Fn(f64) -> String) -> String {
    let low = schedule.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = schedule.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if low == high { format!("{} {unit}", text(high)) } else { format!("{} to {} {unit}", text(low), text(high)) }
}

fn factors(case: &Case) -> String {
    let rows: Vec<Vec<String>> = (case.factors.iter())
        .map(|factor| {
            let bounds = |(low, high): (f64, f64)| format!("{low:.2} to {high:.2}");
            vec![
                factor.name.clone(),
                format::factor_meaning(factor),
                format::trim_zeros(format!("{:.4}", factor.nominal)),
                bounds(factor.small),
                bounds(factor.large),
            ]
        })
        .collect();
    let name = |factor: usize| case.factors[factor].name.as_str();
    let pairs: Vec<String> = (case.correlation.pairs().iter())
        .map(|&(one, other, value)| {
            format!("Correlation of {} and {} in the sampling: {value}", name(one), name(other))
        })
        .collect();
    table("Factors", &["Factor", "Scales", "Nominal", "Small bounds", "Large bounds"], &rows) + &list(&pairs)
}

/// The section "Methods": the model, and the methods of every result.
pub(super) fn methods(answers: &Answers) -> String {
    let mut out = paragraph(
        "One-dimensional heat conduction through the plies with properties that depend on temperature and pressure, \
         contact conductance between plies, and the boundary conditions listed under Exposure. A factor multiplies the \
         property or exposure that it names.",
    );
    for text in answers.results().iter().flat_map(|answer| answer.methods(answers)) {
        out += &paragraph(&text);
    }
    out + &paragraph(
        "\"The paper\" is \"Flexible Thermal Protection System Physics-Based Modeling for Temperature Profile \
         Predictions\". Its property tables and thermocouple traces are not public; surrogates are marked.",
    )
}
