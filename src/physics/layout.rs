//! The data that a march reads from a plan: rows of plain data, sizes and switches. Only rows are uploaded to a device.
//!
//! Real-valued rows are generic over the scalar and hold only reals, so that one definition serves f32 and f64; index
//! rows are `u32`. The WGSL structs of a kernel are generated from these definitions.

use std::sync::Arc;

/// The WGSL layout of a row: its name, its scalar (`real` or `u32`), and its fields in order.
pub struct RowLayout {
    pub name: &'static str,
    pub scalar: &'static str,
    pub fields: &'static [&'static str],
}

/// Declares rows: for each a generic struct, its field names and a function that flattens it; and the layouts of all
/// rows, from which the WGSL structs are generated.
macro_rules! rows {
    (@map real $name:ident $($field:ident),+) => {
        impl<S: Copy> $name<S> {
            /// The same row in another scalar.
            pub fn map<T>(&self, each: impl Fn(S) -> T) -> $name<T> {
                $name { $($field: each(self.$field)),+ }
            }
        }
    };
    (@map u32 $name:ident $($field:ident),+) => {};
    ($($(#[$about:meta])* $scalar:ident $name:ident { $($(#[$doc:meta])* $field:ident),+ $(,)? })+) => {
        $(
            $(#[$about])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            pub struct $name<S> { $($(#[$doc])* pub $field: S),+ }

            impl<S: Copy> $name<S> {
                /// Names of the fields, as in WGSL.
                pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),+];

                /// Append the fields in order.
                pub fn flatten(&self, into: &mut Vec<S>) {
                    into.extend([$(self.$field),+]);
                }
            }

            rows!(@map $scalar $name $($field),+);
        )+

        /// Layouts of all rows.
        pub const ROWS: &[RowLayout] = &[$(RowLayout {
            name: stringify!($name),
            scalar: stringify!($scalar),
            fields: $name::<u32>::FIELDS,
        }),+];
    };
}

rows! {
    /// A finite volume. Its node lies `above_m` below its upper face and `below_m` above its lower face.
    real Cell {
        width_m,
        above_m,
        below_m,
        /// Half the reciprocal distance to the next node, 1/m: conductance within a ply is this times k + k'.
        half_over_next_1_m,
        /// Initial temperature, K.
        start_k,
    }

    /// Constant parameters of a face.
    real Face {
        /// 1 where the temperature is prescribed, else 0.
        held,
    }

    /// Boundary forcing of a face at one end of a step.
    real BoundaryForcing {
        /// Cold-wall flux, W/m², or film coefficient of an enthalpy difference, kg/m²/s.
        convection,
        /// 1 of a flux; of a film coefficient the recovery enthalpy above that at the cold wall, J/kg.
        recovery,
        /// 1/(h_r − h_w(T_cw)) of the hot-wall correction of a flux, kg/J, or zero without; 1 of a film coefficient.
        hot_wall,
        /// 2λ of the blowing correction; zero disables it.
        blowing,
        radiant_w_m2,
        film_w_m2_k,
        gas_k,
        surroundings_k,
        /// Ambient pressure.
        pressure_pa,
        held_k,
        /// Temperature of the holder around the layup, the same for both faces.
        holder_k,
    }

    /// Interpolation of a sensor on the face below its cell: the reading is `above` × upper side + `below` × lower side
    /// of the face.
    real Sensor {
        above,
        below,
        /// Distance from the node above to the face, and from the face to the node below, m.
        above_m,
        below_m,
        /// Nominal depth below the hot face, m.
        depth_m,
        /// Initial temperature at the nominal depth, K, where the bead starts; zero where it starts at the reading.
        start_k,
    }

    /// A bend of the initial profile within the layup as stated, which a displaced sensor passes.
    real InitialBend {
        depth_m,
        /// Slope below less slope above, K/m.
        slope_change_k_m,
    }

    /// Location of a sensor: the cell above its face, the plies of that cell and the next, and the factor column of its
    /// depth. With a depth factor also the nearest nodes above and below the face, and how many node-to-node steps the
    /// bounds of the factor reach on either side.
    ///
    /// The row of a part with a temperature limit reads the highest of its nodes from `first_node` to `end_node` and of
    /// the `faces` rows after it. Other rows have neither.
    u32 SensorLocation {
        cell,
        ply_above,
        ply_below,
        depth,
        node_above,
        steps_above,
        node_below,
        steps_below,
        first_node,
        end_node,
        faces,
    }

    /// First-order lag of a thermocouple bead over a step: weights of the readings at the start and at the end.
    real Bead { start, end }

    /// A table: its rows, and the directory that finds the row of a temperature: see `table`.
    u32 TableLocation {
        /// Offset of the first row, and columns of a row.
        offset,
        columns,
        /// Rows of a pressure level.
        rows,
        /// Offset of the directory, after the rows; zero where the rows are the table steps.
        directory,
        /// Buckets of the directory in a table step, and the last bucket; without a directory rows.
        buckets_per_step,
        last_bucket,
        /// Length of a list of row starts, which takes the place of the directory where they are few; else zero. The
        /// first, the origin of the steps, has a group of columns of its own.
        list_length,
        /// The first property of a row for a conductivity that is integrated; zero where fluxes use the mean of two
        /// conductivities.
        conductivity_integral,
        /// The largest power of two of the row numbers, for a search by enthalpy; zero where steps advance
        /// temperatures.
        enthalpy_search_span,
    }

    /// A ply: its cells, states, reactions and factor columns. Column 0 is one.
    u32 Ply {
        first_cell,
        end_cell,
        /// Number of states, virgin and residues; their rows start at `first_state`.
        states,
        /// Tabulated states: all, or the virgin one alone where the properties of every residue are multiples
        /// of the virgin ones.
        rows,
        /// Conductivity columns that the factors need separately: see [`PlanRows::conductivity_parts`].
        parts,
        /// 1 where the ply above is of the same material, else 0.
        same_material_above,
        /// Pressure levels of the ply, at which the conductivity is tabulated.
        first_level,
        levels,
        /// 1 where the conductivity of the ply depends on a changing pressure, else 0.
        depends_on_pressure,
        first_state,
        first_reaction,
        end_reaction,
        heat_capacity,
        density,
        thickness,
        pre_exponential,
        activation,
        pyrolysis_heat,
        char_yield,
        permeability,
        holder,
        /// Factor column of the contact below the ply.
        contact,
    }

    /// Factor columns of the conductivity of a state of a ply: of the total, and of each part; and its pores, where the
    /// gas part follows a changing pressure.
    u32 ConductivityColumns {
        whole,
        solid,
        gas,
        radiative,
        /// The column of the density factor, where extinction follows density.
        extinction,
        first_pore,
        end_pore,
    }

    /// A pore class: its factor on the conductivity of unconfined air at pressure P is `share P/(P + slip T)`.
    real PoreClass {
        share,
        slip_pa_k,
    }

    /// A pressure at which conductivities are tabulated; they are linear in its logarithm between levels.
    real PressureLevel { log_pressure }

    /// Factor columns of a face.
    u32 FaceColumns { heating, film, exchange, emissivity }

    /// Constants of a ply.
    real BulkProperties {
        /// Density of the virgin material.
        density_kg_m3,
        /// Relative loss of thickness at complete reaction.
        shrinkage,
        /// 1: properties mix by volume; 0: by mass.
        by_volume,
        /// 1: absolute enthalpies include the heat of pyrolysis; 0: the reactions carry it.
        absolute,
        /// Conductance to the holder per volume.
        holder_w_m3_k,
    }

    /// Properties of a state of a ply: virgin or a residue.
    real StateProperties {
        /// Mass of this state per mass of the virgin material that it has replaced.
        remains,
        porosity,
        permeability_m2,
        /// Klinkenberg slip pressure over temperature.
        slip_pa_k,
        forchheimer_1_m,
        /// Enthalpy at the first table node, where the tables start at zero, J/kg.
        formation_j_kg,
        /// Multiple of the virgin conductivity and heat capacity, where the tables hold the virgin state alone.
        conductivity,
        heat_capacity,
    }

    /// A reaction of a ply.
    real Reaction {
        /// Natural logarithm of the pre-exponential factor in 1/s: f32 cannot hold every factor.
        log_rate_1_s,
        /// E/R, K.
        activation_k,
        order,
        onset_k,
        /// E/RT above which the reaction is negligible over the whole march.
        idle,
        /// Mass of gas released per virgin mass.
        loss,
        /// Share of the volume that the reaction converts from one state into another.
        share,
        heat_j_kg,
        /// 1: consumes the product of the previous reaction; 0: the virgin material.
        chained,
    }

    /// The states that a reaction of a ply consumes and produces.
    u32 ReactionPath { source, product }
}

/// Temperature of the first node of every table, K.
pub const TABLE_START_K: f64 = 0.0;
/// Unit of table positions, K; rows without a directory are one step long.
pub const TABLE_STEP_K: f64 = 5.0;
/// Table steps. A member above the end of the last step, 4,000 K, has diverged.
pub const TABLE_STEPS: usize = 800;
/// Table columns per vector load: two properties, each as its value at a node and its increment to the next node.
pub const COLUMNS_PER_LOAD: usize = 4;
/// Properties in the table of the faces before the emissivities of the hot face and of the back face in each state:
/// enthalpy of air relative to the cold wall (J/kg) and its slope (J/kg/K).
pub const AIR_PROPERTIES: usize = 2;
/// Columns of the table of the faces.
pub const FACE_COLUMNS: usize = 2 * (AIR_PROPERTIES + 2 * MAX_STATES);
/// Gas columns at the end of a row: enthalpy (J/kg), its slope (J/kg/K), molar mass over the gas constant (kg K/J) and
/// viscosity (Pa s).
pub const GAS_COLUMNS: usize = 2 * 4;
/// Columns of a row, before those of enthalpies, for each tabulated state where a conductivity is integrated: the
/// integral of its first conductivity column from the start of the table (W/m), and the upper bound of it (W/m/K).
pub const STEEP_COLUMNS: usize = 2 * 2;
/// Columns at the end of a row for each tabulated state where steps advance enthalpies: the lower bound of its heat
/// capacity (J/kg/K), and the position of the row in table steps.
pub const ENTHALPY_COLUMNS: usize = 2 * 2;
/// Maximum number of states of a ply.
pub const MAX_STATES: usize = 4;
/// Gauges of a layup at every instant, in a case with gas.
pub const GAUGES: usize = 6;

/// Accumulated heats of a member: in and out through the hot face and the back face, from and to the holder.
pub const HEAT_TOTALS: usize = 6;

/// Marks a step that ends on no instant.
pub const NO_INSTANT: u32 = u32::MAX;

/// Models of gas transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GasTransport {
    /// Gas leaves at the hot face at once, without heat exchange with the solid.
    Instantaneous,
    /// Gas flows to the hot face without storage, in thermal equilibrium with the solid.
    QuasiSteady,
    /// Darcy's law with storage in the pores.
    Darcy,
}

