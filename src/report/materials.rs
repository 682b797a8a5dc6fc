//! The material database as text for a terminal of 80 columns.

mod decomposition;

use super::braille::{Curve, chart};
use super::format;
use crate::case::CaseError;
use crate::case::library::material_ids;
use crate::case::{Conductivity, Material, OutOfRange, Table};
use crate::case::{Provenance, SourceKind, ThreePartConductivity};

const WIDTH: usize = 78;
/// Rows of a plot.
const PLOT_ROWS: usize = 12;
/// Pressures of the tables and curves: sea level and two arc-jet runs.
const PRESSURES_PA: [(f64, &str); 3] = [(101_325.0, "1 atm"), (8010.0, "8.01 kPa"), (3100.0, "3.1 kPa")];
const AMBIENT_K: f64 = 300.0;

/// One line per material: density, conductivity, heat capacity and emissivity at 300 K and one atmosphere, and their
/// marks.
///
/// # Errors
/// When a built-in material file is invalid.
pub fn list() -> Result<String, CaseError> {
    let heads = ["ρ", "k", "c_p", "ε", "kg/m³", "W/m/K", "J/kg/K"];
    let [density, k, cp, emissivity, density_unit, k_unit, cp_unit] = heads;
    let mut text = format!("{:<45}{density:>6}{k:>8}{cp:>7}{emissivity:>6}  marks\n", "material");
    text += &format!("{:<16}{:<29}{density_unit:>6}{k_unit:>8}{cp_unit:>7}\n", "", "at 300 K and 1 atm");
    for id in material_ids() {
        let material = Material::named(id)?;
        let k: f64 = material.conductivity.parts(AMBIENT_K, PRESSURES_PA[0].0).iter().sum();
        let (cp, emissivity) = (material.heat_capacity.at(AMBIENT_K), material.emissivity.at(AMBIENT_K));
        let marks: String =
            provenances(&material).map(|provenance| letter(provenance.source_kind)).into_iter().collect();
        let name = shortened(&material.name, 28);
        let density = material.density_kg_m3;
        text += &format!("{id:<16}{name:<29}{density:>6.0}{k:>8.4}{cp:>7.0}{emissivity:>6.2}  {marks}\n");
    }
    text += "marks of ρ, k, c_p, ε: r read, m remembered, e estimated, p paper, b by us\n";
    Ok(text)
}

/// All properties of a material, with curves.
pub fn show(material: &Material) -> String {
    let mut text = format!("{}: {}\n{}\n", material.id, material.name, wrapped(&material.note, ""));
    text += &heading("density, kg/m³", &material.density_provenance);
    text += &format!("  {}\n\n", density(material));

    text += &heading("conductivity, W/m/K", &material.conductivity_provenance);
    text += &match &material.conductivity {
        Conductivity::ThreePart(parts) => conductivity_parts_text(parts, &material.conductivity),
        Conductivity::Tables(tables) => tables_text(tables),
    };
    text += &conductivity_curves(&material.conductivity);

    text += &heading("heat capacity, J/kg/K", &material.heat_capacity_provenance);
    text += &table_text(&material.heat_capacity, 0);
    text += &curve(&material.heat_capacity, 0);

    text += &heading("emissivity", &material.emissivity_provenance);
    text += &table_text(&material.emissivity, 2);
    text += &curve(&material.emissivity, 2);
    if let Some(provenance) = &material.pores_provenance {
        text += &decomposition::pores_text(&material.pores, provenance);
    }
    if let Some(decomposition) = &material.decomposition {
        text += &decomposition::decomposition_text(decomposition, material.density_kg_m3);
    }
    text
}

