use super::*;
use crate::io::format::{Format, sniff};
use proptest::prelude::*;

fn read_named(name: &str, text: &str) -> Result<(Mesh, Vec<Warning>), Fault> {
    let source = Source::from_bytes(name, text.into()).expect("no gzip layer");
    let mut warnings = Vec::new();
    let mesh = read(&source, &mut warnings).map_err(Refusal::fault)?;
    mesh.check()?;
    Ok((mesh, warnings))
}

fn read_text(text: &str) -> (Mesh, Vec<Warning>) {
    read_named("test.xyz", text).expect("points")
}

fn message(text: &str) -> String {
    let fault = read_named("test.xyz", text).expect_err("a fault");
    fault.to_string()
}

#[test]
fn values_are_parted_in_every_usual_way() {
    for text in [
        "1 2 3\n4 5 6e1\n",
        "# points\n\n 1\t2 3\r\n4 5  60 # the last\r\n",
        "1,2,3\n4, 5, 60\n",
        "1;2;3;\n4;5;60;\n",
        "X,Y,Z\n1,2,3\n4,5,60\n",
        "\u{feff}\"z\";\"x\";\"y\"\n3;1;2\n60;4;5\n",
        "//X Y Z\n1 2 3\n4 5 60\n",
        "2\n1 2 3\n4 5 60\n",
    ] {
        let (mesh, warnings) = read_text(text);
        assert_eq!(
            mesh.positions,
            [[1.0, 2.0, 3.0], [4.0, 5.0, 60.0]],
            "{text:?}"
        );
        assert!(
            mesh.is_cloud() && warnings.is_empty(),
            "{text:?}: {warnings:?}"
        );
    }
}

#[test]
fn six_columns_are_normals_of_unit_length_or_colours() {
    let (mesh, _) = read_text("0 0 0 0 0.6 0.8\n1 0 0 1 0 0.0001\n");
    assert_eq!(
        mesh.normals,
        Some(vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0001]])
    );
    let (mesh, _) = read_text("0 0 0 255 0 51\n1 0 0 1 0 0\n");
    let colors = mesh.colors.expect("colours");
    assert_eq!((mesh.normals, colors[0]), (None, [1.0, 0.0, 0.2, 1.0]));
    let (mesh, _) = read_text("0 0 0 0.5 0 0.25\n");
    assert_eq!(mesh.colors, Some(vec![[0.5, 0.0, 0.25, 1.0]]));
    let (mesh, _) = read_text("0 0 0 65535 0 13107\n");
    assert_eq!(mesh.colors, Some(vec![[1.0, 0.0, 0.2, 1.0]]));
    let (mesh, warnings) = read_text("0 0 0 -7 0 1\n");
    assert_eq!((mesh.colors, &*warnings[0].code), (None, "unknown-columns"));
}

#[test]
fn more_columns_are_told_by_their_number_or_names() {
    let (mesh, warnings) = read_text("0 0 0 0 0 1 255 0 0\n");
    assert_eq!(mesh.normals, Some(vec![[0.0, 0.0, 1.0]]));
    assert_eq!(mesh.colors, Some(vec![[1.0, 0.0, 0.0, 1.0]]));
    assert!(warnings.is_empty());
    let (mesh, warnings) = read_named("a.pts", "0 0 0 -1200 0 0 255\n").expect("a point");
    assert_eq!(mesh.colors, Some(vec![[0.0, 0.0, 1.0, 1.0]]));
    assert_eq!(
        warnings[0].message,
        "properties that are not read: column 4"
    );
    let text =
        "//X Y Z R G B Intensity Nx Ny Nz Scalar_Classification\n0 0 0 255 255 0 7 0 0 1 2\n";
    let (mesh, warnings) = read_text(text);
    assert_eq!(mesh.normals, Some(vec![[0.0, 0.0, 1.0]]));
    assert_eq!(mesh.colors, Some(vec![[1.0, 1.0, 0.0, 1.0]]));
    assert_eq!(mesh.classes, Some(vec![2]));
    assert_eq!(
        warnings[0].message,
        "properties that are not read: intensity"
    );
    // A comment that happens to begin like names, of another number of columns.
    let (mesh, warnings) = read_text("# x y z in metres\n1 2 3\n");
    assert_eq!((mesh.positions.len(), warnings.len()), (1, 0));
    let (mesh, warnings) = read_text("9\n1 2 3\n");
    assert_eq!(
        (mesh.positions.len(), &*warnings[0].code),
        (1, "other-count")
    );
    let (mesh, warnings) = read_text("x,y,z,class\n1,2,3,2.5\n");
    assert_eq!(
        (mesh.classes, &*warnings[0].code),
        (None, "unknown-classes")
    );
}

#[test]
fn faults_name_the_line() {
    assert_eq!(
        message("1 2 3\n1 2\n"),
        "2: has 2 values, but 3 are needed: \"1 2\""
    );
    assert_eq!(
        message("1 2\n"),
        "1: has 2 values, but 3 are needed: \"1 2\""
    );
    assert_eq!(message("1 2 3\n1 2 x\n"), "2: \"x\" is not a number");
    assert_eq!(message("1 2 3\n\n1 nan 3\n"), "3: \"nan\" is not finite");
    assert_eq!(message("2\nC 0 0 0\nC 1 0 0\n"), "2: \"C\" is not a number");
    assert_eq!(message("x,y,w\n1,2,3\n"), "1: no column is named z");
    assert_eq!(message("x,y,z,x\n1,2,3,4\n"), "1: 2 columns are named x");
    assert_eq!(message("# none\n"), "holds no points");
    assert_eq!(message("x y z\n"), "holds no points");
    assert_eq!(message("1,5;2,5;3,5\n"), "1: no column is named x");
}

