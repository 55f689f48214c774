use super::*;
use proptest::prelude::*;

fn source(bytes: &[u8]) -> Source {
    Source::from_bytes("test.pcd", bytes.to_vec()).expect("no gzip layer")
}

fn read_bytes(bytes: &[u8]) -> Result<(Mesh, Vec<Warning>), Fault> {
    let mut warnings = Vec::new();
    let mesh = read(&source(bytes), &mut warnings).map_err(Refusal::fault)?;
    Ok((mesh, warnings))
}

fn message(bytes: &[u8]) -> String {
    read_bytes(bytes).expect_err("a fault").to_string()
}

const HEADER: &str = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n\
    FIELDS x y z _ normal_x normal_y normal_z rgb intensity label\n\
    SIZE 4 4 8 1 4 4 4 4 4 2\nTYPE F I F U F F F F F U\nCOUNT 1 1 1 3 1 1 1 1 2 1\n\
    WIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\n";

/// Four points of many fields: of each its numbers, and its colour.
fn rows() -> Vec<([f64; 3], [f32; 3], u32)> {
    (0..4u8)
        .map(|i| {
            let position = [f64::from(i) + 0.5, f64::from(i) - 7.0, 0.1 * f64::from(i)];
            let normal = [0.0, f32::from(i), -1.0];
            (position, normal, u32::from_be_bytes([0, 255, 51 * i, i]))
        })
        .collect()
}

fn text() -> Vec<u8> {
    let mut text = format!("{HEADER}DATA ascii\n");
    for ([x, y, z], [u, v, w], color) in rows() {
        let color = f32::from_bits(color);
        text += &format!("{x} {y} {z} 0 0 0 {u} {v} {w} {color:e} 1 2 7\n");
    }
    text.into_bytes()
}

/// The bytes of each field of a point.
fn fields_of(([x, y, z], normal, color): ([f64; 3], [f32; 3], u32)) -> Vec<Vec<u8>> {
    vec![
        (x as f32).to_le_bytes().to_vec(),
        (y as i32).to_le_bytes().to_vec(),
        z.to_le_bytes().to_vec(),
        vec![0; 3],
        normal[0].to_le_bytes().to_vec(),
        normal[1].to_le_bytes().to_vec(),
        normal[2].to_le_bytes().to_vec(),
        color.to_le_bytes().to_vec(),
        vec![9; 8],
        vec![7, 0],
    ]
}

fn binary() -> Vec<u8> {
    let mut bytes = format!("{HEADER}DATA binary\n").into_bytes();
    bytes.extend(rows().into_iter().flat_map(fields_of).flatten());
    bytes
}

