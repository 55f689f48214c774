use super::super::colour::WHITE;
use super::super::text::Align;
use super::axis::{fit, has_place};
use super::labels::{Area, Obstacles};
use super::scene::{Scene, Shape, Text, Words};
use super::*;

fn axis(title: &str, scale: Scale) -> Axis {
    Axis::new(title, scale)
}

fn point(x: f64, y: f64, label: &str) -> Point {
    Point {
        x,
        y,
        label: label.to_owned(),
        ..Point::default()
    }
}

/// Costs and errors of some settings, a third of them on a front.
fn cost_against_error() -> Plot {
    let mut plot = Plot::new(
        "error against cost",
        axis("cost (s)", Scale::Log),
        axis("error (voxel)", Scale::Log),
    );
    let settings = |factor: f64| {
        (0..8)
            .map(|i| {
                let size = f64::from(1 << i);
                let label = format!("resolution={} factor={factor}", 32.0 * size);
                let mut p = point(1e-3 * size * size * factor, factor / size, &label);
                p.x_spread = Some([p.x * 0.9, p.x * 1.3]);
                p
            })
            .collect()
    };
    plot.series.push(Series::front("front", settings(1.0)));
    plot.series.push(Series::new("others", 1, settings(3.0)));
    plot
}

fn texts(scene: &Scene) -> Vec<&Text> {
    let mut texts = Vec::new();
    for shape in &scene.shapes {
        if let Shape::Text(text) = shape {
            texts.push(text);
        }
    }
    texts
}

fn area(text: &Text) -> Area {
    let left = text.at[0] - text.before();
    Area {
        from: [left, text.at[1] - text.cap],
        to: [
            left + text.words.width(text.cap),
            text.at[1] + text.cap * 0.3,
        ],
    }
}

fn words(axis: &Axis, numbers: &[f64], most: usize) -> Vec<String> {
    let fitted = fit(axis, numbers, [0.0, 1000.0]);
    let ticks = fitted.ticks(most);
    let all = ticks.iter().map(|t| match t.words.power.as_str() {
        "" => t.words.base.clone(),
        power => format!("{}^{power}", t.words.base),
    });
    all.filter(|w| !w.is_empty()).collect()
}

#[test]
fn ticks_are_round_numbers_in_the_words_of_their_scale() {
    let log = axis("", Scale::Log);
    assert_eq!(
        words(&log, &[0.01, 100.0], 9),
        ["0.01", "0.1", "1", "10", "100"]
    );
    assert_eq!(
        words(&log, &[1e-9, 1e-6], 9),
        ["10^−9", "10^−8", "10^−7", "10^−6"]
    );
    assert_eq!(
        words(&log, &[1e-16, 1.0], 6),
        ["10^−15", "10^−12", "10^−9", "10^−6", "10^−3", "10^0"]
    );
    assert_eq!(words(&log, &[1.0, 30.0], 9), ["1", "2", "5", "10", "20"]);
    assert_eq!(
        words(&log, &[2.0, 3.0], 6),
        ["2.0", "2.2", "2.4", "2.6", "2.8", "3.0"]
    );
    let octaves = axis("", Scale::Log2);
    let ends = [(-100f64).exp2(), 100f64.exp2()];
    assert_eq!(
        words(&octaves, &ends, 5),
        ["2^−100", "2^−50", "2^0", "2^50", "2^100"]
    );
    let linear = axis("", Scale::Linear);
    assert_eq!(
        words(&linear, &[-1.0, 1.0], 5),
        ["−1.0", "−0.5", "0", "0.5", "1.0"]
    );
    let millions = ["0", "2×10^6", "4×10^6", "6×10^6", "8×10^6", "10×10^6"];
    assert_eq!(words(&linear, &[0.0, 1e7], 6), millions);
}

