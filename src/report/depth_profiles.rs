//! Profiles through the thickness.

use super::figure::{Axis, Figure, Ink, Layer, Stroke};
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::html::table::{paragraph, table};
use super::reportable::{Reportable, Section};
use super::{ReportError, format};
use crate::case::Case;
use crate::study::answers::Answers;
use crate::study::depth_profiles::{CellStates, DepthProfiles, MAX_MEMBERS, ProfileBands, ProfileDepth};
use serde::Serialize;

/// Most instants whose profiles are drawn in one figure.
const MAX_SHOWN_INSTANTS: usize = 6;

impl Reportable for DepthProfiles {
    fn uses_observations(&self) -> bool {
        false
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        let case = &answers.case;
        let mut figures = vec![maximum(case, self)];
        // A slider over one instant has nothing to choose.
        figures.extend((self.instants_s.len() > 1).then(|| time_slider_figure(case, self)));
        figures.push(instants_figure(case, self));
        figures.extend(self.cell_states.iter().flat_map(|states| cell_state_figures(case, self, states)));
        figures.into_iter().map(|figure| ("depth-profiles", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("depth-profiles", "Profiles", page(&answers.case, self))]
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        vec![format!(
            "Profiles through the thickness: the case is marched again on the processor in double precision and read \
             at the cell faces and nodes that both resolutions have, on both sides of every interface, with Richardson \
             extrapolation. Bands are percentiles 5 and 95 at each depth, over the first {} members of the sweep at \
             most. Depths are those of the layup in the case file.",
            format::count(MAX_MEMBERS)
        )]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![profiles_table().description(), states_table().description()]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let mut tables = vec![profiles_file(&answers.case, self)?];
        if let Some(states) = &self.cell_states {
            tables.push(states_file(&answers.case, self, states)?);
        }
        Ok(tables)
    }

    fn write_summary(&self, _: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put(
            "depth_profiles",
            &Record {
                instants_s: &self.instants_s,
                depths: self.depths.len(),
                members: self.bands.as_ref().map(|bands| bands.members),
            },
        )
    }

    fn screen_footer(&self, _: &Answers) -> Vec<String> {
        let instants = format::counted(self.instants_s.len(), "instant");
        vec![format!("profiles at {instants} and {} depths: depth-profiles.csv", format::count(self.depths.len()))]
    }
}

#[derive(Serialize)]
struct Record<'a> {
    instants_s: &'a [f64],
    depths: usize,
    /// Members of the bands.
    members: Option<usize>,
}

/// Depths in millimetres, with a gap between the two sides of an interface.
fn depths_mm(depths: &[ProfileDepth]) -> Vec<f64> {
    with_gaps(depths, |at| 1e3 * depths[at].depth_m)
}

/// Values at depths, with a gap between the two sides of an interface.
fn with_gaps(depths: &[ProfileDepth], value: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut values = Vec::with_capacity(depths.len());
    for at in 0..depths.len() {
        if at > 0 && depths[at].ply > depths[at - 1].ply {
            values.push(f64::NAN);
        }
        values.push(value(at));
    }
    values
}

fn profile(name: String, ink: Ink, stroke: Stroke, depths: &[ProfileDepth], values: &[f64]) -> Layer {
    Layer::Line { name, ink, stroke, x: depths_mm(depths), y: with_gaps(depths, |at| values[at]) }
}

/// The interfaces between plies, as vertical lines over the range of the values.
fn interfaces(case: &Case, (low, high): (f64, f64)) -> Layer {
    let each = case.layup.interfaces_m().into_iter().map(|depth_m| 1e3 * depth_m);
    let x = each.clone().flat_map(|mm| [mm, mm, f64::NAN]).collect();
    let y = each.flat_map(|_| [low, high, f64::NAN]).collect();
    Layer::Line { name: "interfaces".to_owned(), ink: Ink::Guide, stroke: Stroke::Dotted, x, y }
}

fn depth_axis(case: &Case) -> Axis {
    Axis::linear("Depth below the hot face, mm").with_range(1e3 * case.layup.origin_m, 1e3 * case.layup.back_m())
}