/// All that a march reads of a plan.
#[derive(Clone, Debug)]
pub struct PlanRows {
    /// Number of the record at the start and at the end of each step, or [`NO_INSTANT`].
    pub record_at_step: Vec<u32>,
    /// Records of every sensor in a march.
    pub records: usize,
    pub plies: Vec<Ply<u32>>,
    /// The table of each ply, then that of the faces.
    pub tables: Vec<TableLocation<u32>>,
    /// Ply × state.
    pub conductivity_columns: Vec<ConductivityColumns<u32>>,
    /// Factor columns of the hot face and of the back face.
    pub face_columns: [FaceColumns<u32>; 2],
    /// Location of each sensor, then the rows of the temperature limits.
    pub sensor_locations: Vec<SensorLocation<u32>>,
    /// Sensors of the case: the first of these rows.
    pub sensors: usize,
    /// Whether a factor scales the depth of a sensor; otherwise the march skips the correction of readings.
    pub has_depth_factors: bool,
    /// Conductivity columns of a table row, the maximum over plies. One: the total. Two: solid with gas, and radiative,
    /// where a factor on density scales extinction. Three: solid, gas and radiative, where a factor scales a part.
    pub conductivity_parts: usize,
    /// Whether fluxes within some ply are differences of the integral of its conductivity.
    pub has_steep_conductivities: bool,
    /// Whether steps of some ply advance enthalpies.
    pub has_enthalpy_steps: bool,
    /// Maximum number of states of a ply, and of reactions.
    pub max_states: usize,
    pub max_reactions: usize,
    /// The states that each reaction consumes and produces.
    pub reaction_paths: Vec<ReactionPath<u32>>,
    /// Gas transport; `None` without gas.
    pub gas: Option<GasTransport>,
    /// Whether gauges are recorded at every instant, in a case with gas.
    pub has_gauges: bool,
    /// Whether the back face is permeable to gas.
    pub back_is_open: bool,
    /// Faces that are not insulated, counted from the hot face: 2, or 1 where the march skips the back face.
    pub exchanging_faces: usize,
    /// Whether a holder takes heat sideways; the march skips it otherwise.
    pub has_holder: bool,
    /// Number of factors; an ensemble has one column more.
    pub factors: usize,
    pub data: PlanData<f64>,
}