/// Name, density, and the other properties at 300 K and one atmosphere.
pub fn summary(material: &Material) -> String {
    let k: f64 = material.conductivity.parts(AMBIENT_K, PRESSURES_PA[0].0).iter().sum();
    let (low, high) = material.conductivity.range_k();
    let range = if low.is_finite() { format!("tabulated from {low} to {high} K") } else { "constant".to_owned() };
    let mut text = format!(
        "  {}, {} kg/m³\n  at 300 K and 1 atm: k {k:.4} W/m/K ({range}), c_p {:.0} J/kg/K, ε {:.2}\n",
        material.name,
        density(material),
        material.heat_capacity.at(AMBIENT_K),
        material.emissivity.at(AMBIENT_K),
    );
    let by_pressure = match &material.conductivity {
        Conductivity::Tables(tables) => tables.as_slice(),
        Conductivity::ThreePart(_) => {
            text += "  k: a formula, linear over each 5 K with the same integral\n";
            &[]
        }
    };
    for (pressure_pa, table) in by_pressure {
        let name = if by_pressure.len() > 1 { format!("k at {pressure_pa} Pa") } else { "k".to_owned() };
        text += &use_of_table(&name, table);
    }
    text += &use_of_table("c_p", &material.heat_capacity);
    text += &use_of_table("ε", &material.emissivity);
    let tables = by_pressure.iter().map(|(_, table)| table).chain([&material.heat_capacity, &material.emissivity]);
    if tables.into_iter().any(|table| table.outside == OutOfRange::Extrapolate) {
        text += "  tables that extrapolate: linearly, but not below a tenth of their end values\n";
    }
    text + &material.decomposition.as_ref().map_or(String::new(), decomposition::half_conversions)
}

/// How a march uses a table: at its own temperatures. Empty for a constant.
fn use_of_table(name: &str, table: &Table) -> String {
    let temperatures_k = table.temperatures_k();
    let (Some(first_k), Some(last_k), 2..) = (temperatures_k.first(), temperatures_k.last(), temperatures_k.len())
    else {
        return String::new();
    };
    let jumps = temperatures_k.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let jumps = match jumps {
        0 => String::new(),
        1 => ", 1 jump".to_owned(),
        _ => format!(", {jumps} jumps"),
    };
    format!("  {name}: {} points from {first_k} to {last_k} K{jumps}, linear between them\n", temperatures_k.len())
}

/// Density to six digits, kg/m³.
fn density(material: &Material) -> String {
    format::trim_zeros(format::significant(material.density_kg_m3, 6))
}

fn provenances(material: &Material) -> [&Provenance; 4] {
    [
        &material.density_provenance,
        &material.conductivity_provenance,
        &material.heat_capacity_provenance,
        &material.emissivity_provenance,
    ]
}

fn letter(mark: SourceKind) -> char {
    match mark {
        SourceKind::ReadInSource => 'r',
        SourceKind::Remembered => 'm',
        SourceKind::Estimated => 'e',
        SourceKind::Paper => 'p',
        SourceKind::Measured => 'b',
        SourceKind::NotStated => '-',
    }
}

/// A property with its mark, its uncertainty and its source.
fn heading(property: &str, provenance: &Provenance) -> String {
    let mark = match provenance.source_kind {
        SourceKind::NotStated => "provenance not stated",
        kind => kind.key(),
    };
    let spread = provenance.relative_uncertainty;
    let spread = spread.map_or(String::new(), |deviation| format!(", ±{:.0} % at 95 %", 200.0 * deviation));
    let trust = format!("{mark}{spread}");
    let space = WIDTH.saturating_sub(property.chars().count());
    format!("{property}{trust:>space$}\n{}\n", wrapped(&provenance.source, "  "))
}