fn compressed() -> Vec<u8> {
    let points: Vec<_> = rows().into_iter().map(fields_of).collect();
    let mut columns = Vec::new();
    for field in (0..points[0].len()).filter(|field| *field != 3) {
        columns.extend(points.iter().flat_map(|point| &point[field]));
    }
    // Runs of bytes as they are.
    let runs = columns.chunks(32);
    let packed: Vec<u8> = runs
        .flat_map(|run| [&[run.len() as u8 - 1], run].concat())
        .collect();
    let mut bytes = format!("{HEADER}DATA binary_compressed\n").into_bytes();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend((columns.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

#[test]
fn every_encoding_holds_the_same() {
    let (mesh, warnings) = read_bytes(&binary()).expect("points");
    let positions: Vec<_> = rows().iter().map(|row| row.0).collect();
    assert_eq!(mesh.positions, positions);
    assert_eq!(mesh.normals.as_ref().expect("normals")[3], [0.0, 3.0, -1.0]);
    let colors = mesh.colors.as_ref().expect("colours");
    assert_eq!(colors[1], [1.0, 0.2, cloud::from_byte(1), 1.0]);
    assert!(mesh.is_cloud());
    let expected = "properties that are not read: intensity, label";
    assert_eq!((warnings.len(), &*warnings[0].message), (1, expected));
    for other in [text(), compressed()] {
        assert_eq!(
            read_bytes(&other).expect("points"),
            (mesh.clone(), warnings.clone())
        );
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    for bytes in [binary(), compressed()] {
        for length in 0..bytes.len() {
            assert!(read_bytes(&bytes[..length]).is_err(), "{length}");
        }
    }
    let bytes = binary();
    let end = bytes.len() - 1;
    let expected = format!("byte {end}: the file ends after 3 of 4 points");
    assert_eq!(message(&bytes[..end]), expected);
    let bytes = text();
    let end = bytes.len() - 30;
    assert!(message(&bytes[..end]).starts_with("15: point 3 has fewer values"));
}

#[test]
fn points_that_are_none_are_refused_or_left_to_who_skips_them() {
    let text = "FIELDS x y z\nWIDTH 3\nDATA ascii\n0 0 0\nnan nan nan\n1 2 3\n";
    let fault = read_bytes(text.as_bytes()).expect_err("a fault");
    assert_eq!(
        fault.to_string(),
        "5: point 1 has \"nan\", which is not finite"
    );
    assert_eq!(fault.hint.as_deref(), Some(SKIP));
    let (content, _, warnings) =
        crate::io::read(&source(text.as_bytes()).skipping_bad(true), None).expect("points");
    let crate::io::Content::Mesh(mesh) = content else {
        panic!("a cloud is a mesh");
    };
    assert_eq!(mesh.positions, [[0.0; 3], [1.0, 2.0, 3.0]]);
    assert_eq!(mesh.points, [0, 1]);
    assert_eq!(
        (&*warnings[0].code, warnings[0].first),
        ("skipped-points", Some(1))
    );
    let nothing = text.replace("0 0 0", "nan 0 0").replace("1 2 3", "inf 0 0");
    let error = crate::io::read(&source(nothing.as_bytes()).skipping_bad(true), None);
    let said = error.expect_err("no point").to_string();
    assert_eq!(said, "test.pcd: holds no points that are finite");
}

#[test]
fn colours_are_packed_in_floats_and_in_whole_numbers() {
    let read_color = |kind: &str, name: &str, word: &str| {
        let text = format!(
            "FIELDS x y z {name}\nSIZE 4 4 4 4\nTYPE F F F {kind}\nWIDTH 1\nDATA ascii\n0 0 0 {word}\n"
        );
        let (mesh, warnings) = read_bytes(text.as_bytes()).expect("a point");
        let color = mesh.colors.expect("a colour")[0];
        (color.map(cloud::to_byte), warnings.len())
    };
    assert_eq!(read_color("U", "rgb", "16711935"), ([255, 0, 255, 255], 0));
    assert_eq!(read_color("F", "rgb", "16711935"), ([255, 0, 255, 255], 0));
    assert_eq!(
        read_color("F", "rgb", "2.3418052e-38"),
        ([255, 0, 0, 255], 0)
    );
    assert_eq!(read_color("I", "rgba", "-16777216"), ([0, 0, 0, 255], 0));
    assert_eq!(read_color("U", "rgba", "2130706687"), ([0, 0, 255, 127], 0));
    assert_eq!(read_color("U", "rgba", "255"), ([0, 0, 255, 255], 0));
    assert_eq!(read_color("F", "rgb", "nan"), ([0, 0, 0, 255], 1));
}

#[test]
fn headers_of_old_versions_say_less() {
    let text = "VERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n";
    assert_eq!(
        read_bytes(text.as_bytes()).expect("a point").0.positions,
        [[1.0, 2.0, 3.0]]
    );
    let moved = "FIELDS x y z\nWIDTH 1\nVIEWPOINT 0 0 0 0 1 0 0\nDATA ascii\n1 2 3\n";
    assert_eq!(
        read_bytes(moved.as_bytes()).expect("a point").1[0].code,
        "ignored-viewpoint"
    );
    assert!(is_document(b"# a cloud\n\nVERSION .7\n") && is_document(b"FIELDS x y z\n"));
    assert!(!is_document(b"# spheres\nx,y,z,r\n") && !is_document(b""));
}

#[test]
fn faults_say_where() {
    let with = |from: &str, to: &str| {
        let text = String::from_utf8(text()).expect("text");
        assert!(text.contains(from), "{from}");
        message(text.replacen(from, to, 1).as_bytes())
    };
    assert_eq!(
        with("FIELDS x y", "FIELDS x v"),
        "3: FIELDS: no field is named y"
    );
    assert_eq!(
        with("VERSION 0.7", "VERSION 8"),
        "2: VERSION: \"8\" is not known, only 0.5, 0.6 and 0.7"
    );
    assert_eq!(
        with("SIZE 4", "SIZE 3"),
        "5: TYPE: field \"x\" has type F of 3 bytes, which is none"
    );
    assert_eq!(
        with("SIZE 4", "SIZE"),
        "4: SIZE: 9 values, but 10 are needed"
    );
    assert_eq!(
        with("COUNT 1", "COUNT 0"),
        "6: COUNT: field \"x\" has 0 numbers, not 1 to 65536"
    );
    assert_eq!(
        with("POINTS 4", "POINTS 5"),
        "10: POINTS: is 5, but WIDTH 2 by HEIGHT 2 are 4"
    );
    assert_eq!(
        with("DATA ascii", "DATA zip"),
        "11: DATA: \"zip\" is no encoding"
    );
    assert_eq!(
        with("HEIGHT 2", "HIGHT 2"),
        "8: \"HIGHT\" is no keyword of a PCD header"
    );
    assert_eq!(
        with("HEIGHT 2", "WIDTH 2"),
        "8: WIDTH: stands in the header twice"
    );
    assert_eq!(with("0.5 -7", "0.5 x"), "12: \"x\" is not a number");
    assert_eq!(
        message(b"VERSION .7\n"),
        "2: the file ends within the header, before DATA"
    );
    assert_eq!(
        message(b"FIELDS x y z\nDATA ascii\n"),
        "2: the header has no POINTS"
    );
    assert_eq!(
        message(b"FIELDS x y z\nPOINTS 0\nDATA ascii\n"),
        "holds no points"
    );
}

#[test]
fn what_a_header_claims_is_refused_before_room_is_made() {
    let many = 1u64 << 31;
    let header = |data: &str| format!("FIELDS x y z\nWIDTH {many}\nDATA {data}\n");
    let text = header("binary") + "0123456789ab0123";
    let expected = format!(
        "byte {}: the file ends after 1 of {many} points",
        text.len()
    );
    assert_eq!(message(text.as_bytes()), expected);
    let text = header("ascii") + "0 0 0\n";
    assert_eq!(
        message(text.as_bytes()),
        format!("4: the file ends after 1 of {many} points")
    );
    let mut bytes = "FIELDS x y z\nWIDTH 300000000\nDATA binary_compressed\n"
        .to_owned()
        .into_bytes();
    let start = bytes.len();
    bytes.extend(4u32.to_le_bytes());
    bytes.extend(3_600_000_000u32.to_le_bytes());
    bytes.extend([0; 4]);
    let expected = format!("byte {start}: 4 bytes of packed data cannot stand for 3600000000");
    assert_eq!(message(&bytes), expected);
}

#[test]
fn clouds_are_written_with_all_they_carry() {
    let mut mesh = cloud::of_all(Mesh {
        positions: vec![[1.0, 2.5, -3.0], [500_000.125, 0.1, 1e-30]],
        normals: Some(vec![[0.0, 0.0, 1.0], [0.5, 0.25, 0.0]]),
        colors: Some(vec![[1.0, 0.2, 0.0, 1.0], [0.0, 0.4, 1.0, 1.0]]),
        classes: Some(vec![2, 255]),
        ..Mesh::default()
    })
    .expect("points");
    for wide in [true, false] {
        if !wide {
            mesh.positions[1] = [0.5; 3];
            mesh.colors = Some(vec![[1.0, 0.2, 0.0, 1.0], [0.0, 0.4, 1.0, 0.6]]);
        }
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).expect("bytes");
        assert_eq!(cloud::rounded_colors(&mesh), (0, None));
        assert_eq!(
            read_bytes(&bytes).expect("points"),
            (mesh.clone(), Vec::new())
        );
    }
    mesh.colors = Some(vec![[1.0; 4], [0.3, 0.0, 0.0, 1.0]]);
    assert_eq!(cloud::rounded_colors(&mesh), (1, Some(1)));
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(
        which in 0..3usize,
        at in 0..900usize,
        change in prop::collection::vec(any::<u8>(), 1..4),
    ) {
        let mut bytes = [text(), binary(), compressed()][which].clone();
        let at = at % bytes.len();
        for (old, new) in bytes[at..].iter_mut().zip(change) {
            *old = new;
        }
        let _ = read_bytes(&bytes);
    }
}
