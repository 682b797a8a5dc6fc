//! The table `virgin` or `char` of a material of PATO.

use super::Property;
use crate::case::error::{Diagnostics, ErrorReported, ReadResult, SourceLocation};
use std::sync::Arc;

/// The columns: p, T, c_p, h, k_i, k_j, k_k, emissivity and absorptivity.
const COLUMNS: usize = 9;
const HEAT_CAPACITY: usize = 2;
const ENTHALPY: usize = 3;
const CONDUCTIVITY: usize = 4;
const EMISSIVITY: usize = 7;

type Row = [f64; COLUMNS];

/// Rows at one pressure, by increasing temperature.
type Block = Vec<Row>;

/// Rows of properties, in blocks of increasing pressure.
pub(super) struct StateTable {
    file: Arc<str>,
    blocks: Vec<Block>,
}

impl StateTable {
    /// # Errors
    /// A row of other than nine finite numbers; temperatures that do not increase at a pressure; no row.
    pub(super) fn parse(text: &str, label: &str, diagnostics: &Diagnostics) -> ReadResult<Self> {
        let file: Arc<str> = label.into();
        let mut blocks: Vec<Block> = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let fault = |message: String| -> ErrorReported {
                diagnostics.record(
                    &SourceLocation { file: file.clone(), sheet: None, line_column: Some((index + 1, 1)) },
                    message,
                )
            };
            let code = line.split("//").next().unwrap_or_default().trim();
            if code.is_empty() {
                continue;
            }
            let numbers: Vec<f64> = code.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let row = Row::try_from(numbers).ok().filter(|row| row.iter().all(|number| number.is_finite()));
            let is_complete = code.split_whitespace().count() == COLUMNS;
            let expected = "expected nine numbers: p, T, c_p, h, k_i, k_j, k_k, emissivity, absorptivity";
            let row = row.filter(|_| is_complete).ok_or_else(|| fault(format!("{expected}; found {code:?}")))?;
            let at = blocks.iter_mut().find(|block| block[0][0] == row[0]);
            match at {
                Some(block) if block[block.len() - 1][1] >= row[1] => {
                    let last_k = block[block.len() - 1][1];
                    return Err(fault(format!("expected a temperature above {last_k} K, found {} K", row[1])));
                }
                Some(block) => block.push(row),
                None => blocks.push(vec![row]),
            }
        }
        if blocks.is_empty() {
            return Err(diagnostics.record(&SourceLocation::without_line(file), "the table has no row"));
        }
        blocks.sort_by(|a, b| a[0][0].total_cmp(&b[0][0]));
        Ok(Self { file, blocks })
    }

    pub(super) fn label(&self) -> Arc<str> {
        self.file.clone()
    }

    /// The temperatures of the first block, K.
    pub(super) fn range_k(&self) -> (f64, f64) {
        let block = &self.blocks[0];
        (block[0][1], block[block.len() - 1][1])
    }

    fn property(block: &Block, column: usize, factor: f64) -> Property {
        let values: Vec<f64> = block.iter().map(|row| factor * row[column]).collect();
        if values.iter().all(|value| *value == values[0]) && column == EMISSIVITY {
            return Property::Constant(values[0]);
        }
        Property::Table { temperatures_k: block.iter().map(|row| row[1]).collect(), values }
    }

    /// A property that is the same at all pressures.
    fn of_all_pressures(&self, column: usize, name: &str, diagnostics: &Diagnostics) -> ReadResult<Property> {
        let property = Self::property(&self.blocks[0], column, 1.0);
        match self.blocks.iter().find(|block| Self::property(block, column, 1.0) != property) {
            None => Ok(property),
            Some(block) => {
                let (one_pa, other_pa) = (self.blocks[0][0][0], block[0][0]);
                let message =
                    format!("{name} at {one_pa} Pa and at {other_pa} Pa differ: expected values of temperature alone");
                Err(diagnostics.record(&SourceLocation::without_line(self.label()), message))
            }
        }
    }

    pub(super) fn heat_capacity(&self, diagnostics: &Diagnostics) -> ReadResult<Property> {
        self.of_all_pressures(HEAT_CAPACITY, "the heat capacity", diagnostics)
    }

    pub(super) fn emissivity(&self, diagnostics: &Diagnostics) -> ReadResult<Property> {
        self.of_all_pressures(EMISSIVITY, "the emissivity", diagnostics)
    }

    /// Pressure and conductivity of each block in a direction, times a factor; one entry if all blocks are equal.
    pub(super) fn conductivity(
        &self,
        direction: Option<usize>,
        factor: f64,
        diagnostics: &Diagnostics,
    ) -> ReadResult<Vec<(f64, Property)>> {
        let differs =
            |row: &&Row| row[CONDUCTIVITY] != row[CONDUCTIVITY + 1] || row[CONDUCTIVITY] != row[CONDUCTIVITY + 2];
        if direction.is_none()
            && let Some(row) = self.blocks.iter().flatten().find(differs)
        {
            let [temperature_k, i, j, k] = [1, CONDUCTIVITY, CONDUCTIVITY + 1, CONDUCTIVITY + 2].map(|at| row[at]);
            let message = format!(
                "the conductivities {i}, {j} and {k} W/m/K at {temperature_k} K differ: state the direction through \
                 the thickness"
            );
            return Err(diagnostics.record(&SourceLocation::without_line(self.label()), message));
        }
        let column = CONDUCTIVITY + direction.unwrap_or(0);
        let of_blocks = self.blocks.iter().map(|block| (block[0][0], Self::property(block, column, factor)));
        let mut tables: Vec<(f64, Property)> = of_blocks.collect();
        if tables.iter().all(|table| table.1 == tables[0].1) {
            tables.truncate(1);
        }
        Ok(tables)
    }

    /// A column at a temperature within the table, linear between its rows.
    fn at(&self, column: usize, temperature_k: f64) -> f64 {
        let block = &self.blocks[0];
        let next = block.partition_point(|row| row[1] <= temperature_k).clamp(1, (block.len() - 1).max(1));
        let (Some(above), Some(below)) = (block.get(next), block.get(next - 1)) else { return block[0][column] };
        let fraction = (temperature_k - below[1]) / (above[1] - below[1]);
        below[column] + fraction * (above[column] - below[column])
    }

    /// Enthalpy at a temperature within the table, J/kg.
    pub(super) fn enthalpy_j_kg(&self, temperature_k: f64) -> f64 {
        self.at(ENTHALPY, temperature_k)
    }

    /// The largest difference between the enthalpy and the integral of the heat capacity from a reference temperature,
    /// J/kg, and its temperature, K.
    pub(super) fn enthalpy_drift(&self, reference_k: f64) -> (f64, f64) {
        let block = &self.blocks[0];
        let heat_capacity = |temperature_k| self.at(HEAT_CAPACITY, temperature_k);
        // The integral from the first row, by the trapezoidal rule, exact for a piecewise linear heat capacity.
        let integral = |temperature_k: f64| {
            let ends = block.iter().map(|row| row[1]).filter(|&end_k| end_k < temperature_k).chain([temperature_k]);
            let ends_k: Vec<f64> = ends.collect();
            let part = |pair: &[f64]| 0.5 * (heat_capacity(pair[0]) + heat_capacity(pair[1])) * (pair[1] - pair[0]);
            ends_k.windows(2).map(part).sum::<f64>()
        };
        let start_j_kg = self.enthalpy_j_kg(reference_k) - integral(reference_k);
        let drifts = block.iter().map(|row| ((row[ENTHALPY] - start_j_kg - integral(row[1])).abs(), row[1]));
        drifts.fold((0.0, reference_k), |most, drift| if drift.0 > most.0 { drift } else { most })
    }
}
