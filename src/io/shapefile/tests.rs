use super::*;
use crate::vector::{Polygon, Shape, Vec2};
use proptest::prelude::*;

/// A file of records, whose header says the length of all of them.
fn file(kind: i32, records: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = vec![0; 100];
    bytes[..4].copy_from_slice(&9994i32.to_be_bytes());
    bytes[28..32].copy_from_slice(&1000i32.to_le_bytes());
    bytes[32..36].copy_from_slice(&kind.to_le_bytes());
    for (number, record) in (1i32..).zip(records) {
        bytes.extend(number.to_be_bytes());
        bytes.extend((record.len() as i32 / 2).to_be_bytes());
        bytes.extend(record);
    }
    let words = bytes.len() as i32 / 2;
    bytes[24..28].copy_from_slice(&words.to_be_bytes());
    bytes
}

fn parts(kind: i32, parts: &[&[Vec2]]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend([0; 32]);
    let count: usize = parts.iter().map(|part| part.len()).sum();
    bytes.extend((parts.len() as i32).to_le_bytes());
    bytes.extend((count as i32).to_le_bytes());
    let mut start = 0i32;
    for part in parts {
        bytes.extend(start.to_le_bytes());
        start += part.len() as i32;
    }
    bytes.extend(
        parts
            .iter()
            .flat_map(|part| part.as_flattened())
            .flat_map(|c| c.to_le_bytes()),
    );
    bytes
}

fn point(x: f64, y: f64) -> Vec<u8> {
    [
        1i32.to_le_bytes().as_slice(),
        &x.to_le_bytes(),
        &y.to_le_bytes(),
    ]
    .concat()
}

fn parsed(bytes: Vec<u8>) -> Result<(Vec<Shape>, Vec<Warning>), Fault> {
    let source = Source::from_bytes("a.shp", bytes).map_err(|e| Fault::whole(e.to_string()))?;
    let mut warnings = Vec::new();
    let layer = read(&source, &mut warnings).map_err(Refusal::fault)?;
    layer.check()?;
    warnings.retain(|warning| warning.code != "no-properties");
    let shapes = layer.features.into_iter().map(|feature| feature.shape);
    Ok((shapes.collect(), warnings))
}

const OUTER: [Vec2; 5] = [[0.0, 0.0], [0.0, 9.0], [9.0, 9.0], [9.0, 0.0], [0.0, 0.0]];
const HOLE: [Vec2; 5] = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0]];
const ISLAND: [Vec2; 4] = [[20.0, 0.0], [20.0, 5.0], [25.0, 0.0], [20.0, 0.0]];

#[test]
fn points_and_lines_are_as_they_stand() {
    let (shapes, warnings) =
        parsed(file(1, &[point(1.0, 2.0), 0i32.to_le_bytes().to_vec()])).expect("shapes");
    assert_eq!(shapes, [Shape::Points(vec![[1.0, 2.0]]), Shape::Empty]);
    assert_eq!(warnings, []);
    let line = parts(3, &[&OUTER[..2], &OUTER[2..3]]);
    let (shapes, warnings) = parsed(file(3, &[line])).expect("shapes");
    assert_eq!(shapes, [Shape::Lines(vec![OUTER[..2].to_vec()])]);
    assert_eq!(warnings[0].code, "short-parts");
}

#[test]
fn holes_go_to_the_ring_around_them() {
    let polygon = |rings: &[&[Vec2]]| Polygon {
        rings: rings
            .iter()
            .map(|ring| ring[..ring.len() - 1].to_vec())
            .collect(),
    };
    let (shapes, warnings) =
        parsed(file(5, &[parts(5, &[&HOLE, &ISLAND, &OUTER])])).expect("shapes");
    assert_eq!(
        shapes,
        [Shape::Polygons(vec![
            polygon(&[&ISLAND]),
            polygon(&[&OUTER, &HOLE])
        ])]
    );
    assert_eq!(warnings, []);
    let (shapes, warnings) = parsed(file(5, &[parts(5, &[&HOLE, &ISLAND])])).expect("shapes");
    assert_eq!(
        shapes,
        [Shape::Polygons(vec![
            polygon(&[&ISLAND]),
            polygon(&[&HOLE])
        ])]
    );
    assert_eq!(warnings[0].code, "holes-in-nothing");
    let (shapes, _) = parsed(file(5, &[parts(5, &[&HOLE])])).expect("shapes");
    assert_eq!(shapes, [Shape::Polygons(vec![polygon(&[&HOLE])])]);
}

