//! ESRI ASCII grids (`.asc`): a header of names and numbers, then heights row by row from the north.
//!
//! Source: ESRI, "Esri ASCII raster format" (ArcGIS documentation); `dx` and `dy` are GDAL's.

use super::refusal::{RAISE, Refusal, expect_room};
use super::source::Source;
use super::{prj, text};
use crate::error::{Fault, number};
use crate::report::Warning;
use crate::terrain::{Grid, Samples, Transform};
use rayon::prelude::*;
use std::io::{self, Write};

/// Whether a text starts as a grid does.
pub fn is_document(text: &[u8]) -> bool {
    let first = text::words(text).next();
    first.is_some_and(|word| {
        [b"ncols".as_slice(), b"nrows"]
            .iter()
            .any(|name| word.eq_ignore_ascii_case(name))
    })
}

/// What the header says.
#[derive(Debug, Default)]
struct Header {
    columns: Option<usize>,
    rows: Option<usize>,
    /// Lower left: the corner, or the centre of the cell there.
    corner: [Option<f64>; 2],
    centre: [Option<f64>; 2],
    size: [Option<f64>; 2],
    nodata: Option<f64>,
    /// Where the heights start.
    end: usize,
    /// The line there, from 1.
    line: u64,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        let mut header = Header::default();
        let mut lines = text::Lines::new(bytes);
        let missing =
            |header: &Header, what| Fault::line(header.line, format!("{what} is missing"));
        loop {
            header.end = bytes.len() - lines.bytes_left();
            header.line = lines.number() + 1;
            let Some(line) = lines.next() else { break };
            let mut words = text::words(line);
            let Some(name) = words.next() else { continue };
            if text::number(name).is_some() {
                break;
            }
            let name = String::from_utf8_lossy(name).to_ascii_lowercase();
            let word = words.next();
            let word =
                word.ok_or_else(|| Fault::line(header.line, format!("{name} has no value")))?;
            header.set(&name, word)?;
        }
        for (what, has) in [("ncols", header.columns), ("nrows", header.rows)] {
            has.ok_or_else(|| missing(&header, what))?;
        }
        Ok(header)
    }

    fn set(&mut self, name: &str, word: &[u8]) -> Result<(), Fault> {
        let line = self.line;
        let value = || text::finite(word, line);
        match name {
            "ncols" | "nrows" => {
                let count = text::integer(word).filter(|n| *n > 0);
                let count = count.and_then(|n| usize::try_from(n).ok());
                let count = count.ok_or_else(|| {
                    let shown = text::shown(word);
                    Fault::line(line, format!("{name} is {shown}, not a number of cells"))
                })?;
                let slot = if name == "ncols" {
                    &mut self.columns
                } else {
                    &mut self.rows
                };
                *slot = Some(count);
            }
            "xllcorner" => self.corner[0] = Some(value()?),
            "yllcorner" => self.corner[1] = Some(value()?),
            "xllcenter" | "xllcentre" => self.centre[0] = Some(value()?),
            "yllcenter" | "yllcentre" => self.centre[1] = Some(value()?),
            "dx" => self.size[0] = Some(value()?),
            "dy" => self.size[1] = Some(value()?),
            "cellsize" => self.size = [Some(value()?); 2],
            // A NaN never is a height, so that it need not be kept.
            "nodata_value" | "nodata" => {
                self.nodata = text::number(word).filter(|value| value.is_finite());
            }
            _ => {
                let shown = text::shown(name.as_bytes());
                let problem = format!("{shown} is no word of the header of a grid");
                return Err(Fault::line(line, problem));
            }
        }
        Ok(())
    }

    fn transform(&self, rows: usize) -> Result<Transform, Fault> {
        let fault = |problem: String| Fault::line(self.line, problem);
        let mut size = [0.0; 2];
        let mut low = [0.0; 2];
        for (axis, name) in ["x", "y"].into_iter().enumerate() {
            let own = self.size[axis];
            size[axis] = own.ok_or_else(|| fault(format!("cellsize or d{name} is missing")))?;
            if size[axis] <= 0.0 {
                let said = number(size[axis]);
                return Err(fault(format!("cells of size {said} have no area")));
            }
            low[axis] = match (self.corner[axis], self.centre[axis]) {
                (Some(corner), _) => corner,
                (None, Some(centre)) => centre - 0.5 * size[axis],
                (None, None) => {
                    let problem = format!("{name}llcorner or {name}llcenter is missing");
                    return Err(fault(problem));
                }
            };
        }
        let top = low[1] + rows as f64 * size[1];
        Ok(Transform::north_up([low[0], top], size))
    }
}

