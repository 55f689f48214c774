//! The normal field of a disc.

use super::grow::{Cloud, Growth};
use crate::numeric::vector::{Vec3, add, dot, scale, sub};

/// Points that a field is fitted to where the disc itself covers fewer.
const ENOUGH: usize = 12;
/// How much farther than the disc they may be.
const WIDER: f64 = 4.0;
/// Spreads below this share of the other are none.
const THIN: f64 = 1e-9;

/// A field of normals: `centre + along * slopes[0] * tangent + across * slopes[1] * bitangent`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Field {
    /// The field at the disc's centre.
    pub centre: Vec3,
    /// Unit vector in the plane along which it turns most.
    pub tangent: Vec3,
    /// Lean per local length along the tangent and across it.
    pub slopes: [f64; 2],
    /// Sum over the points of the squares of the differences.
    pub residual: f64,
    /// How many points it was fitted to.
    pub points: u32,
}

/// Sums over points at `(u, v)` with normal `(a, b, c)` along both axes and the plane's normal.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    n: f64,
    u: [f64; 2],
    uu: [f64; 3],
    a: [f64; 3],
    aa: [f64; 4],
    au: [[f64; 2]; 2],
}

impl Moments {
    #[inline]
    fn add(&mut self, u: [f64; 2], a: Vec3) {
        self.n += 1.0;
        for i in 0..2 {
            self.u[i] += u[i];
            for j in 0..2 {
                self.au[i][j] += a[i] * u[j];
            }
        }
        for i in 0..3 {
            self.a[i] += a[i];
            self.aa[i] += a[i] * a[i];
        }
        self.aa[3] += a[0] * a[1];
        self.uu[0] += u[0] * u[0];
        self.uu[1] += u[1] * u[1];
        self.uu[2] += u[0] * u[1];
    }
}

/// Fits the field to the normals of the points that a disc covers, and where those are few to some
/// around it.
///
/// Least squares in closed form: along the plane's normal the field is the mean; within the plane the
/// matrix of slopes is fitted, its symmetric part turned to its own axes, and along each the normals are
/// fitted by a line. With these axes the two slopes lose nothing symmetric. Source: Linsen, Müller and
/// Rosenthal, section 3.3, where the axes are not given.
pub fn fit(cloud: &Cloud, growth: &Growth) -> Field {
    let i = growth.source as usize;
    let (normal, [eu, ev]) = (cloud.normals[i], growth.axes);
    let mut m = Moments::default();
    let mut note = |j: u32| {
        let d = sub(cloud.points[j as usize], cloud.points[i]);
        let n = cloud.normals[j as usize];
        m.add(
            [dot(d, eu), dot(d, ev)],
            [dot(n, eu), dot(n, ev), dot(n, normal)],
        );
    };
    growth.covered.iter().for_each(|j| note(*j));
    let covered = growth.covered.len();
    if covered < ENOUGH {
        let most = WIDER * growth.radius;
        let more = cloud.near.row(i).iter().filter(|j| {
            let (in_plane, _) = growth.place(cloud, **j);
            let agrees = dot(cloud.normals[**j as usize], normal) > 0.5;
            agrees && in_plane <= most * most && !growth.covered.contains(*j)
        });
        more.take(ENOUGH - covered).for_each(|j| note(*j));
    }
    solve(&m, normal, [eu, ev])
}

fn solve(m: &Moments, normal: Vec3, [eu, ev]: [Vec3; 2]) -> Field {
    let share = 1.0 / m.n;
    let mean_u = m.u.map(|u| u * share);
    let mean_a = m.a.map(|a| a * share);
    // Central moments: of places, of normals with places, of normals.
    let suu = m.uu[0] - m.u[0] * mean_u[0];
    let svv = m.uu[1] - m.u[1] * mean_u[1];
    let suv = m.uu[2] - m.u[0] * mean_u[1];
    let s = |i: usize, j: usize| m.au[i][j] - m.a[i] * mean_u[j];
    let sau = [[s(0, 0), s(0, 1)], [s(1, 0), s(1, 1)]];
    let saa: [f64; 3] = std::array::from_fn(|i| (m.aa[i] - m.a[i] * mean_a[i]).max(0.0));
    let sab = m.aa[3] - m.a[0] * mean_a[1];
    let det = suu * svv - suv * suv;
    let spread = 0.5 * (suu + svv);
    let (sin, cos) = if m.n >= 3.0 && det > THIN * spread * spread {
        // The slopes, times the determinant, and the axes of their symmetric part.
        let xx = sau[0][0] * svv - sau[0][1] * suv;
        let xy = sau[0][1] * suu - sau[0][0] * suv;
        let yx = sau[1][0] * svv - sau[1][1] * suv;
        let yy = sau[1][1] * suu - sau[1][0] * suv;
        half_angle(xx - yy, xy + yx)
    } else {
        half_angle(suu - svv, 2.0 * suv)
    };
    // The same moments along the turned axes.
    let turn = |x: f64, y: f64| [cos * x + sin * y, cos * y - sin * x];
    let quadratic = |xx: f64, yy: f64, xy: f64| {
        let cross = 2.0 * sin * cos * xy;
        [
            cos * cos * xx + sin * sin * yy + cross,
            sin * sin * xx + cos * cos * yy - cross,
        ]
    };
    let places = quadratic(suu, svv, suv);
    let both = quadratic(sau[0][0], sau[1][1], 0.5 * (sau[0][1] + sau[1][0]));
    let normals = quadratic(saa[0], saa[1], sab);
    let (at, mean) = (turn(mean_u[0], mean_u[1]), turn(mean_a[0], mean_a[1]));
    let mut slopes = [0.0; 2];
    let mut lean = mean;
    let mut residual = saa[2];
    for axis in 0..2 {
        if m.n >= 3.0 && places[axis] > THIN * spread {
            slopes[axis] = both[axis] / places[axis];
            lean[axis] -= slopes[axis] * at[axis];
        }
        residual += (normals[axis] - slopes[axis] * both[axis]).max(0.0);
    }
    let mut axes = [
        add(scale(eu, cos), scale(ev, sin)),
        sub(scale(ev, cos), scale(eu, sin)),
    ];
    let centre = add(
        scale(normal, mean_a[2]),
        add(scale(axes[0], lean[0]), scale(axes[1], lean[1])),
    );
    if slopes[1].abs() > slopes[0].abs() {
        slopes.swap(0, 1);
        // Turned by a quarter, so that the second axis is again normal times first.
        axes = [axes[1], scale(axes[0], -1.0)];
    }
    Field {
        centre,
        tangent: axes[0],
        slopes,
        residual,
        points: m.n as u32,
    }
}

/// Sine and cosine of half the angle of a direction; of 0 where it has none.
fn half_angle(x: f64, y: f64) -> (f64, f64) {
    if x == 0.0 && y == 0.0 {
        return (0.0, 1.0);
    }
    (0.5 * y.atan2(x)).sin_cos()
}
