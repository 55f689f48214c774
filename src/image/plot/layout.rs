//! From the description to shapes in their places.

use super::super::colour::{FAINT_INK, INK, Srgb};
use super::super::text::{self, Align};
use super::axis::{self, Fitted, Tick, has_place};
use super::labels::{Area, Obstacles};
use super::scene::{Scene, Shape, Text, Words};
use super::{Line, On, Plot, Point, Scale, Series};

// Heights of capitals, in pixels.
const TITLE_CAP: f64 = 13.0;
const AXIS_CAP: f64 = 10.5;
const TICK_CAP: f64 = 9.5;
const NOTE_CAP: f64 = 9.0;
const LABEL_CAP: f64 = 8.5;

/// White along the page's edges.
const SIDE: f64 = 26.0;
const TITLE_LINE: f64 = 40.0;
const LEGEND_LINE: f64 = 23.0;
/// From the plot's lower edge to the page's: the ticks' numbers, the title, the notes.
const FOOT: f64 = 86.0;
/// From the ticks' numbers to the upright title.
const BESIDE: f64 = 34.0;

const RADIUS: f64 = 5.0;
const TICK: f64 = 5.0;
const SMALL_TICK: f64 = 3.0;
/// The width of a legend's sample of a line.
const SAMPLE: f64 = 26.0;
/// The width of a sample without a line.
const SAMPLE_MARK: f64 = 12.0;

const GRID: Srgb = [230, 230, 233];
const LANE: Srgb = [245, 245, 247];
const DASH: [f64; 2] = [6.0, 4.0];

/// A plot taking shape: its inner rectangle, its axes, and what is drawn so far.
struct Layout<'a> {
    plot: &'a Plot,
    size: [f64; 2],
    frame: Area,
    x: Fitted,
    y: Fitted,
    shapes: Vec<Shape>,
}

/// All of a plot as shapes.
pub(super) fn scene(plot: &Plot) -> Scene {
    let width = plot.width.max(Plot::SMALLEST);
    let height = plot.height.max(Plot::SMALLEST);
    let size = [width as f64, height as f64];
    let legend = legend_rows(plot, size[0] - 2.0 * SIDE);
    let top = TITLE_LINE + 14.0 + legend.len() as f64 * LEGEND_LINE;
    let bottom = (size[1] - FOOT).max(top + 1.0);
    let y = axis::fit(&plot.y, &numbers(plot, On::Y), [bottom, top]);
    let y_ticks = y.ticks(((bottom - top) / 42.0) as usize);
    let widest = y_ticks.iter().map(|t| t.words.width(TICK_CAP));
    let left = SIDE + BESIDE + widest.fold(0.0, f64::max);
    let right = size[0] - SIDE;
    let x = axis::fit(&plot.x, &numbers(plot, On::X), [left, right]);
    let x_ticks = x.ticks(((right - left) / 78.0) as usize);
    let mut layout = Layout {
        plot,
        size,
        frame: Area {
            from: [left, top],
            to: [right, bottom],
        },
        x,
        y,
        shapes: Vec::new(),
    };
    layout.draw_head(&legend);
    layout.draw_axes(&x_ticks, &y_ticks);
    let (texts, guides) = layout.draw_guides();
    layout.draw_series();
    let unlabelled = layout.draw_labels(texts, guides);
    layout.draw_foot(unlabelled);
    Scene {
        width,
        height,
        shapes: layout.shapes,
    }
}

fn is_shown(plot: &Plot, p: &Point) -> bool {
    has_place(plot.x.scale, p.x) && has_place(plot.y.scale, p.y)
}

/// The numbers that an axis has to reach.
fn numbers(plot: &Plot, on: On) -> Vec<f64> {
    let points = plot.series.iter().flat_map(|s| &s.points);
    let scale = match on {
        On::X => plot.x.scale,
        On::Y => plot.y.scale,
    };
    let of_point = |p: &Point| match on {
        On::X => (p.x, p.x_spread),
        On::Y => (p.y, p.y_spread),
    };
    points
        .filter(|p| is_shown(plot, p))
        .flat_map(|p| {
            let (v, spread) = of_point(p);
            let bounds = spread.into_iter().flatten();
            // A bar down to zero asks for no lane: it ends at the axis.
            let bounds = bounds.filter(move |b| scale == Scale::Linear || *b > 0.0);
            std::iter::once(v).chain(bounds)
        })
        .chain(plot.guides.iter().filter(|g| g.on == on).map(|g| g.value))
        .collect()
}

