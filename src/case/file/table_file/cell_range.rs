//! Ranges of cells of a sheet.

/// Rows and columns of a sheet, by the format.
const SHEET_ROWS: u32 = 1 << 20;
const SHEET_COLUMNS: u32 = 1 << 14;

/// A rectangle of cells: first and last row and column, counted from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellRange {
    pub(super) rows: (u32, u32),
    pub(super) columns: (u32, u32),
}

impl CellRange {
    pub(super) const ALL: Self = Self { rows: (0, SHEET_ROWS - 1), columns: (0, SHEET_COLUMNS - 1) };

    /// `B4:N2000`, or `B:N` for all rows.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected a range such as \"B4:N2000\" or \"B:N\", found {text:?}");
        let corners = text.split_once(':').and_then(|(from, to)| Some((corner(from)?, corner(to)?)));
        let ((first_column, first_row), (last_column, last_row)) = corners.ok_or_else(wrong)?;
        let rows = match (first_row, last_row) {
            (Some(first), Some(last)) => (first, last),
            (None, None) => Self::ALL.rows,
            _ => return Err(wrong()),
        };
        if rows.0 > rows.1 || first_column > last_column {
            return Err(format!("expected a range from its upper left to its lower right cell, found {text:?}"));
        }
        Ok(Self { rows, columns: (first_column, last_column) })
    }
}

/// Column and row of `B4` or `$B$4`, from zero; `B` has no row.
fn corner(text: &str) -> Option<(u32, Option<u32>)> {
    let plain = text.trim().replace('$', "");
    let (letters, digits) = plain.split_at(plain.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(plain.len()));
    if letters.is_empty() || letters.len() > 3 || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let place = |letter: u8| u32::from(letter.to_ascii_uppercase() - b'A') + 1;
    let column = letters.bytes().fold(0, |column, letter| 26 * column + place(letter)) - 1;
    let row = if digits.is_empty() { None } else { Some(digits.parse::<u32>().ok()?.checked_sub(1)?) };
    (column < SHEET_COLUMNS && row.is_none_or(|row| row < SHEET_ROWS)).then_some((column, row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_two_corners_of_a_sheet() {
        let range = |text| CellRange::parse(text).map(|range| (range.rows, range.columns));
        assert_eq!(range("B4:N2000"), Ok(((3, 1999), (1, 13))));
        assert_eq!(range("$b$4:$n$2000"), range("B4:N2000"));
        assert_eq!(range("B:XFD"), Ok((CellRange::ALL.rows, (1, SHEET_COLUMNS - 1))));
        for wrong in ["", "B4", "B4:N", "4:5", "B0:C2", "N4:B9", "B9:N4", "A1:XFE2", "A1:B1048577", "A1:B-2", "Ä1:B2"]
        {
            assert!(range(wrong).is_err_and(|message| message.contains("expected a range")), "{wrong}");
        }
    }
}