/// Reads a grid; numbers may be parted and broken into lines by any white space.
///
/// Heights are held in 16 bits, in single or in double precision, whichever first holds all exactly. The
/// reference system is that of a `.prj` file beside, if there is one. Errs, with the line, where a
/// word is no number, or heights are missing. Cost: linear, on all threads; 8 bytes of a height are held
/// while it is read.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Grid, Refusal> {
    let bytes = source.bytes();
    let header = Header::parse(bytes)?;
    let (columns, rows) = (header.columns.unwrap_or(0), header.rows.unwrap_or(0));
    let cells = columns as u128 * rows as u128;
    let body = &bytes[header.end..];
    // Each takes a digit and a blank, the last one a digit.
    if cells > (body.len() as u128).div_ceil(2) {
        let problem = format!(
            "{columns} x {rows} heights are claimed, which {} bytes cannot hold",
            body.len()
        );
        return Err(Fault::line(header.line, problem).into());
    }
    let what = || format!("a grid of {columns} x {rows} cells");
    expect_room(what, cells * 12, source.limit(), RAISE)?;
    let transform = header.transform(rows)?;
    let values = values(body, header.line, columns * rows, warnings)?;
    let samples = Samples::narrowest(values);
    let nodata = header.nodata.map(|value| match &samples {
        Samples::F32(_) => f64::from(value as f32),
        _ => value,
    });
    Ok(Grid {
        columns,
        rows,
        transform,
        samples,
        nodata,
        crs: prj::beside(source, warnings),
    })
}

/// Text is parted here, at the next white space, for the threads.
const PART: usize = 1 << 20;