#[test]
fn points_are_told_from_spheres_and_other_text() {
    let sniffed = |text: &str, extension| sniff(text.as_bytes(), extension);
    for (text, extension, format) in [
        ("x,y,z\n1,2,3\n", Some("csv"), Format::PointsCsv),
        ("x,y,z,r,g,b\n1,2,3,0,0,0\n", Some("csv"), Format::PointsCsv),
        ("x,y,z,r\n1,2,3,4\n", Some("csv"), Format::SpheresCsv),
        ("1,2,3,4\n", Some("csv"), Format::SpheresCsv),
        ("1,2,3\n", Some("csv"), Format::PointsCsv),
        ("a,b\n", Some("csv"), Format::SpheresCsv),
        ("1 2 3 4\n", Some("xyzr"), Format::Xyzr),
        ("1 2 3 4\n", Some("txt"), Format::Xyz),
        ("1 2 3\n", None, Format::Xyz),
        ("2\n1 2 3 4\n", None, Format::Xyz),
        ("x,y,z\n1,2,3\n", None, Format::Xyz),
        ("x,y,z,r\n1,2,3,4\n", None, Format::SpheresCsv),
        ("ply\n", Some("xyz"), Format::Ply),
        ("{\"a\": 1}", Some("txt"), Format::Json),
    ] {
        assert_eq!(
            sniffed(text, extension),
            Ok(format),
            "{text:?} {extension:?}"
        );
    }
    assert!(sniffed("1 2 3 4\n", None).is_err() && sniffed("12\n", None).is_err());
    assert!(sniffed("some words\n", None).is_err());
}

#[test]
fn bad_points_are_left_to_who_skips_them() {
    let source = Source::from_bytes("a.xyz", b"0 0 0\nnan 1 1\n2 2 2\n".to_vec());
    let source = source.expect("no gzip layer").skipping_bad(true);
    let (mesh, _, warnings) = crate::io::read_mesh(&source, None).expect("points");
    assert_eq!(mesh.positions, [[0.0; 3], [2.0; 3]]);
    assert_eq!((warnings[0].count, warnings[0].first), (1, Some(1)));
}

#[test]
fn room_is_made_for_the_lines_that_are_there() {
    let text = b"0 0 0\n".repeat(100);
    let path = std::env::temp_dir().join(format!("scantle-xyz-{}.xyz", std::process::id()));
    std::fs::write(&path, &text).expect("a file");
    let source = Source::open(path.to_str().expect("text"), 1000).expect("a source");
    let refused = read(&source, &mut Vec::new()).expect_err("over the limit");
    std::fs::remove_file(&path).expect("a file");
    assert!(matches!(refused, Refusal::OverMemory { limit: 1000, .. }));
}

fn cloud_of(positions: Vec<Vec3>) -> impl Strategy<Value = Mesh> {
    let count = positions.len();
    let byte = prop::array::uniform4(any::<u8>().prop_map(cloud::from_byte));
    let normal = prop::array::uniform3(-1.0..1.0f64);
    let attributes = (
        prop::option::of(prop::collection::vec(normal, count)),
        prop::option::of(prop::collection::vec(byte, count)),
        prop::option::of(prop::collection::vec(any::<u8>(), count)),
    );
    attributes.prop_map(move |(normals, colors, classes)| {
        let mesh = Mesh {
            positions: positions.clone(),
            normals,
            colors,
            classes,
            ..Mesh::default()
        };
        cloud::of_all(mesh).expect("points")
    })
}

proptest! {
    #[test]
    fn tables_with_names_read_back_as_written(
        mesh in prop::collection::vec(prop::array::uniform3(-1e9..1e9f64), 1..20).prop_flat_map(cloud_of)
    ) {
        let mut text = Vec::new();
        write_csv(&mesh, &mut text).expect("text");
        let (back, warnings) = read_text(&String::from_utf8(text).expect("text"));
        prop_assert!(warnings.is_empty());
        prop_assert_eq!(back, mesh);
    }

    #[test]
    fn rows_without_names_read_back_as_written(
        directions in prop::collection::vec(prop::array::uniform3(0.1..1.0f64), 1..20),
    ) {
        let unit = |v: &Vec3| v.map(|c| c / length(*v));
        let mesh = Mesh {
            normals: Some(directions.iter().map(unit).collect()),
            colors: Some(vec![[1.0, 0.2, 0.4, 1.0]; directions.len()]),
            positions: directions,
            ..Mesh::default()
        };
        let mut text = Vec::new();
        write(&mesh, &mut text).expect("text");
        let (back, _) = read_text(&String::from_utf8(text).expect("text"));
        prop_assert_eq!(back, cloud::of_all(mesh).expect("points"));
    }

    #[test]
    fn no_text_makes_it_panic(text in "([#/]{0,2}[xyzrgb, ;]{0,9}\n)?([0-9]\n)?((-?[0-9.e]{0,4}[ ,;]){0,8}\n){0,8}") {
        let _ = read_named("test.xyz", &text);
        let _ = is_document(text.as_bytes());
    }
}
