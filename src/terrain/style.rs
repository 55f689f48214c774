//! How features look on the land, and the land under them.
//!
//! A style sheet is JSON. Everything in it may be left out:
//!
//! ```json
//! {
//!   "layers": {
//!     "roads": {
//!       "stroke": "#9c3a2e", "width": "12m", "opacity": 0.9, "dash": ["60m", "30m"],
//!       "by": "class",
//!       "values": { "track": { "width": "2px" } }
//!     },
//!     "farms": { "fill": "#7fa650", "opacity": 0.5, "stroke": "#4c6a2c", "width": "1px" },
//!     "towns": { "fill": "#303030", "radius": "4px" }
//!   },
//!   "ground": { "tint": "elevation", "shade": 0.7, "sun": [315, 45], "sky": "#bcd6ec" }
//! }
//! ```
//!
//! A layer is named like its file without its ending. Lengths are metres on the ground or pixels of the
//! picture. `by` names a property; what its value has under `values` comes over the rest of the layer.

use crate::error::Fault;
use crate::image::colour::{Linear, OKABE_ITO, Srgb, from_hex, to_linear};
use crate::numeric::vector::{Vec3, dot, normalize};
use crate::terrain::overlay::Light;
use crate::terrain::surface::Surface;
use crate::terrain::view::Seen;
use crate::vector::{Feature, Shape, Vec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// A length on the ground, or in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Breadth {
    /// In the unit of the map.
    Ground(f64),
    /// In pixels of the picture.
    Pixels(f64),
}

impl Breadth {
    /// The length of its name, above 0: `12m`, or `2px`.
    pub fn from_name(name: &str) -> Option<Self> {
        let number = |digits: &str| digits.trim().parse().ok().filter(|n| is_length(*n));
        match name.strip_suffix("px") {
            Some(digits) => number(digits).map(Breadth::Pixels),
            None => number(name.strip_suffix('m')?).map(Breadth::Ground),
        }
    }
}

fn is_length(length: f64) -> bool {
    length > 0.0 && length.is_finite()
}

/// How one feature looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Colour of areas and points; none leaves them open.
    pub fill: Option<Srgb>,
    /// Colour of lines and outlines; none leaves them out.
    pub stroke: Option<Srgb>,
    /// Width of lines and outlines.
    pub width: Breadth,
    /// Radius of points.
    pub radius: Breadth,
    /// From 0, nothing, to 1, all covered.
    pub opacity: f64,
    /// Lengths of dashes and of what is between them, in the unit of the map; none for whole lines.
    pub dash: Option<[f64; 2]>,
}

/// How the land looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Its colour.
    pub tint: Tint,
    /// How much of its light comes from the sun: 0 is flat, 1 leaves slopes that face away black.
    pub shade: f64,
    /// Where the sun stands: degrees from north over east, and above the horizon.
    pub sun: [f64; 2],
    /// Colour of the sky at the horizon; it is deeper above.
    pub sky: Srgb,
}

/// The colour of the land.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tint {
    /// By elevation, from the lowest place to the highest.
    Elevation,
    /// One for all.
    Plain(Srgb),
}

impl Ground {
    /// As in an atlas, with the sun in the north-west.
    pub const DEFAULT: Ground = Ground {
        tint: Tint::Elevation,
        shade: 0.7,
        sun: [315.0, 45.0],
        sky: [196, 220, 240],
    };

    /// The colour of land with a unit normal, at a share of the way from the lowest place to the highest.
    pub fn colour(&self, normal: Vec3, share: f64) -> Linear {
        let base = match self.tint {
            Tint::Elevation => elevation(share),
            Tint::Plain(colour) => to_linear(colour),
        };
        let [azimuth, altitude] = self.sun.map(f64::to_radians);
        let sun = [
            azimuth.sin() * altitude.cos(),
            azimuth.cos() * altitude.cos(),
            altitude.sin(),
        ];
        // Level land has the light of the tint itself.
        let lit = dot(normal, normalize(sun)).max(0.0) / sun[2].max(0.1);
        let light = 1.0 - self.shade + self.shade * lit.min(1.6);
        base.map(|c| (f64::from(c) * light).min(1.0) as f32)
    }

