//! Volumes made at random or by hand, written and read back, for the tests of their formats.

use super::refusal::Refusal;
use super::samples::{ByteOrder, SampleType, decode, pack_bits, write_raw};
use super::source::Source;
use crate::error::Fault;
use crate::numeric::vector::{length, sub};
use crate::report::Warning;
use crate::volume::{Data, Frame, Volume};
use proptest::prelude::*;
use std::io::{self, Write};

/// Volumes of every sample type, with frames along the axes or turned.
pub fn volumes() -> impl Strategy<Value = Volume> {
    let dims = (1usize..70, 1usize..6, 1usize..12).prop_map(|(x, y, z)| [x, y, z]);
    let place = prop::array::uniform3(-1e3..1e3f64);
    let steps = prop::array::uniform3(1e-3..1e3f64);
    (dims, place, steps, 0usize..12, any::<u64>()).prop_map(|(dims, origin, steps, kind, seed)| {
        let mut frame = Frame::straight(dims, origin, steps);
        if seed % 3 == 0 {
            frame.axes[0] = [0.6 * steps[0], 0.8 * steps[0], 0.0];
            frame.axes[1] = [-0.8 * steps[1], 0.6 * steps[1], 0.0];
        }
        let n = frame.len();
        let mut state = seed;
        let bytes: Vec<u8> = (0..n * 8)
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
                (state >> 56) as u8
            })
            .collect();
        let data = match SampleType::ALL.get(kind) {
            Some(sample) => decode(&bytes[..n * sample.bytes()], *sample, ByteOrder::Little),
            None => {
                let bits: Vec<u8> = bytes[..n].iter().map(|b| b & 1).collect();
                Data::Bits(pack_bits(&bits, dims))
            }
        };
        Volume { frame, data }
    })
}

/// Raw little-endian bytes of the samples: what two volumes of equal content agree in, NaN included.
pub fn raw(volume: &Volume) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_raw(volume, &mut bytes).unwrap();
    bytes
}

/// What a reader gives, and what it warns of.
pub type Parsed = Result<(Volume, Vec<Warning>), Fault>;

/// Reads bytes as a file of that name.
pub fn parsed(
    name: &str,
    bytes: &[u8],
    read: fn(&Source, &mut Vec<Warning>) -> Result<Volume, Refusal>,
) -> Parsed {
    let source = Source::from_bytes(name, bytes.to_vec()).unwrap();
    let mut warnings = Vec::new();
    let volume = read(&source, &mut warnings).map_err(Refusal::fault)?;
    Ok((volume, warnings))
}

/// What a writer writes.
pub fn written(volume: &Volume, write: fn(&Volume, &mut dyn Write) -> io::Result<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(volume, &mut bytes).unwrap();
    bytes
}

/// A volume of twelve voxels.
pub fn twelve() -> Volume {
    Volume {
        frame: Frame::straight([3, 2, 2], [0.5; 3], [1.0, 2.0, 3.0]),
        data: Data::U16((0..12).collect()),
    }
}

/// The bytes with one put in the place of another, if there is one at `at`, and without the last `cut`.
pub fn damaged(mut bytes: Vec<u8>, at: usize, byte: u8, cut: usize) -> Vec<u8> {
    if let Some(place) = bytes.get_mut(at) {
        *place = byte;
    }
    bytes.truncate(bytes.len().saturating_sub(cut));
    bytes
}

/// Whether two grids have the same steps, but for the rounding of a direction and a length.
pub fn same_axes(a: &Frame, b: &Frame) -> bool {
    (a.axes.iter().zip(b.axes)).all(|(a, b)| length(sub(*a, b)) <= 4.0 * f64::EPSILON * length(b))
}
