use super::*;
use proptest::prelude::*;

fn source(bytes: &[u8]) -> Source {
    Source::from_bytes("test.las", bytes.to_vec()).expect("no gzip layer")
}

fn read_bytes(bytes: &[u8]) -> Result<(Mesh, Vec<Warning>), Fault> {
    let mut warnings = Vec::new();
    let mesh = read(&source(bytes), &mut warnings).map_err(Refusal::fault)?;
    Ok((mesh, warnings))
}

fn message(bytes: &[u8]) -> String {
    read_bytes(bytes).expect_err("a fault").to_string()
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    bytes[at..at + value.len()].copy_from_slice(value);
}

/// A file of some version and point format, with three points of class 2, 6 and 9 and two extra bytes.
fn file(minor: u8, format: u8, color: Option<usize>) -> Vec<u8> {
    let lengths = [20u16, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
    let length = lengths[usize::from(format)] + 2;
    let size = if minor == 4 { 375 } else { 227 };
    let mut bytes = vec![0; size];
    put(&mut bytes, 0, b"LASF");
    put(&mut bytes, 24, &[1, minor]);
    put(&mut bytes, 94, &(size as u16).to_le_bytes());
    put(&mut bytes, 96, &(size as u32).to_le_bytes());
    put(&mut bytes, 104, &[format]);
    put(&mut bytes, 105, &length.to_le_bytes());
    match minor {
        4 => put(&mut bytes, 247, &3u64.to_le_bytes()),
        _ => put(&mut bytes, 107, &3u32.to_le_bytes()),
    }
    for (axis, scale) in [0.01, 0.001, 0.5].into_iter().enumerate() {
        put(&mut bytes, 131 + 8 * axis, &f64::to_le_bytes(scale));
    }
    put(&mut bytes, 155, &500_000f64.to_le_bytes());
    put(&mut bytes, 163, &4_649_776.22f64.to_le_bytes());
    for (i, class) in [2u8, 6, 9].into_iter().enumerate() {
        let mut point = vec![0xee; usize::from(length)];
        for axis in 0..3 {
            let steps = [123_456i32, -7, 2_000_000_000][(i + axis) % 3];
            put(&mut point, 4 * axis, &steps.to_le_bytes());
        }
        // The second point is withheld, the others are not.
        let withheld = i == 1;
        match format {
            ..=5 => point[15] = class | if withheld { 0x80 } else { 0x40 },
            _ => put(&mut point, 15, &[if withheld { 4 } else { 0xf3 }, class]),
        }
        if let Some(at) = color {
            let channels = [65535u16, 13107, 256 * i as u16];
            let channels = channels.into_iter().flat_map(u16::to_le_bytes);
            put(&mut point, at, &channels.collect::<Vec<_>>());
        }
        bytes.extend(point);
    }
    bytes
}

const COLORS: [Option<usize>; 11] = [
    None,
    None,
    Some(20),
    Some(28),
    None,
    Some(28),
    None,
    Some(30),
    Some(30),
    None,
    Some(30),
];

#[test]
fn every_point_format_and_version_is_read() {
    for (format, color) in (0u8..).zip(COLORS) {
        let minor = if format > 5 { 4 } else { format.min(3) };
        let (mesh, warnings) = read_bytes(&file(minor, format, color)).expect("points");
        let y = |steps: i32| f64::from(steps) * 0.001 + 4_649_776.22;
        let first = [123_456.0 * 0.01 + 500_000.0, y(-7), 1e9];
        assert_eq!(mesh.positions[0], first, "{format}");
        assert_eq!(mesh.positions[1][1], y(2_000_000_000), "{format}");
        assert_eq!(mesh.classes, Some(vec![2, 6, 9]), "{format}");
        assert_eq!(mesh.colors.is_some(), color.is_some(), "{format}");
        if let Some(colors) = &mesh.colors {
            assert_eq!(colors[0], [1.0, 0.2, 0.0, 1.0], "{format}");
        }
        let codes: Vec<_> = warnings.iter().map(|w| (&*w.code, w.first)).collect();
        assert_eq!(
            codes,
            [("withheld-points", Some(1)), ("ignored-properties", None)]
        );
        assert!(
            warnings[1].message.ends_with("extra bytes"),
            "{}",
            warnings[1].message
        );
    }
}

#[test]
fn colours_may_use_a_byte_or_nothing() {
    let mut bytes = file(2, 2, None);
    let black = |bytes: &mut [u8], value: u16| {
        for i in 0..3 {
            let at = 227 + 28 * i + 20;
            let channels = [value, 0, 0].into_iter().flat_map(u16::to_le_bytes);
            put(bytes, at, &channels.collect::<Vec<_>>());
        }
    };
    black(&mut bytes, 51);
    let (mesh, warnings) = read_bytes(&bytes).expect("points");
    assert_eq!(mesh.colors.expect("colours")[2], [0.2, 0.0, 0.0, 1.0]);
    assert!(warnings.iter().any(|w| w.code == "colours-of-bytes"));
    black(&mut bytes, 0);
    let (mesh, warnings) = read_bytes(&bytes).expect("points");
    assert_eq!(mesh.colors, None);
    assert!(warnings.iter().any(|w| w.code == "black-colours"));
    for i in 0..3 {
        bytes[227 + 28 * i + 15] = 0;
    }
    assert_eq!(read_bytes(&bytes).expect("points").0.classes, None);
}

#[test]
fn what_is_no_las_file_is_refused_with_the_byte() {
    let with = |at: usize, value: &[u8]| {
        let mut bytes = file(2, 3, Some(28));
        put(&mut bytes, at, value);
        message(&bytes)
    };
    assert_eq!(with(3, b"X"), "byte 0: does not begin with \"LASF\"");
    assert_eq!(
        with(24, &[2]),
        "byte 24: version 2.2 is not read, only 1.0 to 1.4"
    );
    assert_eq!(
        with(104, &[11]),
        "byte 104: point format 11 is not read, only 0 to 10"
    );
    assert_eq!(
        with(105, &[33]),
        "byte 105: points of 33 bytes, but format 3 has 34"
    );
    assert_eq!(
        with(96, &[0; 4]),
        "byte 96: points begin at byte 0, but the file has 335"
    );
    assert_eq!(with(131, &[0; 8]), "byte 131: the scale of x is 0");
    let nan = f64::NAN.to_le_bytes();
    assert_eq!(with(163, &nan), "byte 163: the offset of y is NaN");
    assert_eq!(
        with(107, &[4]),
        "byte 335: the file ends after 3 of 4 points"
    );
    assert_eq!(with(107, &[0]), "holds no points");
    assert_eq!(
        with(104, &[0x83]),
        "byte 227: points are packed, but no record of LASzip says how"
    );
    let bytes = file(4, 6, None);
    for length in 0..bytes.len() {
        assert!(read_bytes(&bytes[..length]).is_err(), "{length}");
    }
}

/// A cloud of hundredths, some of it far from the origin.
fn cloud_of(count: usize, has_colors: bool) -> Mesh {
    let point = |i: usize| {
        let i = i as f64;
        [
            500_000.0 + (i * 37.0) % 1000.0 / 8.0,
            (i * 1.25) % 900.0,
            -i,
        ]
    };
    let color = |i: usize| [1.0, cloud::from_byte((i % 256) as u8), 0.2, 1.0];
    let mesh = Mesh {
        positions: (0..count).map(point).collect(),
        colors: has_colors.then(|| (0..count).map(color).collect()),
        classes: Some((0..count).map(|i| (i % 200) as u8).collect()),
        ..Mesh::default()
    };
    cloud::of_all(mesh).expect("points")
}

type Writer = fn(&Mesh, &mut dyn std::io::Write) -> std::io::Result<()>;

fn written(writer: Writer, mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    writer(mesh, &mut bytes).expect("bytes");
    bytes
}

#[test]
fn clouds_read_back_as_written_plain_and_packed() {
    for has_colors in [false, true] {
        let mesh = cloud_of(120_000, has_colors);
        assert_eq!(rounded(&mesh).0, 0);
        let plain = written(write, &mesh);
        let packed = written(write_packed, &mesh);
        assert_eq!(
            (is_packed(&plain), is_packed(&packed)),
            (Some(false), Some(true))
        );
        assert!(packed.len() < plain.len() / 2);
        for bytes in [plain, packed] {
            let (back, warnings) = read_bytes(&bytes).expect("points");
            assert_eq!(warnings.len(), 1, "{warnings:?}");
            assert!(back == mesh);
        }
    }
}

#[test]
fn points_of_the_older_kind_are_unpacked() {
    use laz::{LazVlrBuilder, laszip::LasZipCompressor};
    let records = file(2, 3, Some(28));
    for (kind, chunk) in [
        ("chunks", 2),
        ("one chunk", 50_000),
        ("chunks of any size", u32::MAX),
    ] {
        let vlr = LazVlrBuilder::default()
            .with_point_format(3, 2)
            .expect("a format");
        let vlr = match chunk {
            u32::MAX => vlr.with_variable_chunk_size(),
            chunk => vlr.with_fixed_chunk_size(chunk),
        };
        let vlr = vlr.build();
        let mut packing = Vec::new();
        vlr.write_to(&mut packing).expect("bytes");
        let mut bytes = records[..227].to_vec();
        let mut record = [0; 54];
        put(&mut record, 2, b"laszip encoded");
        put(&mut record, 18, &22204u16.to_le_bytes());
        put(&mut record, 20, &(packing.len() as u16).to_le_bytes());
        bytes.extend(record);
        bytes.extend(&packing);
        let data = bytes.len() as u32;
        put(&mut bytes, 96, &data.to_le_bytes());
        put(&mut bytes, 100, &1u32.to_le_bytes());
        put(&mut bytes, 104, &[0x83]);
        let mut out = std::io::Cursor::new(bytes);
        out.set_position(u64::from(data));
        let mut compressor = LasZipCompressor::new(&mut out, vlr).expect("a compressor");
        for (i, point) in records[227..].chunks_exact(36).enumerate() {
            compressor.compress_one(point).expect("bytes");
            if chunk == u32::MAX && i == 0 {
                compressor.finish_current_chunk().expect("bytes");
            }
        }
        compressor.done().expect("bytes");
        drop(compressor);
        let bytes = out.into_inner();
        assert_eq!(read_bytes(&bytes), read_bytes(&records), "{kind}");
        for length in (0..bytes.len()).step_by(7) {
            assert!(
                read_bytes(&bytes[..length]).is_err(),
                "{kind} cut at {length}"
            );
        }
    }
}

#[test]
fn tables_that_claim_too_much_are_refused() {
    let bytes = written(write_packed, &cloud_of(100, false));
    let data = header::u32_at(&bytes, 96) as usize;
    let table = header::u64_at(&bytes, data) as usize;
    let with = |at: usize, value: &[u8]| {
        let mut bytes = bytes.clone();
        put(&mut bytes, at, value);
        message(&bytes)
    };
    let most = (table - data - 8) / 30;
    assert_eq!(
        with(table + 4, &u32::MAX.to_le_bytes()),
        format!(
            "byte {}: the table has 4294967295 chunks, but the file holds {most} at most",
            table + 4
        )
    );
    let said = with(data + 8 + 30 + 4, &u32::MAX.to_le_bytes());
    assert!(
        said.starts_with(&format!("byte {}: layers of 42949", data + 8)),
        "{said}"
    );
    assert_eq!(
        with(247, &60_000u64.to_le_bytes()),
        format!("byte {table}: the file ends after 50000 of 60000 points")
    );
    let said = with(247, &101u64.to_le_bytes());
    assert!(
        said.ends_with("a chunk ends after 100 of 101 points"),
        "{said}"
    );
    assert_eq!(
        with(data, &u64::MAX.to_le_bytes()).split(": ").nth(1),
        Some("the table of chunks is at byte 18446744073709551615, which is not there")
    );
}

#[test]
fn coordinates_are_rounded_to_the_finest_step_that_fits() {
    let cloud = |positions: Vec<[f64; 3]>| {
        cloud::of_all(Mesh {
            positions,
            ..Mesh::default()
        })
        .expect("points")
    };
    let third = cloud(vec![[1.0 / 3.0, 0.25, 1e12], [1000.0, 7.5, -1e12]]);
    let (count, first, step) = rounded(&third);
    assert_eq!((count, first, step), (1, Some(0), 1000.0));
    let (back, _) = read_bytes(&written(write, &third)).expect("points");
    assert!((back.positions[0][0] - 1.0 / 3.0).abs() <= 5e-7);
    assert_eq!(back.positions[0][1..], [0.25, 1e12]);
    // Far from the origin the offset takes the large part.
    let far = cloud(vec![[4_649_776.125, 0.0, 0.0], [4_649_777.5, 0.0, 0.0]]);
    assert_eq!(rounded(&far).0, 0);
    assert_eq!(
        read_bytes(&written(write, &far))
            .expect("points")
            .0
            .positions,
        far.positions
    );
    let wide = cloud(vec![[1e308; 3], [-1e308; 3]]);
    let (back, _) = read_bytes(&written(write, &wide)).expect("points");
    assert!((back.positions[0][0] - 1e308).abs() < 1e299);
    let endless = cloud(vec![[f64::MAX; 3], [f64::MIN; 3]]);
    assert_eq!(
        read_bytes(&written(write, &endless))
            .expect("points")
            .0
            .positions
            .len(),
        2
    );
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(
        which in 0..4usize,
        at in any::<prop::sample::Index>(),
        change in prop::collection::vec(any::<u8>(), 1..4),
    ) {
        let mut bytes = match which {
            0 => file(2, 3, Some(28)),
            1 => file(4, 10, Some(30)),
            2 => written(write_packed, &cloud_of(300, true)),
            _ => written(write_packed, &cloud_of(300, false)),
        };
        let at = at.index(bytes.len());
        for (old, new) in bytes[at..].iter_mut().zip(change) {
            *old = new;
        }
        let _ = read_bytes(&bytes);
    }
}