/// Lowest and highest of all values.
fn extent<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)))
}

/// Lowest and highest temperature of any profile or band.
fn temperatures_k(found: &DepthProfiles) -> (f64, f64) {
    let bands = found.bands.iter().flat_map(|bands| bands.percentiles_k.iter().flatten().flatten());
    let maxima = found.bands.iter().flat_map(|bands| bands.maximum_percentiles_k.iter().flatten());
    extent(found.nominal_k.iter().flatten().chain(&found.nominal_maximum_k).chain(bands).chain(maxima))
}

fn band(bands: &ProfileBands, depths: &[ProfileDepth], [low, high]: [&[f64]; 2]) -> Layer {
    Layer::Band {
        name: format!("5 to 95 % of {}", format::counted(bands.members, "member")),
        ink: Ink::Series(0),
        opacity: 0.25,
        x: depths.iter().map(|depth| 1e3 * depth.depth_m).collect(),
        low: low.to_vec(),
        high: high.to_vec(),
    }
}

/// The highest temperature over time at every depth.
fn maximum(case: &Case, found: &DepthProfiles) -> Figure {
    let mut layers = vec![interfaces(case, temperatures_k(found))];
    if let Some(bands) = &found.bands {
        let [low, median, high] = &bands.maximum_percentiles_k;
        layers.push(band(bands, &found.depths, [low, high]));
        layers.push(profile("median".to_owned(), Ink::Series(0), Stroke::Dashed, &found.depths, median));
    }
    let nominal = &found.nominal_maximum_k;
    layers.push(profile("nominal".to_owned(), Ink::Series(1), Stroke::Solid, &found.depths, nominal));
    Figure {
        id: "depth-profile-maximum".to_owned(),
        title: "Highest temperature through the thickness".to_owned(),
        caption: "Highest temperature over the whole exposure at every depth; each depth has it at a time of its own."
            .to_owned(),
        x: depth_axis(case),
        y: Axis::linear("Highest temperature, K"),
        layers,
    }
}

/// The profile at one instant, chosen by a slider.
fn time_slider_figure(case: &Case, found: &DepthProfiles) -> Figure {
    let step = |instant: usize| {
        let mut layers = Vec::new();
        if let Some(bands) = &found.bands {
            let [low, _, high] = [0, 1, 2].map(|percentile| &bands.percentiles_k[percentile][instant][..]);
            layers.push(band(bands, &found.depths, [low, high]));
        }
        let nominal = &found.nominal_k[instant];
        layers.push(profile("nominal".to_owned(), Ink::Series(1), Stroke::Solid, &found.depths, nominal));
        layers
    };
    let highest = |instant: &usize| found.nominal_k[*instant].iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let instants = 0..found.instants_s.len();
    let shown = instants.clone().max_by(|one, other| highest(one).total_cmp(&highest(other))).unwrap_or(0);
    let (low, high) = temperatures_k(found);
    let air = 0.04 * (high - low).max(1.0);
    Figure {
        id: "depth-profile-time".to_owned(),
        title: "Temperature through the thickness over time".to_owned(),
        caption: format!(
            "Choose the time below the chart. The static image shows {}, when the layup is hottest.",
            format::seconds(found.instants_s[shown])
        ),
        x: depth_axis(case),
        y: Axis::linear("Temperature, K").with_range(low - air, high + air),
        layers: vec![
            interfaces(case, (low - air, high + air)),
            Layer::Steps {
                label: "Time: ".to_owned(),
                names: found.instants_s.iter().map(|&instant_s| format::seconds(instant_s)).collect(),
                steps: instants.map(step).collect(),
                shown,
            },
        ],
    }
}

/// At most [`MAX_SHOWN_INSTANTS`] of the instants, evenly spread.
fn shown_instants(instants: usize) -> Vec<usize> {
    let count = instants.min(MAX_SHOWN_INSTANTS);
    (0..count).map(|n| if count > 1 { n * (instants - 1) / (count - 1) } else { 0 }).collect()
}

