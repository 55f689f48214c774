//! HGT: a square degree of the Shuttle Radar Topography Mission, whose name says where it is.
//!
//! Samples are 16-bit with a sign, big endian, row by row from the north; the outermost stand on the
//! degrees themselves. -32768 is no height. Source: USGS and NASA, "SRTM Topography", section 2.

use super::geojson::stem;
use super::refusal::Refusal;
use super::source::Source;
use crate::error::Fault;
use crate::terrain::{Grid, Samples, Transform};
use crate::vector::crs::Crs;

/// Reads a tile of 1201 or 3601 samples on a side, or of any other number.
///
/// Errs where the name is none like `N46E008.hgt`, or the size is of no square.
pub fn read(source: &Source) -> Result<Grid, Refusal> {
    let bytes = source.bytes();
    let name = stem(source);
    let place = south_west(&name).ok_or_else(|| {
        let problem = format!("its name is {name:?}, which does not say where it is");
        Fault::whole(problem).with_hint("name it for its south west corner: N46E008.hgt")
    })?;
    let (samples, odd) = bytes.as_chunks::<2>();
    let side = samples.len().isqrt();
    if side < 2 || side * side != samples.len() || !odd.is_empty() {
        let problem = format!("{} bytes are no square of 16-bit samples", bytes.len());
        return Err(Fault::whole(problem).into());
    }
    let step = 1.0 / (side - 1) as f64;
    let corner = [place[0] - 0.5 * step, place[1] + 1.0 + 0.5 * step];
    Ok(Grid {
        columns: side,
        rows: side,
        transform: Transform::north_up(corner, [step; 2]),
        samples: Samples::I16(samples.iter().map(|s| i16::from_be_bytes(*s)).collect()),
        nodata: Some(-32768.0),
        crs: Some(Crs::lon_lat()),
    })
}

/// The longitude and latitude in a name like `S34E020`.
fn south_west(name: &str) -> Option<[f64; 2]> {
    let sign = |letter: &str, plus: &str, minus: &str| match letter {
        l if l.eq_ignore_ascii_case(plus) => Some(1.0),
        l if l.eq_ignore_ascii_case(minus) => Some(-1.0),
        _ => None,
    };
    let degrees = |digits: &str, most: f64| {
        let number: f64 = digits.parse::<u16>().ok()?.into();
        (number <= most).then_some(number)
    };
    let north = sign(name.get(..1)?, "N", "S")? * degrees(name.get(1..3)?, 90.0)?;
    let east = sign(name.get(3..4)?, "E", "W")? * degrees(name.get(4..7)?, 180.0)?;
    Some([east, north])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_stands_where_its_name_says() {
        let bytes: Vec<u8> = [10i16, 20, 30, -32768]
            .iter()
            .flat_map(|h| h.to_be_bytes())
            .collect();
        let source = Source::from_bytes("x/S34E020.hgt", bytes.clone()).expect("a source");
        let grid = read(&source).expect("a tile");
        assert_eq!(grid.centre(0, 1), [20.0, -34.0]);
        assert_eq!(grid.centre(1, 0), [21.0, -33.0]);
        assert_eq!((grid.height(0, 0), grid.height(1, 1)), (Some(10.0), None));
        for (name, bytes) in [
            ("tile.hgt", bytes.clone()),
            ("N91E000.hgt", bytes.clone()),
            ("S34E020.hgt", bytes[1..].to_vec()),
        ] {
            let source = Source::from_bytes(name, bytes).expect("a source");
            assert!(read(&source).is_err(), "{name}");
        }
    }
}
