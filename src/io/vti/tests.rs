use super::*;
use crate::io::base64::tests::encoded;
use crate::io::samples::ByteOrder;
use crate::io::written_volume::{
    Parsed, damaged, parsed, raw, same_axes, twelve, volumes, written,
};
use crate::numeric::vector::{Vec3, length, sub};
use crate::volume::Frame;
use proptest::prelude::*;

fn parse(bytes: &[u8]) -> Parsed {
    parsed("a.vti", bytes, read)
}

fn refusal(text: &str) -> String {
    parse(text.as_bytes()).unwrap_err().to_string()
}

/// An image of 3 x 2 x 1 points whose first array is `array`, in line 5.
fn document(file: &str, array: &str, after: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" {file}>\n\
         <ImageData WholeExtent=\"0 2 0 1 0 0\">\n<Piece Extent=\"0 2 0 1 0 0\"><PointData>\n\
         {array}\n</PointData></Piece></ImageData>\n{after}</VTKFile>\n"
    )
}

fn array(attributes: &str, text: &str) -> String {
    format!("<DataArray Name=\"a\" {attributes}>{text}</DataArray>")
}

/// Six bytes as text.
fn plain(attributes: &str) -> String {
    array(&format!("type=\"UInt8\" {attributes}"), "1 2 3 4 5 6")
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

/// How numbers are stored before the data.
#[derive(Clone, Copy)]
struct Numbers {
    width: usize,
    order: ByteOrder,
}

impl Numbers {
    const EACH: [Numbers; 4] = {
        let (little, big) = (ByteOrder::Little, ByteOrder::Big);
        [
            Numbers {
                width: 4,
                order: little,
            },
            Numbers {
                width: 4,
                order: big,
            },
            Numbers {
                width: 8,
                order: little,
            },
            Numbers {
                width: 8,
                order: big,
            },
        ]
    };

    fn bytes(self, numbers: &[u64]) -> Vec<u8> {
        let one = |number: &u64| {
            let mut bytes = number.to_le_bytes()[..self.width].to_vec();
            if self.order == ByteOrder::Big {
                bytes.reverse();
            }
            bytes
        };
        numbers.iter().flat_map(one).collect()
    }

    /// The attributes of a file.
    fn attributes(self) -> String {
        let order = match self.order {
            ByteOrder::Little => "LittleEndian",
            ByteOrder::Big => "BigEndian",
        };
        format!(
            "byte_order=\"{order}\" header_type=\"UInt{}\"",
            8 * self.width
        )
    }

    /// The two parts of data in blocks of `size` bytes: the table, then the blocks.
    fn packed(self, data: &[u8], size: usize) -> [Vec<u8>; 2] {
        let blocks: Vec<_> = data.chunks(size).map(zlib).collect();
        let mut table = vec![blocks.len() as u64, size as u64, (data.len() % size) as u64];
        table.extend(blocks.iter().map(|block| block.len() as u64));
        [self.bytes(&table), blocks.concat()]
    }
}

const ZLIB: &str = "compressor=\"vtkZLibDataCompressor\"";

/// The same data inline and appended, as base64 and raw, packed and not; appended data lies behind
/// three bytes of something else.
fn stored(numbers: Numbers, kind: &str, data: &[u8]) -> Vec<Vec<u8>> {
    let count = numbers.bytes(&[data.len() as u64]);
    let mut documents = Vec::new();
    for (packing, parts) in [
        ("", [[count, data.to_vec()].concat(), vec![]]),
        (ZLIB, numbers.packed(data, 5)),
        (ZLIB, numbers.packed(data, data.len())),
    ] {
        let file = format!("{} {packing}", numbers.attributes());
        let text = parts.each_ref().map(|part| encoded(part)).concat();
        let inline = array(
            &format!("type=\"{kind}\" format=\"binary\""),
            &format!("\n {text}\n"),
        );
        documents.push(document(&file, &inline, "").into_bytes());
        let appended = array(
            &format!("type=\"{kind}\" format=\"appended\" offset=\"4\""),
            "",
        );
        let with = |encoding: &str, bytes: &[u8]| {
            let start = format!("<AppendedData encoding=\"{encoding}\">\n _");
            let text = document(&file, &appended, &start);
            let head = text.strip_suffix("</VTKFile>\n").unwrap();
            [
                head.as_bytes(),
                b"AAAA",
                bytes,
                b"</AppendedData></VTKFile>",
            ]
            .concat()
        };
        documents.push(with("base64", text.as_bytes()));
        documents.push(with("raw", &parts.concat()));
    }
    documents
}

#[test]
fn each_type_is_read_from_each_way_to_store_it() {
    let kinds = [
        "UInt8", "Int8", "UInt16", "Int16", "UInt32", "Int32", "UInt64", "Int64", "Float32",
        "Float64",
    ];
    for (kind, sample) in kinds.into_iter().zip(SampleType::ALL) {
        let little: Vec<u8> = (0..6 * sample.bytes())
            .map(|i| (i * 89 + 7) as u8)
            .collect();
        let wanted = samples::decode(&little, sample, ByteOrder::Little);
        for numbers in Numbers::EACH {
            let mut data = little.clone();
            if numbers.order == ByteOrder::Big {
                data.chunks_exact_mut(sample.bytes())
                    .for_each(<[u8]>::reverse);
            }
            for (way, bytes) in stored(numbers, kind, &data).iter().enumerate() {
                let (volume, warnings) = parse(bytes).unwrap();
                assert_eq!(volume.data, wanted, "{kind}, way {way}");
                assert_eq!(volume.frame, Frame::straight([3, 2, 1], [0.0; 3], [1.0; 3]));
                assert_eq!(warnings, []);
            }
        }
    }
}

#[test]
fn text_is_read_with_what_stands_around_it() {
    let text = "\n<InformationKey name=\"k\"><Value>9</Value></InformationKey>\n -1 2e3 <!-- 9 -->\n\
                3 4 5 nan ";
    let text = document("", &array("type=\"Float32\" format=\"ascii\"", text), "");
    let Data::F32(values) = parse(text.as_bytes()).unwrap().0.data else {
        panic!("not f32");
    };
    assert_eq!(values[..5], [-1.0, 2000.0, 3.0, 4.0, 5.0]);
    assert!(values[5].is_nan());
}

/// Where a voxel is.
fn place(frame: &Frame, index: Vec3) -> Vec3 {
    std::array::from_fn(|c| {
        frame.origin[c] + (0..3).map(|a| index[a] * frame.axes[a][c]).sum::<f64>()
    })
}

/// An image of zeros as text.
fn zeros(extent: &str, on: &str, count: usize) -> Volume {
    let text = format!(
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"{extent}\" Origin=\"1 2 3\" \
         Spacing=\"2 3 4\" Direction=\"0 -1 0 1 0 0 0 0 1\"><Piece Extent=\"{extent}\"><{on}>\
         <DataArray type=\"Int8\">{}</DataArray></{on}></Piece></ImageData></VTKFile>",
        "0 ".repeat(count)
    );
    parse(text.as_bytes()).unwrap().0
}

#[test]
fn points_and_cells_are_where_origin_spacing_direction_and_extent_put_them() {
    // A quarter turn: x to y, y to -x.
    let axes = [[0.0, 2.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 0.0, 4.0]];
    let points = zeros("10 11 -5 -3 0 1", "PointData", 12).frame;
    assert_eq!((points.dims, points.axes), ([2, 3, 2], axes));
    // Point (11, -3, 1): 22 along y, 9 along x, 4 along z, after the origin.
    assert_eq!(place(&points, [1.0, 2.0, 1.0]), [10.0, 24.0, 7.0]);
    let cells = zeros("10 11 -5 -3 0 1", "CellData", 2).frame;
    assert_eq!((cells.dims, cells.axes), ([1, 2, 1], axes));
    // The middle of (10, -4, 0) and (11, -3, 1): 21 along y, 10.5 along x, 2 along z.
    assert_eq!(place(&cells, [0.0, 1.0, 0.0]), [11.5, 23.0, 5.0]);
    // A plane of cells is in the plane of its points.
    let plane = zeros("0 2 0 3 7 7", "CellData", 6).frame;
    assert_eq!(plane.dims, [2, 3, 1]);
    assert_eq!(plane.origin, [1.0 - 1.5, 2.0 + 1.0, 3.0 + 28.0]);
}

/// The array that is read of a piece, by its first sample, and how many are left out.
fn first_of(points: &str, cells: &str) -> Result<(f64, u64), String> {
    let text = format!(
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 1\">\n\
         <Piece Extent=\"0 1 0 1 0 1\">{points}{cells}</Piece></ImageData></VTKFile>"
    );
    let (volume, warnings) = parse(text.as_bytes()).map_err(|fault| fault.to_string())?;
    let left_out = warnings.iter().map(|warning| {
        assert_eq!(warning.code, "vti-arrays");
        warning.count
    });
    Ok((volume.range().unwrap()[0], left_out.sum()))
}

#[test]
fn scalars_come_first_then_arrays_of_one_component() {
    let array = |name: &str, components: usize, value: usize, count: usize| {
        let text = format!("{value} ").repeat(components * count);
        format!(
            "<DataArray type=\"UInt8\" Name=\"{name}\" NumberOfComponents=\"{components}\">{text}\
             </DataArray>"
        )
    };
    let points = |scalars: &str| {
        let arrays = [
            array("v", 3, 1, 8),
            array("p", 1, 2, 8),
            array("q", 1, 3, 8),
        ];
        format!("<PointData{scalars}>{}</PointData>", arrays.concat())
    };
    let cells = |scalars: &str| {
        format!(
            "<CellData{scalars}>{}{}</CellData>",
            array("c", 1, 4, 1),
            array("d", 1, 5, 1)
        )
    };
    let none = || "<PointData/>".to_owned();
    assert_eq!(first_of(&points(""), &cells("")), Ok((2.0, 4)));
    assert_eq!(first_of(&points(" Scalars=\"\""), ""), Ok((2.0, 2)));
    assert_eq!(
        first_of(&points(" Scalars='q'"), &cells(" Scalars='d'")),
        Ok((3.0, 4))
    );
    assert_eq!(first_of(&points(""), &cells(" Scalars='d'")), Ok((5.0, 4)));
    assert_eq!(first_of(&none(), &cells("")), Ok((4.0, 1)));
    assert_eq!(
        first_of(&points(" Scalars='v'"), "").unwrap_err(),
        "2: the array \"v\" has 3 components, one is needed"
    );
    assert_eq!(
        first_of(&points(" Scalars='d'"), &cells("")).unwrap_err(),
        "2: Scalars is \"d\", but there is no array of this name"
    );
    assert_eq!(
        first_of(&none(), "").unwrap_err(),
        "2: none of its 0 arrays has one component"
    );
}

#[test]
fn files_that_are_no_images_of_one_piece_are_named() {
    let whole = document("", &plain(""), "");
    assert!(parse(whole.as_bytes()).is_ok());
    let check = |from: &str, to: &str, wanted: &str| {
        let changed = whole.replace(from, to);
        assert_ne!(changed, whole, "{from}");
        assert_eq!(refusal(&changed), wanted);
    };
    check(
        "\"ImageData\" ",
        "\"PolyData\" ",
        "2: <VTKFile> holds \"PolyData\", but ImageData is needed",
    );
    check(
        " type=\"ImageData\"",
        "",
        "2: <VTKFile> has no attribute type",
    );
    check(
        "VTKFile",
        "VTK",
        "2: <VTK> is the root, but VTKFile is needed",
    );
    check(
        "</PointData>",
        "",
        "6: </Piece> where <PointData> of line 4 is open",
    );
    check(
        "</Piece>",
        "</Piece>\n<Piece Extent=\"0 2 0 1 0 0\"/>",
        "7: <Piece> is a second piece, the first in line 4; one is read",
    );
    check(
        "<Piece Extent=\"0 2",
        "<Piece Extent=\"0 1",
        "4: <Piece> has the extent 0 1 0 1 0 0, but the whole image has 0 2 0 1 0 0",
    );
    check(
        "<Piece Extent",
        "<Piece Content",
        "4: <Piece> has no attribute Extent",
    );
    check(
        "WholeExtent=\"0 2 0 1 0 0\"",
        "WholeExtent=\"0 2 0 -1 0 0\"",
        "3: <ImageData> WholeExtent: from 0 to -1 there is no point along axis 1",
    );
    check(
        "WholeExtent=\"0 2 0 1 0 0\"",
        "WholeExtent=\"0 2 0 1 0\"",
        "3: <ImageData> WholeExtent: 5 values, but 6 are needed",
    );
    check(
        "<ImageData W",
        "<ImageData Spacing=\"1 x 1\" W",
        "3: <ImageData> Spacing: \"x\" is not a number",
    );
    check(
        "<ImageData W",
        "<ImageData Direction=\"1\" W",
        "3: <ImageData> Direction: 1 values, but 9 are needed",
    );
    check(
        "type=\"UInt8\"",
        "type=\"String\"",
        "5: the array \"a\" has the type \"String\", which is no number",
    );
    check("type=\"UInt8\"", "", "5: <DataArray> has no attribute type");
    check("1 2 3", "1 256 3", "sample 1: \"256\" is not a u8");
    check("1 2 3", "", "6 samples are needed, but 3 are there");
    let check =
        |file: &str, wanted: &str| assert_eq!(refusal(&document(file, &plain(""), "")), wanted);
    check(
        "byte_order=\"Middle\"",
        "2: <VTKFile> byte_order: \"Middle\" is neither LittleEndian nor BigEndian",
    );
    check(
        "header_type=\"UInt16\"",
        "2: <VTKFile> header_type: \"UInt16\" is neither UInt32 nor UInt64",
    );
    assert_eq!(refusal(" "), "holds no element");
    assert_eq!(
        refusal("<VTKFile type=\"ImageData\"/>"),
        "1: <VTKFile> holds no ImageData"
    );
    let empty = "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 1\"/></VTKFile>";
    assert_eq!(refusal(empty), "1: <ImageData> holds no Piece");
}

#[test]
fn arrays_that_do_not_hold_what_they_should_are_named() {
    let inline = |file: &str, parts: &[&[u8]]| {
        let text: String = parts.iter().map(|part| encoded(part)).collect();
        refusal(&document(
            file,
            &array("type=\"UInt8\" format=\"binary\"", &text),
            "",
        ))
    };
    assert_eq!(
        inline("", &[&[7, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7]]),
        "5: the array \"a\" says 7 bytes, but the image needs 6"
    );
    assert_eq!(
        inline("", &[&[6, 0, 0, 0, 1, 2]]),
        "5: the array \"a\" needs 6 bytes more, but no more than 2 are there"
    );
    assert_eq!(
        inline("", &[&[]]),
        "5: the array \"a\" needs 4 bytes more, but no more than 0 are there"
    );
    let lz4 = "compressor=\"vtkLZ4DataCompressor\"";
    assert_eq!(
        inline(lz4, &[&[6, 0, 0, 0]]),
        "5: the array \"a\" is packed with vtkLZ4DataCompressor, but vtkZLibDataCompressor alone is read"
    );
    // A compressor says nothing of text.
    assert!(parse(document(lz4, &plain(""), "").as_bytes()).is_ok());
    let text = |text: &str| {
        refusal(&document(
            "",
            &array("type=\"UInt8\" format=\"binary\"", text),
            "",
        ))
    };
    assert_eq!(
        text("BgAAAAECAwQ!Bg=="),
        "5: the array \"a\" is damaged: character 11 of its base64 data is '!', which is out of place"
    );
    assert_eq!(
        text("BgAAAAECAwQFB"),
        "5: the array \"a\" is damaged: its base64 data ends within four characters"
    );
    let of = |attributes: &str, after: &str| refusal(&document("", &plain(attributes), after));
    assert_eq!(
        of("format=\"hex\"", ""),
        "5: the array \"a\" has the format \"hex\", which is not known"
    );
    assert_eq!(
        of("format=\"appended\" offset=\"0\"", ""),
        "5: the array \"a\" is appended, but the file has no AppendedData"
    );
    let raw = "<AppendedData encoding=\"raw\">_</AppendedData>";
    assert_eq!(
        of("format=\"appended\"", raw),
        "5: the array \"a\" has no offset"
    );
    assert_eq!(
        of("format=\"appended\" offset=\"99\"", raw),
        "5: the array \"a\" begins at byte 99 of the appended data, which has 0"
    );
    assert_eq!(
        of("", "<AppendedData>AAAA</AppendedData>"),
        "7: <AppendedData> does not begin with an underscore"
    );
    assert_eq!(
        of("", "<AppendedData encoding=\"hex\">_</AppendedData>"),
        "7: <AppendedData> encoding: \"hex\" is neither raw nor base64"
    );
}

#[test]
fn blocks_that_do_not_fit_their_table_are_named() {
    let data = [1, 2, 3, 4, 5, 6];
    let numbers = Numbers::EACH[0];
    let refusal = |table: &[u64], blocks: &[u8]| {
        let text = encoded(&numbers.bytes(table)) + &encoded(blocks);
        refusal(&document(
            ZLIB,
            &array("type=\"UInt8\" format=\"binary\"", &text),
            "",
        ))
    };
    let [short, rest] = [zlib(&data[..4]), zlib(&data[4..])];
    let blocks = [&short[..], &rest].concat();
    let [a, b] = [short.len() as u64, rest.len() as u64];
    assert_eq!(
        refusal(&[2, 4, 0, a, b], &blocks),
        "5: the array \"a\" says 8 bytes, but the image needs 6"
    );
    assert_eq!(
        refusal(&[2, 2, 4, a, b], &blocks),
        "5: the array \"a\" has blocks of 2 bytes and a last one of 4"
    );
    assert_eq!(
        refusal(&[2, 4, 2, a, b + 9], &blocks),
        format!(
            "5: the array \"a\" needs {} bytes more, but no more than {} are there",
            a + b + 9,
            (a + b).div_ceil(3) * 3
        )
    );
    assert_eq!(
        refusal(&[2, 3, 0, a, b], &blocks),
        "5: the array \"a\" is damaged in block 0: it holds more than 3 bytes"
    );
    let cut = refusal(&[2, 4, 2, a - 1, b + 1], &blocks);
    let wanted = "5: the array \"a\" is damaged in block 0: ";
    assert!(cut.starts_with(wanted), "{cut}");
    assert_eq!(
        refusal(&[1, 6, 0, 0], &[]),
        "5: the array \"a\" says 6 bytes in 0 packed ones, which cannot hold so many"
    );
    assert_eq!(
        refusal(&[u64::from(u32::MAX), 0, 6], &[]),
        "5: the array \"a\" has blocks of 0 bytes and a last one of 6"
    );
}

#[test]
fn no_room_is_made_for_what_is_not_there() {
    let extent = "WholeExtent=\"0 99999 0 99999 0 9999\"";
    let array = array(
        "type=\"UInt8\" format=\"binary\"",
        &encoded(&[1, 2, 3, 4, 5, 6]),
    );
    let text = document("", &array, "");
    let text = text.replace("Extent=\"0 2 0 1 0 0\"", &extent["Whole".len()..]);
    assert_eq!(
        refusal(&text),
        "5: the array \"a\" says 67305985 bytes, but the image needs 100000000000000"
    );
}

proptest! {
    #[test]
    fn what_is_written_comes_back(volume in volumes()) {
        let (back, warnings) = parse(&written(&volume, write)).unwrap();
        prop_assert!(warnings.is_empty());
        prop_assert_eq!(back.frame.dims, volume.frame.dims);
        prop_assert!(same_axes(&back.frame, &volume.frame));
        let size = length(volume.frame.origin) + volume.frame.axes.map(length).iter().sum::<f64>();
        let moved = length(sub(back.frame.origin, volume.frame.origin));
        prop_assert!(moved <= 8.0 * f64::EPSILON * size, "{} of {}", moved, size);
        prop_assert_eq!(raw(&back), raw(&volume));
    }

    #[test]
    fn any_bytes_are_read_or_refused(cut in 0usize..400, at in 0usize..700, byte in any::<u8>()) {
        let _ = parse(&damaged(written(&twelve(), write), at, byte, cut));
    }
}

#[test]
fn the_header_places_cells_and_the_data_follows_its_length() {
    let mut volume = Volume {
        frame: Frame::straight([2, 1, 1], [10.0, 20.0, 30.0], [2.0, 4.0, 8.0]),
        data: Data::I16(vec![-1, 2]),
    };
    let mut bytes = Vec::new();
    write(&volume, &mut bytes).unwrap();
    let start = bytes.windows(2).position(|w| w == b"\n_").unwrap() + 1;
    let header = std::str::from_utf8(&bytes[..start]).unwrap();
    assert!(
        header.contains(
            "<ImageData WholeExtent=\"0 2 0 1 0 1\" Origin=\"9 18 26\" Spacing=\"2 4 8\">"
        )
    );
    assert!(header.contains("type=\"Int16\" Name=\"voxels\""));
    assert_eq!(
        &bytes[start + 1..start + 13],
        &[4, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 2, 0]
    );
    assert!(bytes[start + 13..].starts_with(b"\n</AppendedData>"));
    volume.frame.axes = [[0.0, 2.0, 0.0], [-4.0, 0.0, 0.0], [0.0, 0.0, 8.0]];
    bytes.clear();
    write(&volume, &mut bytes).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    assert!(
        text.contains("Origin=\"12 19 26\" Spacing=\"2 4 8\" Direction=\"0 -1 0 1 0 0 0 0 1\"")
    );
}
