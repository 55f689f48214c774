//! A stream that is read: any of its frames, as far as it is whole.

use super::coder::Reader;
use super::container::{self, Kind, Section, push_number, take_f64, take_number};
use super::corrections;
use super::hierarchy::Hierarchy;
use super::params::Method;
use super::spectrum::Cosines;
use super::trajectory::{self, Components};
use super::{delta, faces, local};
use crate::anim::Clip;
use crate::error::Fault;
use crate::mesh::polygon::set_faces;
use crate::mesh::{Mesh, Polygons};
use crate::numeric::vector::Vec3;
use schemars::JsonSchema;
use serde::Serialize;
use std::ops::Range;

/// Vertices, frames and faces of a stream at most: a header that claims more is damaged.
const MOST: u64 = 1 << 31;

/// What holds for a whole stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Vertices of every frame.
    pub vertices: usize,
    /// Frames.
    pub frames: usize,
    /// Faces.
    pub faces: usize,
    /// Frames of every window but the last.
    pub window: usize,
    /// Frames per second.
    pub rate: f64,
    /// Time of the first frame, in seconds.
    pub start: f64,
    /// Where local coordinates have their origin.
    pub origin: Vec3,
    /// The power of two that is the unit of local coordinates.
    pub exponent: i32,
}

impl Header {
    /// As a payload.
    pub fn write(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for count in [self.vertices, self.frames, self.faces, self.window] {
            push_number(&mut out, count as u64);
        }
        push_number(&mut out, (self.exponent + 4096) as u64);
        for x in [self.rate, self.start].iter().chain(&self.origin) {
            out.extend_from_slice(&x.to_le_bytes());
        }
        out
    }

    fn read(mut payload: &[u8]) -> Result<Self, Fault> {
        let damaged = |what: &str| Fault::whole(format!("the header has no {what}; damaged"));
        let mut count = |what| {
            let count = take_number(&mut payload).filter(|count| *count < MOST);
            count
                .map(|count| count as usize)
                .ok_or_else(|| damaged(what))
        };
        let (vertices, frames) = (count("number of vertices")?, count("number of frames")?);
        let (faces, window) = (count("number of faces")?, count("length of windows")?);
        let exponent = count("unit")?;
        let mut number = |what| {
            let number = take_f64(&mut payload).filter(|number| number.is_finite());
            number.ok_or_else(|| damaged(what))
        };
        let (rate, start) = (number("rate")?, number("time")?);
        let origin = [number("origin")?, number("origin")?, number("origin")?];
        let sound = vertices > 0 && frames > 0 && (1..=1024).contains(&window) && rate > 0.0;
        if !sound || exponent > 8192 {
            return Err(damaged("sound counts"));
        }
        Ok(Header {
            vertices,
            frames,
            faces,
            window,
            rate,
            start,
            origin,
            exponent: exponent as i32 - 4096,
        })
    }

    /// Number of windows.
    pub fn windows(&self) -> usize {
        self.frames.div_ceil(self.window)
    }

    /// The frames of a window.
    pub fn frames_of(&self, window: usize) -> Range<usize> {
        window * self.window..self.frames.min((window + 1) * self.window)
    }

    /// Local coordinates in the unit of the file.
    pub fn unit(&self) -> f64 {
        2f64.powi(self.exponent)
    }
}

/// Positions that are made together.
const TOGETHER: usize = 1 << 18;

/// The motion of a window.
#[derive(Debug)]
pub enum Motion {
    /// Components.
    Trajectory(Components, Cosines),
    /// Clusters.
    Local(local::Decoded),
    /// Frames.
    Delta(Vec<Vec<Vec3>>),
}

