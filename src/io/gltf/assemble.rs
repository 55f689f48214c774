//! Placed meshes put together to one.

use super::accessor::Reader;
use super::document::Primitive;
use super::scene::Placed;
use crate::error::Fault;
use crate::io::refusal::{Refusal, expect_room};
use crate::mesh::Mesh;
use crate::numeric::vector::normalize;
use crate::report::Warning;

/// Placed meshes in one.
pub struct Assembled {
    /// All of them, as stored.
    pub mesh: Mesh,
    /// Which vertices are whose, in their order.
    pub parts: Vec<Part>,
    counts: Counts,
}

/// Vertices of one set of accessors in one node.
#[derive(Debug, Clone)]
pub struct Part {
    /// Index of the placed mesh.
    pub placed: usize,
    /// The primitives that use them, by their index in the mesh; at least one.
    pub primitives: Vec<usize>,
    /// The first of the vertices.
    pub base: usize,
    /// Their number.
    pub count: usize,
}

impl Assembled {
    /// Warns of what is left out of a mesh as stored.
    pub fn warn(&self, warnings: &mut Vec<Warning>) {
        self.counts.warn(warnings);
    }

    /// Warns of what is left out where joints and morph targets are not.
    pub fn warn_posed(self, warnings: &mut Vec<Warning>) {
        let counts = Counts {
            skins: 0,
            targets: 0,
            ..self.counts
        };
        counts.warn(warnings);
    }
}

/// Puts the primitives of all placed meshes into one mesh, in the order of the nodes.
pub fn assemble(reader: &mut Reader, placed: &[Placed], limit: u64) -> Result<Assembled, Refusal> {
    let mut work = Assembly {
        reader,
        limit,
        mesh: Mesh::default(),
        with_normals: true,
        with_colors: true,
        parts: Vec::new(),
        counts: Counts::default(),
    };
    work.survey(placed)?;
    work.mesh.normals = work.with_normals.then(Vec::new);
    work.mesh.colors = work.with_colors.then(Vec::new);
    for (index, place) in placed.iter().enumerate() {
        work.place(index, place)?;
    }
    Ok(Assembled {
        mesh: work.mesh,
        parts: work.parts,
        counts: work.counts,
    })
}

/// What is left out, counted.
#[derive(Default)]
struct Counts {
    skins: u64,
    instances: u64,
    targets: u64,
    placeless: u64,
    normals: u64,
    colors: u64,
    incomplete: u64,
}

impl Counts {
    fn warn(&self, warnings: &mut Vec<Warning>) {
        let notes = [
            (
                "ignored-skins",
                "nodes with a skin; their meshes are taken as stored, not posed by joints",
                self.skins,
            ),
            (
                "ignored-instancing",
                "nodes with EXT_mesh_gpu_instancing; their meshes are placed once",
                self.instances,
            ),
            (
                "ignored-morph-targets",
                "primitives with morph targets; taken without",
                self.targets,
            ),
            (
                "primitives-without-positions",
                "primitives without the attribute POSITION; left out",
                self.placeless,
            ),
            (
                "dropped-normals",
                "primitives have normals, but not all do; left out",
                self.normals,
            ),
            (
                "dropped-colours",
                "primitives have colours, but not all do; left out",
                self.colors,
            ),
            (
                "incomplete-primitives",
                "vertices at the end of a primitive too few for one more triangle or line; ignored",
                self.incomplete,
            ),
        ];
        for (code, message, count) in notes {
            if count > 0 {
                warnings.push(Warning::new(code, message, count, None));
            }
        }
    }
}

struct Assembly<'r, 'a> {
    reader: &'r mut Reader<'a>,
    limit: u64,
    mesh: Mesh,
    with_normals: bool,
    with_colors: bool,
    parts: Vec<Part>,
    counts: Counts,
}

/// The accessors that make the vertices of a primitive.
type Attributes = (usize, Option<usize>, Option<usize>);

