use super::*;
use crate::progress::Silent;
use crate::terrain::surface::tests::grid;

fn feature(shape: Shape) -> Feature {
    Feature {
        shape,
        ..Feature::default()
    }
}

fn rough(x: f64, y: f64) -> f64 {
    (x * 0.9).sin() * 3.0 + (y * 1.3).cos() * 2.0
}

fn lines(line: &[Vec2]) -> [Feature; 1] {
    [feature(Shape::Lines(vec![line.to_vec()]))]
}

#[test]
fn draped_lines_are_on_the_surface_everywhere() {
    let grid = grid(30, 20, 1.5, rough);
    let line = [[2.0, 3.0], [40.3, 21.7], [41.1, 5.2], [6.3, 28.9]];
    for (kind, most) in [(Kind::Tin, 1e-12), (Kind::Bilinear, 0.01 + 1e-12)] {
        let surface = Surface::new(&grid, kind).unwrap();
        let (out, stats) = drape(&lines(&line), &surface, &Params::DEFAULT, &Silent).unwrap();
        assert_eq!((stats.features, out[0].lines.len()), (1, 1));
        let draped = &out[0].lines[0];
        assert_eq!(draped[0][..2], line[0]);
        assert_eq!(draped[draped.len() - 1][..2], line[3]);
        for pair in draped.windows(2) {
            for k in 0..=10 {
                let t = f64::from(k) / 10.0;
                let [x, y, z] = std::array::from_fn(|a| pair[0][a] + t * (pair[1][a] - pair[0][a]));
                let off = (surface.height([x, y]).unwrap() - z).abs();
                assert!(off < most, "{kind:?} {off} at {x} {y}");
            }
        }
        let plan: f64 = line
            .windows(2)
            .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
            .sum();
        let measures = out[0].measures;
        assert!((measures.length_2d - plan).abs() < 1e-9);
        assert!(measures.length_3d > plan && measures.length_cut == 0.0);
    }
}

#[test]
fn pieces_over_holes_and_outside_are_cut_out() {
    let grid = grid(10, 10, 1.0, |x, y| {
        if x == 5.5 && y == 5.5 { -9999.0 } else { 2.0 }
    });
    let surface = Surface::new(&grid, Kind::Tin).unwrap();
    let through = lines(&[[-3.0, 5.25], [13.0, 5.25]]);
    let (out, _) = drape(&through, &surface, &Params::DEFAULT, &Silent).unwrap();
    let measures = out[0].measures;
    // From 0.5 to the hole and on to 9.5; at this height the hole has 0.25 of the squares' last triangles.
    assert_eq!(out[0].lines.len(), 2);
    assert_eq!(out[0].lines[0][0], [0.5, 5.25, 2.0]);
    assert_eq!(out[0].lines[1].last(), Some(&[9.5, 5.25, 2.0]));
    assert!((measures.length_2d + measures.length_cut - 16.0).abs() < 1e-12);
    assert!(
        (measures.length_cut - 7.0 - 1.75).abs() < 1e-12,
        "{measures:?}"
    );
    let (out, stats) = drape(
        &lines(&[[20.0, 1.0], [30.0, 2.0]]),
        &surface,
        &Params::DEFAULT,
        &Silent,
    )
    .unwrap();
    assert!(out[0].lines.is_empty());
    assert_eq!(stats.outside, 1);
}

#[test]
fn areas_are_those_of_the_triangles() {
    // On a plane the area along the surface is the map's by the slope.
    let grid = grid(30, 20, 1.0, |x, y| 0.75 * x + y);
    let surface = Surface::new(&grid, Kind::Tin).unwrap();
    let outer = vec![[2.0, 2.0], [27.3, 4.1], [22.2, 17.7], [4.4, 15.0]];
    let hole = vec![[8.0, 8.0], [8.0, 11.5], [12.25, 9.0]];
    let shape = Shape::Polygons(vec![Polygon {
        rings: vec![outer, hole],
    }]);
    let (out, _) = drape(&[feature(shape)], &surface, &Params::DEFAULT, &Silent).unwrap();
    let m = out[0].measures;
    assert!((m.area_covered - m.area).abs() < 1e-9 * m.area);
    let slope = (1.0f64 + 0.75 * 0.75 + 1.0).sqrt();
    assert!((m.area_3d - m.area * slope).abs() < 1e-9 * m.area);
    assert_eq!(out[0].lines.len(), 2);
    assert_eq!(out[0].lines[0].first(), out[0].lines[0].last());
}

#[test]
fn areas_on_rough_ground_add_up() {
    let grid = grid(12, 12, 1.0, |x, y| {
        if x == 4.5 && y == 7.5 {
            -9999.0
        } else {
            rough(x, y)
        }
    });
    let surface = Surface::new(&grid, Kind::Tin).unwrap();
    let ring = |x0: f64, x1: f64| vec![[x0, -1.0], [x1, -1.0], [x1, 13.0], [x0, 13.0]];
    let area = |rings: Vec<Vec<Vec2>>| {
        let shape = Shape::Polygons(vec![Polygon { rings }]);
        let (out, _) = drape(&[feature(shape)], &surface, &Params::DEFAULT, &Silent).unwrap();
        out[0].measures
    };
    let whole = area(vec![ring(-2.0, 14.0)]);
    // The hole takes six triangles.
    assert!((whole.area_covered - (121.0 - 3.0)).abs() < 1e-9);
    let (left, right) = (area(vec![ring(-2.0, 6.3)]), area(vec![ring(6.3, 14.0)]));
    assert!((left.area_3d + right.area_3d - whole.area_3d).abs() < 1e-9);
    let mut triangles = 0.0;
    for row in 0..11 {
        for column in 0..11 {
            let square = surface.square(column, row);
            for half in [Half::First, Half::Last] {
                if square.has(half) {
                    let [_, du, dv] = square.plane(half);
                    triangles += 0.5 * (1.0 + du * du + dv * dv).sqrt();
                }
            }
        }
    }
    assert!((whole.area_3d - triangles).abs() < 1e-9);
}

#[test]
fn what_is_no_line_is_counted() {
    let grid = grid(5, 5, 1.0, rough);
    let surface = Surface::new(&grid, Kind::Tin).unwrap();
    let features = [
        feature(Shape::Empty),
        feature(Shape::Lines(vec![vec![[1.0, 1.0]; 3]])),
        feature(Shape::Points(vec![[2.0, 2.0], [50.0, 2.0]])),
    ];
    let (out, stats) = drape(&features, &surface, &Params::DEFAULT, &Silent).unwrap();
    assert_eq!((stats.empty, stats.features, stats.outside), (2, 1, 0));
    assert_eq!(stats.dropped.too_short, 1);
    assert_eq!(out[2].lines.len(), 1);
    let wrong = Params { max_error: 0.0 };
    assert!(drape(&features, &surface, &wrong, &Silent).is_err());
}
