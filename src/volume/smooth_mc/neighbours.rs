//! The vertices at the other ends of a vertex's edges.

/// Lists of neighbours: those of vertex `v` are `all[starts[v]..starts[v + 1]]`.
pub(super) struct Neighbours {
    starts: Vec<u32>,
    all: Vec<u32>,
}

impl Neighbours {
    /// The neighbours that `keeps(vertex, neighbour)` takes, each once, in the order of `key`, which no
    /// two vertices share. Cost: a sort of a few numbers for each vertex.
    pub(super) fn new<K: Ord>(
        vertices: usize,
        triangles: &[[u32; 3]],
        key: impl Fn(u32) -> K,
        keeps: impl Fn(u32, u32) -> bool,
    ) -> Self {
        let mut counts = vec![0u32; vertices + 1];
        for v in triangles.iter().flatten() {
            counts[*v as usize + 1] += 2;
        }
        for v in 0..vertices {
            counts[v + 1] += counts[v];
        }
        let mut filled = counts.clone();
        let mut ends = vec![0u32; counts[vertices] as usize];
        for t in triangles {
            for i in 0..3 {
                let v = t[i] as usize;
                ends[filled[v] as usize] = t[(i + 1) % 3];
                ends[filled[v] as usize + 1] = t[(i + 2) % 3];
                filled[v] += 2;
            }
        }
        let mut starts = Vec::with_capacity(vertices + 1);
        let mut all = Vec::with_capacity(ends.len() / 2);
        starts.push(0);
        for v in 0..vertices {
            let own = &mut ends[counts[v] as usize..counts[v + 1] as usize];
            own.sort_unstable_by_key(|w| key(*w));
            let first = all.len();
            for w in own {
                if keeps(v as u32, *w) && all[first..].last() != Some(w) {
                    all.push(*w);
                }
            }
            starts.push(all.len() as u32);
        }
        Neighbours { starts, all }
    }

    /// The neighbours of a vertex.
    #[inline]
    pub(super) fn of(&self, v: usize) -> &[u32] {
        &self.all[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}
