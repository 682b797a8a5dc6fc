//! The checks of a plan before a march: kernels and vector loads read rows without bounds checks, so a missing row
//! would be a wrong number and not an error.

use super::Plan;
use crate::physics::layout::{
    COLUMNS_PER_LOAD, ENTHALPY_COLUMNS, FACE_COLUMNS, GAS_COLUMNS, MAX_STATES, NO_INSTANT, STEEP_COLUMNS, TABLE_STEPS,
    TableLocation,
};

/// Rows of a plan that do not fit together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the plan is inconsistent: {rows} has {found}, expected {expected}")]
pub struct InconsistentPlan {
    /// Name of the rows, or of the index in them.
    rows: &'static str,
    /// Number of the rows, or the index.
    found: usize,
    /// The number or the range of indices that the other rows imply.
    expected: String,
}

fn count(rows: &'static str, found: usize, expected: usize) -> Result<(), InconsistentPlan> {
    if found == expected { Ok(()) } else { Err(InconsistentPlan { rows, found, expected: expected.to_string() }) }
}

/// Check that every index is below `end`.
fn below(rows: &'static str, indices: impl IntoIterator<Item = u32>, end: usize) -> Result<(), InconsistentPlan> {
    match indices.into_iter().map(|index| index as usize).find(|&index| index >= end) {
        None => Ok(()),
        Some(found) => Err(InconsistentPlan { rows, found, expected: format!("indices below {end}") }),
    }
}

/// Check that the number of rows is at most `most`.
fn at_most(rows: &'static str, found: usize, most: usize) -> Result<(), InconsistentPlan> {
    if found <= most { Ok(()) } else { Err(InconsistentPlan { rows, found, expected: format!("at most {most}") }) }
}

impl Plan {
    /// Whether the numbers of rows agree with each other and every index lies within the rows that it selects.
    ///
    /// # Errors
    /// The first disagreement.
    pub(crate) fn check_consistency(&self) -> Result<(), InconsistentPlan> {
        self.check_counts()?;
        self.check_plies()?;
        self.check_factor_columns()?;
        self.check_sensors()
    }

    fn check_counts(&self) -> Result<(), InconsistentPlan> {
        let (rows, plies, steps) = (&self.rows.data, self.rows.plies.len(), self.steps());
        let paths = self.rows.reaction_paths.len();
        at_most("the least number of steps", 1, steps)?;
        at_most("the least number of plies", 1, plies)?;
        count("ends of steps", self.times_s.len(), steps + 1)?;
        count("records by step", self.rows.record_at_step.len(), steps + 1)?;
        below(
            "a record",
            self.rows.record_at_step.iter().copied().filter(|&record| record != NO_INSTANT),
            self.rows.records,
        )?;
        count("rows of the faces' forcing", rows.boundary_forcing.len(), 4 * (steps + 1))?;
        count("constants of plies", rows.bulk_properties.len(), plies)?;
        count("contacts", rows.contacts_m2_k_w.len(), plies - 1)?;
        count("ranges of temperature", self.table_limits_k.len(), plies)?;
        count("states", rows.state_properties.len(), self.rows.conductivity_columns.len())?;
        count("reactions", rows.reactions.len(), paths)?;
        at_most("states of a ply", self.rows.max_states, MAX_STATES)?;
        count("sensors", rows.sensors.len(), self.rows.sensor_locations.len())?;
        count("weights of sensors by step", rows.beads.len(), steps * self.rows.sensor_locations.len())
    }