/// One line per shown instant.
fn instant_lines(found: &DepthProfiles, depths: &[ProfileDepth], values: &[Vec<f64>]) -> Vec<Layer> {
    let line = |(place, instant): (usize, usize)| {
        let name = format::seconds(found.instants_s[instant]);
        profile(name, Ink::Series(place), Stroke::Solid, depths, &values[instant])
    };
    shown_instants(found.instants_s.len()).into_iter().enumerate().map(line).collect()
}

/// The profiles at the shown instants in one figure.
fn instants_figure(case: &Case, found: &DepthProfiles) -> Figure {
    let mut layers = vec![interfaces(case, temperatures_k(found))];
    layers.extend(instant_lines(found, &found.depths, &found.nominal_k));
    Figure {
        id: "depth-profiles".to_owned(),
        title: "Nominal temperature through the thickness".to_owned(),
        caption: format!("At {}.", shown_count(found)),
        x: depth_axis(case),
        y: Axis::linear("Temperature, K"),
        layers,
    }
}

/// How many of the instants a figure shows.
fn shown_count(found: &DepthProfiles) -> String {
    let (shown, all) = (shown_instants(found.instants_s.len()).len(), found.instants_s.len());
    if shown < all {
        format!("{shown} of {}; the others are in the tables", format::counted(all, "instant"))
    } else {
        format::counted(all, "instant")
    }
}

/// Figures of density, conversion and pressure.
fn cell_state_figures(case: &Case, found: &DepthProfiles, states: &CellStates) -> Vec<Figure> {
    let figure = |id: &str, title: &str, axis: &str, scale: f64, values: &[Vec<f64>]| {
        let scaled: Vec<Vec<f64>> =
            values.iter().map(|profile| profile.iter().map(|value| scale * value).collect()).collect();
        let mut layers = vec![interfaces(case, extent(scaled.iter().flatten()))];
        layers.extend(instant_lines(found, &states.depths, &scaled));
        Figure {
            id: id.to_owned(),
            title: title.to_owned(),
            caption: format!(
                "At {}, with nominal factors, at the nodes of the cells; depths and densities are those of the virgin \
                 layup.",
                shown_count(found)
            ),
            x: depth_axis(case),
            y: Axis::linear(axis),
            layers,
        }
    };
    let mut figures = Vec::new();
    if case.layup.plies.iter().any(|ply| ply.material.decomposition.is_some()) {
        let density = "Density of the solid, kg/m³";
        figures.push(figure(
            "density-profiles",
            "Density through the thickness",
            density,
            1.0,
            &states.densities_kg_m3,
        ));
        let conversion = "Char fraction";
        figures.push(figure(
            "char-profiles",
            "Char fraction through the thickness",
            conversion,
            1.0,
            &states.conversions,
        ));
    }
    if let Some(pressures_pa) = &states.pressures_pa {
        let title = "Gas pressure through the thickness";
        figures.push(figure("pressure-profiles", title, "Gas pressure, kPa", 1e-3, pressures_pa));
    }
    figures
}

/// The hottest depth of every ply.
fn page(case: &Case, found: &DepthProfiles) -> String {
    let row = |(ply, of): (usize, &crate::case::Ply)| {
        let here = (0..found.depths.len()).filter(|&at| found.depths[at].ply == ply);
        let hottest = here.max_by(|&a, &b| found.nominal_maximum_k[a].total_cmp(&found.nominal_maximum_k[b]))?;
        let mut row = vec![
            of.name.clone(),
            format!("{:.2}", 1e3 * found.depths[hottest].depth_m),
            format::grouped(found.nominal_maximum_k[hottest], 1),
        ];
        row.extend(found.bands.iter().flat_map(|bands| {
            bands.maximum_percentiles_k.iter().map(|percentile| format::grouped(percentile[hottest], 1))
        }));
        Some(row)
    };
    let mut head = vec!["Ply", "Depth, mm", "Nominal, K"];
    if found.bands.is_some() {
        head.extend(["5 %, K", "Median, K", "95 %, K"]);
    }
    let rows: Vec<Vec<String>> = case.layup.plies.iter().enumerate().filter_map(row).collect();
    let read = format!(
        "Temperatures at {} instants and {} depths.",
        format::count(found.instants_s.len()),
        format::count(found.depths.len())
    );
    table("Highest temperature of every ply, at its hottest depth", &head, &rows) + &paragraph(&read)
}

