//! Rows lie on the device where the host puts them.

use crate::shaders::{all, compiled, kernel};
use crate::support::{case, text};
use bondline::march::Precision;
use bondline::plan::Plan;
use bondline::plan::layout::{
    Bead, Bulk, Cell, Conduction, Drive, Face, Path, Place, Ply, Reaction, Scaling, Sensor, Substance,
};
use naga::{Module, TypeInner};

/// Rows of reals and rows of indices: their names in the shader, and the fields of their twins.
fn reals() -> [(&'static str, &'static [&'static str]); 8] {
    [
        ("Cell", Cell::<f64>::FIELDS),
        ("Face", Face::<f64>::FIELDS),
        ("Drive", Drive::<f64>::FIELDS),
        ("Sensor", Sensor::<f64>::FIELDS),
        ("Bead", Bead::<f64>::FIELDS),
        ("Bulk", Bulk::<f64>::FIELDS),
        ("Substance", Substance::<f64>::FIELDS),
        ("Reaction", Reaction::<f64>::FIELDS),
    ]
}
fn indices() -> [(&'static str, &'static [&'static str]); 5] {
    [
        ("Ply", Ply::<u32>::FIELDS),
        ("Conduction", Conduction::<u32>::FIELDS),
        ("Scaling", Scaling::<u32>::FIELDS),
        ("Path", Path::<u32>::FIELDS),
        ("Place", Place::<u32>::FIELDS),
    ]
}

/// A struct of a module: each field with its offset, and the span of the whole, in bytes.
pub(crate) fn reflected(module: &Module, name: &str) -> Option<(Vec<(String, u32)>, u32)> {
    let found = module.types.iter().find(|(_, kind)| kind.name.as_deref() == Some(name))?.1;
    let TypeInner::Struct { members, span } = &found.inner else { return None };
    Some((members.iter().map(|member| (member.name.clone().unwrap_or_default(), member.offset)).collect(), *span))
}

/// Whether a struct holds these fields in this order, each of so many bytes and one behind the other, up to a multiple of 16.
fn lies_as(module: &Module, name: &str, fields: &[&str], bytes: u32) -> Result<(), String> {
    let found = reflected(module, name).ok_or(format!("the shader has no struct {name}"))?;
    let offsets = fields.iter().zip(0_u32..).map(|(field, place)| ((*field).to_owned(), place * bytes));
    let expected = (offsets.collect::<Vec<_>>(), (fields.len() as u32 * bytes).next_multiple_of(16));
    if found == expected { Ok(()) } else { Err(format!("{name}: {found:?}, expected {expected:?}")) }
}

/// Whether every row of the shader lies as its twin on the host.
fn rows_lie(text: &str, precision: Precision) -> Result<(), String> {
    let module = compiled(text)?;
    let bytes = if precision == Precision::F32 { 4 } else { 8 };
    reals().iter().try_for_each(|(name, fields)| lies_as(&module, name, fields, bytes))?;
    indices().iter().try_for_each(|(name, fields)| lies_as(&module, name, fields, 4))
}

#[test]
fn every_row_lies_on_the_device_as_on_the_host() {
    for precision in [Precision::F32, Precision::F64] {
        rows_lie(&kernel(&case("slab"), precision), precision).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn no_row_of_the_shader_is_left_uncompared() {
    let text = text("shaders/layout.wgsl");
    let declared: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("struct ").and_then(|rest| rest.strip_suffix(" {")))
        .filter(|name| !["Run", "Plan"].contains(name))
        .collect();
    let mut compared: Vec<&str> = reals().iter().chain(&indices()).map(|(name, _)| *name).collect();
    assert_eq!(declared.len(), compared.len(), "{declared:?} against {compared:?}");
    compared.retain(|name| !declared.contains(name));
    assert!(compared.is_empty(), "not in the shader: {compared:?}");
}

#[test]
fn a_row_renamed_reordered_or_lengthened_is_caught() {
    let text = kernel(&case("slab"), Precision::F32);
    let spoils = [
        (
            "struct Drive {\n    @align(16) flux_w_m2: real,",
            "struct Drive {\n    @align(16) flux_w_cm2: real,",
            ".flux_w_m2",
            ".flux_w_cm2",
        ),
        ("    above_m: real,\n    below_m: real,\n", "    below_m: real,\n    above_m: real,\n", "", ""),
        (
            "struct Bead {\n    @align(16) start: real,",
            "struct Bead {\n    @align(16) unused: real,\n    start: real,",
            "",
            "",
        ),
        ("    film: u32,\n    exchange: u32,", "    film: u32,\n    @align(16) exchange: u32,", "", ""),
    ];
    for (sound, spoiled, uses, renamed) in spoils {
        let mut spoilt = text.replacen(sound, spoiled, 1);
        assert_ne!(text, spoilt, "nothing was spoiled: {sound}");
        if !uses.is_empty() {
            spoilt = spoilt.replace(uses, renamed);
        }
        let error = rows_lie(&spoilt, Precision::F32).expect_err("a spoiled row passed");
        assert!(error.contains("expected (["), "caught for another reason than its layout: {error}");
    }
}

/// The fields of a struct as Rust writes it.
fn written(text: &str, name: &str) -> Vec<(String, String)> {
    let body = text.split_once(&format!("struct {name} {{\n")).and_then(|(_, rest)| rest.split_once("\n}"));
    let lines = body.map_or("", |(body, _)| body).lines();
    let fields = lines.filter_map(|line| line.trim().trim_end_matches(',').split_once(": "));
    fields.map(|(field, kind)| (field.trim_start_matches("pub ").to_owned(), kind.to_owned())).collect()
}

/// The words of a dispatch as a kernel has them: those named, and zeros.
pub(crate) fn dispatched(module: &Module, named: &[(&str, u32)]) -> Vec<u32> {
    let (fields, bytes) = reflected(module, "Run").expect("the shader has it");
    let mut words = vec![0; bytes as usize / 4];
    for (name, word) in named {
        let field = fields.iter().find(|(field, _)| field == name).expect("a word of a dispatch");
        words[field.1 as usize / 4] = *word;
    }
    words
}

/// Whether the words of a dispatch lie on the device as the host writes them; only padding may follow.
fn run_lies(module: &Module, host: &str) -> Result<(), String> {
    let mut fields = written(host, "Run");
    fields.retain(|(field, _)| field != "unused");
    if let Some(odd) = fields.iter().find(|(_, kind)| kind != "u32" && kind != "f32") {
        return Err(format!("Run: {odd:?} is not a word of four bytes"));
    }
    let names: Vec<&str> = fields.iter().map(|(field, _)| field.as_str()).collect();
    lies_as(module, "Run", &names, 4)
}

#[test]
fn the_words_of_a_dispatch_lie_on_the_device_as_on_the_host() {
    let host = text("src/march/gpu/batch.rs");
    for precision in [Precision::F32, Precision::F64] {
        let module = compiled(&kernel(&case("slab"), precision)).unwrap_or_else(|error| panic!("{error}"));
        run_lies(&module, &host).unwrap_or_else(|error| panic!("{error}"));
        let swapped = host.replacen("    steps: u32,\n    members: u32,", "    members: u32,\n    steps: u32,", 1);
        assert_ne!(host, swapped);
        assert!(run_lies(&module, &swapped).is_err(), "swapped words passed");
        assert!(run_lies(&module, &host.replacen("one: f32", "one: f64", 1)).is_err(), "a wide word passed");
    }
}

/// Whether the kinds of rows that are uniform lie on the device as the host writes them, one behind the other.
fn plan_lies(module: &Module, host: &str) -> Result<(), String> {
    let kinds: Vec<&str> = host
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix("bytes(&flat!(").and_then(|rest| rest.split(' ').next()))
        .collect();
    let named = |(_, kind): &(_, &naga::Type)| kind.name.as_deref() == Some("Plan");
    let Some((_, naga::Type { inner: TypeInner::Struct { members, .. }, .. })) = module.types.iter().find(named) else {
        return Err("the shader has no struct Plan".to_owned());
    };
    let mut end = 0;
    let mut found = vec![];
    for member in members {
        let TypeInner::Array { base, .. } = module.types[member.ty].inner else {
            return Err(format!("{:?} holds no rows", member.name));
        };
        if member.offset != end {
            return Err(format!("{:?} begins at {}, where the rows before end at {end}", member.name, member.offset));
        }
        end += module.types[member.ty].inner.size(module.to_ctx());
        found.push(module.types[base].name.as_deref().unwrap_or_default());
    }
    if found == kinds { Ok(()) } else { Err(format!("{found:?}, the host writes {kinds:?}")) }
}

#[test]
fn the_rows_of_a_plan_lie_on_the_device_as_on_the_host() {
    let host = text("src/march/gpu/batch.rs");
    for case in all() {
        // The shader has one length for both of each.
        let plan = Plan::new(&case);
        let rows = &plan.rows;
        assert_eq!(rows.bulks.len(), plan.plies.len(), "{}", case.id());
        assert_eq!(rows.sensors.len(), plan.places.len(), "{}", case.id());
        assert_eq!(plan.conductions.len(), rows.substances.len(), "{}", case.id());
        assert_eq!(rows.reactions.len(), plan.paths.len(), "{}", case.id());
        for precision in [Precision::F32, Precision::F64] {
            let text = kernel(&case, precision);
            let module = compiled(&text).unwrap_or_else(|error| panic!("{error}"));
            plan_lies(&module, &host).unwrap_or_else(|error| panic!("{} in {precision:?}: {error}", case.id()));
            let swapped = host.replacen(
                "bytes(&flat!(Ply of plan.plies)),\n        bytes(&flat!(Bulk of rows.bulks)),",
                "bytes(&flat!(Bulk of rows.bulks)),\n        bytes(&flat!(Ply of plan.plies)),",
                1,
            );
            assert_ne!(host, swapped);
            assert!(plan_lies(&module, &swapped).is_err(), "swapped rows passed");
            let apart = text.replacen("    bulks: array", "    @size(4096) bulks: array", 1);
            assert_ne!(text, apart);
            let module = compiled(&apart).unwrap_or_else(|error| panic!("{error}"));
            assert!(plan_lies(&module, &host).is_err(), "rows with room between them passed");
        }
    }
}
