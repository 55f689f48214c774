//! Tables: aligned for people, comma-separated for programs.

use serde_json::Value;

/// Rows of text under headings.
#[derive(Debug, Default)]
pub struct Table {
    /// A heading per column.
    pub headings: Vec<String>,
    /// As many cells in each row as there are headings.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// As comma-separated values (RFC 4180), headings first.
    pub fn csv(&self) -> Vec<u8> {
        let mut text = String::new();
        for row in std::iter::once(&self.headings).chain(&self.rows) {
            let cells: Vec<String> = row.iter().map(|cell| csv_cell(cell)).collect();
            text.push_str(&cells.join(","));
            text.push_str("\r\n");
        }
        text.into_bytes()
    }

    /// In columns: what is a number stands to the right.
    pub fn aligned(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| row[column].chars().count());
            cells.max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.headings.len())
            .map(|column| width(column).max(self.headings[column].chars().count()))
            .collect();
        let is_number: Vec<bool> = (0..self.headings.len())
            .map(|column| {
                let starts = |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit());
                let mut filled = self.rows.iter().map(|row| &row[column]);
                filled.clone().any(starts) && filled.all(|c| starts(c) || c.is_empty() || c == "-")
            })
            .collect();
        let mut text = String::new();
        for row in std::iter::once(&self.headings).chain(&self.rows) {
            let mut line = String::new();
            for (column, cell) in row.iter().enumerate() {
                let width = widths[column];
                let gap = " ".repeat(width - cell.chars().count());
                let (before, after) = if is_number[column] {
                    (gap, String::new())
                } else {
                    (String::new(), gap)
                };
                line.push_str(&before);
                line.push_str(cell);
                line.push_str(&after);
                line.push_str("  ");
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}

fn csv_cell(cell: &str) -> String {
    if cell.contains([',', '"', '\r', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// A value of a report in a cell: words without quotes, nothing for null.
pub fn plain(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A figure in four digits, for people.
pub fn short(figure: f64) -> String {
    let size = figure.abs();
    if figure == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{figure:.3e}")
    } else {
        let whole = size.log10().floor() as i32;
        let digits = (3 - whole).max(0) as usize;
        format!("{figure:.digits$}")
    }
}

/// A number of bytes in its binary unit, for people.
pub fn bytes(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["KiB", "MiB", "GiB", "TiB"];
    let mut amount = bytes as f64 / 1024.0;
    let mut unit = 0;
    while amount >= 1024.0 && unit + 1 < UNITS.len() {
        amount /= 1024.0;
        unit += 1;
    }
    format!("{amount:.1} {}", UNITS[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let row = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
        Table {
            headings: row(["name", "n"]),
            rows: vec![row(["a,b", "1"]), row(["say \"x\"", "100"])],
        }
    }

    #[test]
    fn cells_are_quoted_as_the_rfc_says() {
        let wanted = "name,n\r\n\"a,b\",1\r\n\"say \"\"x\"\"\",100\r\n";
        assert_eq!(table().csv(), wanted.as_bytes());
    }

    #[test]
    fn columns_are_aligned_and_numbers_stand_to_the_right() {
        let wanted = "name       n\na,b        1\nsay \"x\"  100\n";
        assert_eq!(table().aligned(), wanted);
    }

    #[test]
    fn figures_have_four_digits() {
        let figures = [0.0, 0.012345, 1.5, 123.456, 99999.0, 1e9, 1e-9];
        let shown = figures.map(short);
        let wanted = [
            "0", "0.01235", "1.500", "123.5", "99999", "1.000e9", "1.000e-9",
        ];
        assert_eq!(shown, wanted);
        assert_eq!(bytes(3 << 20), "3.0 MiB");
    }
}