#[test]
fn every_axis_has_ticks_and_keeps_its_points_inside() {
    let numbers = [
        0.0,
        5e-324,
        1e-300,
        1e-16,
        0.1,
        1.0,
        1.0 + f64::EPSILON,
        3.0,
        1e9,
        1e300,
        f64::MAX,
    ];
    for scale in [Scale::Linear, Scale::Log, Scale::Log2] {
        let axis = axis("", scale);
        assert!(fit(&axis, &[], [0.0, 500.0]).ticks(8).len() >= 2);
        for a in numbers {
            for b in numbers {
                let fitted = fit(&axis, &[a, b, f64::NAN, -f64::INFINITY], [500.0, 0.0]);
                for v in [a, b] {
                    let at = fitted.place(v);
                    assert!(
                        at.is_some_and(|at| (0.0..=500.0).contains(&at)),
                        "{scale:?} {a} {b}"
                    );
                }
                let ticks = fitted.ticks(8);
                assert!(
                    (1..=90).contains(&ticks.len()),
                    "{scale:?} {a} {b}: {}",
                    ticks.len()
                );
                assert!(
                    ticks.iter().all(|t| (0.0..=500.0).contains(&t.at)),
                    "{scale:?} {a} {b}"
                );
            }
        }
    }
}

#[test]
fn larger_numbers_lie_further_along_and_zero_has_a_lane_before_them() {
    let fitted = fit(&axis("", Scale::Log), &[1e-12, 0.0, 1e-3], [0.0, 500.0]);
    let places = [0.0, 1e-12, 1e-9, 1e-3].map(|v| fitted.place(v).expect("a place"));
    assert!(places.is_sorted_by(|a, b| a < b), "{places:?}");
    assert!(places[0] < fitted.start() && fitted.start() < places[1]);
    assert_eq!(fitted.ticks(8)[0].words, Words::plain("0"));
    let without = fit(&axis("", Scale::Log), &[1e-12, 1e-3], [0.0, 500.0]);
    assert_eq!(without.zero, None);
    assert_eq!(without.place(-1.0), None);
    assert!(has_place(Scale::Linear, -1.0) && !has_place(Scale::Linear, f64::NAN));
}

#[test]
fn labels_touch_neither_each_other_nor_markers() {
    let plot = cost_against_error();
    let scene = layout::scene(&plot);
    let labels: Vec<Area> = texts(&scene)
        .into_iter()
        .filter(|t| t.words.base.starts_with("resolution="))
        .map(area)
        .collect();
    assert_eq!(labels.len(), 16);
    let apart = |a: Area, b: Area| (0..2).any(|c| a.to[c] <= b.from[c] || b.to[c] <= a.from[c]);
    for (i, a) in labels.iter().enumerate() {
        assert!(labels[..i].iter().all(|b| apart(*a, *b)), "{a:?}");
        for shape in &scene.shapes {
            if let Shape::Mark { at, radius, .. } = shape {
                let mark = Area {
                    from: at.map(|c| c - radius),
                    to: at.map(|c| c + radius),
                };
                assert!(apart(*a, mark), "{a:?} over {at:?}");
            }
        }
    }
}

#[test]
fn a_label_without_room_is_left_out_and_the_first_one_is_kept() {
    let mut obstacles = Obstacles {
        bounds: Area {
            from: [0.0, 0.0],
            to: [90.0, 24.0],
        },
        areas: Vec::new(),
        marks: vec![[20.0, 12.0], [21.0, 12.0]],
        radius: 5.0,
        lines: Vec::new(),
    };
    let words = Words::plain("label");
    assert!(obstacles.place(&words, [20.0, 12.0], 8.0).is_some());
    assert!(obstacles.place(&words, [21.0, 12.0], 8.0).is_none());
    let mut plot = cost_against_error();
    let crowd = (0..200).map(|i| point(1.0, 0.1, &format!("one of many, number {i}")));
    plot.series.push(Series::new("crowd", 2, crowd.collect()));
    let svg = plot.svg();
    assert!(svg.contains(" of 216 labels not shown</text>"), "{svg}");
    assert!(svg.contains(">resolution=32 factor=1</text>"));
    assert!(svg.contains("<title>one of many, number 199</title>"));
}