    fn check_plies(&self) -> Result<(), InconsistentPlan> {
        count("tables", self.rows.tables.len(), self.rows.plies.len() + 1)?;
        self.check_table(self.rows.face_table(), 1, FACE_COLUMNS)?;
        let (mut cell, mut state, mut reaction, mut level) = (0, 0, 0, 0);
        for (ply, table) in self.rows.plies.iter().zip(&self.rows.tables) {
            count("the first pressure level of a ply", ply.first_level as usize, level)?;
            at_most("the least number of pressure levels of a ply", 1, ply.levels as usize)?;
            level += ply.levels as usize;
            count("the first cell of a ply", ply.first_cell as usize, cell)?;
            at_most("the first cell of a ply", cell + 1, ply.end_cell as usize)?;
            cell = ply.end_cell as usize;
            count("the first state of a ply", ply.first_state as usize, state)?;
            at_most("states of a ply", ply.states as usize, self.rows.max_states)?;
            at_most("states of a ply with tables of their own", ply.rows as usize, ply.states as usize)?;
            count("the first reaction of a ply", ply.first_reaction as usize, reaction)?;
            at_most("the first reaction of a ply", reaction, ply.end_reaction as usize)?;
            at_most("the last reaction of a ply", ply.end_reaction as usize, self.rows.reaction_paths.len())?;
            let paths = &self.rows.reaction_paths[reaction..ply.end_reaction as usize];
            below(
                "a state of a reaction",
                paths.iter().flat_map(|path| [path.source, path.product]),
                self.rows.max_states,
            )?;
            (state, reaction) = (state + ply.states as usize, ply.end_reaction as usize);
            let gas = if self.rows.gas.is_some() { GAS_COLUMNS } else { 0 };
            let enthalpy = if table.enthalpy_search_span > 0 { ply.rows as usize * ENTHALPY_COLUMNS } else { 0 };
            let steep = if table.conductivity_integral > 0 { ply.rows as usize * STEEP_COLUMNS } else { 0 };
            let columns = 2 * ply.rows as usize * self.rows.properties() + gas + steep + enthalpy;
            self.check_table(table, ply.levels as usize, columns)?;
        }
        count("pressure levels", self.rows.data.pressure_levels.len(), level)?;
        for row in &self.rows.conductivity_columns {
            at_most("the first pore of a state", row.first_pore as usize, row.end_pore as usize)?;
            at_most("the last pore of a state", row.end_pore as usize, self.rows.data.pore_classes.len())?;
        }
        count("cells", self.cells(), cell)?;
        count("states", self.rows.data.state_properties.len(), state)?;
        count("reactions", self.rows.data.reactions.len(), reaction)
    }

    /// The rows, the directory and all that it leads to lie within the tables.
    fn check_table(&self, table: &TableLocation<u32>, levels: usize, columns: usize) -> Result<(), InconsistentPlan> {
        let tables = &self.rows.data.tables;
        count("columns of a table", table.columns as usize, columns)?;
        count("columns of a table beyond whole groups", columns % COLUMNS_PER_LOAD, 0)?;
        count("offset of a table beyond whole groups", table.offset as usize % COLUMNS_PER_LOAD, 0)?;
        at_most("the least number of rows of a table", TABLE_STEPS, table.rows as usize)?;
        let end = table.offset as usize + levels * table.rows as usize * columns;
        at_most("the end of a table", end, tables.len())?;
        if table.directory == 0 {
            return below("the last row of a table", [table.last_bucket], table.rows as usize);
        }
        count("offset of a directory beyond whole groups", table.directory as usize % COLUMNS_PER_LOAD, 0)?;
        at_most("the start of a directory", end, table.directory as usize)?;
        if table.list_length > 0 {
            let end = table.directory as usize
                + COLUMNS_PER_LOAD * (1 + (table.list_length as usize - 1).div_ceil(COLUMNS_PER_LOAD));
            at_most("the end of a list of row starts", end, tables.len())?;
            let starts = tables[table.directory as usize + COLUMNS_PER_LOAD..end].iter();
            let started = starts.filter(|&&start| start <= TABLE_STEPS as f64).count();
            return at_most("the rows of a list of row starts", TABLE_STEPS + started, table.rows as usize);
        }
        let end = table.directory as usize + COLUMNS_PER_LOAD * (table.last_bucket as usize + 1);
        at_most("the end of a directory", end, tables.len())?;
        let entries = tables[table.directory as usize..end].as_chunks::<COLUMNS_PER_LOAD>().0;
        let started = |entry: &[f64; COLUMNS_PER_LOAD]| {
            entry[2..].iter().filter(|&&start| start <= TABLE_STEPS as f64).count() as f64
        };
        below(
            "a row of a directory",
            entries.iter().map(|entry| (entry[0] + started(entry)) as u32),
            table.rows as usize,
        )
    }

    fn check_factor_columns(&self) -> Result<(), InconsistentPlan> {
        let columns = self.rows.factors + 1;
        let plies = self.rows.plies.iter().flat_map(|ply| {
            [
                ply.heat_capacity,
                ply.density,
                ply.thickness,
                ply.pre_exponential,
                ply.activation,
                ply.pyrolysis_heat,
                ply.char_yield,
                ply.permeability,
                ply.holder,
                ply.contact,
            ]
        });
        below("a factor of a ply", plies, columns)?;
        let conductivities = self
            .rows
            .conductivity_columns
            .iter()
            .flat_map(|row| [row.whole, row.solid, row.gas, row.radiative, row.extinction]);
        below("a factor of a conductivity", conductivities, columns)?;
        let faces = self.rows.face_columns.iter().flat_map(|row| [row.heating, row.film, row.exchange, row.emissivity]);
        below("a factor of a face", faces, columns)?;
        below("a factor of a depth", self.rows.sensor_locations.iter().map(|place| place.depth), columns)
    }

