//! dBASE tables: what is said of the shapes of a shapefile.
//!
//! Source: dBASE III and IV file structures (Ashton-Tate), as ESRI's technical description uses them.

use crate::error::Fault;
use serde_json::{Map, Number, Value};

/// A column.
struct Field {
    name: String,
    kind: u8,
    start: usize,
    end: usize,
}

/// Reads all rows, each as names with values; those that are marked as deleted too, as shapes have no mark.
///
/// Numbers, truth values and dates (`2026-11-22`) are told by the kind of the column; blanks are null. Text
/// is UTF-8 where it can be, and else Latin 1, or what the `.cpg` file says of the two. Errs where the
/// header is damaged or the rows claimed are not there. Cost: linear.
pub fn read(bytes: &[u8], page: Option<&[u8]>) -> Result<Vec<Map<String, Value>>, Fault> {
    let short = |at| u16::from_le_bytes([bytes[at], bytes[at + 1]]).into();
    if bytes.len() < 33 {
        let has = bytes.len();
        return Err(Fault::whole(format!(
            "has {has} bytes, but its header takes 33"
        )));
    }
    let claimed = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]) as usize;
    let (header, width): (usize, usize) = (short(8), short(10));
    let page = page.map(|page| String::from_utf8_lossy(page).to_ascii_lowercase());
    let is_latin = page.is_some_and(|page| page.contains("8859") || page.contains("1252"));
    let fields = fields(bytes, header, width, is_latin)?;
    let rows = bytes.get(header..).unwrap_or_default();
    let rows: Vec<&[u8]> = rows.chunks_exact(width.max(1)).take(claimed).collect();
    if rows.len() < claimed {
        let has = rows.len();
        return Err(Fault::whole(format!(
            "has {has} rows, but claims {claimed}"
        )));
    }
    let row = |row: &[u8]| {
        let values = fields.iter().map(|field| {
            let cell = &row[field.start..field.end];
            (field.name.clone(), value(field.kind, cell, is_latin))
        });
        values.collect()
    };
    Ok(rows.into_iter().map(row).collect())
}

fn fields(bytes: &[u8], header: usize, width: usize, is_latin: bool) -> Result<Vec<Field>, Fault> {
    let mut fields = Vec::new();
    let mut start = 1;
    let described = bytes.get(32..header.min(bytes.len())).unwrap_or_default();
    for entry in described.chunks_exact(32) {
        if entry[0] == 0x0d {
            break;
        }
        let name = entry[..11].split(|b| *b == 0).next().unwrap_or_default();
        let end = start + usize::from(entry[16]);
        fields.push(Field {
            name: text(name, is_latin),
            kind: entry[11],
            start,
            end,
        });
        start = end;
    }
    if start > width || fields.is_empty() {
        let problem = format!("has columns of {start} bytes, but rows of {width}");
        return Err(Fault::whole(problem));
    }
    Ok(fields)
}

fn value(kind: u8, cell: &[u8], is_latin: bool) -> Value {
    let cell = cell.trim_ascii_end();
    let word = cell.trim_ascii_start();
    if word.is_empty() || word.iter().all(|b| *b == 0 || *b == b'*') {
        return Value::Null;
    }
    match kind {
        b'N' | b'F' => number(word).unwrap_or_else(|| Value::from(text(word, is_latin))),
        b'L' => match word[0].to_ascii_uppercase() {
            b'T' | b'Y' => Value::from(true),
            b'F' | b'N' => Value::from(false),
            _ => Value::Null,
        },
        b'D' => match word {
            [_, _, _, _, _, _, _, _] if word.iter().all(u8::is_ascii_digit) => {
                let date = text(word, is_latin);
                Value::from(format!("{}-{}-{}", &date[..4], &date[4..6], &date[6..]))
            }
            _ => Value::from(text(word, is_latin)),
        },
        _ => Value::from(text(cell, is_latin).trim_end_matches('\0')),
    }
}

fn number(word: &[u8]) -> Option<Value> {
    let word = std::str::from_utf8(word).ok()?;
    if let Ok(whole) = word.parse::<i64>() {
        return Some(Value::from(whole));
    }
    let value: f64 = word.parse().ok()?;
    Number::from_f64(value).map(Value::Number)
}

fn text(bytes: &[u8], is_latin: bool) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) if !is_latin => text.to_owned(),
        _ => bytes.iter().map(|b| char::from(*b)).collect(),
    }
}