fn conductivity_parts_text(parts: &ThreePartConductivity, conductivity: &Conductivity) -> String {
    let mut formula = format!("k = {}", parts.solid_w_m_k);
    if parts.solid_exponent != 0.0 {
        formula += &format!(" (T/300 K)^{}", parts.solid_exponent);
    }
    for (share, length_m) in &parts.pores {
        formula += &format!(" + {share} k_air(T, p; {} µm)", (length_m * 1e9).round() / 1e3);
    }
    if let Some(extinction_1_m) = parts.extinction_1_m {
        formula += &format!(" + 16 σ T³/(3 · {extinction_1_m:.0}/m)");
    }
    let columns = PRESSURES_PA.map(|(_, name)| format!("{:>9}", name.replace(' ', ""))).concat();
    let mut text = format!("  {formula}\n\n{:24}{:^27}{:^27}", "", "gas at", "k at").trim_end().to_owned();
    text += &format!("\n{:>6}{:>8}{:>10}{columns}{columns}\n", "T, K", "solid", "radiation");
    for temperature_k in temperatures(parts.range_k) {
        let at = PRESSURES_PA.map(|(pressure_pa, _)| conductivity.parts(temperature_k, pressure_pa));
        text += &format!("{temperature_k:>6.0}{:>8.4}{:>10.4}", at[0][0], at[0][2]);
        text += &at.map(|part| format!("{:>9.4}", part[1])).concat();
        text += &at.map(|part| format!("{:>9.4}", part.iter().sum::<f64>())).concat();
        text += "\n";
    }
    text + "\n"
}

/// Round temperatures within a range, at most twelve.
fn temperatures((low, high): (f64, f64)) -> Vec<f64> {
    const ROUND: [f64; 12] = [300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1200.0, 1400.0, 1600.0, 1800.0];
    ROUND.into_iter().filter(|temperature_k| (low..=high).contains(temperature_k)).collect()
}

fn tables_text(tables: &[(f64, Table)]) -> String {
    match tables {
        [(_, table)] => table_text(table, 4),
        _ => tables
            .iter()
            .map(|(pressure_pa, table)| format!("  at {pressure_pa} Pa\n{}", table_text(table, 4)))
            .collect(),
    }
}

/// Rows of temperatures and values, ten columns at a time.
fn table_text(table: &Table, digits: usize) -> String {
    if let [value] = table.values.as_slice() {
        return format!("  {value:.digits$} at every temperature\n\n");
    }
    let mut text = String::new();
    for (temperatures_k, values) in table.temperatures_k.chunks(10).zip(table.values.chunks(10)) {
        let row = |cells: &mut dyn Iterator<Item = String>| cells.map(|cell| format!("{cell:>7}")).collect::<String>();
        text += &format!("  T, K{}\n", row(&mut temperatures_k.iter().map(|t| format!("{t:.0}"))));
        text += &format!("      {}\n", row(&mut values.iter().map(|v| format!("{v:.digits$}"))));
    }
    let outside = match table.outside {
        OutOfRange::Clamp => "constant",
        OutOfRange::Extrapolate => "linear extrapolation, at least a tenth of the end value",
        OutOfRange::Error => "an error",
    };
    text + &format!("  outside: {outside}\n\n")
}

fn curve(table: &Table, digits: usize) -> String {
    let (low, high) = table.range_k();
    if !low.is_finite() {
        return String::new();
    }
    let points = sampled((low, high), |temperature_k| table.at(temperature_k));
    let curves = [Curve { name: String::new(), points }];
    chart(&curves, PLOT_ROWS, false, "temperature, K", |value| format!("{value:.digits$}")) + "\n"
}

/// One curve per pressure, or a single one without pressure dependence.
fn conductivity_curves(conductivity: &Conductivity) -> String {
    let range_k = conductivity.range_k();
    if !range_k.0.is_finite() {
        return String::new();
    }
    let with_pressure = match conductivity {
        Conductivity::ThreePart(parts) => !parts.pores.is_empty(),
        Conductivity::Tables(tables) => tables.len() > 1,
    };
    let pressures = if with_pressure { &PRESSURES_PA[..] } else { &[(PRESSURES_PA[0].0, "")] };
    let total = |pressure_pa| move |temperature_k| conductivity.parts(temperature_k, pressure_pa).iter().sum::<f64>();
    let curves: Vec<Curve> = pressures
        .iter()
        .map(|&(pressure_pa, name)| Curve { name: name.to_owned(), points: sampled(range_k, total(pressure_pa)) })
        .collect();
    chart(&curves, PLOT_ROWS, true, "temperature, K", |value| format!("{value:.3}")) + "\n"
}