/// A depth of a profile.
struct ProfileRow<'a> {
    kind: &'static str,
    time_s: f64,
    depth_m: f64,
    ply: &'a str,
    temperature_k: f64,
    percentiles_k: Vec<f64>,
}

fn profiles_table<'a>() -> Table<ProfileRow<'a>> {
    Table::<ProfileRow<'a>>::new(
        &["depth-profiles.csv"],
        "Temperatures through the thickness, one row per profile and depth (depth profiles of a prediction, a \
         sweep or a study). The depths are cell faces and nodes; an interface has two rows, one for each side. The \
         percentiles exist with a sweep, over its first 1,000 members at most.",
    )
    .text("profile", "`instant`, or `maximum`: the highest temperature over the whole exposure at each depth.", |row| {
        row.kind.to_owned()
    })
    .number("time_s", "s", "Time; empty for the maximum.", |row| row.time_s)
    .number("depth_m", "m", "Depth below the hot face, in the layup of the case file.", |row| row.depth_m)
    .text("ply", "Ply.", |row| row.ply.to_owned())
    .number("temperature_k", "K", "Temperature at nominal factors.", |row| row.temperature_k)
    .numbers(PERCENTILES, "K", "Percentiles over the members, at each depth separately.", |row| {
        row.percentiles_k.clone()
    })
}

const PERCENTILES: &str = "p{5,50,95}_k";

/// One row per instant and depth, then one per depth for the maximum.
fn profiles_file(case: &Case, found: &DepthProfiles) -> Result<NamedFile, ReportError> {
    let mut rows = Vec::new();
    let mut add = |kind: &'static str, time_s: f64, nominal: &[f64], bands: Vec<&[f64]>| {
        rows.extend(found.depths.iter().enumerate().map(|(at, depth)| ProfileRow {
            kind,
            time_s,
            depth_m: depth.depth_m,
            ply: &case.layup.plies[depth.ply].name,
            temperature_k: nominal[at],
            percentiles_k: bands.iter().map(|band| band[at]).collect(),
        }));
    };
    for (instant, &time_s) in found.instants_s.iter().enumerate() {
        let bands = found.bands.iter().flat_map(|bands| &bands.percentiles_k).map(|of| &of[instant][..]).collect();
        add("instant", time_s, &found.nominal_k[instant], bands);
    }
    let bands = found.bands.iter().flat_map(|bands| &bands.maximum_percentiles_k).map(|of| &of[..]).collect();
    add("maximum", f64::NAN, &found.nominal_maximum_k, bands);
    let absent: &[&str] = if found.bands.is_some() { &[] } else { &[PERCENTILES] };
    profiles_table().without(absent).csv(&Names::default(), rows)
}

/// Instant and depth of the states, and the ply of the depth.
type StateRow<'a> = (&'a DepthProfiles, &'a CellStates, usize, usize, &'a str);

fn states_table<'a>() -> Table<StateRow<'a>> {
    Table::<StateRow<'a>>::new(
        &["state-profiles.csv"],
        "Density, char fraction and gas pressure through the thickness, one row per instant and cell, at nominal \
         factors (depth profiles, where plies decompose or gas moves). The values are those of the finer grid, without \
         extrapolation, computed on the processor.",
    )
    .number("time_s", "s", "Time.", |row| row.0.instants_s[row.2])
    .number("depth_m", "m", "Depth of the node of the cell below the hot face, in the virgin layup.", |row| {
        row.1.depths[row.3].depth_m
    })
    .text("ply", "Ply.", |row| row.4.to_owned())
    .number("density_kg_m3", "kg/m³", "Density of the solid per volume of the virgin layup.", |row| {
        row.1.densities_kg_m3[row.2][row.3]
    })
    .number("char_fraction", "–", "Fraction of the decomposable mass that is lost.", |row| {
        row.1.conversions[row.2][row.3]
    })
    .number(PRESSURE, "Pa", "Gas pressure; only with `flow = \"darcy\"`.", |row| {
        row.1.pressures_pa.as_ref().map_or(f64::NAN, |pressures| pressures[row.2][row.3])
    })
}

