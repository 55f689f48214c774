use super::*;
use crate::io::written_volume::{Parsed, damaged, parsed, raw, twelve, volumes, written};
use crate::volume::{Data, Frame};
use proptest::prelude::*;

fn parse(bytes: &[u8]) -> Parsed {
    parsed("a.nrrd", bytes, read)
}

fn with(fields: &str, data: &[u8]) -> Result<(Volume, Vec<Warning>), Fault> {
    parse(&[b"NRRD0004\n", fields.as_bytes(), b"\n\n", data].concat())
}

proptest! {
    #[test]
    fn what_is_written_comes_back(volume in volumes()) {
        let (back, warnings) = parse(&written(&volume, write)).unwrap();
        prop_assert!(warnings.is_empty());
        prop_assert_eq!(back.frame, volume.frame);
        prop_assert_eq!(raw(&back), raw(&volume));
        back.check().unwrap();
    }

    #[test]
    fn any_bytes_are_read_or_refused(cut in 0usize..400, at in 0usize..400, byte in any::<u8>()) {
        let _ = parse(&damaged(written(&twelve(), write), at, byte, cut));
    }
}

#[test]
fn encodings_hold_the_same_samples() {
    let fields = |encoding: &str| {
        format!("type: short\ndimension: 3\nsizes: 2 2 1\nendian: big\nencoding: {encoding}")
    };
    let samples = [0, 1, 0xff, 0xfe, 0, 3, 1, 0];
    let wanted = Data::I16(vec![1, -2, 3, 256]);
    assert_eq!(with(&fields("raw"), &samples).unwrap().0.data, wanted);
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(&samples).unwrap();
    let packed = packer.finish().unwrap();
    assert_eq!(with(&fields("gzip"), &packed).unwrap().0.data, wanted);
    assert_eq!(
        with(&fields("ascii"), b"1 -2\n3 256\n").unwrap().0.data,
        wanted
    );
    let after = format!("{}\nline skip: 1\nbyte skip: 2", fields("raw"));
    let stored = [b"a line\nxx".as_slice(), &samples].concat();
    assert_eq!(with(&after, &stored).unwrap().0.data, wanted);
    let last = format!("{}\nbyte skip: -1", fields("raw"));
    assert_eq!(with(&last, &stored).unwrap().0.data, wanted);
    let after = format!("{}\nbyte skip: 2", fields("gz"));
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer
        .write_all(&[&[9, 9], samples.as_slice()].concat())
        .unwrap();
    assert_eq!(
        with(&after, &packer.finish().unwrap()).unwrap().0.data,
        wanted
    );
}

#[test]
fn placement_by_spacing_counts_from_the_middle_of_cells() {
    let fields = "type: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\nspacings: 0.5 2 NaN\n\
                  axis mins: 10 20 30\ncenters: cell node cell\nkey:=value";
    let (volume, _) = with(fields, &[1, 2]).unwrap();
    assert_eq!(
        volume.frame,
        Frame::straight([2, 1, 1], [10.25, 20.0, 30.5], [0.5, 2.0, 1.0])
    );
    let fields = "type: uchar\ndimension: 2\nsizes: 2 1\nencoding: raw\naxis mins: 0 0\n\
                  axis maxs: 3 4\ncenterings: node cell";
    let (volume, warnings) = with(fields, &[1, 2, 3]).unwrap();
    assert_eq!(
        volume.frame,
        Frame::straight([2, 1, 1], [0.0, 2.0, 0.0], [3.0, 4.0, 1.0])
    );
    assert_eq!(warnings[0].code, "trailing-bytes");
}

#[test]
fn a_leading_axis_of_size_one_is_taken_off() {
    let fields = "type: uchar\ndimension: 4\nspace: left-posterior-superior\nsizes: 1 2 1 1\n\
                  encoding: raw\nspace directions: none (0, 2, 0) (3,0,0) (0,0,1)\n\
                  space origin: (1,2,3)";
    let (volume, _) = with(fields, &[1, 2]).unwrap();
    assert_eq!(volume.frame.dims, [2, 1, 1]);
    assert_eq!(volume.frame.origin, [1.0, 2.0, 3.0]);
    assert_eq!(volume.frame.axes[0], [0.0, 2.0, 0.0]);
    let fault = with(&fields.replace("1 2 1 1", "3 2 1 1"), &[0; 6]).unwrap_err();
    assert!(fault.problem.contains("the first holds 3 values per voxel"));
}

#[test]
fn a_detached_header_names_its_data() {
    let folder = tempfile::tempdir().unwrap();
    let header = folder.path().join("a.nhdr");
    let text =
        "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 3 1 1\nencoding: raw\ndata file: a.raw\n";
    std::fs::write(&header, text).unwrap();
    // Raw samples may look like the start of a gzip file.
    std::fs::write(folder.path().join("a.raw"), [0x1f, 0x8b, 8]).unwrap();
    let source = Source::open(header.to_str().unwrap(), u64::MAX).unwrap();
    let volume = read(&source, &mut Vec::new()).unwrap();
    assert_eq!(volume.data, Data::U8(vec![0x1f, 0x8b, 8]));
}
