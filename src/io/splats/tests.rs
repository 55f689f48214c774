use super::*;
use crate::error::Result as Checked;
use crate::io::source::Source;
use crate::io::{Content, format};
use crate::numeric::vector::{cross, dot, scale, sub};
use crate::points::Splat;
use crate::report::Warning;
use proptest::prelude::*;

/// Unit vectors at right angles, from any direction and angle.
fn frame(z: f64, turn: f64) -> [Vec3; 2] {
    let (sin, cos) = turn.sin_cos();
    let r = (1.0 - z * z).sqrt();
    let normal = [r * cos, r * sin, z];
    let beside = cross(normal, [sin, -cos, 0.5]);
    [normal, scale(beside, 1.0 / length(beside))]
}

fn splat_of(centre: Vec3, [z, turn]: [f64; 2], radius: f64) -> Splat {
    let [normal, tangent] = frame(z, turn);
    Splat {
        centre,
        normal,
        tangent,
        radius,
        field: scale(normal, 0.9),
        slopes: [turn / 7.0, -z / 3.0],
        error: radius / 13.0,
        count: (turn * 1e6) as u32,
        source: 7,
    }
}

fn splats() -> impl Strategy<Value = Splats> {
    let splat = (
        prop::array::uniform3(-1e7..1e7f64),
        [-0.99..0.99f64, 0.0..6.2f64],
        0.0..100.0f64,
    );
    let splat = splat.prop_map(|(centre, turned, radius)| splat_of(centre, turned, radius));
    let byte = any::<u8>().prop_map(crate::io::cloud::from_byte);
    let channel = prop_oneof![byte, 0.0..=1.0f32];
    prop::collection::vec(splat, 1..20).prop_flat_map(move |splats| {
        let count = splats.len();
        let color = prop::array::uniform4(channel.clone());
        let colors = prop::option::of(prop::collection::vec(color, count));
        let classes = prop::option::of(prop::collection::vec(any::<u8>(), count));
        (Just(splats), colors, classes).prop_map(|(splats, colors, classes)| Splats {
            splats,
            colors,
            classes,
        })
    })
}

fn source(bytes: Vec<u8>) -> Source {
    Source::from_bytes("test.ply", bytes).expect("no gzip layer")
}

/// Reads in whatever format the bytes tell.
fn read_any(bytes: Vec<u8>) -> Checked<(Splats, Vec<Warning>)> {
    let (content, _, warnings) = crate::io::read(&source(bytes), None)?;
    match content {
        Content::Splats(splats) => Ok((splats, warnings)),
        other => panic!("{:?}, not splats", other.kind()),
    }
}

fn written(
    splats: &Splats,
    writer: fn(&Splats, &mut dyn std::io::Write) -> std::io::Result<()>,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    writer(splats, &mut bytes).expect("bytes");
    bytes
}

fn few() -> Splats {
    Splats {
        splats: vec![
            splat_of([500_000.5, 4_000_000.25, 10.0], [0.3, 1.0], 0.5),
            splat_of([500_001.5, 4_000_001.25, 11.0], [-0.9, 4.0], 2.0),
        ],
        ..Splats::default()
    }
}

#[test]
fn files_are_told_from_meshes_and_clouds() {
    let splats = few();
    assert_eq!(kind_of(&written(&splats, write)), Some(Format::Splats));
    assert_eq!(
        kind_of(&written(&splats, write_gaussians)),
        Some(Format::Gaussians)
    );
    let cloud = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty float radius\nend_header\n0 0 0 1\n";
    assert_eq!(kind_of(cloud), None);
    assert_eq!(format::sniff(cloud, Some("ply")), Ok(Format::Ply));
    // Asked for, the centres are a cloud.
    let read = crate::io::read_mesh(&source(written(&splats, write)), Some(Format::Ply));
    assert!(read.expect("a cloud").0.is_cloud());
}

#[test]
fn gaussians_cover_what_their_discs_do() {
    let splats = few();
    let (back, warnings) = read_any(written(&splats, write_gaussians)).expect("splats");
    assert!(warnings.is_empty(), "{warnings:?}");
    // Lit from above: what faces the lamp is brighter than what faces away, and all is grey.
    let lamp = [-2.0, 6.0, 3.0].map(|c| c / 7.0);
    for (splat, color) in splats
        .splats
        .iter()
        .zip(back.colors.as_ref().expect("colours"))
    {
        let grey = 0.55 + 0.35 * dot(splat.normal, lamp);
        assert!(
            color[..3]
                .iter()
                .all(|c| (f64::from(*c) - grey).abs() < 1e-6)
        );
    }
    for (splat, back) in splats.splats.iter().zip(&back.splats) {
        // Relative to an origin nearby, single precision keeps the place.
        assert!(length(sub(splat.centre, back.centre)) < 1e-6);
        assert!((splat.radius - back.radius).abs() < 1e-6 * splat.radius);
        assert!((splat.error - back.error).abs() < 1e-6 * splat.radius);
        assert!(dot(splat.normal, back.normal) > 1.0 - 1e-6);
        assert!(dot(splat.tangent, back.tangent) > 1.0 - 1e-6);
    }
    let text = String::from_utf8_lossy(&written(&splats, write_gaussians)[..200]).into_owned();
    assert!(
        text.contains("\ncomment origin 500002 4000001 11\n"),
        "{text}"
    );
}