    fn check_sensors(&self) -> Result<(), InconsistentPlan> {
        let (cells, plies) = (self.cells(), self.rows.plies.len());
        below("the cell of a sensor", self.rows.sensor_locations.iter().map(|place| place.cell), cells)?;
        below(
            "the ply of a sensor",
            self.rows.sensor_locations.iter().flat_map(|row| [row.ply_above, row.ply_below]),
            plies,
        )?;
        for (row, place) in self.rows.sensor_locations.iter().enumerate() {
            at_most("the last node of a limit", place.end_node as usize, cells)?;
            at_most("the first node of a limit", place.first_node as usize, place.end_node as usize)?;
            at_most("the last face of a limit", row + place.faces as usize + 1, self.rows.sensor_locations.len())?;
        }
        below(
            "the row of a limit",
            self.limits.iter().map(|limit| limit.row as u32),
            self.rows.sensor_locations.len(),
        )?;
        for place in self.rows.sensor_locations.iter().filter(|place| place.depth > 0) {
            at_most("nodes above a sensor", place.steps_above as usize, place.node_above as usize)?;
            below("a node below a sensor", [place.node_below + place.steps_below], cells)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use std::path::Path;
    use std::sync::Arc;

    /// A change of a plan that a device must not read.
    type Spoil = fn(&mut Plan);

    fn shorten<T>(rows: &mut Vec<T>) {
        rows.truncate(rows.len() - 1);
    }

    const SPOILED: &[(&str, Spoil)] = &[
        ("tables cut short", |plan| plan.rows.data.tables = plan.rows.data.tables[8..].into()),
        ("no tables", |plan| plan.rows.data.tables = Arc::new([])),
        ("a table that begins too late", |plan| plan.rows.tables[0].offset += plan.rows.data.tables.len() as u32),
        ("a cell too few", |plan| shorten(&mut plan.rows.data.cells)),
        ("a step too few", |plan| shorten(&mut plan.rows.data.step_lengths_s)),
        ("forcing cut short", |plan| shorten(&mut plan.rows.data.boundary_forcing)),
        ("weights of sensors cut short", |plan| shorten(&mut plan.rows.data.beads)),
        ("a record too many", |plan| plan.rows.record_at_step[0] = plan.rows.records as u32),
        ("a contact too many", |plan| plan.rows.data.contacts_m2_k_w.push(0.0)),
        ("a state too few", |plan| shorten(&mut plan.rows.data.state_properties)),
        ("a reaction without states", |plan| shorten(&mut plan.rows.reaction_paths)),
        ("a factor that no member has", |plan| plan.rows.plies[0].density = plan.rows.factors as u32 + 1),
        ("a factor of a face that no member has", |plan| plan.rows.face_columns[1].film = u32::MAX),
        ("a sensor behind the last cell", |plan| {
            plan.rows.sensor_locations[0].cell = plan.rows.data.cells.len() as u32;
        }),
        ("a sensor between other plies", |plan| plan.rows.sensor_locations[0].ply_below = plan.rows.plies.len() as u32),
        ("a reaction into another ply's state", |plan| {
            plan.rows.reaction_paths[0].product = plan.rows.max_states as u32;
        }),
    ];

    fn plan(folder: &Path) -> Plan {
        Plan::new(&Case::load(folder).unwrap_or_else(|error| panic!("{error}")))
    }

    #[test]
    fn plans_of_shipped_cases_are_consistent_and_every_spoiled_one_is_refused() {
        let cases = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/cases"));
        let folders = cases.read_dir().expect("cases").map(|entry| entry.expect("an entry").path());
        for folder in folders.filter(|path| path.join("case.toml").exists()) {
            assert_eq!(plan(&folder).check_consistency(), Ok(()), "{}", folder.display());
        }
        let sound = plan(&cases.join("lcat-2259-pyrolysis"));
        for (name, spoil) in SPOILED {
            let mut spoiled = sound.clone();
            spoil(&mut spoiled);
            assert!(spoiled.check_consistency().is_err(), "{name}");
        }
    }
}