impl<'a> Assembly<'_, 'a> {
    fn primitives(&self, place: &Placed) -> Result<&'a [Primitive], Refusal> {
        let meshes = &self.reader.document.meshes;
        match meshes.get(place.mesh) {
            Some(mesh) => Ok(&mesh.primitives),
            None => {
                let problem = format!("has mesh {}, but there are {}", place.mesh, meshes.len());
                Err(Fault::element("node", place.node, problem).into())
            }
        }
    }

    /// Finds out which attributes every primitive has, and counts what will be left out.
    fn survey(&mut self, placed: &[Placed]) -> Result<(), Refusal> {
        let (mut total, mut normals, mut colors) = (0, 0, 0);
        for place in placed {
            self.counts.skins += u64::from(place.skinned);
            self.counts.instances += u64::from(place.instanced);
            for primitive in self.primitives(place)? {
                if !primitive.attributes.contains_key("POSITION") {
                    self.counts.placeless += 1;
                    continue;
                }
                total += 1;
                normals += u64::from(primitive.attributes.contains_key("NORMAL"));
                colors += u64::from(primitive.attributes.contains_key("COLOR_0"));
                self.counts.targets += u64::from(!primitive.targets.is_empty());
            }
        }
        self.with_normals = total > 0 && normals == total;
        self.with_colors = total > 0 && colors == total;
        self.counts.normals = if self.with_normals { 0 } else { normals };
        self.counts.colors = if self.with_colors { 0 } else { colors };
        Ok(())
    }

    /// Adds the primitives of one node.
    fn place(&mut self, place_index: usize, place: &Placed) -> Result<(), Refusal> {
        // The vertices made for this node so far: the accessors and the part.
        let mut made: Vec<(Attributes, usize)> = Vec::new();
        for (index, primitive) in self.primitives(place)?.iter().enumerate() {
            let Some(position) = primitive.attributes.get("POSITION").copied() else {
                continue;
            };
            let other = |wanted: bool, name| {
                wanted
                    .then(|| primitive.attributes.get(name).copied())
                    .flatten()
            };
            let attributes = (
                position,
                other(self.with_normals, "NORMAL"),
                other(self.with_colors, "COLOR_0"),
            );
            let part = match made.iter().find(|(key, _)| *key == attributes) {
                Some((_, part)) => *part,
                None => {
                    let base = self.mesh.positions.len();
                    let count = self.add_vertices(place, attributes)?;
                    made.push((attributes, self.parts.len()));
                    self.parts.push(Part {
                        placed: place_index,
                        primitives: Vec::new(),
                        base,
                        count,
                    });
                    self.parts.len() - 1
                }
            };
            let part = &mut self.parts[part];
            part.primitives.push(index);
            let (base, count) = (part.base, part.count);
            self.add_elements(place, index, primitive, base, count)?;
        }
        Ok(())
    }

    /// Adds the vertices of one set of accessors. Returns their number.
    fn add_vertices(&mut self, place: &Placed, attributes: Attributes) -> Result<usize, Refusal> {
        let (position, normal, color) = attributes;
        let positions = self.reader.vectors(position, 3..=3, [0.0; 3])?;
        let count = positions.len();
        self.fits(place, count as u64, 0)?;
        let same = |index: usize, what: &str, length: usize| {
            if length == count {
                return Ok(());
            }
            let problem = format!("{length} {what} for {count} positions in accessor {position}");
            Err(Fault::element("accessor", index, problem))
        };
        if let (Some(index), Some(normals)) = (normal, &mut self.mesh.normals) {
            let found = self.reader.vectors(index, 3..=3, [0.0; 3])?;
            same(index, "normals", found.len())?;
            normals.extend(found.iter().map(|n| normalize(place.normal(*n))));
        }
        if let (Some(index), Some(colors)) = (color, &mut self.mesh.colors) {
            let found = self.reader.vectors(index, 3..=4, [0.0, 0.0, 0.0, 1.0])?;
            same(index, "colours", found.len())?;
            colors.extend(found.iter().map(|c| c.map(|v| v as f32)));
        }
        let placed = positions.iter().map(|p| place.point(*p));
        self.mesh.positions.extend(placed);
        Ok(count)
    }

    /// Whether so many vertices and corners more can be held.
    fn fits(&self, place: &Placed, vertices: u64, corners: u64) -> Result<(), Refusal> {
        let vertices = self.mesh.positions.len() as u64 + vertices;
        let held = 3 * self.mesh.triangles.len() + 2 * self.mesh.segments.len();
        let corners = (held + self.mesh.points.len()) as u64 + corners;
        let bytes = u128::from(vertices) * 64 + u128::from(corners) * 4;
        if vertices > u64::from(u32::MAX) {
            let problem = format!(
                "with its mesh there are {vertices} vertices, but at most {} can be held",
                u32::MAX
            );
            return Err(Fault::element("node", place.node, problem)
                .with_hint("use the mesh in fewer nodes")
                .into());
        }
        let what = || {
            format!(
                "the mesh with that of node {}, {vertices} vertices,",
                place.node
            )
        };
        let hint = "raise --max-memory, or use the mesh in fewer nodes";
        expect_room(what, bytes, self.limit, hint)
    }

    /// Adds the triangles, segments or points of a primitive whose vertices begin at `base`.
    fn add_elements(
        &mut self,
        place: &Placed,
        primitive_index: usize,
        primitive: &Primitive,
        base: usize,
        count: usize,
    ) -> Result<(), Refusal> {
        let fault = |problem: String| {
            let problem = format!("primitive {primitive_index}: {problem}");
            Fault::element("mesh", place.mesh, problem)
        };
        let base = base as u32;
        let corners: Vec<u32> = match primitive.indices {
            Some(accessor) => {
                let mut indices = self.reader.indices(accessor)?;
                for (i, index) in indices.iter_mut().enumerate() {
                    if *index as usize >= count {
                        return Err(fault(format!(
                            "index {i} refers to vertex {index}, but there are {count}"
                        ))
                        .into());
                    }
                    *index += base;
                }
                indices
            }
            None => (base..base + count as u32).collect(),
        };
        self.fits(place, 0, 3 * corners.len() as u64)?;
        let turned = place.mirrors();
        let triangle = |[a, b, c]: [u32; 3]| if turned { [a, c, b] } else { [a, b, c] };
        let mesh = &mut self.mesh;
        let (pairs, rest_of_pairs) = corners.as_chunks::<2>();
        let (threes, rest_of_threes) = corners.as_chunks::<3>();
        let short = |least: usize| {
            if corners.len() < least {
                corners.len()
            } else {
                0
            }
        };
        let left = match primitive.mode {
            0 => {
                mesh.points.extend(&corners);
                0
            }
            1 => {
                mesh.segments.extend(pairs);
                rest_of_pairs.len()
            }
            mode @ (2 | 3) => {
                mesh.segments
                    .extend(corners.windows(2).map(|w| [w[0], w[1]]));
                if let (2, [first, .., last]) = (mode, corners.as_slice()) {
                    mesh.segments.push([*last, *first]);
                }
                short(2)
            }
            4 => {
                mesh.triangles.extend(threes.iter().map(|t| triangle(*t)));
                rest_of_threes.len()
            }
            5 => {
                let strip = corners.windows(3).enumerate().map(|(i, w)| {
                    // Every other triangle of a strip runs the other way round.
                    let (b, c) = if i % 2 == 0 {
                        (w[1], w[2])
                    } else {
                        (w[2], w[1])
                    };
                    triangle([w[0], b, c])
                });
                mesh.triangles.extend(strip);
                short(3)
            }
            6 => {
                if let Some((first, others)) = corners.split_first() {
                    let fan = others.windows(2).map(|w| triangle([w[0], w[1], *first]));
                    mesh.triangles.extend(fan);
                }
                short(3)
            }
            mode => return Err(fault(format!("mode {mode} is none of 0 to 6")).into()),
        };
        self.counts.incomplete += left as u64;
        Ok(())
    }
}