#[test]
fn gaussians_that_are_no_circle_are_counted() {
    let header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\n\
        property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n\
        property float opacity\nproperty float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n\
        end_header\n";
    let read = |row: &str| read_any(format!("{header}{row}\n").into_bytes());
    let (splats, warnings) = read("1 2 3 -9 0 1 1 0 0 0 0 0 0 0").expect("a splat");
    let splat = splats.splats[0];
    assert_eq!(
        (splat.centre, splat.normal, splat.radius),
        ([1.0, 2.0, 3.0], [1.0, 0.0, 0.0], 2.0)
    );
    assert_eq!(splats.colors, Some(vec![[0.5; 4]]));
    assert_eq!(warnings[0].code, "elliptic-gaussians");
    let said = read("1 2 3 -9 0 1 0 0 0 0 0 0 0 0")
        .expect_err("no rotation")
        .to_string();
    assert_eq!(
        said,
        "test.ply:splat 0: has a rotation that is 0 or not finite"
    );
    let said = read("1 2 3 -9 0 900 0 1 0 0 0 0 0 0")
        .map(|_| ())
        .map_err(|e| e.to_string());
    assert_eq!(said, Ok(()));
    let said = read("nan 2 3 -9 0 1 1 0 0 0 0 0 0 0")
        .expect_err("no place")
        .to_string();
    assert_eq!(said, "test.ply:splat 0: has a number that is not finite");
}

#[test]
fn what_is_no_splat_is_refused() {
    let said = |change: fn(&mut Splat)| {
        let mut splats = few();
        change(&mut splats.splats[1]);
        read_any(written(&splats, write))
            .expect_err("a fault")
            .to_string()
    };
    assert_eq!(
        said(|s| s.radius = -1.0),
        "test.ply:splat 1: has the radius -1"
    );
    assert_eq!(
        said(|s| s.error = -1.0),
        "test.ply:splat 1: has the error -1"
    );
    assert_eq!(
        said(|s| s.slopes[1] = f64::NAN),
        "test.ply:splat 1: has a number that is not finite"
    );
    assert_eq!(
        said(|s| s.normal = [0.0, 0.0, 2.0]),
        "test.ply:splat 1: has a normal of length 2"
    );
    assert_eq!(
        said(|s| s.tangent = [0.0; 3]),
        "test.ply:splat 1: has a tangent of length 0"
    );
    let slanted = said(|s| s.tangent = s.normal);
    assert!(slanted.starts_with("test.ply:splat 1: has a tangent that leaves its plane by "));
    let header =
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float radius\nproperty float kappa_u\n";
    let read = |rest: &str| read_any(format!("{header}{rest}end_header\n").into_bytes());
    let said = read("").expect_err("no x").to_string();
    assert_eq!(said, "test.ply:3: the vertex element has no property x");
    let none = written(&Splats::default(), write);
    assert_eq!(
        read_any(none).expect_err("none").to_string(),
        "test.ply: holds no splats"
    );
    let bytes = written(&few(), write);
    for length in 0..bytes.len() {
        assert!(read_any(bytes[..length].to_vec()).is_err(), "{length}");
    }
}

#[test]
fn discs_lie_in_their_planes_and_within_their_rims() {
    let mut splats = few();
    splats.classes = Some(vec![2, 6]);
    let mesh = discs(&splats, 12).expect("a mesh");
    mesh.check().expect("sound");
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 20));
    assert_eq!(mesh.classes.as_ref().map(|c| (c[11], c[12])), Some((2, 6)));
    for (corner, position) in mesh.positions.iter().enumerate() {
        let splat = splats.splats[corner / 12];
        let offset = sub(*position, splat.centre);
        assert!(dot(offset, splat.normal).abs() < 1e-9);
        assert!((length(offset) - splat.radius).abs() < 1e-9);
    }
    let [a, b, c] = mesh.corners(0);
    assert!(dot(cross(sub(b, a), sub(c, a)), splats.splats[0].normal) > 0.0);
    assert!(discs(&splats, 2).is_err());
}

proptest! {
    #[test]
    fn every_bit_reads_back(splats in splats()) {
        let (back, warnings) = read_any(written(&splats, write)).expect("splats");
        prop_assert!(warnings.is_empty(), "{:?}", warnings);
        prop_assert_eq!(back, splats);
    }

    #[test]
    fn no_bytes_make_it_panic(
        gaussians in any::<bool>(),
        at in any::<prop::sample::Index>(),
        change in prop::collection::vec(any::<u8>(), 1..4),
    ) {
        let mut bytes = written(&few(), if gaussians { write_gaussians } else { write });
        let at = at.index(bytes.len());
        for (old, new) in bytes[at..].iter_mut().zip(change) {
            *old = new;
        }
        let source = source(bytes);
        let _ = read(&source, &mut Vec::new());
        let _ = read_gaussians(&source, &mut Vec::new());
    }
}