impl Motion {
    /// Reads the sections of a window of so many frames, as far as there are parts.
    pub fn read<P: AsRef<[u8]>>(
        method: Method,
        hierarchy: &Hierarchy,
        frames: usize,
        window: &[u8],
        parts: &[P],
    ) -> Result<Self, Fault> {
        let parts: Vec<&[u8]> = parts.iter().map(AsRef::as_ref).collect();
        Ok(match method {
            Method::Delta => Motion::Delta(delta::decode(hierarchy, frames, window, &parts)?),
            Method::Rlpca | Method::Lpca | Method::Pca => {
                Motion::Local(local::decode(hierarchy, frames, window, &parts)?)
            }
            Method::Auto | Method::Trajectory => {
                let read = trajectory::decode(hierarchy, frames, window, &parts)?;
                Motion::Trajectory(read, Cosines::new(frames))
            }
        })
    }

    /// Hands over frames of the window, one after the other, in local coordinates, before corrections.
    ///
    /// Several are made together where that is faster, as many as hold a quarter of a million positions.
    pub fn each_frame(
        &self,
        vertices: usize,
        frames: Range<usize>,
        mut take: impl FnMut(usize, &mut [Vec3]),
    ) {
        let most = match self {
            Motion::Trajectory(..) => (TOGETHER / vertices.max(1)).clamp(1, 16),
            _ => 1,
        };
        let mut out = vec![[0.0; 3]; vertices * most.min(frames.len())];
        for first in frames.clone().step_by(most) {
            let frames = first..frames.end.min(first + most);
            let out = &mut out[..vertices * frames.len()];
            match self {
                Motion::Trajectory(components, cosines) => {
                    components.frames(cosines, frames.clone(), out);
                }
                Motion::Local(clusters) => clusters.frame(first, out),
                Motion::Delta(frames) => out.copy_from_slice(&frames[first]),
            }
            for (f, out) in frames.zip(out.chunks_exact_mut(vertices.max(1))) {
                take(f, out);
            }
        }
    }
}

/// A window that is read.
#[derive(Debug)]
struct Window<'a> {
    frames: Range<usize>,
    motion: Motion,
    corrections: Option<&'a [u8]>,
}

/// A stream that is read.
#[derive(Debug)]
pub struct Stream<'a> {
    header: Header,
    faces: Polygons,
    windows: Vec<Window<'a>>,
    cut: Option<usize>,
}

/// What stands in a stream, without its being read whole.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Version of the format.
    pub version: u8,
    /// Vertices of every frame.
    pub vertices: u64,
    /// Frames.
    pub frames: u64,
    /// Faces.
    pub faces: u64,
    /// Frames per second.
    pub rate: f64,
    /// Windows of frames that are told together, and frames of each but the last.
    pub windows: [u64; 2],
    /// How the motion of each window is told.
    pub methods: Vec<String>,
    /// Components of each window, where it has any.
    pub components: Vec<u64>,
    /// Sections and their bytes, kind by kind.
    pub sections: Vec<Sections>,
    /// The byte at which the stream breaks off, where it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off_at: Option<u64>,
}

/// The sections of one kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Sections {
    /// Their kind.
    pub kind: String,
    /// How many there are.
    pub count: u64,
    /// Bytes of all of them.
    pub bytes: u64,
}

/// The sections of one window.
struct Parts<'a> {
    method: Method,
    window: &'a [u8],
    parts: Vec<&'a [u8]>,
    corrections: Option<&'a [u8]>,
}

/// A stream taken apart.
struct Opened<'a> {
    header: Header,
    faces: &'a [u8],
    windows: Vec<Parts<'a>>,
    sections: container::Sections<'a>,
}

