//! Files for other programs to read: `tests/peers/*.py` compare what they find with the reference.

use super::format::Format;
use super::sink::Sink;
use super::source::Source;
use crate::mesh::Mesh;
use crate::volume::bits::BitGrid;
use crate::volume::octree::Octree;
use crate::volume::{Data, Frame, Volume};
use serde_json::json;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

type Writer = fn(&Volume, &mut dyn Write) -> io::Result<()>;

/// A frame whose axes are turned about z by the angle of 3-4-5.
fn turned(dims: [usize; 3]) -> Frame {
    Frame {
        dims,
        origin: [10.5, -20.25, 3.125],
        axes: [[0.3, 0.4, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 2.0]],
    }
}

/// Bits without symmetry: a ball cut by a plane, and a lone voxel in the last corner.
fn shape(frame: Frame) -> Volume {
    let [nx, ny, nz] = frame.dims;
    let mut grid = BitGrid::new(frame.dims);
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let (u, v, w) = (x as f64 - 20.0, y as f64 - 15.0, z as f64 - 17.0);
                if u * u + v * v + w * w < 225.0 && 2 * x + y < 55 + z {
                    grid.set(x, y, z);
                }
            }
        }
    }
    grid.set(nx - 1, ny - 1, nz - 1);
    Volume {
        frame,
        data: Data::Bits(grid),
    }
}

/// Numbers that differ everywhere.
fn numbers(frame: Frame) -> Volume {
    let values = (0..frame.len() as i32).map(|i| (i * 37 % 20011 - 10000) as i16);
    Volume {
        frame,
        data: Data::I16(values.collect()),
    }
}

fn write(folder: &Path, name: &str, volume: &Volume, formats: &[Format]) {
    let [nx, ny, nz] = volume.frame.dims;
    let mut raw = Vec::new();
    super::samples::write_raw(volume, &mut raw).unwrap();
    fs::write(folder.join(format!("{name}.reference.raw")), &raw).unwrap();
    let reference = json!({
        "dims": [nx, ny, nz],
        "type": if volume.is_binary() { "uint8" } else { "int16" },
        "origin": volume.frame.origin,
        "axes": volume.frame.axes,
    });
    let text = serde_json::to_vec(&reference).unwrap();
    fs::write(folder.join(format!("{name}.reference.json")), text).unwrap();
    for format in formats {
        let path = folder.join(format!("{name}.{}", format.name()));
        let sink = Sink::File(path.clone());
        super::write_volume(volume, &sink, *format).unwrap();
        if format.is_read() {
            let source = Source::open(path.to_str().unwrap(), u64::MAX).unwrap();
            let (back, _, _) = super::read_volume(&source, Some(*format)).unwrap();
            assert_eq!(back.count_set(), volume.count_set());
        }
    }
}

#[test]
#[ignore = "writes into the folder named by SCANTLE_PEERS, for tests/peers/formats_readback.py"]
fn write_files_for_peers() {
    let folder = std::env::var_os("SCANTLE_PEERS").expect("SCANTLE_PEERS names a folder");
    let folder = Path::new(&folder);
    let straight = Frame::straight([45, 37, 70], [1.5, -2.25, 1e3], [0.5, 0.25, 2.0]);
    let uniform = Frame::straight([48; 3], [-7.0, 0.125, 3.0], [0.1; 3]);
    let mut formats = vec![
        Format::Nrrd,
        Format::Mha,
        Format::Mhd,
        Format::Nifti,
        Format::Npy,
        Format::Vti,
    ];
    write(folder, "numbers", &numbers(straight), &formats);
    write(
        folder,
        "numbers-turned",
        &numbers(turned([9, 8, 7])),
        &formats,
    );
    formats.push(Format::Vdb);
    write(folder, "bits", &shape(straight), &formats);
    write(
        folder,
        "bits-turned",
        &shape(turned([45, 37, 70])),
        &formats,
    );
    let large = Frame::straight([300, 150, 140], [0.0; 3], [1.0; 3]);
    let mut solid = shape(large);
    if let Data::Bits(grid) = &mut solid.data {
        for z in 0..140 {
            for y in 0..150 {
                grid.set_run(100, 300, y, z);
            }
        }
    }
    write(folder, "bits-solid", &solid, &[Format::Nrrd, Format::Vdb]);
    formats.push(Format::Binvox);
    write(folder, "bits-cube", &shape(uniform), &formats);

    let mesh = Mesh {
        positions: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 0.0, 3.0],
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..Mesh::default()
    };
    let sink = Sink::File(folder.join("tetrahedron.glb"));
    let (outputs, _) = super::write_mesh(&mesh, &sink, Format::Glb).unwrap();
    assert!(outputs[0].bytes > 0);
}

/// Bits are written the same whether they are stored densely or sparsely.
#[test]
fn sparse_and_dense_volumes_are_written_alike() {
    let solid = |dims: [usize; 3]| {
        let mut volume = shape(Frame::straight(dims, [0.0; 3], [0.5; 3]));
        if let Data::Bits(grid) = &mut volume.data {
            for z in dims[2] / 4..dims[2] {
                for y in 0..dims[1] {
                    grid.set_run(dims[0] / 3, dims[0], y, z);
                }
            }
        }
        volume
    };
    for dims in [
        [130, 45, 71],
        [37, 37, 37],
        [144, 144, 144],
        [257, 131, 190],
    ] {
        let dense = solid(dims);
        let Data::Bits(grid) = &dense.data else {
            panic!("the shape is made of bits");
        };
        let sparse = Volume {
            frame: dense.frame,
            data: Data::Sparse(Octree::from_bits(grid)),
        };
        let writers: [Writer; 7] = [
            super::nrrd::write,
            super::metaimage::write,
            super::nifti::write,
            super::npy::write,
            super::vti::write,
            super::vdb::write,
            super::binvox::write,
        ];
        for (index, writer) in writers.into_iter().enumerate() {
            let (mut a, mut b) = (Vec::new(), Vec::new());
            writer(&dense, &mut a).unwrap();
            writer(&sparse, &mut b).unwrap();
            assert!(a == b, "writer {index} of a grid of {dims:?}");
        }
    }
}
