use super::*;
use crate::io::roundtrip::{self, Content};
use proptest::prelude::*;

fn read_text(text: &str) -> Result<(Mesh, Vec<Warning>), Fault> {
    let source = Source::from_bytes("test.obj", text.into()).unwrap();
    let mut warnings = Vec::new();
    read(&source, &mut warnings).map(|mesh| (mesh, warnings))
}

fn message(text: &str) -> String {
    read_text(text).unwrap_err().to_string()
}

#[test]
fn objects_are_merged_and_what_is_not_geometry_is_counted() {
    let text = "# a comment that ends with \\\nmtllib C:\\none\\\r\no one\nv 0 0 0\nv 1 0 0 # inline\n\
        vt 0 0\nvn 0 0 1\nv 0 1 0\nusemtl red\nf 1/1/1 2//1 3/1\ng two\nv 1 1 0\nf -3 -1 -2\n\
        l 1 2 3\np 4 1\ncurv 0 1\n";
    // The library's name ends with a backslash, so the object's line belongs to it.
    let (mesh, warnings) = read_text(text).unwrap();
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(mesh.polygons, None);
    assert_eq!(mesh.segments, [[0, 1], [1, 2]]);
    assert_eq!(mesh.points, [3, 0]);
    let counted: Vec<_> = warnings
        .iter()
        .map(|w| (w.code.as_str(), w.count, w.first))
        .collect();
    assert_eq!(
        counted,
        [
            ("ignored-texture-coordinates", 1, Some(6)),
            ("ignored-normals", 1, Some(7)),
            ("ignored-materials", 2, Some(2)),
            ("ignored-statements", 1, Some(16)),
        ]
    );
}

#[test]
fn statements_go_on_after_a_backslash() {
    let (mesh, warnings) =
        read_text("v 0 0 0\r\nv 1 \\\r\n0 \\\r\n0\r\nv 0 1 0\r\nf 1 2\\\r\n 3\r\n").unwrap();
    assert_eq!(mesh.positions[1], [1.0, 0.0, 0.0]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(warnings.is_empty());
    assert_eq!(
        message("v 0 0 \\\n0\nv 1 0 \\\nx\n"),
        "3: \"x\" is not a number"
    );
}

#[test]
fn vertices_may_have_weights_and_colours() {
    let (mesh, warnings) =
        read_text("v 2 4 6 2\nv 0 0 0 0.25 0.5 1\nv 1 1 1 0 0 0 0.5\nv 3 3 3 1\n").unwrap();
    assert_eq!(mesh.positions[0], [1.0, 2.0, 3.0]);
    assert_eq!(mesh.points, [0, 1, 2, 3]);
    let colors = mesh.colors.unwrap();
    let expected = [WHITE, [0.25, 0.5, 1.0, 1.0], [0.0, 0.0, 0.0, 0.5], WHITE];
    assert_eq!(colors, expected);
    let codes: Vec<_> = warnings.iter().map(|w| (&*w.code, w.count)).collect();
    assert_eq!(codes, [("weighted-vertices", 1), ("missing-colours", 2)]);
}

#[test]
fn polygons_are_kept() {
    let (mesh, _) = read_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 2 3\n").unwrap();
    assert_eq!(mesh.face_count(), 2);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
}

#[test]
fn faults_name_the_line_and_the_numbers() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    assert_eq!(
        message(&format!("{three}f 1 2 9001\nv 1 1 1\n")),
        "4: face refers to vertex 9001, but only 3 are defined so far"
    );
    assert_eq!(
        message(&format!("{three}l 1 -4\n")),
        "4: line refers to vertex -4, but only 3 are defined so far"
    );
    assert_eq!(
        message(&format!("{three}f 0 1 2\n")),
        "4: face refers to vertex 0, but vertices count from 1"
    );
    assert_eq!(
        message(&format!("{three}f 99999999999999999999 1 2\n")),
        "4: face has the corner \"99999999999999999999\", which is no index"
    );
    assert_eq!(
        message("v 1 2\n"),
        "1: vertex has 2 numbers, but 3 are needed"
    );
    assert_eq!(message("v 1 2 nan\n"), "1: \"nan\" is not finite");
    assert_eq!(message("hello\n"), "holds no vertices");
}

#[test]
fn an_index_may_refer_forward() {
    let (mesh, warnings) = read_text("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(warnings[0].code, "forward-references");
}

#[test]
fn parts_know_what_stands_before_them() {
    let mut text = String::new();
    let count = 20_000;
    for i in 0..count {
        text += &format!("v {i} \\\n{} 0.5\n", i % 7);
        if i >= 2 {
            text += "f -3 -2 -1\n";
        }
    }
    assert!(text.len() > 2 * PART);
    let (mesh, _) = read_text(&text).unwrap();
    assert_eq!(mesh.positions.len(), count);
    assert!(
        mesh.positions
            .iter()
            .zip(0..)
            .all(|(p, i)| p[0] == f64::from(i))
    );
    assert!(
        mesh.triangles
            .iter()
            .zip(0..)
            .all(|(t, i)| *t == [i, i + 1, i + 2])
    );
    let lines = 3 * count as u64 - 2;
    text += "f 1 2 20001\n";
    assert_eq!(
        message(&text),
        format!(
            "{}: face refers to vertex 20001, but only 20000 are defined so far",
            lines + 1
        )
    );
}

#[test]
fn as_many_normals_as_points_are_theirs() {
    let (mesh, warnings) = read_text("vn 0 0 1\nv 1 2 3\nvn 1 0 0\nv 4 5 6\n").unwrap();
    assert_eq!(mesh.normals, Some(vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]));
    assert!(mesh.is_cloud() && warnings.is_empty());
    for text in ["vn 0 0 1\nv 1 2 3\nv 4 5 6\n", "vn 0 0 1\nv 1 2 3\np 1\n"] {
        let (mesh, warnings) = read_text(text).unwrap();
        assert_eq!(
            (mesh.normals, &*warnings[0].code),
            (None, "ignored-normals")
        );
    }
    let said = read_text("v 1 2 3\nvn 0 1\n").unwrap_err().to_string();
    assert_eq!(said, "2: normal has 2 numbers, but 3 are needed");
}

proptest! {
    #[test]
    fn what_was_written_reads_back(mesh in roundtrip::mesh(Content {
        normals: false, classes: false, ..Content::ALL
    })) {
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let (back, warnings) = read_text(&text).unwrap();
        prop_assert!(roundtrip::only_about_faces(&warnings), "{:?}", warnings);
        prop_assert_eq!(back, mesh);
    }

    #[test]
    fn no_text_makes_it_panic(text in "((v|f|l|p|vt|#|\\\\)( -?[0-9/.e]{0,4}){0,5}[\\\\]?\r?\n){0,12}") {
        let _ = read_text(&text);
    }
}