/// The named series in rows that fit a width, each with where it begins.
fn legend_rows(plot: &Plot, width: f64) -> Vec<Vec<(f64, &Series)>> {
    let mut rows: Vec<Vec<(f64, &Series)>> = Vec::new();
    let mut at = f64::INFINITY;
    for series in plot.series.iter().filter(|s| !s.name.is_empty()) {
        let wide = sample(series) + 8.0 + text::width(&series.name, NOTE_CAP);
        if at + wide > width {
            rows.push(Vec::new());
            at = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((at, series));
        }
        at += wide + 26.0;
    }
    rows
}

impl Layout<'_> {
    fn text(&mut self, words: Words, at: [f64; 2], cap: f64, align: Align, colour: Srgb) {
        self.shapes.push(Shape::Text(Text {
            words,
            at,
            cap,
            align,
            colour,
            turned: false,
            halo: false,
        }));
    }

    fn path(&mut self, points: Vec<[f64; 2]>, width: f64, colour: Srgb) {
        let dash = None;
        self.shapes.push(Shape::Path {
            points,
            width,
            colour,
            dash,
        });
    }

    fn mark(&mut self, series: &Series, at: [f64; 2], hint: &str) {
        self.shapes.push(Shape::Mark {
            marker: series.marker,
            at,
            radius: RADIUS,
            colour: series.colour,
            hint: hint.to_owned(),
        });
    }

    /// A level line as one row of whole pixels.
    fn level(&mut self, y: f64, from: f64, to: f64, colour: Srgb) {
        self.shapes.push(Shape::Box {
            from: [from.floor(), y.floor()],
            to: [to.floor() + 1.0, y.floor() + 1.0],
            colour,
        });
    }

    /// An upright line as one column of whole pixels.
    fn upright(&mut self, x: f64, from: f64, to: f64, colour: Srgb) {
        self.shapes.push(Shape::Box {
            from: [x.floor(), from.floor()],
            to: [x.floor() + 1.0, to.floor() + 1.0],
            colour,
        });
    }

    fn draw_head(&mut self, legend: &[Vec<(f64, &Series)>]) {
        let room = self.size[0] - 2.0 * SIDE;
        let title = text::shortened(&self.plot.title, TITLE_CAP, room);
        let at = [SIDE, TITLE_LINE];
        self.text(Words::plain(title), at, TITLE_CAP, Align::Left, INK);
        for (i, row) in legend.iter().enumerate() {
            let middle = TITLE_LINE + 22.0 + i as f64 * LEGEND_LINE;
            for (at, series) in row {
                let from = SIDE + at;
                let sample = sample(series);
                if series.line != Line::None {
                    let ends = vec![[from, middle], [from + sample, middle]];
                    self.path(ends, line_width(series), series.colour);
                }
                self.mark(series, [from + sample * 0.5, middle], "");
                let at = [from + sample + 8.0, middle + NOTE_CAP * 0.5];
                let name = text::shortened(&series.name, NOTE_CAP, self.size[0] - SIDE - at[0]);
                self.text(Words::plain(name), at, NOTE_CAP, Align::Left, INK);
            }
        }
    }

    fn draw_axes(&mut self, x_ticks: &[Tick], y_ticks: &[Tick]) {
        let Area {
            from: [left, top],
            to: [right, bottom],
        } = self.frame;
        let (colour, start) = (LANE, [self.x.start(), self.y.start()]);
        if self.y.zero.is_some() {
            let (from, to) = ([left, start[1]], [right, bottom]);
            self.shapes.push(Shape::Box { from, to, colour });
        }
        if self.x.zero.is_some() {
            let (from, to) = ([left, top], [start[0], bottom]);
            self.shapes.push(Shape::Box { from, to, colour });
        }
        for tick in x_ticks.iter().filter(|t| t.words != Words::default()) {
            self.upright(tick.at, top, bottom, GRID);
        }
        for tick in y_ticks.iter().filter(|t| t.words != Words::default()) {
            self.level(tick.at, left, right, GRID);
        }
        // The axes have a gap where the logarithms end and zero begins.
        let gap = |zero: Option<f64>| if zero.is_some() { 3.0 } else { 0.0 };
        let (gap_x, gap_y) = (gap(self.x.zero), gap(self.y.zero));
        self.level(bottom, start[0] + gap_x, right, FAINT_INK);
        self.upright(left, top, start[1] - gap_y, FAINT_INK);
        if gap_x > 0.0 {
            self.level(bottom, left, start[0] - gap_x, FAINT_INK);
        }
        if gap_y > 0.0 {
            self.upright(left, start[1] + gap_y, bottom, FAINT_INK);
        }
        for tick in x_ticks {
            let long = if tick.words == Words::default() {
                SMALL_TICK
            } else {
                TICK
            };
            self.upright(tick.at, bottom, bottom + long, FAINT_INK);
            let at = [tick.at, bottom + TICK + 7.0 + TICK_CAP];
            self.text(tick.words.clone(), at, TICK_CAP, Align::Centre, INK);
        }
        for tick in y_ticks {
            let long = if tick.words == Words::default() {
                SMALL_TICK
            } else {
                TICK
            };
            self.level(tick.at, left - long, left, FAINT_INK);
            let at = [left - TICK - 7.0, tick.at + TICK_CAP * 0.5];
            self.text(tick.words.clone(), at, TICK_CAP, Align::Right, INK);
        }
        self.draw_titles();
    }

    fn draw_titles(&mut self) {
        let Area { from, to } = self.frame;
        let across = text::shortened(&self.plot.x.title, AXIS_CAP, to[0] - from[0]);
        let at = [(from[0] + to[0]) * 0.5, to[1] + TICK + TICK_CAP + 30.0];
        self.text(Words::plain(across), at, AXIS_CAP, Align::Centre, INK);
        let upwards = text::shortened(&self.plot.y.title, AXIS_CAP, to[1] - from[1]);
        self.shapes.push(Shape::Text(Text {
            words: Words::plain(upwards),
            at: [SIDE + AXIS_CAP - 4.0, (from[1] + to[1]) * 0.5],
            cap: AXIS_CAP,
            align: Align::Centre,
            colour: INK,
            turned: true,
            halo: false,
        }));
    }

    /// Draws the guides; the areas of their texts and their lines, which labels keep away from.
    fn draw_guides(&mut self) -> (Vec<Area>, Vec<[[f64; 2]; 2]>) {
        let Area { from, to } = self.frame;
        let (mut areas, mut lines) = (Vec::new(), Vec::new());
        for guide in &self.plot.guides {
            let axis = match guide.on {
                On::X => &self.x,
                On::Y => &self.y,
            };
            let Some(at) = axis.place(guide.value) else {
                continue;
            };
            let room = (to[0] - from[0]) * 0.5;
            let words = Words::plain(text::shortened(&guide.text, LABEL_CAP, room));
            let wide = words.width(LABEL_CAP);
            let (ends, corner) = match guide.on {
                On::Y => {
                    let above = at - 5.0 - LABEL_CAP;
                    let above = if above < from[1] { at + 6.0 } else { above };
                    ([[from[0], at], [to[0], at]], [to[0] - wide - 6.0, above])
                }
                On::X => {
                    let after = at + 6.0;
                    let after = if after + wide > to[0] {
                        at - 6.0 - wide
                    } else {
                        after
                    };
                    ([[at, from[1]], [at, to[1]]], [after, from[1] + 4.0])
                }
            };
            self.shapes.push(Shape::Path {
                points: ends.to_vec(),
                width: 1.2,
                colour: FAINT_INK,
                dash: Some(DASH),
            });
            self.shapes.push(Shape::Text(Text {
                words,
                at: [corner[0], corner[1] + LABEL_CAP],
                cap: LABEL_CAP,
                align: Align::Left,
                colour: FAINT_INK,
                turned: false,
                halo: true,
            }));
            lines.push(ends);
            areas.push(Area {
                from: corner,
                to: [corner[0] + wide, corner[1] + LABEL_CAP * 1.3],
            });
        }
        (areas, lines)
    }

    /// Where a point is, in pixels.
    fn place(&self, p: &Point) -> Option<[f64; 2]> {
        Some([self.x.place(p.x)?, self.y.place(p.y)?])
    }

    /// The bars of a point.
    fn bars(&self, p: &Point, [x, y]: [f64; 2]) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let level = p.x_spread.filter(|s| s.iter().all(|v| v.is_finite()));
        let upright = p.y_spread.filter(|s| s.iter().all(|v| v.is_finite()));
        let level = level.map(|s| s.map(|v| [self.x.place_bound(v), y]));
        let upright = upright.map(|s| s.map(|v| [x, self.y.place_bound(v)]));
        level.into_iter().chain(upright)
    }

    /// The lines of a series: one for each run of points that have a place.
    fn runs(&self, series: &Series) -> Vec<Vec<[f64; 2]>> {
        let mut runs: Vec<Vec<[f64; 2]>> = Vec::new();
        let mut open = false;
        for p in &series.points {
            let Some(at) = self.place(p) else {
                open = false;
                continue;
            };
            match runs.last_mut().filter(|_| open) {
                Some(run) => {
                    if series.line == Line::Steps
                        && let Some(last) = run.last().copied()
                    {
                        run.push([at[0], last[1]]);
                    }
                    run.push(at);
                }
                None => runs.push(vec![at]),
            }
            open = true;
        }
        runs
    }

    fn draw_series(&mut self) {
        for series in self.plot.series.iter().rev() {
            if series.line != Line::None {
                for run in self.runs(series).into_iter().filter(|run| run.len() > 1) {
                    self.path(run, line_width(series), series.colour);
                }
            }
            for p in &series.points {
                if let Some(at) = self.place(p) {
                    for bar in self.bars(p, at).collect::<Vec<_>>() {
                        self.path(bar.to_vec(), 1.2, series.colour);
                    }
                }
            }
            for p in series.points.iter().rev() {
                if let Some(at) = self.place(p) {
                    self.mark(series, at, &p.label);
                }
            }
        }
    }

    /// Draws the labels that there is room for; how many there was none for.
    fn draw_labels(&mut self, areas: Vec<Area>, guides: Vec<[[f64; 2]; 2]>) -> usize {
        let plot = self.plot;
        let points = || plot.series.iter().flat_map(|s| &s.points);
        let mut lines = guides;
        for series in plot.series.iter().filter(|s| s.line != Line::None) {
            for run in self.runs(series) {
                lines.extend(run.windows(2).map(|w| [w[0], w[1]]));
            }
        }
        for p in points() {
            if let Some(at) = self.place(p) {
                lines.extend(self.bars(p, at));
            }
        }
        let mut obstacles = Obstacles {
            bounds: self.frame,
            areas,
            marks: points().filter_map(|p| self.place(p)).collect(),
            radius: RADIUS,
            lines,
        };
        let mut unlabelled = 0;
        for p in points().filter(|p| !p.label.is_empty()) {
            let Some(mark) = self.place(p) else {
                continue;
            };
            let words = Words::plain(p.label.as_str());
            let Some(placed) = obstacles.place(&words, mark, LABEL_CAP) else {
                unlabelled += 1;
                continue;
            };
            if let Some(leader) = placed.leader {
                self.path(leader.to_vec(), 1.0, FAINT_INK);
            }
            self.shapes.push(Shape::Text(Text {
                words,
                at: placed.at,
                cap: LABEL_CAP,
                align: placed.align,
                colour: INK,
                turned: false,
                halo: true,
            }));
        }
        unlabelled
    }

    /// The notes in the lower left corner, the caption in the lower right.
    fn draw_foot(&mut self, unlabelled: usize) {
        let line = self.size[1] - 13.0;
        let room = self.size[0] - 2.0 * SIDE;
        let notes = text::shortened(&notes(self.plot, unlabelled), LABEL_CAP, room * 0.5);
        let left = room - text::width(&notes, LABEL_CAP) - 16.0;
        let caption = text::shortened(&self.plot.caption, NOTE_CAP, left);
        let corners = [SIDE, self.size[0] - SIDE];
        self.text(
            Words::plain(notes),
            [corners[0], line],
            LABEL_CAP,
            Align::Left,
            FAINT_INK,
        );
        self.text(
            Words::plain(caption),
            [corners[1], line],
            NOTE_CAP,
            Align::Right,
            INK,
        );
    }
}