    /// The colour of the sky by the height of the line of sight over the horizon, as the z of a unit vector.
    pub fn sky(&self, up: f64) -> Linear {
        let depth = 1.0 - 0.55 * up.clamp(0.0, 1.0).sqrt();
        let [red, green, blue] = to_linear(self.sky);
        let by = |c: f32, power: f64| (f64::from(c) * depth.powf(power)) as f32;
        [by(red, 2.0), by(green, 1.4), by(blue, 0.8)]
    }
}

/// The land of a surface as a picture shows it.
#[derive(Debug, Clone, Copy)]
pub struct Painted {
    /// How it looks.
    pub ground: Ground,
    /// From its lowest place to its highest.
    pub relief: f64,
}

impl Light for Painted {
    fn ground(&self, surface: &Surface, seen: &Seen) -> Linear {
        // On a border of a hole there may be no slope: the land is level there.
        let normal = surface.normal(seen.at).unwrap_or([0.0, 0.0, 1.0]);
        let share = if self.relief > 0.0 {
            seen.z / self.relief
        } else {
            0.0
        };
        self.ground.colour(normal, share)
    }

    fn sky(&self, height: f64) -> Linear {
        self.ground.sky(1.0 - height)
    }
}

/// Tints of an atlas, from the lowest land to the highest.
const ATLAS: [Srgb; 6] = [
    [150, 178, 132],
    [196, 207, 150],
    [232, 218, 166],
    [214, 182, 134],
    [176, 144, 116],
    [245, 243, 240],
];

fn elevation(share: f64) -> Linear {
    let steps = (ATLAS.len() - 1) as f64;
    let at = share.clamp(0.0, 1.0) * steps;
    let first = (at as usize).min(ATLAS.len() - 2);
    let (a, b) = (to_linear(ATLAS[first]), to_linear(ATLAS[first + 1]));
    let t = (at - first as f64) as f32;
    std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
}

/// A style sheet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sheet {
    layers: BTreeMap<String, Layer>,
    /// How the land looks; none for [`Ground::DEFAULT`].
    ground: Option<Ground>,
}

/// What a sheet says of a layer or of some of its features.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Layer {
    fill: Option<String>,
    stroke: Option<String>,
    width: Option<String>,
    radius: Option<String>,
    opacity: Option<f64>,
    dash: Option<[String; 2]>,
    by: Option<String>,
    #[serde(default)]
    values: BTreeMap<String, Layer>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default)]
    layers: BTreeMap<String, Layer>,
    #[serde(default)]
    ground: WrittenGround,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenGround {
    tint: Option<String>,
    shade: Option<f64>,
    sun: Option<[f64; 2]>,
    sky: Option<String>,
}

/// The colour of a name: `#RRGGBB`; `none` is no colour.
fn colour(name: &str, place: &str) -> Result<Option<Srgb>, Fault> {
    if name == "none" {
        return Ok(None);
    }
    let found = name.starts_with('#').then(|| from_hex(name)).flatten();
    let problem = || Fault::whole(format!("{place}: {name} is no colour: #RRGGBB or none"));
    found.map(Some).ok_or_else(problem)
}

fn breadth(name: &str, place: &str) -> Result<Breadth, Fault> {
    Breadth::from_name(name).ok_or_else(|| {
        Fault::whole(format!(
            "{place}: {name} is no length: metres such as 12m, or pixels such as 2px, above 0"
        ))
    })
}

fn metres(name: &str, place: &str) -> Result<f64, Fault> {
    match breadth(name, place)? {
        Breadth::Ground(length) => Ok(length),
        Breadth::Pixels(_) => Err(Fault::whole(format!("{place}: {name} is not in metres"))),
    }
}

fn share(value: f64, place: &str) -> Result<f64, Fault> {
    match (0.0..=1.0).contains(&value) {
        true => Ok(value),
        false => Err(Fault::whole(format!("{place}: {value} is not from 0 to 1"))),
    }
}

