//! The rows of a plan: the only types that cross to a device.
//!
//! Rows of reals are generic over their scalar and hold nothing but reals, so that one text serves f32 and
//! f64; rows of indices are `u32` throughout. Each has a twin of the same fields in the same order in
//! `shaders/layout.wgsl`, which a test holds against these by reflection.

/// Declares a row: a struct of one scalar type, its field names in order, and its flat form.
macro_rules! row {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $field:ident),+ $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name<S> { $($(#[$doc])* pub $field: S),+ }

        impl<S: Copy> $name<S> {
            /// The fields, as their twin in the shader names them.
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),+];

            /// Append the fields in order.
            pub fn flatten(&self, into: &mut Vec<S>) {
                into.extend([$(self.$field),+]);
            }

            /// The same row of another scalar.
            pub fn map<T>(&self, each: impl Fn(S) -> T) -> $name<T> {
                $name { $($field: each(self.$field)),+ }
            }
        }
    };
}

row! {
    /// A finite volume. Its node lies `above_m` under its upper face and `below_m` over its lower one.
    Cell {
        width_m,
        above_m,
        below_m,
        /// Half over the distance to the next node, 1/m: conductance within a ply is this times k + k'.
        half_over_next_1_m,
        /// Temperature at the start, K.
        start_k,
    }
}

row! {
    /// What does not change with time on a face.
    Face {
        film_w_m2_k,
        /// 1/(h_r − h_w(T_cw)) of the hot-wall correction, kg/J; zero leaves the flux as given.
        hot_wall_kg_j,
        /// One where the temperature is prescribed, else zero.
        held,
    }
}

row! {
    /// What drives a face at one end of a step.
    Drive {
        flux_w_m2,
        radiant_w_m2,
        gas_k,
        surroundings_k,
        held_k,
        /// Of the holder around the layup, the same for either face.
        holder_k,
    }
}

row! {
    /// A sensor on the face under its cell: `above` of the upper and `below` of the lower side are read.
    Sensor {
        above,
        below,
        /// From the node over the face to the face, and from the face to the node under it, m.
        above_m,
        below_m,
        /// Nominal, below the hot face.
        depth_m,
    }
}

row! {
    /// Where a sensor lies: the cell over its face, and the column that scales its depth. Where one does, the nearest
    /// nodes above and below the face, and how many steps from node to node its bounds may take it on either side.
    Place { cell, depth, node_above, steps_above, node_below, steps_below }
}

row! {
    /// How a sensor's bead follows over a step: its weights of the readings at the start and at the end.
    Bead { start, end }
}

row! {
    /// A ply: its cells, its block of tables and the ensemble columns that scale it. Column 0 is one.
    Ply {
        first_cell,
        end_cell,
        /// Where its block begins in the tables.
        table,
        conductivity,
        conductivity_solid,
        conductivity_gas,
        conductivity_radiative,
        heat_capacity,
        density,
        thickness,
        holder,
        /// The factor on density where extinction follows it.
        extinction,
        /// The factor on the contact under the ply.
        contact,
    }
}

row! {
    /// The ensemble columns that scale a face.
    Scaling { heating, film, exchange, emissivity }
}

row! {
    /// Constants of a ply: its bulk density, kg/m³, and its conductance to the holder in a volume, W/m³/K.
    Bulk { density_kg_m3, holder_w_m3_k }
}

/// Temperature of the first node of every table, K.
pub const TABLE_START_K: f64 = 0.0;
/// Distance between nodes, K: a power-law property is resampled to better than 1e-4 of itself.
pub const TABLE_STEP_K: f64 = 5.0;
/// Nodes of every table. The last, 4,000 K, is also the temperature above which a member has strayed.
pub const TABLE_NODES: usize = 801;
/// Columns of the faces' block of tables: emissivity of the hot face, enthalpy of air over that at the
/// cold wall (J/kg), its slope (J/kg/K), emissivity of the back face.
pub const FACE_COLUMNS: usize = 4;

/// Sums of heat that a member keeps: in and out through the hot face and the back face, from and to the holder.
pub const HEATS: usize = 6;

/// No reading falls on the end of this step.
pub const NO_INSTANT: u32 = u32::MAX;