fn open(bytes: &[u8]) -> Result<Opened<'_>, Fault> {
    let sections = container::parse(bytes)?;
    let short = || {
        let at = sections.cut.unwrap_or(bytes.len());
        Fault::byte(at, "the stream breaks off before any frame is told")
    };
    let payload = |at: usize, kind: Kind| {
        let section: Option<&Section> = sections.list.get(at);
        let found = section.filter(|section| section.kind == kind);
        found.map(|section| section.payload).ok_or_else(short)
    };
    let header = Header::read(payload(0, Kind::Header)?)?;
    let faces = payload(1, Kind::Faces)?;
    let mut windows: Vec<Parts> = Vec::new();
    for (number, section) in sections.list.iter().enumerate().skip(2) {
        let mut payload = section.payload;
        let problem = |what: &str| {
            let kind = section.kind.name();
            Err(Fault::whole(format!(
                "section {number} ({kind}): {what}; damaged"
            )))
        };
        let Some(window) = take_number(&mut payload).map(|window| window as usize) else {
            return problem("names no window");
        };
        match section.kind {
            Kind::Window => {
                let Some((method, rest)) = payload.split_first() else {
                    return problem("names no method");
                };
                let name = Method::NAMES.get(usize::from(*method)).copied();
                let Some(method) = name.and_then(Method::from_name) else {
                    return problem("is of an unknown method");
                };
                if window != windows.len() || window >= header.windows() {
                    return problem("is not the next window");
                }
                windows.push(Parts {
                    method,
                    window: rest,
                    parts: Vec::new(),
                    corrections: None,
                });
            }
            Kind::Part | Kind::Corrections => {
                let Some(of) = windows.get_mut(window) else {
                    return problem("belongs to no window");
                };
                match section.kind {
                    Kind::Part => of.parts.push(payload),
                    _ => of.corrections = Some(payload),
                }
            }
            _ => return problem("stands where none may"),
        }
    }
    if windows.is_empty() {
        return Err(short());
    }
    Ok(Opened {
        header,
        faces,
        windows,
        sections,
    })
}

/// Whether bytes begin as a stream does.
pub fn is_stream(bytes: &[u8]) -> bool {
    bytes.starts_with(container::MAGIC)
}

/// Bytes that decoding so many frames of a stream takes, for the frames themselves and what they are
/// made of.
pub fn room_to_decode(summary: &Summary, frames: usize) -> u128 {
    let (vertices, window) = (u128::from(summary.vertices), u128::from(summary.windows[1]));
    let most = summary.components.iter().copied().max().unwrap_or(0);
    // Weights twice, and what foresees them; then places, rings and neighbours.
    let held = u128::from(most) * (2 * vertices + 3 * window) * 8 + vertices * 800;
    vertices * frames as u128 * 24 + held + u128::from(summary.faces) * 48
}

/// What stands in a stream. Cost: one pass over the bytes, for their checksums.
pub fn summary(bytes: &[u8]) -> Result<Summary, Fault> {
    let opened = open(bytes)?;
    let header = &opened.header;
    let mut sections: Vec<Sections> = Vec::new();
    for section in &opened.sections.list {
        let kind = section.kind.name();
        let known = sections.iter_mut().find(|known| known.kind == kind);
        match known {
            Some(known) => {
                known.count += 1;
                known.bytes += section.whole as u64;
            }
            None => sections.push(Sections {
                kind: kind.to_owned(),
                count: 1,
                bytes: section.whole as u64,
            }),
        }
    }
    let components = |window: &Parts| {
        let counts = window
            .parts
            .iter()
            .map(|part| take_number(&mut &**part).unwrap_or(0));
        (window.method != Method::Delta).then(|| counts.sum())
    };
    Ok(Summary {
        version: bytes[container::MAGIC.len()],
        vertices: header.vertices as u64,
        frames: header.frames as u64,
        faces: header.faces as u64,
        rate: header.rate,
        windows: [header.windows() as u64, header.window as u64],
        methods: opened
            .windows
            .iter()
            .map(|w| w.method.name().to_owned())
            .collect(),
        components: opened.windows.iter().filter_map(components).collect(),
        sections,
        cut_off_at: opened.sections.cut.map(|at| at as u64),
    })
}

/// The edges of faces, each from every face that has it.
pub fn edges(faces: &Polygons) -> impl Iterator<Item = [u32; 2]> {
    faces.iter().flat_map(|face| {
        let next = face.iter().cycle().skip(1);
        face.iter().zip(next).map(|(a, b)| [*a, *b])
    })
}

