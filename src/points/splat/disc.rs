//! A disc with a field of normals over it, and sets of such discs.

use crate::numeric::vector::{Vec3, add, cross, dot, scale};
use crate::spatial::aabb::Aabb;

/// A disc in space whose normal changes linearly over it.
///
/// Source: Linsen, Müller and Rosenthal, "Splat-based ray tracing of point clouds", 2007, sections 3
/// and 4. The plane is the one the disc was grown in; shading takes the field.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Splat {
    /// Its centre, in the cloud's unit.
    pub centre: Vec3,
    /// The unit normal of its plane, pointing outwards.
    pub normal: Vec3,
    /// A unit vector in its plane, along which the field turns most; the other axis is
    /// [`Splat::bitangent`].
    pub tangent: Vec3,
    /// Its radius, in the cloud's unit.
    pub radius: f64,
    /// The field at the centre, not of unit length.
    pub field: Vec3,
    /// How much the field leans along the tangent and the bitangent, per unit of length.
    pub slopes: [f64; 2],
    /// The largest height above or below the plane of the points it covers, in the cloud's unit.
    pub error: f64,
    /// The number of points it covers.
    pub count: u32,
    /// The point it was grown from, from 0.
    pub source: u32,
}

impl Splat {
    /// The second axis of the plane: normal times tangent.
    #[inline]
    pub fn bitangent(&self) -> Vec3 {
        cross(self.normal, self.tangent)
    }

    /// The field's normal at `along` the tangent and `across` it, both in the cloud's unit from the
    /// centre; unit length, or the plane's normal where the field vanishes.
    #[inline]
    pub fn normal_at(&self, along: f64, across: f64) -> Vec3 {
        let lean = add(
            scale(self.tangent, along * self.slopes[0]),
            scale(self.bitangent(), across * self.slopes[1]),
        );
        let normal = add(self.field, lean);
        let length = dot(normal, normal).sqrt();
        if length > 0.0 {
            scale(normal, 1.0 / length)
        } else {
            self.normal
        }
    }

    /// The tight box around the disc.
    #[inline]
    pub fn bounds(&self) -> Aabb {
        let half = self
            .normal
            .map(|n| self.radius * (1.0 - n * n).max(0.0).sqrt());
        let corner = |sign: f64| add(self.centre, scale(half, sign));
        Aabb::around(&[corner(-1.0), corner(1.0)])
    }
}

/// Discs that cover a cloud, with what its points carried.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Splats {
    /// The discs.
    pub splats: Vec<Splat>,
    /// One colour per disc: red, green, blue, alpha from 0 to 1.
    pub colors: Option<Vec<[f32; 4]>>,
    /// One class per disc, as LAS numbers them.
    pub classes: Option<Vec<u8>>,
}

impl Splats {
    /// The box around all discs; empty where there is none.
    pub fn bounds(&self) -> Aabb {
        self.splats
            .iter()
            .fold(Aabb::EMPTY, |all, splat| all.union(splat.bounds()))
    }
}