impl Layer {
    /// A style with what is said here in place of what it has.
    fn over(&self, base: Style, place: &str) -> Result<Style, Fault> {
        let at = |name: &str| format!("{place}.{name}");
        let mut style = base;
        if let Some(name) = &self.fill {
            style.fill = colour(name, &at("fill"))?;
        }
        if let Some(name) = &self.stroke {
            style.stroke = colour(name, &at("stroke"))?;
        }
        if let Some(name) = &self.width {
            style.width = breadth(name, &at("width"))?;
        }
        if let Some(name) = &self.radius {
            style.radius = breadth(name, &at("radius"))?;
        }
        if let Some(value) = self.opacity {
            style.opacity = share(value, &at("opacity"))?;
        }
        if let Some([on, off]) = &self.dash {
            style.dash = Some([metres(on, &at("dash"))?, metres(off, &at("dash"))?]);
        }
        Ok(style)
    }

    fn check(&self, place: &str) -> Result<(), Fault> {
        self.over(Style::of_layer("", 0, &Shape::Empty), place)?;
        if self.by.is_none() && !self.values.is_empty() {
            let problem = format!("{place}: has values, but no property that they are of (by)");
            return Err(Fault::whole(problem));
        }
        for (value, layer) in &self.values {
            layer.check(&format!("{place}.values.{value}"))?;
        }
        Ok(())
    }
}

impl Sheet {
    /// The sheet of a JSON text.
    ///
    /// Errs, naming the place, for text that is no JSON, names that are not known, and values that are no
    /// colour, length or share.
    pub fn from_json(text: &str) -> Result<Sheet, Fault> {
        let written: Written =
            serde_json::from_str(text).map_err(|error| Fault::whole(error.to_string()))?;
        for (name, layer) in &written.layers {
            layer.check(&format!("layers.{name}"))?;
        }
        Ok(Sheet {
            layers: written.layers,
            ground: Some(ground(&written.ground)?),
        })
    }

    /// How the land looks.
    pub fn ground(&self) -> Ground {
        self.ground.unwrap_or(Ground::DEFAULT)
    }

    /// The layers that are spoken of and not among these.
    pub fn unused<'a>(&'a self, layers: &[&str]) -> Vec<&'a str> {
        let names = self.layers.keys().map(String::as_str);
        names.filter(|name| !layers.contains(name)).collect()
    }

    /// How a feature of a layer looks; `number` counts the layers.
    pub fn style(&self, layer: &str, number: usize, feature: &Feature) -> Style {
        let mut style = Style::of_layer(layer, number, &feature.shape);
        let Some(rules) = self.layers.get(layer) else {
            return style;
        };
        // What is written was checked when it was read.
        style = rules.over(style, "").unwrap_or(style);
        let value = rules.by.as_ref().and_then(|by| feature.properties.get(by));
        let word = value.map(|value| match value {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        });
        match word.and_then(|word| rules.values.get(&word)) {
            Some(rules) => rules.over(style, "").unwrap_or(style),
            None => style,
        }
    }
}

fn ground(written: &WrittenGround) -> Result<Ground, Fault> {
    let mut ground = Ground::DEFAULT;
    if let Some(name) = &written.tint {
        ground.tint = match name.as_str() {
            "elevation" => Tint::Elevation,
            other => match colour(other, "ground.tint") {
                Ok(Some(plain)) => Tint::Plain(plain),
                _ => {
                    let problem = format!("ground.tint: {other} is neither elevation nor #RRGGBB");
                    return Err(Fault::whole(problem));
                }
            },
        };
    }
    if let Some(value) = written.shade {
        ground.shade = share(value, "ground.shade")?;
    }
    if let Some(sun) = written.sun {
        if !sun[0].is_finite() || !(1.0..=90.0).contains(&sun[1]) {
            let problem =
                format!("ground.sun: {sun:?} is no direction and 1 to 90 degrees of height");
            return Err(Fault::whole(problem));
        }
        ground.sun = sun;
    }
    if let Some(name) = &written.sky {
        ground.sky = colour(name, "ground.sky")?.unwrap_or(ground.sky);
    }
    Ok(ground)
}

