//! The rows of a plan: the only types that cross to a device.
//!
//! Rows of reals are generic over their scalar and hold nothing but reals, so that one text serves f32 and
//! f64; rows of indices are `u32` throughout. The structs of a kernel are generated from them.

use std::sync::Arc;

#[cfg(feature = "gpu")]
/// The layout of a row on a device: its name there, its scalar, which is `real` or `u32`, and its fields in order.
pub struct RowLayout {
    pub name: &'static str,
    pub scalar: &'static str,
    pub fields: &'static [&'static str],
}

/// Declares rows: of each a struct of one scalar type, its field names in order, and its flat form; and the layouts of
/// all, from which kernels get their structs.
macro_rules! rows {
    (@map real $name:ident $($field:ident),+) => {
        impl<S: Copy> $name<S> {
            /// The same row of another scalar.
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
                #[cfg(feature = "gpu")]
                /// The fields, as a kernel names them.
                pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),+];

                #[cfg(feature = "gpu")]
                /// Append the fields in order.
                pub fn flatten(&self, into: &mut Vec<S>) {
                    into.extend([$(self.$field),+]);
                }
            }

            rows!(@map $scalar $name $($field),+);
        )+

        #[cfg(feature = "gpu")]
        /// The layout of every row.
        pub const ROWS: &[RowLayout] = &[$(RowLayout {
            name: stringify!($name),
            scalar: stringify!($scalar),
            fields: $name::<u32>::FIELDS,
        }),+];
    };
}

rows! {
    /// A finite volume. Its node lies `above_m` under its upper face and `below_m` over its lower one.
    real Cell {
        width_m,
        above_m,
        below_m,
        /// Half over the distance to the next node, 1/m: conductance within a ply is this times k + k'.
        half_over_next_1_m,
        /// Temperature at the start, K.
        start_k,
    }

    /// What does not change with time on a face.
    real Face {
        film_w_m2_k,
        /// 1/(h_r − h_w(T_cw)) of the hot-wall correction, kg/J; zero leaves the flux as given.
        hot_wall_kg_j,
        /// Twice λ of the blowing correction; zero leaves it out.
        blowing,
        /// One where the temperature is prescribed, else zero.
        held,
    }

    /// What drives a face at one end of a step.
    real Drive {
        flux_w_m2,
        radiant_w_m2,
        gas_k,
        surroundings_k,
        /// Of the gas outside.
        pressure_pa,
        held_k,
        /// Of the holder around the layup, the same for either face.
        holder_k,
    }

    /// A sensor on the face under its cell: `above` of the upper and `below` of the lower side are read.
    real Sensor {
        above,
        below,
        /// From the node over the face to the face, and from the face to the node under it, m.
        above_m,
        below_m,
        /// Nominal, below the hot face.
        depth_m,
    }

    /// Where a sensor lies: the cell over its face, the plies of that and of the next, and the column that scales its depth. Where one does, the nearest
    /// nodes above and below the face, and how many steps from node to node its bounds may take it on either side.
    u32 Place { cell, ply_above, ply_below, depth, node_above, steps_above, node_below, steps_below }

    /// How a sensor's bead follows over a step: its weights of the readings at the start and at the end.
    real Bead { start, end }

    /// A ply: its cells, its block of tables, its reactions and the ensemble columns that scale it. Column 0 is one.
    u32 Ply {
        first_cell,
        end_cell,
        /// Where its tables begin, and how many columns a row of them has: those of every state, then those of the gas.
        table,
        columns,
        /// Virgin and residues; their rows begin at `first_state`.
        states,
        /// States with properties of their own in the tables: all, or the virgin one alone where those of every residue are so many times its.
        rows,
        /// Conductivity columns that a member's factors tell apart: see [`Plan::parts`](super::Plan::parts).
        parts,
        first_state,
        first_reaction,
        end_reaction,
        heat_capacity,
        density,
        thickness,
        kinetics,
        activation,
        pyrolysis_heat,
        char_yield,
        permeability,
        holder,
        /// The factor on the contact under the ply.
        contact,
    }

    /// The ensemble columns that scale the conductivity of a state of a ply: all of it, and each of its parts.
    u32 Conduction {
        whole,
        solid,
        gas,
        radiative,
        /// The factor on density where extinction follows it.
        extinction,
    }

    /// The ensemble columns that scale a face.
    u32 Scaling { heating, film, exchange, emissivity }

    /// What is constant in a ply.
    real Bulk {
        /// Of the virgin material.
        density_kg_m3,
        /// Share of the thickness lost when all has reacted.
        shrinkage,
        /// One where properties mix by volume, zero where by mass.
        by_volume,
        /// One where enthalpies are absolute and hold the heat of pyrolysis, zero where the reactions do.
        absolute,
        /// Conductance to the holder in a volume.
        holder_w_m3_k,
    }

    /// A state of a ply: virgin or a residue.
    real Substance {
        /// Mass where it has replaced all the virgin material, over the mass of that.
        remains,
        porosity,
        permeability_m2,
        /// Klinkenberg's slip over temperature.
        slip_pa_k,
        inertia_1_m,
        /// Enthalpy over that of the tables, which begins at zero, J/kg.
        formation_j_kg,
        /// Where the tables hold the virgin state alone: over what that conducts and stores.
        conductivity,
        heat_capacity,
    }

    /// A reaction of a ply.
    real Reaction {
        rate_1_s,
        /// E/R, K.
        activation_k,
        order,
        onset_k,
        /// E/RT from which on it comes to nothing over a whole march.
        idle,
        /// Mass of gas over the virgin mass.
        loss,
        /// Share of the volume that it turns from one state into another.
        share,
        heat_j_kg,
        /// One where it lives on what the reaction before it made, zero where on the virgin material.
        chained,
    }

    /// Between which states of its ply a reaction leads.
    u32 Path { source, product }
}

