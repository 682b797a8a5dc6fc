//! Data layout of a kernel: the host rows and the WGSL structs are generated from one declaration.

use super::scalar::DeviceScalar;
use super::state::{self, Slots};
use crate::physics::layout::{
    BulkProperties, ConductivityColumns, Face, FaceColumns, InitialBend, PlanData, Ply, PoreClass, PressureLevel, ROWS,
    Reaction, ReactionPath, RowLayout, Sensor, SensorLocation, StateProperties, TableLocation,
};
use crate::plan::Plan;
use bytemuck::{Pod, Zeroable};

/// Declares a struct of words, and its WGSL source.
macro_rules! words {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $field:ident: $kind:ident),+ $(,)? }) => {
        $(#[$about])*
        #[repr(C)]
        #[derive(Clone, Copy, Pod, Zeroable)]
        pub(super) struct $name { $($(#[$doc])* pub(super) $field: $kind),+ }

        impl $name {
            const WGSL: &'static str = concat!(
                "struct ", stringify!($name), " {\n",
                $("    ", stringify!($field), ": ", stringify!($kind), ",\n",)+
                "}\n"
            );
        }
    };
}

words! {
    /// Parameters of a dispatch. Bounds of short loops are run-time values, so that drivers do not unroll the loops
    /// over plies and one kernel serves all time grids.
    DispatchParameters {
        slots: Slots,
        first_step: u32,
        end_step: u32,
        steps: u32,
        members: u32,
        one: f32,
        plies: u32,
        sensors: u32,
        faces: u32,
        open_faces: u32,
        stages: u32,
        gauges: u32,
        threads_per_member: u32,
        partial_sums: u32,
        /// At most `CELLS`, the length of the columns.
        cells: u32,
        last_cell: u32,
        /// Solutions of the first stage with lower heat capacities.
        reductions: u32,
    }
}

/// Rows in sequence, each aligned to 16 bytes; one row of zeros if there are none, as a binding cannot be empty.
pub(super) fn flatten_rows<S: Pod, T>(rows: &[T], fields: usize, flatten: impl Fn(&T, &mut Vec<S>)) -> Vec<S> {
    let stride = fields.next_multiple_of(16 / size_of::<S>());
    let mut words = Vec::with_capacity(stride * rows.len().max(1));
    for row in rows {
        flatten(row, &mut words);
        words.resize(words.len().next_multiple_of(stride), S::zeroed());
    }
    words.resize(words.len().max(stride), S::zeroed());
    words
}

/// Flattens rows of a type of `physics/layout.rs`.
macro_rules! flat {
    ($kind:ident of $rows:expr) => {
        $crate::march::gpu::layout::flatten_rows(&$rows[..], $kind::<u32>::FIELDS.len(), |row, into| row.flatten(into))
    };
}
pub(super) use flat;

/// Declares the data that all members and steps share: the WGSL struct `Plan`, and its bytes on the host. One buffer,
/// because lavapipe of Mesa 22.3 writes beyond its memory when it compiles a condition on a word of the fourth or a
/// later uniform buffer.
macro_rules! uniform_rows {
    ($plan:ident, $rows:ident: $($field:ident: $kind:ident[$length:literal] of $list:expr),+ $(,)?) => {
        const PLAN_STRUCT: &str = concat!(
            "struct Plan {\n",
            $("    ", stringify!($field), ": array<", stringify!($kind), ", ", $length, ">,\n",)+
            "}\n"
        );

        /// Bytes of the WGSL struct `Plan`.
        pub(super) fn plan_bytes<S: DeviceScalar>($plan: &Plan, $rows: &PlanData<S>) -> Vec<u8> {
            let rows: &[Vec<u8>] = &[$(bytemuck::cast_slice(&flat!($kind of $list)).to_vec()),+];
            rows.concat()
        }
    };
}

uniform_rows! {
    plan, rows:
    plies: Ply["PLIES"] of plan.rows.plies,
    tables: TableLocation["TABLES"] of plan.rows.tables,
    pressure_levels: PressureLevel["PRESSURE_LEVELS"] of rows.pressure_levels,
    pore_classes: PoreClass["PORE_CLASSES"] of rows.pore_classes,
    bulk_properties: BulkProperties["PLIES"] of rows.bulk_properties,
    faces: Face["2"] of rows.faces,
    face_columns: FaceColumns["2"] of plan.rows.face_columns,
    sensors: Sensor["SENSORS"] of rows.sensors,
    initial_bends: InitialBend["INITIAL_BENDS"] of rows.initial_bends,
    sensor_locations: SensorLocation["SENSORS"] of plan.rows.sensor_locations,
    state_properties: StateProperties["STATE_ROWS"] of rows.state_properties,
    conductivity_columns: ConductivityColumns["STATE_ROWS"] of plan.rows.conductivity_columns,
    reactions: Reaction["REACTION_ROWS"] of rows.reactions,
    reaction_paths: ReactionPath["REACTION_ROWS"] of plan.rows.reaction_paths,
}

/// WGSL struct of a row. Rows are aligned to 16 bytes, as uniform arrays require.
fn row_struct(row: &RowLayout) -> String {
    let fields = row.fields.iter().map(|field| format!("    {field}: {},\n", row.scalar)).collect::<String>();
    format!("struct {} {{\n{}}}\n", row.name, fields.replacen("    ", "    @align(16) ", 1))
}

/// The WGSL structs, and the functions that load and save the state.
pub(super) fn declarations() -> String {
    let rows = ROWS.iter().map(row_struct).collect::<String>();
    format!("{rows}{PLAN_STRUCT}{}{}", state::declarations(), DispatchParameters::WGSL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::march::Precision;
    use crate::march::gpu::{COOPERATIVE_THREADS, shader};
    use naga::{Module, TypeInner};

    /// Offsets of the members of a struct, and its size.
    fn struct_layout(module: &Module, name: &str) -> (Vec<u32>, u32) {
        let named = |(_, kind): &(_, &naga::Type)| kind.name.as_deref() == Some(name);
        let Some((_, naga::Type { inner: TypeInner::Struct { members, span }, .. })) = module.types.iter().find(named)
        else {
            panic!("the kernel has no struct {name}");
        };
        (members.iter().map(|member| member.offset).collect(), *span)
    }

    /// Whether the rows and the dispatch parameters of a kernel have the layout that the host writes.
    fn has_host_layout<W: DeviceScalar>(plan: &Plan, text: &str) -> bool {
        let module =
            naga::front::wgsl::parse_str(text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
        let rows_match = ROWS.iter().all(|row| {
            let bytes = if row.scalar == "real" { size_of::<W>() } else { size_of::<u32>() };
            let each = (0..row.fields.len()).map(|place| (place * bytes) as u32).collect();
            struct_layout(&module, row.name) == (each, (row.fields.len() * bytes).next_multiple_of(16) as u32)
        });
        let slots = size_of::<Slots>() as u32;
        let words = (0..).step_by(4).take(16).map(|offset| slots + offset);
        let run = (std::iter::once(0).chain(words).collect(), size_of::<DispatchParameters>() as u32);
        let plan_bytes = plan_bytes(plan, &plan.rows.data.map(W::from_f64)).len() as u32;
        rows_match
            && struct_layout(&module, "DispatchParameters") == run
            && struct_layout(&module, "Plan").1 == plan_bytes
    }

    #[test]
    fn kernel_structs_have_the_layout_of_the_host() {
        for id in ["slab", "lcat-2259-pyrolysis"] {
            let plan = Plan::new(&Case::load(format!("cases/{id}").as_ref()).expect("a shipped case"));
            for lanes in [1, COOPERATIVE_THREADS] {
                let source = |precision| shader::kernel(&plan, precision, false, lanes, shader::MARCH);
                assert!(has_host_layout::<f32>(&plan, &source(Precision::F32)), "{id} in f32");
                assert!(has_host_layout::<f64>(&plan, &source(Precision::F64)), "{id} in f64");
                assert!(!has_host_layout::<f64>(&plan, &source(Precision::F32)), "{id}: the other precision passed");
                for (from, to) in [
                    ("    end_step: u32,", "    @align(16) end_step: u32,"),
                    ("    bulk_properties: array", "    @size(4096) bulk_properties: array"),
                    ("    @align(16) start: real,", "    @align(16) unused: real,\n    start: real,"),
                ] {
                    let altered = source(Precision::F32).replacen(from, to, 1);
                    assert_ne!(altered, source(Precision::F32), "the text has no {from}");
                    assert!(!has_host_layout::<f32>(&plan, &altered), "{id}: {to} passed");
                }
            }
        }
    }
}