/// Words in the names of layers, and what maps draw such things in: fill, stroke, opacity.
///
/// The first whose word is in the name counts: a watershed is no water.
const CUSTOMS: &[(&[&str], Srgb, Srgb, f64)] = &[
    (
        &[
            "watershed",
            "catchment",
            "basin",
            "border",
            "boundar",
            "district",
        ],
        [236, 226, 214],
        [142, 68, 96],
        0.3,
    ),
    (
        &["water", "river", "lake", "stream", "canal", "dam", "sea"],
        [92, 148, 200],
        [64, 116, 172],
        0.85,
    ),
    (
        &["road", "street", "highway", "motorway"],
        [158, 58, 46],
        [158, 58, 46],
        0.95,
    ),
    (
        &["rail", "path", "trail", "track"],
        [70, 62, 58],
        [70, 62, 58],
        0.9,
    ),
    (
        &["building", "urban", "town", "village", "place", "city"],
        [92, 84, 88],
        [52, 48, 52],
        0.8,
    ),
    (
        &["forest", "wood", "park", "protected", "reserve"],
        [62, 122, 72],
        [38, 88, 50],
        0.45,
    ),
    (
        &["farm", "field", "parcel"],
        [222, 200, 120],
        [128, 100, 44],
        0.3,
    ),
];

impl Style {
    /// How a layer looks of which nothing is said: as on maps where its name tells what it is, else in
    /// a colour of its own.
    fn of_layer(name: &str, number: usize, shape: &Shape) -> Style {
        let name = name.to_lowercase();
        let custom = CUSTOMS
            .iter()
            .find(|(words, ..)| words.iter().any(|word| name.contains(word)));
        let plain = OKABE_ITO[number % OKABE_ITO.len()];
        let (fill, stroke, opacity) = match custom {
            Some((_, fill, stroke, opacity)) => (*fill, *stroke, *opacity),
            None => (plain, plain, 0.6),
        };
        let is_area = matches!(shape, Shape::Polygons(_));
        Style {
            fill: Some(fill),
            stroke: Some(stroke),
            width: Breadth::Pixels(if is_area { 1.0 } else { 2.0 }),
            radius: Breadth::Pixels(4.0),
            opacity: if is_area { opacity } else { opacity.max(0.9) },
            dash: None,
        }
    }
}

/// A line cut into dashes of one length with gaps of another between them, both above 0.
///
/// It begins with a dash. Cost: linear in vertices and dashes; a line of over a million dashes stays whole.
pub fn dashes(line: &[Vec2], [on, off]: [f64; 2]) -> Vec<Vec<Vec2>> {
    let length = |a: Vec2, b: Vec2| (b[0] - a[0]).hypot(b[1] - a[1]);
    let whole: f64 = line.windows(2).map(|ends| length(ends[0], ends[1])).sum();
    if line.len() < 2 || whole / (on + off) > MOST_DASHES {
        return vec![line.to_vec()];
    }
    let mut all = Vec::new();
    let mut dash = vec![line[0]];
    let (mut drawn, mut left) = (true, on);
    for ends in line.windows(2) {
        let [a, b] = [ends[0], ends[1]];
        let step = length(a, b);
        let mut at = 0.0;
        while step - at > left {
            at += left;
            let p = [0, 1].map(|c| a[c] + (b[c] - a[c]) * (at / step));
            if drawn {
                dash.push(p);
                all.push(std::mem::take(&mut dash));
            } else {
                dash = vec![p];
            }
            drawn = !drawn;
            left = if drawn { on } else { off };
        }
        left -= step - at;
        if drawn {
            dash.push(b);
        }
    }
    if drawn && dash.len() > 1 {
        all.push(dash);
    }
    all
}