/// Temperature of the first node of every table, K.
pub const TABLE_START_K: f64 = 0.0;
/// Distance between nodes, K: a power-law property is resampled to better than 1e-4 of itself.
pub const TABLE_STEP_K: f64 = 5.0;
/// Nodes of every table. The last, 4,000 K, is also the temperature above which a member has strayed.
pub const TABLE_NODES: usize = 801;
/// Columns of a table stand in fours that are read at once: two properties, each with its value at a node and by how much it
/// rises to the next.
pub const ABREAST: usize = 4;
/// Properties in the faces' block of tables before the emissivities of the hot face in each state and those of the back
/// face: enthalpy of air over that at the cold wall (J/kg) and its slope (J/kg/K).
pub const AIR_PROPERTIES: usize = 2;
/// Columns of that block.
pub const FACE_COLUMNS: usize = 2 * (AIR_PROPERTIES + 2 * STATES_MAX);
/// Columns of the gas at the end of a row: enthalpy (J/kg), its slope (J/kg/K), molar mass over the gas constant
/// (kg K/J) and viscosity (Pa s).
pub const GAS_COLUMNS: usize = 2 * 4;
/// Most states of a ply.
pub const STATES_MAX: usize = 4;
/// Levels of pressure in the tables of a case whose pressure changes.
pub const LEVELS_MAX: usize = 17;
/// What is told of a whole layup at every instant, where it makes gas or lets it through.
pub const GAUGES: usize = 6;

/// Sums of heat that a member keeps: in and out through the hot face and the back face, from and to the holder.
pub const HEATS: usize = 6;

/// No reading falls on the end of this step.
pub const NO_INSTANT: u32 = u32::MAX;

/// The real-valued rows of a plan, in the scalar of a march.
#[derive(Clone, Debug)]
pub struct Rows<S> {
    pub cells: Vec<Cell<S>>,
    pub bulks: Vec<Bulk<S>>,
    /// Ply × state.
    pub substances: Vec<Substance<S>>,
    /// Ply × reaction.
    pub reactions: Vec<Reaction<S>>,
    /// Contact resistance of each interface, m²K/W.
    pub contacts_m2_k_w: Vec<S>,
    /// Hot, back.
    pub faces: [Face<S>; 2],
    /// Four a step: hot at the start, hot at the end, back at the start, back at the end; and four for the
    /// end of the march.
    pub drives: Vec<Drive<S>>,
    pub lengths_s: Vec<S>,
    /// Ply × level × node × state × (conductivity, heat capacity, slope of the conductivity, enthalpy), SI, and where the
    /// conductivity is in parts, the first of which is then the solid one, × (radiative, its slope, gas, its slope); in each row
    /// what all states are like that have rows is followed by what the gas is like, where there is one. Plies of one material share their
    /// tables. Then the faces' table. Each property with by how much it rises to the next node. Plans of one case share them.
    pub tables: Arc<[S]>,
    pub sensors: Vec<Sensor<S>>,
    /// Step × sensor.
    pub beads: Vec<Bead<S>>,
}

impl<S: Copy> Rows<S> {
    /// The same rows in another scalar.
    pub fn map<T>(&self, each: impl Fn(S) -> T + Copy) -> Rows<T> {
        Rows {
            cells: self.cells.iter().map(|row| row.map(each)).collect(),
            bulks: self.bulks.iter().map(|row| row.map(each)).collect(),
            substances: self.substances.iter().map(|row| row.map(each)).collect(),
            reactions: self.reactions.iter().map(|row| row.map(each)).collect(),
            contacts_m2_k_w: self.contacts_m2_k_w.iter().map(|&x| each(x)).collect(),
            faces: [self.faces[0].map(each), self.faces[1].map(each)],
            drives: self.drives.iter().map(|row| row.map(each)).collect(),
            lengths_s: self.lengths_s.iter().map(|&x| each(x)).collect(),
            tables: self.tables.iter().map(|&x| each(x)).collect(),
            sensors: self.sensors.iter().map(|row| row.map(each)).collect(),
            beads: self.beads.iter().map(|row| row.map(each)).collect(),
        }
    }
}
