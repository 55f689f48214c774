//! Where a NIfTI header puts its samples.

use super::header::{Header, PIXDIM, QFORM_CODE, QOFFSET, QUATERN, SFORM_CODE, SROW};
use crate::error::{Fault, number};
use crate::numeric::vector::{Vec3, add, dot, length, scale, sub};
use crate::report::Warning;
use crate::volume::Frame;

/// How far apart the sform and the qform may place a voxel, in voxels, to say the same.
const SAME_PLACE: f64 = 1e-3;

/// The frame by the sform, else by the qform, else by the steps alone.
///
/// Errs where a number that is used is none. Warns where the qform says otherwise than the sform.
pub fn frame(
    header: &Header,
    dims: [usize; 3],
    warnings: &mut Vec<Warning>,
) -> Result<Frame, Fault> {
    let has_qform = header.integer(QFORM_CODE, 0) > 0;
    let frame = if header.integer(SFORM_CODE, 0) > 0 {
        let frame = by_sform(header, dims)?;
        if has_qform {
            compare(&frame, by_qform(header, dims), warnings);
        }
        frame
    } else if has_qform {
        by_qform(header, dims)?
    } else {
        Frame::straight(dims, [0.0; 3], steps(header)?)
    };
    Ok(Frame {
        dims,
        origin: frame.origin.map(|c| header.in_millimetres(c)),
        axes: frame
            .axes
            .map(|axis| axis.map(|c| header.in_millimetres(c))),
    })
}

/// By three rows of an affine matrix: each has a coordinate of the three axes, then of the origin.
fn by_sform(header: &Header, dims: [usize; 3]) -> Result<Frame, Fault> {
    let mut axes = [[0.0; 3]; 3];
    let mut origin = [0.0; 3];
    for row in 0..3 {
        for (column, axis) in axes.iter_mut().enumerate() {
            axis[row] = header.finite(SROW, 4 * row + column)?;
        }
        origin[row] = header.finite(SROW, 4 * row + 3)?;
    }
    Ok(Frame { dims, origin, axes })
}

/// By a rotation, whose quaternion leaves out its first number, and the steps. `pixdim[0]` below 0
/// turns the third axis round.
fn by_qform(header: &Header, dims: [usize; 3]) -> Result<Frame, Fault> {
    let mut quaternion = [0.0; 3];
    let mut origin = [0.0; 3];
    for index in 0..3 {
        quaternion[index] = header.finite(QUATERN, index)?;
        origin[index] = header.finite(QOFFSET, index)?;
    }
    let mut steps = steps(header)?;
    if header.finite(PIXDIM, 0)? < 0.0 {
        steps[2] = -steps[2];
    }
    let rotation = rotation(header, quaternion)?;
    let axes = std::array::from_fn(|a| scale(rotation[a], steps[a]));
    Ok(Frame { dims, origin, axes })
}

/// The images of the coordinate axes under the rotation of the unit quaternion with these last three
/// numbers.
fn rotation(header: &Header, [b, c, d]: Vec3) -> Result<[Vec3; 3], Fault> {
    let square = dot([b, c, d], [b, c, d]);
    let rest = 1.0 - square;
    // A half turn has a first number of 0, which the rounding of the others must not hide.
    let a = if rest.abs() <= 3.0 * header.epsilon() {
        0.0
    } else if rest < 0.0 {
        let problem = format_args!(
            "to quatern_d have the length {}, but in a rotation it is 1 at most",
            number(square.sqrt())
        );
        return Err(header.fault(QUATERN, 0, problem));
    } else {
        rest.sqrt()
    };
    let s = 2.0 / (a * a + square);
    Ok([
        [
            1.0 - s * (c * c + d * d),
            s * (b * c + a * d),
            s * (b * d - a * c),
        ],
        [
            s * (b * c - a * d),
            1.0 - s * (b * b + d * d),
            s * (c * d + a * b),
        ],
        [
            s * (b * d + a * c),
            s * (c * d - a * b),
            1.0 - s * (b * b + c * c),
        ],
    ])
}

/// The step along each axis; 1 along axes that the file has not, where it gives none.
fn steps(header: &Header) -> Result<Vec3, Fault> {
    let mut steps = [0.0; 3];
    for (axis, step) in steps.iter_mut().enumerate() {
        let index = axis + 1;
        *step = header.finite(PIXDIM, index)?;
        if *step < 0.0 {
            let problem = format!("is {}, but a step is above 0", number(*step));
            return Err(header.fault(PIXDIM, index, problem));
        }
        if *step == 0.0 && index > header.dimensions() {
            *step = 1.0;
        }
    }
    Ok(steps)
}

/// Warns where the frame of the qform is not that of the sform.
fn compare(sform: &Frame, qform: Result<Frame, Fault>, warnings: &mut Vec<Warning>) {
    let message = match qform {
        Err(fault) => format!("the qform is not sound, and the sform is used: {fault}"),
        Ok(qform) => {
            let apart = distance(sform, &qform);
            if apart <= SAME_PLACE {
                return;
            }
            format!("sform and qform are up to {apart:.6} voxels apart; the sform is used")
        }
    };
    warnings.push(Warning::new("nifti-affines", message, 1, None));
}

/// The largest distance between the places of a voxel, in the shortest steps of the first frame.
/// It is reached at a corner of the grid.
fn distance(a: &Frame, b: &Frame) -> f64 {
    let place = |frame: &Frame, corner: usize| {
        let mut place = frame.origin;
        for axis in 0..3 {
            if corner >> axis & 1 == 1 {
                let steps = frame.dims[axis] as f64 - 1.0;
                place = add(place, scale(frame.axes[axis], steps));
            }
        }
        place
    };
    let apart = (0..8).map(|corner| length(sub(place(a, corner), place(b, corner))));
    let step = a.spacing().into_iter().fold(f64::INFINITY, f64::min);
    apart.fold(0.0, f64::max) / step
}
