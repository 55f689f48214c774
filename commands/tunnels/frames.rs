//! The same tunnels in many frames: clusters, and how wide each is over time.

use super::solve::Model;
use scantle::error::Result;
use scantle::io::sink::Sink;
use scantle::protein::tunnels::cluster::{Course, clusters};
use serde::Serialize;
use std::sync::Mutex;

/// Tunnels of all frames, as they are found.
pub struct Frames {
    sink: Sink,
    /// Courses further apart than this, on average, are not one tunnel.
    most: f64,
    all: Mutex<Vec<Frame>>,
}

/// A model of an input.
struct Frame {
    input: String,
    model: i32,
    tunnels: Vec<Shape>,
}

/// A tunnel of a frame.
struct Shape {
    course: Course,
    seen: Seen,
}

/// A tunnel in one frame.
#[derive(Debug, Clone, Copy, Serialize)]
struct Seen {
    bottleneck: f64,
    length: f64,
    throughput: f64,
}

/// What is written.
#[derive(Debug, Serialize)]
struct Document {
    /// How far apart courses of one cluster are on average, at most.
    threshold: f64,
    /// The frames, in the order of the command line and the file.
    frames: Vec<FrameNamed>,
    /// The clusters, that of the highest mean throughput over all frames first.
    clusters: Vec<Cluster>,
}

#[derive(Debug, Serialize)]
struct FrameNamed {
    input: String,
    model: i32,
    tunnels: usize,
}

#[derive(Debug, Serialize)]
struct Cluster {
    /// Tunnels in it.
    tunnels: usize,
    /// Frames that have one of them.
    frames: usize,
    /// Mean throughput over all frames, 0 where there is none.
    priority: f64,
    /// Smallest, mean and largest bottleneck over the frames that have it.
    bottleneck: [f64; 3],
    /// Per frame the widest of its tunnels in the cluster; null where there is none.
    by_frame: Vec<Option<Seen>>,
}

impl Frames {
    /// None yet, to be written there.
    pub fn new(sink: Sink, most: f64) -> Self {
        Frames {
            sink,
            most,
            all: Mutex::default(),
        }
    }

    /// Where they are written.
    pub fn sink(&self) -> &Sink {
        &self.sink
    }

    /// Adds what was found in a model.
    pub fn add(&self, input: &str, model: &Model) {
        let shape = |tunnel| Shape {
            course: Course::of(tunnel),
            seen: Seen {
                bottleneck: tunnel.narrowest.radius,
                length: tunnel.length,
                throughput: tunnel.throughput,
            },
        };
        let frame = Frame {
            input: input.to_owned(),
            model: model.number,
            tunnels: model.tunnels.iter().map(shape).collect(),
        };
        self.all.lock().expect("no one panics with it").push(frame);
    }

    /// Writes the clusters, where there is any frame.
    pub fn write(self) -> Result<()> {
        let frames = self.all.into_inner().expect("no one panics with it");
        if frames.is_empty() {
            return Ok(());
        }
        let courses: Vec<Course> = frames
            .iter()
            .flat_map(|frame| frame.tunnels.iter().map(|shape| shape.course.clone()))
            .collect();
        let labels = clusters(&courses, self.most);
        let count = labels.iter().max().map_or(0, |most| most + 1);
        let mut made: Vec<Cluster> = (0..count)
            .map(|label| Cluster::new(label, &labels, &frames))
            .collect();
        made.sort_by(|a, b| b.priority.total_cmp(&a.priority));
        let document = Document {
            threshold: self.most,
            frames: frames
                .into_iter()
                .map(|frame| FrameNamed {
                    input: frame.input,
                    model: frame.model,
                    tunnels: frame.tunnels.len(),
                })
                .collect(),
            clusters: made,
        };
        let bytes = crate::words::json(&document, true);
        self.sink.write_as("json", |out| out.write_all(&bytes))?;
        Ok(())
    }
}

impl Cluster {
    fn new(label: usize, labels: &[usize], frames: &[Frame]) -> Self {
        let mut next = labels.iter();
        let mut tunnels = 0;
        let by_frame: Vec<Option<Seen>> = frames
            .iter()
            .map(|frame| {
                let mut widest: Option<Seen> = None;
                for shape in &frame.tunnels {
                    if next.next() == Some(&label) {
                        tunnels += 1;
                        let seen = shape.seen;
                        if widest.is_none_or(|w| seen.bottleneck > w.bottleneck) {
                            widest = Some(seen);
                        }
                    }
                }
                widest
            })
            .collect();
        let seen = || by_frame.iter().flatten();
        let count = seen().count();
        let widths = || seen().map(|s| s.bottleneck);
        let mean = widths().sum::<f64>() / count as f64;
        let least = widths().fold(f64::INFINITY, f64::min);
        let most = widths().fold(f64::NEG_INFINITY, f64::max);
        Cluster {
            tunnels,
            frames: count,
            priority: seen().map(|s| s.throughput).sum::<f64>() / frames.len() as f64,
            bottleneck: [least, mean, most],
            by_frame,
        }
    }
}