impl PlanRows {
    /// Steps of a march.
    pub fn steps(&self) -> usize {
        self.data.step_lengths_s.len()
    }

    /// Cells through the thickness.
    pub fn cells(&self) -> usize {
        self.data.cells.len()
    }

    /// Properties of a state in a table row.
    pub fn properties(&self) -> usize {
        properties_per_state(self.conductivity_parts)
    }

    /// The table of the faces.
    pub fn face_table(&self) -> &TableLocation<u32> {
        &self.tables[self.plies.len()]
    }

    /// Whether there are rows of temperature limits.
    pub fn has_limit_rows(&self) -> bool {
        self.sensor_locations.len() > self.sensors
    }

    /// Number of gauges recorded at every instant: all, or none.
    pub fn gauges(&self) -> usize {
        if self.has_gauges { GAUGES } else { 0 }
    }
}

/// Properties of a state in a table row: four, or eight where its conductivity is in parts.
pub fn properties_per_state(conductivity_parts: usize) -> usize {
    if conductivity_parts > 1 { 8 } else { 4 }
}

/// The real-valued data of a plan, in the scalar of a march.
#[derive(Clone, Debug)]
pub struct PlanData<S> {
    pub cells: Vec<Cell<S>>,
    pub bulk_properties: Vec<BulkProperties<S>>,
    /// Ply × state.
    pub state_properties: Vec<StateProperties<S>>,
    /// Ply × level.
    pub pressure_levels: Vec<PressureLevel<S>>,
    pub pore_classes: Vec<PoreClass<S>>,
    /// Ply × reaction.
    pub reactions: Vec<Reaction<S>>,
    /// Contact resistance of each interface, m²K/W.
    pub contacts_m2_k_w: Vec<S>,
    /// Hot face, back face.
    pub faces: [Face<S>; 2],
    /// Four a step: hot face at its start and end, back face at its start and end; then four for the end of the march.
    pub boundary_forcing: Vec<BoundaryForcing<S>>,
    pub step_lengths_s: Vec<S>,
    /// Ply × pressure level × row × state × (conductivity, heat capacity, slope of the conductivity, enthalpy), SI.
    /// Where the conductivity is in parts, its first column is the solid part, and (radiative, its slope, gas, its
    /// slope) follow. Each row ends with the gas properties, if the case has gas, and with those of steps that advance
    /// enthalpies. Each property is a pair: value at the start of the row, rise per table step. After the rows of a
    /// table lie its directories. Plies of one material share a table; the table of the faces is last. Plans of one
    /// case share the tables.
    pub tables: Arc<[S]>,
    pub sensors: Vec<Sensor<S>>,
    /// None where no factor scales the depth of a sensor.
    pub initial_bends: Vec<InitialBend<S>>,
    /// Step × sensor.
    pub beads: Vec<Bead<S>>,
}

