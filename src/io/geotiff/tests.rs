use super::*;
use crate::terrain::{Samples, Transform};
use crate::vector::crs::Crs;
use proptest::prelude::*;

fn parsed(bytes: &[u8]) -> Result<(Grid, Vec<Warning>), Fault> {
    let source =
        Source::from_bytes("a.tif", bytes.to_vec()).map_err(|e| Fault::whole(e.to_string()))?;
    let mut warnings = Vec::new();
    let grid = read(&source, &mut warnings).map_err(Refusal::fault)?;
    grid.check()?;
    Ok((grid, warnings))
}

fn written(grid: &Grid) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(grid, &mut bytes).expect("room");
    bytes
}

fn grid(columns: usize, rows: usize, samples: Samples) -> Grid {
    Grid {
        columns,
        rows,
        transform: Transform::north_up([969491.25, 6250297.0], [82.0, 81.5]),
        samples,
        nodata: Some(-9999.0),
        crs: Some(Crs::from_epsg(32733)),
    }
}

#[test]
fn what_is_written_comes_back() {
    let heights = |n: usize| (0..n).map(|i| (i as f64 * 0.37).sin() * 900.0 - 10.0);
    let kinds = [
        Samples::I16(heights(300 * 700).map(|h| h as i16).collect()),
        Samples::F32(heights(300 * 700).map(|h| h as f32).collect()),
        Samples::F64(heights(300 * 700).collect()),
    ];
    for samples in kinds {
        let grid = grid(300, 700, samples);
        let (back, warnings) = parsed(&written(&grid)).expect("a grid");
        assert_eq!(back, grid);
        assert_eq!(warnings, []);
    }
}

#[test]
fn a_turned_raster_and_one_in_degrees_keep_their_place() {
    let mut turned = grid(2, 2, Samples::F32(vec![1.0, 2.0, f32::NAN, 4.0]));
    turned.transform.across = [3.0, 1.0];
    turned.transform.down = [0.5, -3.0];
    turned.nodata = None;
    let (back, _) = parsed(&written(&turned)).expect("a grid");
    assert_eq!(back.transform, turned.transform);
    assert_eq!((back.height(0, 1), back.height(1, 1)), (None, Some(4.0)));
    let mut degrees = grid(1, 1, Samples::I16(vec![7]));
    degrees.crs = Some(Crs::lon_lat());
    assert_eq!(
        parsed(&written(&degrees)).expect("a grid").0.crs,
        degrees.crs
    );
    degrees.crs = None;
    assert_eq!(parsed(&written(&degrees)).expect("a grid").0.crs, None);
}

#[test]
fn pixels_that_are_points_are_centres() {
    let whole = grid(3, 2, Samples::I16(vec![1, 2, 3, 4, 5, 6]));
    let mut bytes = written(&whole);
    // The entry of the raster type: key 1025 in its own tag, one value, 1 for areas.
    let entry = [1, 4, 0, 0, 1, 0, 1, 0];
    let at = bytes.windows(8).position(|w| w == entry).expect("the key");
    bytes[at + 6] = 2;
    let (points, _) = parsed(&bytes).expect("a grid");
    assert_eq!(points.centre(0, 0), whole.transform.origin);
}

#[test]
fn masks_are_whole_numbers() {
    let numbers: Vec<u16> = (0..600).map(|i| i * 109).collect();
    let mask = Raster {
        columns: 30,
        rows: 20,
        transform: Transform::north_up([0.0, 20.0], [1.0, 1.0]),
        cells: Cells::U16(&numbers),
        nodata: None,
        crs: None,
    };
    let mut bytes = Vec::new();
    write_raster(&mask, &mut bytes).expect("room");
    let (back, _) = parsed(&bytes).expect("a grid");
    let wanted = numbers.iter().map(|n| f32::from(*n)).collect();
    assert_eq!(back.samples, Samples::F32(wanted));
    let bytes_of = |cells| {
        let mut bytes = Vec::new();
        write_raster(&Raster { cells, ..mask }, &mut bytes).expect("room");
        parsed(&bytes).expect("a grid").0.samples
    };
    assert_eq!(
        bytes_of(Cells::U8(&[255; 600])),
        Samples::I16(vec![255; 600])
    );
    let large = [16_777_217; 600];
    assert_eq!(
        bytes_of(Cells::U32(&large)),
        Samples::F64(vec![16_777_217.0; 600])
    );
}

#[test]
fn what_a_header_claims_is_held_against_the_file() {
    let bytes = written(&grid(4, 4, Samples::I16(vec![0; 16])));
    let mut wide = bytes.clone();
    // The value of the first tag, the width.
    wide[18..22].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
    let fault = parsed(&wide).expect_err("a fault").to_string();
    assert!(fault.contains("2147483647 x 4 cells"), "{fault}");
    assert!(parsed(&bytes[..bytes.len() - 3]).is_err());
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(at in 0usize..420, byte in any::<u8>(), cut in 0usize..420) {
        let mut bytes = written(&grid(5, 3, Samples::F32(vec![1.5; 15])));
        let at = at % bytes.len();
        bytes[at] = byte;
        let _ = parsed(&bytes);
        let cut = cut % bytes.len();
        let _ = parsed(&bytes[..cut]);
    }
}