#[test]
fn damaged_shapes_are_empty_and_counted() {
    let mut damaged = parts(3, &[&OUTER]);
    damaged[40..44].copy_from_slice(&999i32.to_le_bytes());
    let (shapes, warnings) =
        parsed(file(3, &[parts(3, &[&OUTER]), damaged, parts(3, &[&HOLE])])).expect("shapes");
    assert_eq!(shapes[1], Shape::Empty);
    assert_eq!(shapes[2], Shape::Lines(vec![HOLE.to_vec()]));
    assert_eq!(
        (
            warnings[0].code.as_str(),
            warnings[0].count,
            warnings[0].first
        ),
        ("damaged-shapes", 1, Some(1))
    );
}

#[test]
fn a_lost_end_is_told_of_and_a_wrong_length_refused() {
    let whole = file(3, &[parts(3, &[&OUTER]), parts(3, &[&HOLE])]);
    let (shapes, warnings) = parsed(whole[..whole.len() - 20].to_vec()).expect("shapes");
    assert_eq!((shapes.len(), &shapes[1]), (2, &Shape::Empty));
    assert_eq!(
        (warnings[0].code.as_str(), warnings[0].first),
        ("truncated", Some(1))
    );
    let mut wrong = whole;
    wrong[104..108].copy_from_slice(&0x1000i32.to_be_bytes());
    let fault = parsed(wrong).expect_err("a fault").to_string();
    assert_eq!(
        fault,
        "shape 0: it has 8192 bytes by its header at byte 100, but 264 are left in the file"
    );
}

#[test]
fn tables_have_numbers_text_and_dates() {
    let mut table = vec![3, 126, 1, 1];
    table.extend(2u32.to_le_bytes());
    table.extend((32u16 + 4 * 32 + 1).to_le_bytes());
    table.extend((1u16 + 6 + 5 + 8 + 1).to_le_bytes());
    table.resize(32, 0);
    for (name, kind, width) in [
        ("NAME", b'C', 6),
        ("SIZE", b'N', 5),
        ("DAY", b'D', 8),
        ("OK", b'L', 1),
    ] {
        let mut field = [0; 32];
        field[..name.len()].copy_from_slice(name.as_bytes());
        field[11] = kind;
        field[16] = width;
        table.extend(field);
    }
    table.push(0x0d);
    table.extend(b" Br\xfbde  1.50".iter().chain(b"20261122T"));
    table.extend(b"           3        ?");
    let rows = dbf::read(&table, None).expect("rows");
    let row = |n: usize| serde_json::Value::from(rows[n].clone());
    assert_eq!(
        row(0),
        serde_json::json!({"NAME": "Brûde", "SIZE": 1.5, "DAY": "2026-11-22", "OK": true})
    );
    assert_eq!(
        row(1),
        serde_json::json!({"NAME": null, "SIZE": 3, "DAY": null, "OK": null})
    );
    assert!(dbf::read(&table[..table.len() - 1], None).is_err());
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(at in 0usize..400, byte in any::<u8>(), cut in 0usize..400) {
        let mut bytes = file(5, &[parts(5, &[&OUTER, &HOLE]), point(1.0, 2.0)]);
        let at = at % bytes.len();
        bytes[at] = byte;
        let cut = cut % bytes.len();
        let _ = parsed(bytes[..cut].to_vec());
        let _ = parsed(bytes);
    }
}