const PRESSURE: &str = "pressure_pa";

fn states_file(case: &Case, found: &DepthProfiles, states: &CellStates) -> Result<NamedFile, ReportError> {
    let places = (0..found.instants_s.len()).flat_map(|instant| (0..states.depths.len()).map(move |at| (instant, at)));
    let rows =
        places.map(|(instant, at)| (found, states, instant, at, case.layup.plies[states.depths[at].ply].name.as_str()));
    let absent: &[&str] = if states.pressures_pa.is_some() { &[] } else { &[PRESSURE] };
    states_table().without(absent).csv(&Names::default(), rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{chart, marched, svg};

    fn reported() -> (Answers, DepthProfiles) {
        let answers = marched::study().answers("study");
        let found = answers.depth_profiles.clone().expect("the study has profiles");
        (answers, found)
    }

    #[test]
    fn the_slider_has_a_step_for_every_instant_and_shows_the_hottest() {
        let (answers, found) = reported();
        let figure = time_slider_figure(&answers.case, &found);
        let drawn = chart::draw(&figure);
        let steps = drawn["layout"]["sliders"][0]["steps"].as_array().expect("steps").clone();
        assert_eq!(steps.len(), found.instants_s.len());
        let traces = drawn["traces"].as_array().expect("traces");
        let active = drawn["layout"]["sliders"][0]["active"].as_u64().expect("an active step") as usize;
        let highest = |instant: usize| found.nominal_k[instant].iter().copied().fold(0.0, f64::max);
        assert!((0..found.instants_s.len()).all(|instant| highest(instant) <= highest(active)));
        for (step, entry) in steps.iter().enumerate() {
            let visible = entry["args"][0]["visible"].as_array().expect("one flag per trace");
            assert_eq!(visible.len(), traces.len());
            // The interfaces, the two edges of the band and the nominal profile.
            assert_eq!(visible.iter().filter(|flag| **flag == true).count(), 4, "step {step}");
            let is_visible = |trace: &serde_json::Value| trace["visible"] != false;
            let begins_so = traces.iter().zip(visible).all(|(trace, flag)| is_visible(trace) == (*flag == true));
            assert_eq!(begins_so, step == active);
        }
        assert!(svg::draw(&figure).contains("nominal"));
    }

    #[test]
    fn the_table_has_every_instant_and_the_maximum_with_bands_around_the_nominal_profile() {
        let (answers, found) = reported();
        let (_, bytes) = profiles_file(&answers.case, &found).expect("a table");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let rows: Vec<csv::StringRecord> = rows.records().map(|row| row.expect("a row")).collect();
        assert_eq!(rows.len(), (found.instants_s.len() + 1) * found.depths.len());
        let number = |row: &csv::StringRecord, at: usize| row[at].parse::<f64>().expect("a number");
        for row in &rows {
            assert!(number(row, 5) <= number(row, 6) && number(row, 6) <= number(row, 7), "{row:?}");
        }
        let last = &rows[rows.len() - 1];
        assert_eq!(
            (&last[0], &last[1], &last[3]),
            ("maximum", "", &answers.case.layup.plies.last().expect("a ply").name[..])
        );
    }

    #[test]
    fn a_profile_has_a_gap_between_the_sides_of_an_interface() {
        let depth = |depth_m, ply| ProfileDepth { depth_m, ply };
        let depths = [depth(0.0, 0), depth(1e-3, 0), depth(1e-3, 1), depth(2e-3, 1)];
        let x = depths_mm(&depths);
        assert!(x.len() == 5 && x[2].is_nan());
        assert_eq!([x[0], x[1], x[3], x[4]], [0.0, 1.0, 1.0, 2.0]);
    }

    #[test]
    fn figures_of_many_instants_show_six_from_the_first_to_the_last() {
        assert_eq!(shown_instants(25), [0, 4, 9, 14, 19, 24]);
        assert_eq!((shown_instants(1), shown_instants(2)), (vec![0], vec![0, 1]));
    }
}