fn values(
    body: &[u8],
    line: u64,
    count: usize,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<f64>, Fault> {
    let mut parts = Vec::new();
    let mut rest = body;
    while !rest.is_empty() {
        let from = PART.min(rest.len());
        let more = rest[from..].iter().position(|b| *b <= b' ');
        let (part, after) = rest.split_at(more.map_or(rest.len(), |n| from + n));
        parts.push(part);
        rest = after;
    }
    let numbers = |part: &&[u8]| -> Result<Vec<f64>, usize> {
        let words = text::words(part);
        let start = part.as_ptr() as usize;
        let value = |word: &[u8]| {
            let value = text::number(word);
            value.ok_or(word.as_ptr() as usize - start)
        };
        words.map(value).collect()
    };
    let read: Vec<_> = parts.par_iter().map(numbers).collect();
    let mut all = Vec::with_capacity(count);
    let mut before = 0;
    for (part, numbers) in parts.iter().zip(read) {
        match numbers {
            Ok(numbers) => all.extend(numbers),
            Err(at) => {
                let wrong = before + at;
                let lines = body[..wrong].iter().filter(|b| **b == b'\n').count() as u64;
                let word = text::words(&body[wrong..]).next().unwrap_or_default();
                let problem = format!("{} is not a number", text::shown(word));
                return Err(Fault::line(line + lines, problem));
            }
        }
        before += part.len();
    }
    if all.len() < count {
        let problem = format!("has {} heights, but {count} are needed", all.len());
        return Err(Fault::whole(problem));
    }
    let more = all.len() - count;
    if more > 0 {
        let message = "numbers after the last height; not read";
        warnings.push(Warning::new("trailing-data", message, more as u64, None));
        all.truncate(count);
    }
    Ok(all)
}

/// Why a grid cannot be written, if it cannot: only rasters along the axes of the map can.
pub fn refusal(grid: &Grid) -> Option<String> {
    let is_straight = grid.transform.is_north_up();
    (!is_straight).then(|| "holds rasters along the axes of the map only".to_owned())
}

/// Writes a grid, a row on a line, with the shortest digits that read back; the reference system is left
/// out.
///
/// Cells without a height that are not of the value for such are written as -9999, or the next lower
/// number that is no height.
pub fn write(grid: &Grid, out: &mut dyn Write) -> io::Result<()> {
    let Transform { across, down, .. } = grid.transform;
    let low = grid.transform.place(0.0, grid.rows as f64);
    let nodata = grid.nodata.unwrap_or_else(|| {
        let lowest = grid.heights().map_or(0.0, |[low, _]| low);
        if lowest > -9999.0 {
            -9999.0
        } else {
            lowest.floor() - 1.0
        }
    });
    let size = match (across[0], -down[1]) {
        (wide, high) if wide == high => format!("cellsize {}", number(wide)),
        (wide, high) => format!("dx {}\ndy {}", number(wide), number(high)),
    };
    writeln!(
        out,
        "ncols {}\nnrows {}\nxllcorner {}\nyllcorner {}\n{size}\nNODATA_value {}",
        grid.columns,
        grid.rows,
        number(low[0]),
        number(low[1]),
        number(nodata)
    )?;
    let mut line = Vec::new();
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            if column > 0 {
                line.push(b' ');
            }
            text::push_number(&mut line, grid.height(column, row).unwrap_or(nodata));
        }
        line.push(b'\n');
        text::spill(&mut line, out)?;
    }
    out.write_all(&line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<(Grid, Vec<Warning>), Fault> {
        let source =
            Source::from_bytes("a.asc", text.into()).map_err(|e| Fault::whole(e.to_string()))?;
        let mut warnings = Vec::new();
        let grid = read(&source, &mut warnings).map_err(Refusal::fault)?;
        Ok((grid, warnings))
    }

    #[test]
    fn corners_and_centres_and_any_white_space() {
        let corner =
            "NCOLS 3\r\nnrows\t2\r\nxllcorner 10\r\nyllcorner 20\r\ncellsize 2\r\n1 2\r\n3 4\t5 6";
        let centre = "ncols 3\nnrows 2\nxllcenter 11\nyllcenter 21\ndx 2\ndy 2\nNODATA_value 4\n1 2 3 4 5 6\n";
        let (a, warnings) = parsed(corner).expect("a grid");
        assert_eq!(a.transform, Transform::north_up([10.0, 24.0], [2.0, 2.0]));
        assert_eq!(a.samples, Samples::I16(vec![1, 2, 3, 4, 5, 6]));
        assert_eq!(warnings, []);
        let (b, _) = parsed(centre).expect("a grid");
        assert_eq!((b.transform, b.height(0, 1)), (a.transform, None));
        assert_eq!(b.heights(), Some([1.0, 6.0]));
    }

    #[test]
    fn what_is_written_comes_back() {
        let text = "ncols 2\nnrows 2\nxllcorner 0.1\nyllcorner -3\ndx 1.5\ndy 1\nnodata nan\n0.1 nan 7e20 -0.25";
        let (grid, _) = parsed(text).expect("a grid");
        assert!(matches!(grid.samples, Samples::F64(_)));
        let mut bytes = Vec::new();
        write(&grid, &mut bytes).expect("room");
        let written = String::from_utf8(bytes).expect("text");
        let (back, _) = parsed(&written).expect("a grid");
        assert_eq!(back.nodata, Some(-9999.0));
        assert_eq!(back.transform, grid.transform);
        for (column, row) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            assert_eq!(back.height(column, row), grid.height(column, row));
        }
    }

    #[test]
    fn faults_say_the_line_and_the_numbers() {
        let head = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
        let message = |text: String| parsed(&text).expect_err("a fault").to_string();
        assert_eq!(
            message(format!("{head}1 2\n3 x\n")),
            "7: \"x\" is not a number"
        );
        assert_eq!(
            message(format!("{head}1 2\n   3\n")),
            "has 3 heights, but 4 are needed"
        );
        assert_eq!(
            message(format!("{head}1 2")),
            "6: 2 x 2 heights are claimed, which 3 bytes cannot hold"
        );
        assert_eq!(
            message("ncols 0\n".into()),
            "1: ncols is \"0\", not a number of cells"
        );
        assert_eq!(message("ncols 2\n1 2".into()), "2: nrows is missing");
        assert_eq!(
            message(head.replace("cellsize 1", "cellsize 0") + "1 2 3 4"),
            "6: cells of size 0 have no area"
        );
        assert_eq!(
            message(head.replace("xllcorner 0\n", "") + "1 2 3 4"),
            "5: xllcorner or xllcenter is missing"
        );
        let (_, warnings) = parsed(&format!("{head}1 2 3 4 5 6")).expect("a grid");
        assert_eq!(
            (warnings[0].code.as_str(), warnings[0].count),
            ("trailing-data", 2)
        );
    }
}
