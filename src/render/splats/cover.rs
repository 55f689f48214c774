//! What a ray sees of an object made of discs.

use super::boxes::Boxes;
use super::disc::{Discs, Hit, Ray};
use super::octree::Octree;
use super::params::{Accelerator, Blend};
use super::tree::{Tree, Visits};
use crate::image::colour::Linear;
use crate::numeric::vector::{Vec3, add, dot, normalize, scale, sub};
use std::ops::ControlFlow;

/// The discs of one object, and the way to those that a ray meets.
#[derive(Debug)]
pub(super) struct Cover {
    pub discs: Discs,
    pub tree: Tree,
}

/// What is seen of a cover: one disc, and what those around it say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub t: f64,
    pub disc: u32,
    /// Unit length, on the side that the cover's normals point to.
    pub normal: Vec3,
    /// The light that it sends back, where the discs have colours.
    pub colour: Option<Linear>,
    /// The discs that are met around the first hit.
    pub around: u32,
    /// The largest error of those.
    pub error: f64,
}

/// Hits that are kept from one ray to the next for their memory.
pub(super) type Scratch = Vec<Hit>;

impl Cover {
    pub fn new(discs: Discs, accelerator: Accelerator) -> Cover {
        let tree = match accelerator {
            Accelerator::Bvh => {
                let bounds = |i: u32| discs.splats[i as usize].bounds();
                Tree::Boxes(Boxes::new(&discs.plates, bounds))
            }
            Accelerator::Octree => Tree::Octree(Box::new(Octree::new(&discs.splats, discs.bounds))),
        };
        Cover { discs, tree }
    }

