use super::find::natural;
use super::*;
use crate::mesh::shapes;
use std::fs;

/// A folder with files of these names and contents.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, content) in files {
        fs::write(folder.path().join(name), content).expect("a file");
    }
    folder
}

fn word(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// The names found, or the message without the folder.
fn found(folder: &tempfile::TempDir, name: &str) -> Result<Vec<String>, String> {
    let said = |e: Error| e.to_string().replace(&word(folder, ""), "");
    let paths = find(&word(folder, name), None).map_err(said)?;
    let name = |path: &PathBuf| path.file_name().map(|n| n.display().to_string());
    Ok(paths.iter().filter_map(name).collect())
}

#[test]
fn numbers_in_names_count_as_numbers() {
    let mut names = ["f10", "f2", "f02b", "f1", "g", "f", "f2b", "F3", "f002"];
    names.sort_by(|a, b| natural(a, b));
    let wanted = ["F3", "f", "f1", "f002", "f2", "f02b", "f2b", "f10", "g"];
    assert_eq!(names, wanted);
}

#[test]
fn folders_give_their_meshes_in_order() {
    let one = folder(&[
        ("w10.obj", ""),
        ("w9.OBJ", ""),
        ("w.mtl", ""),
        (".w.obj", ""),
        ("w11.obj.gz", ""),
    ]);
    let wanted = ["w9.OBJ", "w10.obj", "w11.obj.gz"].map(str::to_owned);
    assert_eq!(found(&one, ""), Ok(wanted.to_vec()));
    let two = folder(&[("b.ply", ""), ("a.obj", "")]);
    let said = found(&two, "").expect_err("two formats");
    assert!(said.contains("a.obj and b.ply"), "{said}");
    let ply = find(&word(&two, ""), Some(Format::Ply)).expect("one format");
    assert_eq!(ply, [two.path().join("b.ply")]);
    let said = found(&folder(&[("a.txt", "")]), "").expect_err("no mesh");
    assert!(said.ends_with("holds no mesh"), "{said}");
}

#[test]
fn patterns_find_their_files_and_gaps_are_named() {
    let names = ["w0008.obj", "w0009.obj", "w0010.obj", "w7.obj", "w8.obj"];
    let files = folder(&names.map(|name| (name, "")));
    let all = |names: &[&str]| Ok(names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
    assert_eq!(found(&files, "w%04d.obj"), all(&names[..3]));
    assert_eq!(found(&files, "w%d.obj"), all(&names[3..]));
    let any = ["w7.obj", "w0008.obj", "w8.obj", "w0009.obj", "w0010.obj"];
    assert_eq!(found(&files, "w*.obj"), all(&any));
    fs::remove_file(files.path().join("w0009.obj")).expect("a file less");
    assert_eq!(
        found(&files, "w%04d.obj").expect_err("a gap"),
        "w%04d.obj: w0009.obj is missing, but w0010.obj is there"
    );
    assert_eq!(
        found(&files, "x*.obj").expect_err("none"),
        "x*.obj: no file has such a name"
    );
    for none in ["w*.*", "w%d-%d.obj", "w%4d.obj", "w%s.obj", "w8.obj"] {
        assert!(!is_sequence(&word(&files, none)), "{none}");
        assert!(found(&files, none).is_err(), "{none}");
    }
    for some in ["w*.obj", "w%05d.obj", ""] {
        assert!(is_sequence(&word(&files, some)), "{some}");
    }
    // A file of that very name is itself.
    fs::write(files.path().join("a*.obj"), "").expect("a file");
    assert!(!is_sequence(&word(&files, "a*.obj")));
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn read_all(files: &tempfile::TempDir) -> Result<Clip, String> {
    let paths = find(&word(files, ""), None).expect("files");
    let said = |e: Error| e.to_string().replace(&word(files, ""), "");
    read(&paths, None, 30.0, 1 << 20)
        .map(|(clip, _, _)| clip)
        .map_err(said)
}

#[test]
fn frames_are_the_files_in_order() {
    let raised = SQUARE.replace(" 0\n", " 2\n");
    let first = format!("{SQUARE}f 1 2 3 4\nf 1 2 3\n");
    let second = format!("{raised}f 1 2 3 4\nf 1 2 3\n");
    let files = folder(&[("a2.obj", &first), ("a10.obj", &second)]);
    let clip = read_all(&files).expect("a clip");
    assert_eq!((clip.frames(), clip.vertices()), (2, 4));
    assert_eq!(clip.mesh.face_count(), 2);
    assert_eq!(clip.frame(1)[2], [1.0, 1.0, 2.0]);
    assert_eq!((clip.start, clip.rate), (0.0, 30.0));
}

#[test]
fn what_differs_from_the_first_is_named() {
    let first = format!("{SQUARE}f 1 2 3\nf 1 3 4\n");
    let said = |second: String| {
        let files = folder(&[("a1.obj", &first), ("a2.obj", &second)]);
        read_all(&files).expect_err("an error")
    };
    assert_eq!(
        said(format!("{SQUARE}v 5 5 5\nf 1 2 3\nf 1 3 4\n")),
        "a2.obj: 5 vertices, but frame 0 (a1.obj) has 4"
    );
    assert_eq!(
        said(format!("{SQUARE}f 1 2 3\n")),
        "a2.obj: 1 faces, but frame 0 (a1.obj) has 2"
    );
    assert_eq!(
        said(format!("{SQUARE}f 1 2 3\nf 2 3 4\n")),
        "a2.obj:face 1: has corners 1, 2, 3 in frame 1, but 0, 2, 3 in frame 0 (a1.obj)"
    );
    assert_eq!(
        said(format!("{SQUARE}f 1 2 3 4\nf 1 3 4\n")),
        "a2.obj:face 0: has corners 0, 1, 2, 3 in frame 1, but 0, 1, 2 in frame 0 (a1.obj)"
    );
    assert_eq!(
        said(format!("{SQUARE}f 1 2 3\nf 1 3 4\np 1\n")),
        "a2.obj: frame 1 has other polylines or points than frame 0 (a1.obj)"
    );
    let broken = said("v 0 0 nan\n".to_owned());
    assert!(broken.starts_with("a2.obj:1: "), "{broken}");
}

#[test]
fn what_is_written_comes_back() {
    let mut mesh = shapes::torus([0.0; 3], 1.0, 0.25, 12, 8);
    mesh.normals = Some(vec![[0.0, 0.0, 1.0]; mesh.positions.len()]);
    let moved = |f: i32| {
        let moved = mesh
            .positions
            .iter()
            .map(move |p| p.map(|c| c + f64::from(f) / 8.0));
        moved.collect::<Vec<Vec3>>()
    };
    let clip = Clip {
        positions: (0..11).flat_map(moved).collect(),
        mesh: mesh.clone(),
        start: 0.0,
        rate: 25.0,
    };
    let files = folder(&[]);
    let (outputs, warnings) = write(&clip, &word(&files, "new/"), Format::Obj).expect("files");
    let codes: Vec<_> = warnings.iter().map(|w| w.code.as_str()).collect();
    assert_eq!((outputs.len(), codes), (11, vec!["dropped-normals"]));
    let paths = find(&word(&files, "new"), None).expect("files");
    assert!(paths[0].ends_with("new/frame00.obj") && paths[10].ends_with("frame10.obj"));
    let (back, inputs, _) = read(&paths, None, 25.0, u64::MAX).expect("a clip");
    assert_eq!(inputs.len(), 11);
    assert_eq!(back.positions, clip.positions);
    assert_eq!(back.mesh.triangles, mesh.triangles);
    assert!(matches!(
        read(&paths, None, 25.0, 5000),
        Err(Error::Limit { .. })
    ));
}

#[test]
fn names_of_frames_are_of_one_width() {
    let named = |word: &str, frames| places(word, Format::Ply, frames);
    let names = named("a-{frame}.ply", 3).expect("names");
    assert_eq!(names, ["a-0.ply", "a-1.ply", "a-2.ply"].map(PathBuf::from));
    let names = named("out/", 101).expect("names");
    assert_eq!(names[7], PathBuf::from("out/frame007.ply"));
    let said = named("a.ply", 3).expect_err("one place").to_string();
    assert_eq!(
        said,
        "--output a.ply: one place for 3 frames of ply files; name a folder (out/) or use {frame}"
    );
}

#[test]
fn warnings_of_frames_are_added_up() {
    let mut all = Gathered::default();
    let warning = |count| vec![Warning::new("x", "odd ones", count, Some(9))];
    all.add(0, Vec::new());
    all.add(1, warning(2));
    all.add(4, warning(3));
    let wanted = Warning::new("x", "in all frames together: odd ones", 5, Some(1));
    assert_eq!(all.warnings, [wanted]);
}
