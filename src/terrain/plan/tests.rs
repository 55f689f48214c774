use super::*;
use crate::progress::Silent;
use crate::terrain::Transform;
use crate::vector::Polygon;

fn frame(columns: usize, rows: usize) -> Frame {
    Frame {
        transform: Transform {
            origin: [0.0, rows as f64],
            across: [1.0, 0.0],
            down: [0.0, -1.0],
        },
        columns,
        rows,
    }
}

fn feature(shape: Shape) -> Feature {
    Feature {
        shape,
        ..Feature::default()
    }
}

fn polygon(rings: &[&[Vec2]]) -> Shape {
    Shape::Polygons(vec![Polygon {
        rings: rings.iter().map(|ring| ring.to_vec()).collect(),
    }])
}

fn picture(shape: Shape, columns: usize, rows: usize, all_touched: bool) -> Vec<String> {
    let params = Params { all_touched };
    let (mask, _) = mask(&[feature(shape)], &frame(columns, rows), &params, &Silent).unwrap();
    let row = |r: &[u8]| r.iter().map(|p| [".", "#"][*p as usize]).collect();
    mask.chunks(columns).map(row).collect()
}

#[test]
fn a_rectangle_on_pixel_borders_has_its_pixels() {
    let square = polygon(&[&[[1.0, 1.0], [4.0, 1.0], [4.0, 3.0], [1.0, 3.0]]]);
    assert_eq!(
        picture(square, 5, 4, false),
        [".....", ".###.", ".###.", "....."]
    );
}

// The pictures of the next three tests are those of rasterio 1.4.4 (GDAL 3.10.3).

#[test]
fn centres_on_borders_are_as_in_gdal() {
    let below = [
        [0.5, 0.5],
        [7.5, 0.5],
        [7.5, 5.2],
        [5.5, 5.2],
        [5.5, 2.5],
        [2.5, 2.5],
        [2.5, 5.2],
        [0.5, 5.2],
    ];
    let above = [
        [0.5, 0.8],
        [2.5, 0.8],
        [2.5, 3.5],
        [5.5, 3.5],
        [5.5, 0.8],
        [7.5, 0.8],
        [7.5, 5.5],
        [0.5, 5.5],
    ];
    let (legs, floor, none) = (".##...##", ".#######", "........");
    for (ring, expected) in [
        (below, [none, legs, legs, floor, floor, floor]),
        (above, [floor, floor, floor, legs, legs, none]),
    ] {
        let mut turned = ring;
        turned.reverse();
        for ring in [ring, turned] {
            assert_eq!(picture(polygon(&[&ring]), 8, 6, false), expected);
        }
    }
}

#[test]
fn holes_are_open_and_parts_are_joined() {
    let hole: &[Vec2] = &[[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0]];
    let outer: &[Vec2] = &[[1.0, 1.0], [4.0, 1.0], [4.0, 4.0], [1.0, 4.0]];
    let rows = picture(polygon(&[outer, hole]), 5, 5, false);
    assert_eq!(rows, [".....", ".###.", ".#.#.", ".###.", "....."]);
    let both = Shape::Polygons(vec![
        Polygon {
            rings: vec![outer.to_vec()],
        },
        Polygon {
            rings: vec![hole.to_vec()],
        },
    ]);
    assert_eq!(picture(both, 5, 5, false)[2], ".###.");
}

#[test]
fn lines_and_points_have_their_pixels() {
    let line = || Shape::Lines(vec![vec![[0.2, 3.8], [4.7, 1.4]]]);
    let thin = picture(line(), 5, 4, false);
    assert_eq!(thin, ["#....", ".##..", "...##", "....."]);
    let thick = picture(line(), 5, 4, true);
    assert_eq!(thick, ["##...", ".###.", "...##", "....."]);
    let points = Shape::Points(vec![[0.0, 0.0], [4.9, 3.9], [5.0, 1.0], [2.5, 1.5]]);
    let rows = picture(points, 5, 4, false);
    assert_eq!(rows, ["....#", ".....", "..#..", "....."]);
}

#[test]
fn later_features_lie_on_earlier_ones() {
    let square = |c: f64| polygon(&[&[[c, c], [c + 2.0, c], [c + 2.0, c + 2.0], [c, c + 2.0]]]);
    let features = [
        feature(square(0.0)),
        feature(Shape::Empty),
        feature(square(1.0)),
        feature(square(90.0)),
    ];
    let (ids, stats) = ids(&features, &frame(3, 3), &Params::DEFAULT, &Silent).unwrap();
    assert_eq!(ids, [0, 3, 3, 1, 3, 3, 1, 1, 0]);
    let expected = Stats {
        features: 3,
        empty: 1,
        outside: 1,
        pixels: 7,
    };
    assert_eq!(stats, expected);
}

#[test]
fn rows_can_be_drawn_in_pieces_and_lines_may_be_endless() {
    let features = [
        feature(polygon(&[&[[3.1, 2.0], [60.3, 40.2], [10.0, 90.7]]])),
        feature(Shape::Lines(vec![vec![[-1e300, -1e300], [1e300, 1e300]]])),
        feature(Shape::Lines(vec![vec![[0.3, 95.2], [70.0, 3.0]]])),
    ];
    for all_touched in [false, true] {
        let (params, frame) = (Params { all_touched }, frame(70, 100));
        let (whole, _) = ids(&features, &frame, &params, &Silent).unwrap();
        let plan = Plan::new(&features, &frame, &params).unwrap();
        let mut pieces = Vec::new();
        for start in (0..100).step_by(37) {
            let mut rows = vec![0; 37.min(100 - start) * 70];
            plan.draw(start..start + 37, &mut rows, |f| f as u32 + 1, &Silent);
            pieces.extend(rows);
        }
        assert!(pieces == whole);
    }
}

#[test]
fn pixels_without_area_are_an_error() {
    let mut frame = frame(3, 3);
    frame.transform.down = [2.0, 0.0];
    let wrong = mask(&[], &frame, &Params::DEFAULT, &Silent).unwrap_err();
    assert!(wrong.to_string().contains("no area"), "{wrong}");
}

#[test]
fn turned_rasters_have_the_pixels_that_cover_the_same_ground() {
    let ring = [[1.3, 1.2], [7.9, 2.2], [6.1, 8.4], [3.3, 5.1]];
    let (straight, _) = mask(
        &[feature(polygon(&[&ring]))],
        &frame(10, 10),
        &Params::DEFAULT,
        &Silent,
    )
    .unwrap();
    // A quarter turn: columns go north, rows go east.
    let turned = Frame {
        transform: Transform {
            origin: [0.0, 0.0],
            across: [0.0, 1.0],
            down: [1.0, 0.0],
        },
        columns: 10,
        rows: 10,
    };
    let (other, _) = mask(
        &[feature(polygon(&[&ring]))],
        &turned,
        &Params::DEFAULT,
        &Silent,
    )
    .unwrap();
    assert!(straight.contains(&1));
    for row in 0..10 {
        for column in 0..10 {
            let same = other[column * 10 + (9 - row)];
            assert_eq!(straight[row * 10 + column], same);
        }
    }
}