/// What the plot does not show, in words.
fn notes(plot: &Plot, unlabelled: usize) -> String {
    let points = || plot.series.iter().flat_map(|s| &s.points);
    let not_finite = points()
        .filter(|p| !(p.x.is_finite() && p.y.is_finite()))
        .count();
    let negative = points().filter(|p| !is_shown(plot, p)).count() - not_finite;
    let labels = points()
        .filter(|p| !p.label.is_empty() && is_shown(plot, p))
        .count();
    let mut notes = Vec::new();
    if points().all(|p| !is_shown(plot, p)) {
        notes.push("no points to draw".to_owned());
    }
    if not_finite > 0 {
        notes.push(format!(
            "{} left out: not finite",
            counted(not_finite, "point")
        ));
    }
    if negative > 0 {
        let points = counted(negative, "point");
        notes.push(format!("{points} left out: negative on a logarithmic axis"));
    }
    if unlabelled > 0 {
        notes.push(format!(
            "{unlabelled} of {} not shown",
            counted(labels, "label")
        ));
    }
    notes.join("; ")
}

fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// The width of a series' sample in the legend.
fn sample(series: &Series) -> f64 {
    if series.line == Line::None {
        SAMPLE_MARK
    } else {
        SAMPLE
    }
}

/// A black line is a front and stands out.
fn line_width(series: &Series) -> f64 {
    if series.line == Line::Steps { 2.2 } else { 1.6 }
}