    /// Walks the hits that the ray does not leave out.
    #[inline]
    fn walk(
        &self,
        tree: &Tree,
        object: usize,
        ray: &Ray,
        limit: f64,
        visits: &mut Visits,
        mut visit: impl FnMut(Hit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let own = ray.from.filter(|from| from.object == object);
        let mut ray = *ray;
        if let Some(from) = own.filter(|from| from.ball > 0.0) {
            ray.least = from.ball;
        }
        let own = own.filter(|from| from.ball == 0.0);
        let mut far = limit;
        tree.walk(&self.discs, &ray, limit, visits, |hit| {
            let is_own = own.is_some_and(|from| self.discs.is_own(&from, &ray, hit.disc));
            if !is_own {
                far = visit(hit)?;
            }
            ControlFlow::Continue(far)
        })
    }

    /// Whether the ray meets a disc before `reach`.
    pub fn blocks(&self, object: usize, ray: &Ray, reach: f64, visits: &mut Visits) -> bool {
        self.walk(&self.tree, object, ray, reach, visits, |_| {
            ControlFlow::Break(())
        })
        .is_break()
    }

    /// The hits around the first one, by disc: those within a ball around it, of the radius of
    /// its disc, whose normals point to its side. The first is returned too.
    ///
    /// Nothing here depends on the order in which hits are found: of equal ones the first disc counts.
    fn around(
        &self,
        tree: &Tree,
        object: usize,
        ray: &Ray,
        limit: f64,
        hits: &mut Scratch,
        visits: &mut Visits,
    ) -> Option<Hit> {
        hits.clear();
        let window = |hit: &Hit| hit.t + self.discs.splats[hit.disc as usize].radius;
        let mut first: Option<Hit> = None;
        let mut seen_to = limit;
        let _ = self.walk(tree, object, ray, limit, visits, |hit| {
            hits.push(hit);
            if first.is_none_or(|f| (hit.t, hit.disc) < (f.t, f.disc)) {
                first = Some(hit);
                seen_to = seen_to.min(window(&hit));
            }
            ControlFlow::Continue(seen_to)
        });
        let first = first?;
        let end = window(&first);
        if end.min(limit) > seen_to {
            // The window was smaller at first: some hits of the last one may have been passed by.
            hits.clear();
            let _ = self.walk(tree, object, ray, end.min(limit), visits, |hit| {
                hits.push(hit);
                ControlFlow::Continue(end.min(limit))
            });
        }
        let normal = |hit: &Hit| self.discs.plates[hit.disc as usize].normal;
        let side = normal(&first);
        hits.retain(|hit| hit.t <= end && dot(normal(hit), side) > 0.0);
        hits.sort_unstable_by_key(|hit| hit.disc);
        hits.dedup_by_key(|hit| hit.disc);
        Some(first)
    }

    /// What the ray sees first by `limit`.
    ///
    /// Of the discs met around the first hit the one counts whose centre is nearest in radii. Normals
    /// are weighted by 1 - |(u, v)|, which is 0 at a rim, so that they change continuously. Source:
    /// the paper, sections 4.3 and 4.4; which hits are chosen from is restated so that neither the
    /// cells of a tree nor another layer of the surface matter.
    pub fn see(
        &self,
        object: usize,
        ray: &Ray,
        limit: f64,
        blend: Blend,
        hits: &mut Scratch,
        visits: &mut Visits,
    ) -> Option<Seen> {
        self.see_by(&self.tree, object, ray, limit, blend, hits, visits)
    }

    /// What the ray sees by looking at every disc: the reference.
    pub fn see_one_by_one(&self, ray: &Ray, blend: Blend) -> Option<Seen> {
        let (mut hits, mut visits) = (Scratch::new(), Visits::default());
        let far = f64::INFINITY;
        self.see_by(&Tree::Each, 0, ray, far, blend, &mut hits, &mut visits)
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "one caller names a tree, the other does not"
    )]
    fn see_by(
        &self,
        tree: &Tree,
        object: usize,
        ray: &Ray,
        limit: f64,
        blend: Blend,
        hits: &mut Scratch,
        visits: &mut Visits,
    ) -> Option<Seen> {
        self.around(tree, object, ray, limit, hits, visits)?;
        let nearer = |a: &Hit, b: &Hit| a.off.total_cmp(&b.off).then(a.disc.cmp(&b.disc));
        let chosen = *hits.iter().min_by(|a, b| nearer(a, b))?;
        let errors = hits
            .iter()
            .map(|hit| self.discs.splats[hit.disc as usize].error);
        let alone = Seen {
            t: chosen.t,
            disc: chosen.disc,
            normal: self.normal(ray, &chosen),
            colour: self.colour(&chosen),
            around: hits.len() as u32,
            error: errors.fold(0.0, f64::max),
        };
        if blend == Blend::None {
            return Some(alone);
        }
        Some(self.blended(ray, hits, alone, blend == Blend::Depth))
    }

    fn normal(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let splat = &self.discs.splats[hit.disc as usize];
        let away = sub(ray.at(hit.t), splat.centre);
        splat.normal_at(dot(away, splat.tangent), dot(away, splat.bitangent()))
    }

    fn colour(&self, hit: &Hit) -> Option<Linear> {
        let colours = self.discs.colours.as_ref()?;
        colours.get(hit.disc as usize).copied()
    }

    fn blended(&self, ray: &Ray, hits: &[Hit], alone: Seen, depth: bool) -> Seen {
        let (mut sum, mut normal, mut t, mut light) = (0.0, [0.0; 3], 0.0, [0.0; 3]);
        for hit in hits {
            let weight = 1.0 - hit.off.sqrt();
            sum += weight;
            normal = add(normal, scale(self.normal(ray, hit), weight));
            t += weight * (hit.t - alone.t);
            let colour = self.colour(hit).unwrap_or([0.0; 3]).map(f64::from);
            light = add(light, scale(colour, weight));
        }
        let normal = normalize(normal);
        // All on rims, or normals that cancel: one disc speaks for all.
        if sum <= 0.0 || dot(normal, normal) < 0.5 {
            return alone;
        }
        Seen {
            t: if depth { alone.t + t / sum } else { alone.t },
            normal,
            colour: alone.colour.map(|_| light.map(|c| (c / sum) as f32)),
            ..alone
        }
    }
}
