//! An order of the vertices of a mesh from coarse to fine, from its edges alone.

use crate::error::{Error, Result};

/// Vertices from coarse to fine, each with the coarser ones around it.
///
/// Fine vertices are taken out of the mesh one after the other, those of one round being no
/// neighbours, and the hole of each is closed; in the order from the last to the first each vertex
/// stands in the middle of vertices that are known before it. Ranks count from the coarsest.
#[derive(Debug, Clone, PartialEq)]
pub struct Hierarchy {
    /// The vertex of each rank.
    pub vertices: Vec<u32>,
    /// The vertices around each when it was taken out, and then those around them, as ranks below
    /// its own.
    pub rings: Lists,
    /// How many of each ring stand beside the vertex itself.
    pub inner: Vec<u32>,
    /// The neighbours of each in the mesh, as ranks.
    pub neighbours: Lists,
}

/// Lists of numbers, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    fn from_iter<'a>(lists: impl Iterator<Item = &'a [u32]>) -> Self {
        let mut made = Lists {
            starts: vec![0],
            items: Vec::new(),
        };
        for list in lists {
            made.items.extend_from_slice(list);
            made.starts.push(made.items.len() as u32);
        }
        made
    }

    /// List `i`.
    #[inline]
    pub fn of(&self, i: usize) -> &[u32] {
        &self.items[self.span(i)]
    }

    /// Where list `i` stands among all numbers.
    #[inline]
    pub fn span(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// All numbers of all lists.
    pub fn total(&self) -> usize {
        self.items.len()
    }

    /// Number of lists.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no list.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A mesh that loses its vertices.
struct Thinning {
    around: Vec<Vec<u32>>,
    /// The last round in which a vertex had a neighbour taken out.
    touched: Vec<u32>,
    gone: Vec<bool>,
    taken: Vec<Taken>,
}

/// A vertex that was taken out, and what stood around it.
struct Taken {
    vertex: u32,
    ring: Vec<u32>,
    inner: usize,
}

impl Thinning {
    /// Takes out the vertices of one round: those of few neighbours first, none beside another.
    fn round(&mut self, left: &mut Vec<u32>, round: u32) {
        left.sort_by_key(|v| (self.around[*v as usize].len(), *v));
        // Vertices of many neighbours are left for later; half of all have no more than the middle
        // one, so a round never ends empty.
        let middle = left[left.len() / 2] as usize;
        let most = self.around[middle].len().max(7);
        for v in left.iter().map(|v| *v as usize) {
            if self.touched[v] == round || self.around[v].len() > most {
                continue;
            }
            for u in &self.around[v] {
                self.touched[*u as usize] = round;
            }
            self.gone[v] = true;
            self.take(v as u32);
        }
        left.retain(|v| !self.gone[*v as usize]);
    }

    /// Takes a vertex out and joins its ring to the one of its neighbours that has most of it around
    /// it already.
    fn take(&mut self, v: u32) {
        let mut ring = std::mem::take(&mut self.around[v as usize]);
        for u in &ring {
            self.around[*u as usize].retain(|w| *w != v);
        }
        let beyond = |u: &u32| self.around[*u as usize].iter().copied();
        let outer: Vec<u32> = ring
            .iter()
            .take(Hierarchy::WIDEST)
            .flat_map(beyond)
            .collect();
        let centre = ring.iter().copied().min_by_key(|u| {
            let around = &self.around[*u as usize];
            let new = ring.iter().filter(|w| *w != u && !around.contains(w));
            (new.count(), around.len(), *u)
        });
        if let Some(centre) = centre {
            for w in ring.iter().copied().filter(|w| *w != centre) {
                if !self.around[centre as usize].contains(&w) {
                    self.around[centre as usize].push(w);
                    self.around[w as usize].push(centre);
                }
            }
        }
        ring.truncate(Hierarchy::WIDEST);
        let inner = ring.len();
        for u in outer {
            if ring.len() < Hierarchy::WIDEST && !ring.contains(&u) {
                ring.push(u);
            }
        }
        self.taken.push(Taken {
            vertex: v,
            ring,
            inner,
        });
    }
}

impl Hierarchy {
    /// The hierarchy of a mesh of so many vertices with these edges, of any order and repeated or not.
    ///
    /// Vertices that no edge touches are joined to the one before them, so that they are predicted
    /// too. Errs with [`Error::Limit`] where there are more than 2^31 neighbours. Cost: about
    /// linear for meshes of a bounded number of neighbours.
    pub fn new(vertices: usize, edges: impl Iterator<Item = [u32; 2]>) -> Result<Self> {
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); vertices];
        let mut total = 0usize;
        for [a, b] in edges.filter(|[a, b]| a != b) {
            around[a as usize].push(b);
            around[b as usize].push(a);
            total += 2;
        }
        if total > i32::MAX as usize {
            return Err(Error::Limit {
                what: "neighbours of vertices".into(),
                needed: total.to_string(),
                limit: i32::MAX.to_string(),
                hint: None,
            });
        }
        for v in 1..vertices {
            if around[v].is_empty() {
                around[v].push(v as u32 - 1);
                around[v - 1].push(v as u32);
            }
        }
        for list in &mut around {
            list.sort_unstable();
            list.dedup();
        }
        let neighbours = around.clone();
        let mut thinning = Thinning {
            around,
            touched: vec![0; vertices],
            gone: vec![false; vertices],
            taken: Vec::with_capacity(vertices),
        };
        let mut left: Vec<u32> = (0..vertices as u32).collect();
        let mut round = 0;
        while !left.is_empty() {
            round += 1;
            thinning.round(&mut left, round);
        }
        let mut taken = thinning.taken;
        taken.reverse();
        let mut rank = vec![0u32; vertices];
        for (r, taken) in taken.iter().enumerate() {
            rank[taken.vertex as usize] = r as u32;
        }
        // The coarsest vertex of each further part of the mesh has no ring: it follows the one before.
        for (r, taken) in taken.iter_mut().enumerate() {
            taken.ring.iter_mut().for_each(|u| *u = rank[*u as usize]);
            if taken.ring.is_empty() && r > 0 {
                taken.ring.push(r as u32 - 1);
                taken.inner = 1;
            }
        }
        let ranks = |v: u32| neighbours[v as usize].iter().map(|u| rank[*u as usize]);
        let near: Vec<Vec<u32>> = taken.iter().map(|t| ranks(t.vertex).collect()).collect();
        Ok(Hierarchy {
            vertices: taken.iter().map(|t| t.vertex).collect(),
            inner: taken.iter().map(|t| t.inner as u32).collect(),
            rings: Lists::from_iter(taken.iter().map(|t| t.ring.as_slice())),
            neighbours: Lists::from_iter(near.iter().map(Vec::as_slice)),
        })
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// How fine a rank is, in [`Hierarchy::LEVELS`] classes; the last is the finest quarter.
    pub fn level(&self, rank: usize) -> usize {
        let n = self.len();
        match rank {
            r if r < n / 14 => 0,
            r if r < n / 4 => 1,
            r if r < n / 2 => 2,
            r if r < n - n / 4 => 3,
            _ => 4,
        }
    }

    /// Vertices of a ring, at most.
    pub const WIDEST: usize = 24;

    /// Classes of [`Hierarchy::level`].
    pub const LEVELS: usize = 5;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn check(hierarchy: &Hierarchy, vertices: usize) {
        let mut seen = hierarchy.vertices.clone();
        seen.sort_unstable();
        assert!(seen.iter().copied().eq(0..vertices as u32));
        for rank in 0..vertices {
            let ring = hierarchy.rings.of(rank);
            assert!(ring.iter().all(|u| (*u as usize) < rank));
            assert!(rank == 0 || !ring.is_empty(), "rank {rank} has no ring");
        }
    }

    #[test]
    fn every_vertex_of_a_sphere_stands_among_coarser_ones() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 4);
        let edges = mesh
            .triangles
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let hierarchy = Hierarchy::new(mesh.positions.len(), edges).unwrap();
        check(&hierarchy, mesh.positions.len());
        let inner: u32 = hierarchy.inner.iter().sum();
        let mean = f64::from(inner) / hierarchy.len() as f64;
        assert!(mean > 4.0 && mean < 7.0, "{mean}");
    }

    #[test]
    fn clouds_parts_and_odd_edges_are_ordered_too() {
        check(&Hierarchy::new(9, std::iter::empty()).unwrap(), 9);
        check(&Hierarchy::new(1, std::iter::empty()).unwrap(), 1);
        check(&Hierarchy::new(0, std::iter::empty()).unwrap(), 0);
        let edges = [[0, 1], [1, 0], [2, 2], [3, 4], [4, 5], [5, 3]];
        check(&Hierarchy::new(7, edges.into_iter()).unwrap(), 7);
        let star = (1..100).map(|v| [0, v]);
        check(&Hierarchy::new(100, star).unwrap(), 100);
        let full = (0..30).flat_map(|a| (0..a).map(move |b| [a, b]));
        check(&Hierarchy::new(30, full).unwrap(), 30);
    }
}