#[test]
fn zeros_are_drawn_and_what_has_no_place_is_counted() {
    let mut plot = Plot::new(
        "drift",
        axis("scale", Scale::Log2),
        axis("drift", Scale::Log),
    );
    let all = [
        point(1.0, 0.0, ""),
        point(2.0, 1e-15, ""),
        point(4.0, f64::NAN, ""),
        point(f64::INFINITY, 1.0, ""),
        point(8.0, -1.0, ""),
        point(16.0, 1e-14, ""),
    ];
    plot.series.push(Series {
        line: Line::Straight,
        ..Series::new("", 0, all.to_vec())
    });
    let svg = plot.svg();
    assert_eq!(svg.matches("<circle").count(), 3);
    assert!(svg.contains("2 points left out: not finite; 1 point left out: negative on a"));
    // The last point stands alone: the line to it is broken.
    let runs = svg.lines().filter(|l| l.contains("fill=\"none\" stroke="));
    assert_eq!(runs.count(), 1);
    let empty = Plot::new("", axis("", Scale::Log), axis("", Scale::Linear));
    assert!(empty.svg().contains("no points to draw"));
}

#[test]
fn steps_go_level_first() {
    let mut plot = Plot::new("", axis("", Scale::Linear), axis("", Scale::Linear));
    let points = vec![point(0.0, 1.0, ""), point(1.0, 0.0, "")];
    plot.series.push(Series::front("", points));
    let scene = layout::scene(&plot);
    let front = scene.shapes.iter().find_map(|shape| match shape {
        Shape::Path { points, .. } => Some(points.clone()),
        _ => None,
    });
    let front = front.expect("a front is drawn");
    assert_eq!(front.len(), 3);
    assert_eq!((front[1][0], front[1][1]), (front[2][0], front[0][1]));
}

#[test]
fn svg_is_small_escaped_and_always_the_same() {
    let mut plot = cost_against_error();
    plot.title = "a < b & \"c\"\u{7}".to_owned();
    plot.caption = "x > 1".to_owned();
    let svg = plot.svg();
    assert!(svg.contains("<title>a &lt; b &amp; &quot;c&quot; </title>"));
    assert!(svg.contains("x &gt; 1"));
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert!(svg.len() < 30_000, "{}", svg.len());
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    assert_eq!(svg, plot.svg());
}

#[test]
fn png_shows_the_marks_where_the_scene_has_them() {
    let plot = cost_against_error();
    let scene = layout::scene(&plot);
    let picture = paint::picture(&scene);
    assert_eq!((picture.width(), picture.height()), (1024, 640));
    let mut marks = 0;
    for shape in &scene.shapes {
        if let Shape::Mark { at, colour, .. } = shape {
            assert_eq!(picture.get(at[0] as usize, at[1] as usize), *colour);
            marks += 1;
        }
    }
    assert_eq!(marks, 18, "sixteen points and two samples in the legend");
    for x in 0..1024 {
        assert_eq!(picture.get(x, 0), WHITE);
        assert_eq!(picture.get(x, 639), WHITE);
    }
    let png = plot.png();
    assert!(png.len() <= png::README_LIMIT);
    assert_eq!(png, plot.png());
}

#[test]
fn a_plot_smaller_than_its_axes_and_endless_texts_still_fit() {
    let long = "word ".repeat(2000);
    let mut plot = cost_against_error();
    (plot.width, plot.height) = (1, 1);
    plot.title = long.clone();
    plot.caption = long.clone();
    plot.x.title = long.clone();
    plot.y.title = long.clone();
    plot.series[1].name = long.clone();
    let (on, value, text) = (On::Y, 0.05, long.clone());
    plot.guides.push(Guide { on, value, text });
    let (on, value, text) = (On::X, f64::NAN, long);
    plot.guides.push(Guide { on, value, text });
    let scene = layout::scene(&plot);
    assert_eq!(
        (scene.width, scene.height),
        (Plot::SMALLEST, Plot::SMALLEST)
    );
    for text in texts(&scene).into_iter().filter(|t| !t.turned) {
        let area = area(text);
        let size = Plot::SMALLEST as f64;
        assert!(
            area.from[0] >= 0.0 && area.to[0] <= size,
            "{}",
            text.words.base
        );
    }
    let turned = texts(&scene).into_iter().filter(|t| t.turned);
    assert!(turned.clone().count() == 1 && turned.into_iter().all(|t| t.align == Align::Centre));
}