/// More dashes of one line are not drawn apart.
const MOST_DASHES: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn feature(shape: Shape, properties: Value) -> Feature {
        let Value::Object(properties) = properties else {
            unreachable!("written as an object")
        };
        Feature { shape, properties }
    }

    const LINE: Shape = Shape::Lines(Vec::new());

    #[test]
    fn a_property_changes_what_its_layer_says() {
        let sheet = Sheet::from_json(
            r##"{"layers": {"ways": {"stroke": "#102030", "width": "12m", "dash": ["60m", "3m"],
                "by": "lanes", "values": {"2": {"width": "2px", "opacity": 0.5}, "big": {"stroke": "none"}}}}}"##,
        )
        .expect("a sheet");
        let of = |lanes: Value| sheet.style("ways", 0, &feature(LINE, json!({ "lanes": lanes })));
        let plain = of(json!(7));
        assert_eq!(plain.stroke, Some([16, 32, 48]));
        assert_eq!(plain.width, Breadth::Ground(12.0));
        assert_eq!(plain.dash, Some([60.0, 3.0]));
        let two = of(json!(2));
        assert_eq!((two.width, two.opacity), (Breadth::Pixels(2.0), 0.5));
        assert_eq!(two.stroke, plain.stroke);
        assert_eq!(of(json!("big")).stroke, None);
        assert_eq!(of(Value::Null), plain);
        assert_eq!(sheet.unused(&["roads"]), ["ways"]);
        assert!(sheet.unused(&["roads", "ways"]).is_empty());
        assert_eq!(sheet.ground(), Ground::DEFAULT);
    }

    #[test]
    fn layers_look_as_on_maps_and_otherwise_apart() {
        let sheet = Sheet::default();
        let of = |name: &str, number| sheet.style(name, number, &feature(LINE, json!({})));
        let [red, _, blue] = of("Rivers_33S", 3).stroke.expect("a colour");
        assert!(blue > 2 * red);
        let [red, _, blue] = of("watersheds", 3).stroke.expect("a colour");
        assert!(blue < red);
        assert_ne!(of("a", 1).stroke, of("b", 2).stroke);
        let area = sheet.style("a", 1, &feature(Shape::Polygons(Vec::new()), json!({})));
        assert!(area.opacity < 0.7 && of("a", 1).opacity > 0.85);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let why = |text: &str| Sheet::from_json(text).expect_err("a fault").to_string();
        let layer = |text: &str| why(&format!("{{\"layers\": {{\"a\": {text}}}}}"));
        assert_eq!(
            layer(r#"{"fill": "red"}"#),
            "layers.a.fill: red is no colour: #RRGGBB or none"
        );
        assert_eq!(
            layer(r#"{"width": "0m"}"#),
            "layers.a.width: 0m is no length: metres such as 12m, or pixels such as 2px, above 0"
        );
        assert_eq!(
            layer(r#"{"by": "x", "values": {"y": {"opacity": 1.5}}}"#),
            "layers.a.values.y.opacity: 1.5 is not from 0 to 1"
        );
        assert_eq!(
            layer(r#"{"values": {"y": {}}}"#),
            "layers.a: has values, but no property that they are of (by)"
        );
        assert!(layer(r#"{"colour": "x"}"#).contains("unknown field `colour`"));
        assert_eq!(
            why(r#"{"ground": {"sun": [0, 0]}}"#),
            "ground.sun: [0.0, 0.0] is no direction and 1 to 90 degrees of height"
        );
        assert_eq!(
            why(r#"{"ground": {"tint": "green"}}"#),
            "ground.tint: green is neither elevation nor #RRGGBB"
        );
    }

    #[test]
    fn dashes_run_around_corners() {
        let line = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]];
        let found = dashes(&line, [3.0, 2.0]);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0], [[0.0, 0.0], [3.0, 0.0]]);
        assert_eq!(found[1], [[4.0, 1.0], [4.0, 3.0]]);
        assert_eq!(dashes(&line, [100.0, 1.0]), [line.to_vec()]);
        assert_eq!(dashes(&line, [1e-9, 1e-9]), [line.to_vec()]);
    }

    #[test]
    fn slopes_to_the_sun_are_brighter() {
        let ground = Ground::DEFAULT;
        let light = |normal: Vec3| ground.colour(normalize(normal), 0.3)[1];
        let [north_west, level, south_east] =
            [[-1.0, 1.0, 2.0], [0.0, 0.0, 1.0], [1.0, -1.0, 2.0]].map(light);
        assert!(north_west > level && level > 1.5 * south_east);
        for (share, tint) in [(0.0, ATLAS[0]), (1.0, ATLAS[5])] {
            let found = ground.colour([0.0, 0.0, 1.0], share);
            let wanted = to_linear(tint);
            assert!((0..3).all(|c| (found[c] - wanted[c]).abs() < 1e-6));
        }
        assert!(ground.sky(1.0)[0] < ground.sky(0.0)[0]);
    }
}
