use super::*;
use crate::vector::{Feature, Polygon, Raised, Shape};
use serde_json::{Map, Value, json};

fn parsed(text: &str) -> Result<(Layer, Vec<Warning>), Fault> {
    let source = Source::from_bytes("dir/roads.geojson", text.into());
    let source = source.map_err(|e| Fault::whole(e.to_string()))?;
    let mut warnings = Vec::new();
    let layer = read(&source, &mut warnings).map_err(Refusal::fault)?;
    layer.check()?;
    Ok((layer, warnings))
}

fn of_geometry(geometry: &str) -> Result<(Layer, Vec<Warning>), Fault> {
    parsed(&format!(
        r#"{{"features": [{{"type": "Feature", "properties": {{"a": 1}}, "geometry": {geometry}}}], "type": "FeatureCollection"}}"#
    ))
}

fn shape_of(geometry: &str) -> Shape {
    let (layer, _) = of_geometry(geometry).expect("a layer");
    layer.features[0].shape.clone()
}

fn said(geometry: &str) -> String {
    of_geometry(geometry).expect_err("a fault").to_string()
}

#[test]
fn every_geometry_is_read() {
    let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    let polygon = Polygon {
        rings: vec![square.clone()],
    };
    for (text, shape) in [
        (
            r#"{"type": "Point", "coordinates": [1, 2.5]}"#,
            Shape::Points(vec![[1.0, 2.5]]),
        ),
        (
            r#"{"coordinates": [[1, 2], [3, 4]], "type": "MultiPoint"}"#,
            Shape::Points(vec![[1.0, 2.0], [3.0, 4.0]]),
        ),
        (
            r#"{"type": "LineString", "coordinates": [[1, 2], [3, 4]]}"#,
            Shape::Lines(vec![vec![[1.0, 2.0], [3.0, 4.0]]]),
        ),
        (
            r#"{"type": "MultiLineString", "coordinates": [[[1, 2], [3, 4]], []]}"#,
            Shape::Lines(vec![vec![[1.0, 2.0], [3.0, 4.0]]]),
        ),
        (
            r#"{"type": "Polygon", "coordinates": [[[0,0],[1,0],[1,1],[0,0]]]}"#,
            Shape::Polygons(vec![polygon.clone()]),
        ),
        (
            r#"{"type": "MultiPolygon", "coordinates": [[[[0,0],[1,0],[1,1],[0,0]]], [[[0,0],[1,0],[1,1],[0,0]]]]}"#,
            Shape::Polygons(vec![polygon.clone(), polygon.clone()]),
        ),
        (
            r#"{"type": "GeometryCollection", "geometries": [{"type": "Point", "coordinates": [1, 2]}, {"type": "Point", "coordinates": [3, 4]}]}"#,
            Shape::Points(vec![[1.0, 2.0], [3.0, 4.0]]),
        ),
        ("null", Shape::Empty),
        (r#"{"type": "Polygon", "coordinates": []}"#, Shape::Empty),
        (
            r#"{"type": "MultiPolygon", "coordinates": [[]]}"#,
            Shape::Empty,
        ),
    ] {
        assert_eq!(shape_of(text), shape, "{text}");
    }
    let (bare, _) = parsed(r#"{"type": "Point", "coordinates": [1, 2]}"#).expect("a layer");
    assert_eq!(bare.features.len(), 1);
    assert_eq!(
        (bare.name.as_str(), bare.crs),
        ("roads", Some(Crs::lon_lat()))
    );
    let (lone, _) = parsed(r#"{"type": "Feature", "id": 7, "geometry": null, "properties": null}"#)
        .expect("a layer");
    assert_eq!(lone.features[0].properties["id"], 7);
}

#[test]
fn what_is_put_right_is_counted() {
    let (layer, warnings) =
        of_geometry(r#"{"type": "Polygon", "coordinates": [[[0,0,5],[1,0,5],[1,1,5]]]}"#)
            .expect("a layer");
    let codes: Vec<&str> = warnings.iter().map(|w| w.code.as_str()).collect();
    assert_eq!(codes, ["dropped-heights", "unclosed-rings"]);
    assert_eq!(layer.places().count(), 3);
}

#[test]
fn faults_name_the_feature_and_the_numbers() {
    for (geometry, message) in [
        (
            r#"{"type": "Polygon", "coordinates": [[[0,0],[1,0],[0,0]]]}"#,
            "feature 0: ring 0 has 2 places, at least 3 are needed",
        ),
        (
            r#"{"type": "MultiPolygon", "coordinates": [[[[0,0],[1,0],[1,1],[0,0]]], [[[0,0],[0,0]]]]}"#,
            "feature 0: polygon 1, ring 0 has 1 place, at least 3 are needed",
        ),
        (
            r#"{"type": "LineString", "coordinates": [[0,0]]}"#,
            "feature 0: line 0 has 1 place, at least 2 are needed",
        ),
        (
            r#"{"type": "Point", "coordinates": [1]}"#,
            "feature 0: the point has 1 coordinates, at least 2 are needed",
        ),
        (
            r#"{"type": "Point", "coordinates": [1, null]}"#,
            "feature 0: the point has null for a number",
        ),
        (
            r#"{"type": "LineString", "coordinates": [[0,0], ["1", 2]]}"#,
            "feature 0: place 1 of line 0 has text for a number",
        ),
        (
            r#"{"type": "Circle", "coordinates": [1, 2]}"#,
            "feature 0: its geometry is a \"Circle\", which GeoJSON has not",
        ),
        (
            r#"{"type": "Polygon", "coordinates": [1, 2]}"#,
            "feature 0: ring 0 is a number, not an array",
        ),
        (
            r#"{"type": "GeometryCollection", "geometries": [{"type": "Point", "coordinates": [1, 2]}, {"type": "LineString", "coordinates": [[3, 4], [5, 6]]}]}"#,
            "feature 0: a collection of geometries of several kinds",
        ),
        (
            r#"{"coordinates": [1, 2]}"#,
            "feature 0: its geometry has no type",
        ),
    ] {
        assert_eq!(said(geometry), message);
    }
    let message = |text| parsed(text).expect_err("a fault").to_string();
    assert_eq!(message("{}"), "has no type, and so is no GeoJSON");
    assert_eq!(
        message("{\"type\": \"FeatureCollection\",\n\"features\": [\n{]"),
        "3: key must be a string"
    );
    assert_eq!(
        message(r#"{"type": "FeatureCollection"}"#),
        "a FeatureCollection without features"
    );
    let crs = r#"{"type": "FeatureCollection", "features": [], "crs": {"type": "name", "properties": {"name": "moon"}}}"#;
    assert_eq!(
        message(crs),
        "crs: \"moon\" is no coordinate reference system that is known"
    );
}

#[test]
fn what_is_written_comes_back() {
    let properties: Map<String, Value> = [
        ("name".to_owned(), json!("a \"b\"")),
        ("n".to_owned(), json!(1.5)),
    ]
    .into_iter()
    .collect();
    let ring = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    let hole = vec![[1.0, 1.0], [1.0, 2.0], [2.0, 2.0]];
    let shapes = [
        Shape::Empty,
        Shape::Points(vec![[0.1, -2e-9]]),
        Shape::Points(vec![[1.0, 2.0], [3.0, 4.0]]),
        Shape::Lines(vec![vec![[1.0, 2.0], [3.0, 4.0]]]),
        Shape::Polygons(vec![Polygon {
            rings: vec![ring.clone(), hole],
        }]),
    ];
    let layer = Layer {
        name: "roads".to_owned(),
        crs: Some(Crs::from_epsg(32733)),
        features: shapes
            .map(|shape| Feature {
                shape,
                properties: properties.clone(),
            })
            .to_vec(),
    };
    let mut bytes = Vec::new();
    write(&layer, &mut bytes).expect("room");
    let (back, warnings) = parsed(std::str::from_utf8(&bytes).expect("text")).expect("a layer");
    assert_eq!(back, layer);
    assert_eq!(warnings, []);
    // A ring that goes clockwise is turned about its first place.
    let mut turned = layer.clone();
    turned.crs = None;
    turned.features.truncate(1);
    turned.features[0].shape = Shape::Polygons(vec![Polygon {
        rings: vec![vec![[0.0, 0.0], [0.0, 4.0], [4.0, 4.0], [4.0, 0.0]]],
    }]);
    let mut bytes = Vec::new();
    write(&turned, &mut bytes).expect("room");
    let (back, _) = parsed(std::str::from_utf8(&bytes).expect("text")).expect("a layer");
    assert_eq!(
        back.features[0].shape,
        Shape::Polygons(vec![Polygon { rings: vec![ring] }])
    );
    assert_eq!(back.crs, None);
}

#[test]
fn heights_are_the_third_coordinates() {
    let layer = Layer {
        features: vec![Feature::default()],
        crs: Some(Crs::lon_lat()),
        ..Layer::default()
    };
    let raised = [Raised::Lines(vec![vec![[1.0, 2.0, 3.25], [4.0, 5.0, 6.0]]])];
    let mut bytes = Vec::new();
    write_raised(&layer, &raised, &mut bytes).expect("room");
    let value: Value = serde_json::from_slice(&bytes).expect("JSON");
    assert_eq!(
        value["features"][0]["geometry"]["coordinates"],
        json!([[1, 2, 3.25], [4, 5, 6]])
    );
    assert!(value.get("crs").is_none());
    assert!(write_raised(&layer, &[], &mut bytes).is_err());
}