fn sampled((low, high): (f64, f64), at: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    const STEPS: usize = 116;
    let along = |step: usize| low + (high - low) * step as f64 / STEPS as f64;
    (0..=STEPS).map(along).map(|temperature_k| (temperature_k, at(temperature_k))).collect()
}

/// Wrap a text at the width, each line indented.
fn wrapped(words: &str, indent: &str) -> String {
    let mut text = String::new();
    let mut column = 0;
    for word in words.split_whitespace() {
        let length = word.chars().count();
        if column == 0 || column + 1 + length > WIDTH {
            text += if column == 0 { "" } else { "\n" };
            text += indent;
            column = indent.len();
        } else {
            text += " ";
            column += 1;
        }
        text += word;
        column += length;
    }
    text + "\n"
}

fn shortened(name: &str, width: usize) -> String {
    if name.chars().count() <= width {
        return name.to_owned();
    }
    name.chars().take(width - 1).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(id: &str) -> String {
        show(&Material::named(id).unwrap_or_else(|error| panic!("{error}")))
    }

    #[test]
    fn the_database_fits_a_terminal_of_80_columns() {
        let list = list().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(list.lines().count(), material_ids().len() + 3);
        let texts: Vec<String> = material_ids().into_iter().map(shown).chain([list]).collect();
        for line in texts.iter().flat_map(|text| text.lines()) {
            assert!(line.chars().count() <= 80, "{} columns: {line}", line.chars().count());
        }
    }

    #[test]
    fn a_porous_insulator_shows_its_conductivity_parts_its_source_and_a_curve_per_pressure() {
        let text = shown("pyrogel3350");
        for expected in
            ["estimated, ±30 %", "0.93 k_air(T, p; 0.12 µm)", "product sheets", " 1 atm\n", " 8.01 kPa\n", "⠉"]
        {
            assert!(text.contains(expected), "{expected}: {text}");
        }
    }

    #[test]
    fn a_decomposing_material_shows_its_reactions_its_char_and_its_residual_mass() {
        let text = shown("pyrogel3350");
        for expected in
            ["0.1400     4.420e8", "char, 122.4 kg/m³", "permeability 1.0e-13 m²", "residual mass at 10 K/min", "0.720"]
        {
            assert!(text.contains(expected), "{expected}: {text}");
        }
        assert!(shown("tacot").contains("virgin -0.857 MJ/kg at 298 K"));
        assert!(!shown("saffil_96").contains("decomposition"));
    }

    #[test]
    fn errors_of_a_material_file_have_their_line_and_a_valid_file_is_summarised() {
        let folder = std::env::temp_dir().join(format!("bondline-check-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        let path = folder.join("mine.toml");
        let whole = include_str!("../../data/materials/akk.toml");
        std::fs::write(&path, whole).expect("a file in a temporary folder");
        let text = summary(&Material::load(&path).unwrap_or_else(|error| panic!("{error}")));
        assert!(text.contains("at 300 K and 1 atm: k 0.1000 W/m/K (constant)"), "{text}");
        let melting = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/derivatives/melting.toml");
        let melting = summary(&Material::load(melting.as_ref()).unwrap_or_else(|error| panic!("{error}")));
        for expected in [
            "k at 50 Pa: 4 points from 280 to 1200 K, 1 jump, linear between them",
            "k at 90000 Pa: 2 points from 280 to 1200 K, linear between them",
            "c_p: 8 points from 280 to 1200 K, 2 jumps, linear between them",
        ] {
            assert!(melting.contains(expected), "{expected}: {melting}");
        }
        let spoiled = whole.replace("0.10 W/m/K", "0.10 W/m").replace("400, 500", "500, 400");
        std::fs::write(&path, spoiled).expect("a file in a temporary folder");
        let error = Material::load(&path).expect_err("two faults").to_string();
        assert!(error.contains("mine.toml:14:29: expected a temperature above 500 K, found 400 K"), "{error}");
        assert!(error.contains("mine.toml:23:9: wrong dimension: expected a conductivity"), "{error}");
        assert!(error.ends_with("2 errors"), "{error}");
        std::fs::remove_dir_all(&folder).expect("the folder made above");
    }
}