impl<S: Copy> PlanData<S> {
    /// The same data in another scalar.
    pub fn map<T>(&self, each: impl Fn(S) -> T + Copy) -> PlanData<T> {
        PlanData {
            cells: self.cells.iter().map(|row| row.map(each)).collect(),
            bulk_properties: self.bulk_properties.iter().map(|row| row.map(each)).collect(),
            state_properties: self.state_properties.iter().map(|row| row.map(each)).collect(),
            pressure_levels: self.pressure_levels.iter().map(|row| row.map(each)).collect(),
            pore_classes: self.pore_classes.iter().map(|row| row.map(each)).collect(),
            reactions: self.reactions.iter().map(|row| row.map(each)).collect(),
            contacts_m2_k_w: self.contacts_m2_k_w.iter().map(|&x| each(x)).collect(),
            faces: [self.faces[0].map(each), self.faces[1].map(each)],
            boundary_forcing: self.boundary_forcing.iter().map(|row| row.map(each)).collect(),
            step_lengths_s: self.step_lengths_s.iter().map(|&x| each(x)).collect(),
            tables: self.tables.iter().map(|&x| each(x)).collect(),
            sensors: self.sensors.iter().map(|row| row.map(each)).collect(),
            initial_bends: self.initial_bends.iter().map(|row| row.map(each)).collect(),
            beads: self.beads.iter().map(|row| row.map(each)).collect(),
        }
    }
}