impl<'a> Stream<'a> {
    /// Reads what the frames of a range need; all frames where none is given.
    ///
    /// `limit` is how many bytes it may take. A stream that breaks off is read as far as it goes:
    /// see [`Stream::cut_off_at`]. Errs with the byte and the section where a stream is damaged, and
    /// where frames of the range are not in it. Cost: every window that the range touches, whole.
    pub fn open(bytes: &'a [u8], range: Option<Range<usize>>) -> Result<Self, Fault> {
        let opened = open(bytes)?;
        let header = opened.header;
        let range = range.unwrap_or(0..header.frames);
        if range.is_empty() || range.end > header.frames {
            return Err(Fault::whole(format!(
                "frames {}:{} are asked for, but there are {}",
                range.start, range.end, header.frames
            )));
        }
        let vertices = header.vertices as u32;
        let mut reader = Reader::new(opened.faces);
        let faces = faces::code(&mut reader, vertices, header.faces, std::iter::empty())?;
        reader.check()?;
        let hierarchy = Hierarchy::new(header.vertices, edges(&faces));
        let hierarchy = hierarchy.map_err(|error| Fault::whole(error.to_string()))?;
        let mut windows = Vec::new();
        for number in range.start / header.window..range.end.div_ceil(header.window) {
            let frames = header.frames_of(number);
            let Some(parts) = opened.windows.get(number) else {
                let at = opened.sections.cut.unwrap_or(bytes.len());
                let problem = format!(
                    "the stream breaks off before frames {}:{} are told",
                    frames.start, frames.end
                );
                return Err(Fault::byte(at, problem));
            };
            let motion = Motion::read(
                parts.method,
                &hierarchy,
                frames.len(),
                parts.window,
                &parts.parts,
            )?;
            windows.push(Window {
                frames,
                motion,
                corrections: parts.corrections,
            });
        }
        Ok(Stream {
            header,
            faces,
            windows,
            cut: opened.sections.cut,
        })
    }

    /// What holds for all of it.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The byte at which the stream breaks off; all frames are there, but less accurate.
    pub fn cut_off_at(&self) -> Option<usize> {
        self.cut
    }

    /// Hands over the frames of a range one after the other, in the unit of the file.
    ///
    /// Errs as [`Stream::open`] where corrections are damaged. Cost: that of each frame, and of all
    /// before it in its window where the window has corrections.
    pub fn each_frame(
        &self,
        range: Range<usize>,
        mut take: impl FnMut(usize, &[Vec3]),
    ) -> Result<(), Fault> {
        let vertices = self.header.vertices;
        let (unit, origin) = (self.header.unit(), self.header.origin);
        for window in &self.windows {
            let corrections = window.corrections;
            let corrections = corrections.map(|c| corrections::Decoder::new(vertices, c));
            let mut corrections = corrections.transpose()?;
            let before = window.frames.start;
            let first = match corrections {
                Some(_) => 0,
                None => range.start.saturating_sub(before),
            };
            let last = range.end.min(window.frames.end).saturating_sub(before);
            window.motion.each_frame(vertices, first..last, |f, frame| {
                if let Some(corrections) = &mut corrections {
                    corrections.frame(frame);
                }
                if before + f >= range.start {
                    for p in frame.iter_mut() {
                        *p = std::array::from_fn(|i| p[i] * unit + origin[i]);
                    }
                    take(before + f, frame);
                }
            });
        }
        Ok(())
    }

    /// The frames of a range as a clip.
    pub fn clip(&self, range: Range<usize>) -> Result<Clip, Fault> {
        let mut positions = Vec::with_capacity(range.len() * self.header.vertices);
        self.each_frame(range.clone(), |_, frame| positions.extend_from_slice(frame))?;
        let mut mesh = Mesh {
            positions: positions[..self.header.vertices].to_vec(),
            ..Mesh::default()
        };
        set_faces(&mut mesh, self.faces.clone(), &mut Vec::new())?;
        if self.header.faces == 0 {
            mesh.points = (0..self.header.vertices as u32).collect();
        }
        Ok(Clip {
            mesh,
            positions,
            start: self.header.start + range.start as f64 / self.header.rate,
            rate: self.header.rate,
        })
    }
}
