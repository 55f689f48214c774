//! Which cluster each vertex is in, coded along a walk from the frames' own vertices outwards.

use crate::anim::compress::coder::Coder;
use crate::anim::compress::hierarchy::Hierarchy;
use crate::anim::compress::mixing::Adaptive;
use std::collections::VecDeque;

/// Neighbours that are told apart as contexts.
const SEEN: usize = 8;
const MEMORY: u16 = 200;

/// Codes the cluster of each vertex, by vertex; `known` are those of some vertices that both sides
/// know, and where the walk begins. `given` are all of them where they are not read.
///
/// A vertex mostly is where most of its known neighbours are. Cost: linear.
pub fn code(
    coder: &mut impl Coder,
    hierarchy: &Hierarchy,
    clusters: usize,
    known: &[(u32, u32)],
    given: Option<&[u32]>,
) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let count = hierarchy.len();
    let mut rank = vec![0u32; count];
    for (r, v) in hierarchy.vertices.iter().enumerate() {
        rank[*v as usize] = r as u32;
    }
    let (mut labels, mut queued) = (vec![NONE; count], vec![false; count]);
    let mut queue = VecDeque::new();
    for (v, label) in known {
        let r = rank[*v as usize];
        labels[r as usize] = *label;
        if !std::mem::replace(&mut queued[r as usize], true) {
            queue.push_back(r);
        }
    }
    let mut first = [[Adaptive::NEW; SEEN]; SEEN];
    let mut second = [Adaptive::NEW; SEEN];
    let bits = usize::BITS - (clusters - 1).leading_zeros();
    let mut next = 0;
    let mut ballot: Vec<(u32, usize)> = Vec::new();
    loop {
        let r = match queue.pop_front() {
            Some(r) => r as usize,
            None => {
                while next < count && queued[next] {
                    next += 1;
                }
                if next == count {
                    break;
                }
                queued[next] = true;
                next
            }
        };
        ballot.clear();
        let mut voters = 0;
        for u in hierarchy.neighbours.of(r).iter().map(|u| *u as usize) {
            if labels[u] != NONE {
                voters += 1;
                match ballot.iter_mut().find(|(label, _)| *label == labels[u]) {
                    Some((_, votes)) => *votes += 1,
                    None => ballot.push((labels[u], 1)),
                }
            }
            if !std::mem::replace(&mut queued[u], true) {
                queue.push_back(u as u32);
            }
        }
        if labels[r] != NONE || clusters == 1 {
            labels[r] = labels[r].min(clusters as u32 - 1);
            continue;
        }
        ballot.sort_by_key(|(label, votes)| (std::cmp::Reverse(*votes), *label));
        let own = given.map_or(0, |given| given[hierarchy.vertices[r] as usize]);
        let mut found = None;
        for (i, (label, votes)) in ballot.iter().take(2).enumerate() {
            let place = match i {
                0 => &mut first[(*votes).min(SEEN - 1)][voters.min(SEEN - 1)],
                _ => &mut second[voters.min(SEEN - 1)],
            };
            let is = coder.bit(place.one(), own == *label);
            place.meet(is, MEMORY);
            if is {
                found = Some(*label);
                break;
            }
        }
        labels[r] = found.unwrap_or_else(|| coder.number(u64::from(own), bits) as u32);
        labels[r] = labels[r].min(clusters as u32 - 1);
    }
    let mut by_vertex = vec![0; count];
    for (v, label) in hierarchy.vertices.iter().zip(labels) {
        by_vertex[*v as usize] = label;
    }
    by_vertex
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::compress::coder::{Reader, Writer};
    use crate::mesh::shapes;

    #[test]
    fn labels_come_back_and_cost_little_inside_of_clusters() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 4);
        let edges = mesh
            .triangles
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let hierarchy = Hierarchy::new(mesh.positions.len(), edges).unwrap();
        let octant = |p: &[f64; 3]| (0..3).map(|i| u32::from(p[i] > 0.1) << i).sum::<u32>();
        let labels: Vec<u32> = mesh.positions.iter().map(octant).collect();
        let known: Vec<(u32, u32)> = (0..8)
            .filter_map(|c| labels.iter().position(|l| *l == c).map(|v| (v as u32, c)))
            .collect();
        for known in [known.as_slice(), &[]] {
            let mut writer = Writer::new();
            assert_eq!(
                code(&mut writer, &hierarchy, 8, known, Some(&labels)),
                labels
            );
            let bits = writer.spent() / labels.len() as f64;
            assert!(bits < 0.5, "{bits} bits a vertex");
            let bytes = writer.finish();
            assert_eq!(
                code(&mut Reader::new(&bytes), &hierarchy, 8, known, None),
                labels
            );
        }
    }

    #[test]
    fn one_cluster_costs_nothing() {
        let hierarchy = Hierarchy::new(5, std::iter::empty()).unwrap();
        let mut writer = Writer::new();
        assert_eq!(
            code(&mut writer, &hierarchy, 1, &[], Some(&[0; 5])),
            vec![0; 5]
        );
        assert_eq!(writer.spent(), 0.0);
    }
}
