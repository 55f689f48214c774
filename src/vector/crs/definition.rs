//! Definitions of coordinate reference systems by their terms, and what tells which one it is.

use super::wkt::Node;
use crs_definitions::{Def, from_code};

/// What is known of a number in the EPSG registry.
pub fn known(code: u32) -> Option<Def> {
    u16::try_from(code).ok().and_then(from_code)
}

/// The terms by which two definitions are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Definition {
    /// The projection, as PROJ names it.
    pub projection: String,
    /// `lat_0`, `lon_0`, `lat_1`, `lat_2`, `lat_ts`, the scale, `x_0` and `y_0`.
    terms: [f64; 8],
    /// Metres in a unit.
    pub to_metre: f64,
    /// Half the longer axis of the ellipsoid, and the shorter one.
    ellipsoid: [f64; 2],
    /// What relates it to WGS 84: the datum or the numbers of a shift.
    pub datum: String,
}

/// Names of ellipsoids with their longer half axis and inverse flattening (0: a sphere).
const ELLIPSOIDS: [(&str, f64, f64); 22] = [
    ("WGS84", 6378137.0, 298.257223563),
    ("GRS80", 6378137.0, 298.257222101),
    ("intl", 6378388.0, 297.0),
    ("bessel", 6377397.155, 299.1528128),
    ("clrk66", 6378206.4, 294.978698213898),
    ("clrk80", 6378249.145, 293.4663),
    ("clrk80ign", 6378249.2, 293.4660212936269),
    ("airy", 6377563.396, 299.3249646),
    ("mod_airy", 6377340.189, 299.3249646),
    ("krass", 6378245.0, 298.3),
    ("GRS67", 6378160.0, 298.247167427),
    ("aust_SA", 6378160.0, 298.25),
    ("WGS72", 6378135.0, 298.26),
    ("WGS66", 6378145.0, 298.25),
    ("evrst30", 6377276.345, 300.8017),
    ("evrst48", 6377304.063, 300.8017),
    ("evrstSS", 6377298.556, 300.8017),
    ("helmert", 6378200.0, 298.3),
    ("hough", 6378270.0, 297.0),
    ("bess_nam", 6377483.865, 299.1528128),
    ("GRS67mod", 6378160.0, 298.25),
    ("sphere", 6370997.0, 0.0),
];

impl Definition {
    /// The terms of a string of PROJ; none where it names no projection or an ellipsoid that is not known.
    pub fn of(text: &str) -> Option<Self> {
        let get = |name: &str| {
            let mut words = text.split_whitespace();
            words.find_map(|word| match word.strip_prefix('+')?.split_once('=') {
                Some((key, value)) => (key == name).then_some(value),
                None => (&word[1..] == name).then_some(""),
            })
        };
        let number = |name: &str| get(name).and_then(|value| value.parse::<f64>().ok());
        let projection = get("proj")?;
        let mut terms = [0.0; 8];
        let names = ["lat_0", "lon_0", "lat_1", "lat_2", "lat_ts"];
        for (term, name) in terms.iter_mut().zip(names) {
            *term = number(name).unwrap_or(0.0);
        }
        terms[5] = number("k_0").or(number("k")).unwrap_or(1.0);
        terms[6] = number("x_0").unwrap_or(0.0);
        terms[7] = number("y_0").unwrap_or(0.0);
        if projection == "utm" {
            let south = if get("south").is_some() { 1e7 } else { 0.0 };
            let meridian = number("zone")? * 6.0 - 183.0;
            terms = [0.0, meridian, 0.0, 0.0, 0.0, 0.9996, 5e5, south];
        }
        Some(Definition {
            projection: canonical(projection).to_owned(),
            terms,
            to_metre: number("to_meter")
                .or_else(|| unit(get("units")?))
                .unwrap_or(1.0),
            ellipsoid: ellipsoid(&get, &number)?,
            datum: datum(&get),
        })
    }

    /// Whether coordinates are angles.
    pub fn is_geographic(&self) -> bool {
        self.projection == "longlat"
    }

    /// Whether all but the datum is the same, up to the digits that files are written with.
    pub fn is_same(&self, other: &Definition) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1.0);
        let all = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| close(*a, *b));
        self.projection == other.projection
            && all(&self.terms, &other.terms)
            && close(self.to_metre, other.to_metre)
            && all(&self.ellipsoid, &other.ellipsoid)
    }
}

fn canonical(projection: &str) -> &str {
    match projection {
        "utm" | "etmerc" => "tmerc",
        "latlong" | "latlon" | "lonlat" => "longlat",
        other => other,
    }
}

fn unit(name: &str) -> Option<f64> {
    let units = [
        ("m", 1.0),
        ("us-ft", 1200.0 / 3937.0),
        ("ft", 0.3048),
        ("km", 1000.0),
    ];
    units.iter().find(|(n, _)| *n == name).map(|(_, u)| *u)
}

fn ellipsoid<'a>(
    get: &impl Fn(&str) -> Option<&'a str>,
    number: &impl Fn(&str) -> Option<f64>,
) -> Option<[f64; 2]> {
    let of_name = |name: &str| ELLIPSOIDS.iter().find(|(n, ..)| *n == name);
    let flattened = |a: f64, rf: f64| [a, if rf == 0.0 { a } else { a - a / rf }];
    if let Some(radius) = number("R") {
        return Some([radius; 2]);
    }
    if let Some(a) = number("a") {
        return match (number("b"), number("rf")) {
            (Some(b), _) => Some([a, b]),
            (_, rf) => Some(flattened(a, rf.unwrap_or(0.0))),
        };
    }
    let name = match (get("ellps"), get("datum")) {
        (Some(name), _) => name,
        (None, None | Some("WGS84")) => "WGS84",
        (None, Some("NAD83" | "GGRS87")) => "GRS80",
        (None, Some("NAD27")) => "clrk66",
        (None, Some("OSGB36")) => "airy",
        (None, Some("potsdam" | "hermannskogel")) => "bessel",
        (None, Some("carthage")) => "clrk80ign",
        (None, Some("nzgd49")) => "intl",
        (None, Some(_)) => return None,
    };
    of_name(name).map(|(_, a, rf)| flattened(*a, *rf))
}

/// The datum in one form: a shift of nothing on the ellipsoid of WGS 84 or GRS 80 is that of WGS 84.
fn datum<'a>(get: &impl Fn(&str) -> Option<&'a str>) -> String {
    let meridian = get("pm").unwrap_or("");
    let shift = match (get("datum"), get("towgs84"), get("nadgrids")) {
        (Some("WGS84" | "NAD83"), ..) => "0".to_owned(),
        (Some(name), ..) => name.to_owned(),
        (None, Some(shift), _) => {
            let zero = |word: &str| word.parse() == Ok(0.0);
            let numbers: Vec<&str> = shift.split(',').collect();
            let used = numbers.iter().rposition(|word| !zero(word));
            used.map_or("0".to_owned(), |last| numbers[..=last].join(","))
        }
        (None, None, Some(grids)) => grids.to_owned(),
        (None, None, None) => String::new(),
    };
    format!("{shift} {meridian}").trim().to_owned()
}

/// Names of projections in WKT, and in PROJ.
const PROJECTIONS: [(&str, &str); 33] = [
    ("transversemercator", "tmerc"),
    ("gausskruger", "tmerc"),
    ("transversemercatorsouthorientated", "tmerc +axis=wsu"),
    ("lambertconformalconic", "lcc"),
    ("lambertconformalconic1sp", "lcc"),
    ("lambertconformalconic2sp", "lcc"),
    ("lambertconicconformal1sp", "lcc"),
    ("lambertconicconformal2sp", "lcc"),
    ("albers", "aea"),
    ("albersconicequalarea", "aea"),
    ("albersequalarea", "aea"),
    ("lambertazimuthalequalarea", "laea"),
    ("mercator", "merc"),
    ("mercator1sp", "merc"),
    ("mercator2sp", "merc"),
    ("mercatorvarianta", "merc"),
    ("mercatorvariantb", "merc"),
    ("mercatorauxiliarysphere", "webmerc"),
    ("popularvisualisationpseudomercator", "webmerc"),
    ("polarstereographic", "stere"),
    ("polarstereographicvarianta", "stere"),
    ("polarstereographicvariantb", "stere"),
    ("stereographic", "stere"),
    ("stereographicnorthpole", "stere"),
    ("stereographicsouthpole", "stere"),
    ("obliquestereographic", "sterea"),
    ("doublestereographic", "sterea"),
    ("cassinisoldner", "cass"),
    ("equidistantconic", "eqdc"),
    ("azimuthalequidistant", "aeqd"),
    ("sinusoidal", "sinu"),
    ("mollweide", "moll"),
    ("platecarree", "eqc"),
];

/// Names of parameters in WKT, and in PROJ.
const PARAMETERS: [(&str, &str); 22] = [
    ("latitudeoforigin", "lat_0"),
    ("latitudeofcenter", "lat_0"),
    ("latitudeofnaturalorigin", "lat_0"),
    ("latitudeoffalseorigin", "lat_0"),
    ("centralmeridian", "lon_0"),
    ("longitudeoforigin", "lon_0"),
    ("longitudeofcenter", "lon_0"),
    ("longitudeofnaturalorigin", "lon_0"),
    ("longitudeoffalseorigin", "lon_0"),
    ("straightverticallongitudefrompole", "lon_0"),
    ("standardparallel1", "lat_1"),
    ("standardparallel2", "lat_2"),
    ("latitudeof1ststandardparallel", "lat_1"),
    ("latitudeof2ndstandardparallel", "lat_2"),
    ("latitudeofstandardparallel", "lat_ts"),
    ("scalefactor", "k_0"),
    ("scalefactoratnaturalorigin", "k_0"),
    ("falseeasting", "x_0"),
    ("falsenorthing", "y_0"),
    ("eastingatfalseorigin", "x_0"),
    ("northingatfalseorigin", "y_0"),
    ("longitudeofpole", "lon_0"),
];

/// Letters and digits alone, in lower case.
fn plain(name: &str) -> String {
    let kept = name.chars().filter(char::is_ascii_alphanumeric);
    kept.map(|c| c.to_ascii_lowercase()).collect()
}

/// A name as ESRI and as EPSG write it, in one form.
fn normal(name: &str) -> String {
    let mut name = plain(&name.replace("(deprecated)", ""));
    if let Some(rest) = name.strip_prefix("gcs") {
        name = rest.to_owned();
    }
    let short = [
        ("wgs1984", "wgs84"),
        ("wgs1972", "wgs72"),
        ("nad1983", "nad83"),
        ("nad1927", "nad27"),
        ("northamerican1983", "nad83"),
        ("northamerican1927", "nad27"),
        ("etrs1989", "etrs89"),
        ("european1950", "ed50"),
    ];
    short
        .iter()
        .fold(name, |name, (long, short)| name.replace(long, short))
}

/// The geographic system of one, or itself.
fn geographic(system: &Node) -> Option<&Node> {
    const KEYWORDS: [&str; 7] = [
        "GEOGCS",
        "GEOGCRS",
        "GEOGRAPHICCRS",
        "GEODCRS",
        "GEODETICCRS",
        "BASEGEOGCRS",
        "BASEGEODCRS",
    ];
    if KEYWORDS.contains(&system.keyword.as_str()) {
        return Some(system);
    }
    system.child(&KEYWORDS)
}

/// The numbers in the EPSG registry that are known, with what is.
fn registry() -> impl Iterator<Item = Def> {
    (1024..=32767u16).filter_map(from_code)
}

/// The number in the EPSG registry of a geographic system, by its own word or by its name.
fn geographic_code(system: &Node) -> Option<u32> {
    if let Some(code) = system.epsg().filter(|code| known(*code).is_some()) {
        return Some(code);
    }
    let name = normal(system.name()?);
    registry()
        .filter(|def| def.wkt.starts_with("GEOGCS"))
        .find(|def| normal(super::wkt::first_name(def.wkt)) == name)
        .map(|def| u32::from(def.code))
}

/// The number in the EPSG registry of a system that does not say it.
///
/// It has the terms of that number, and its name too or else the same geographic system; of several
/// the first that is in force.
pub fn identify(system: &Node) -> Option<u32> {
    let base = geographic(system)?;
    if std::ptr::eq(base, system) {
        return geographic_code(system);
    }
    let own = Definition::of(&proj_string(system)?)?;
    let (name, base) = (normal(system.name()?), normal(base.name()?));
    let mut of_base = None;
    for def in registry().filter(|def| def.wkt.starts_with("PROJCS")) {
        let mut names = def.wkt.split('"').skip(1).step_by(2);
        let (Some(own_name), Some(its_base)) = (names.next(), names.next()) else {
            continue;
        };
        let is_named = normal(own_name) == name;
        let is_candidate = normal(its_base) == base && !own_name.contains("deprecated");
        if !is_named && (!is_candidate || of_base.is_some()) {
            continue;
        }
        if Definition::of(def.proj4).is_some_and(|its| its.is_same(&own)) {
            if is_named {
                return Some(u32::from(def.code));
            }
            of_base = Some(u32::from(def.code));
        }
    }
    of_base
}

/// A definition in WKT as a string of PROJ; none where its projection is not known.
pub fn proj_string(system: &Node) -> Option<String> {
    let base = geographic(system)?;
    let ground = ground(base)?;
    if std::ptr::eq(base, system) {
        return Some(format!("+proj=longlat {ground} +no_defs"));
    }
    let conversion = system.child(&["CONVERSION"]).unwrap_or(system);
    let method = conversion.child(&["PROJECTION", "METHOD"])?;
    let method = plain(method.name()?);
    let (_, projection) = PROJECTIONS.iter().find(|(name, _)| *name == method)?;
    let unit = system.child(&["UNIT", "LENGTHUNIT"]);
    let axis_unit = || system.child(&["AXIS"])?.child(&["LENGTHUNIT", "UNIT"]);
    let unit = unit
        .or_else(axis_unit)
        .and_then(|unit| unit.numbers().next());
    let unit = unit.unwrap_or(1.0);
    let mut terms = vec![format!("+proj={projection}")];
    for node in conversion.children().filter(|n| n.keyword == "PARAMETER") {
        let name = plain(node.name()?);
        let Some((_, term)) = PARAMETERS.iter().find(|(known, _)| *known == name) else {
            continue;
        };
        let mut value = node.numbers().next()?;
        if let (true, Some(unit)) = (term.ends_with("_0") && term.len() == 3, Some(unit)) {
            let own = node.child(&["LENGTHUNIT"]).and_then(|u| u.numbers().next());
            value *= own.unwrap_or(unit);
        }
        let is_polar = *projection == "stere" && *term == "lat_1";
        let is_mercator = projection.contains("merc") && *term == "lat_1";
        let term = if is_polar || is_mercator {
            "lat_ts"
        } else {
            term
        };
        terms.push(format!("+{term}={value}"));
    }
    settle_poles(projection, &mut terms);
    if *projection == "webmerc" {
        let sphere = "+proj=merc +a=6378137 +b=6378137 +lat_ts=0 +lon_0=0 +x_0=0 +y_0=0 +k=1";
        return Some(format!("{sphere} +units=m +nadgrids=@null +no_defs"));
    }
    Some(format!(
        "{} {ground} +to_meter={unit} +no_defs",
        terms.join(" ")
    ))
}

/// The pole of a polar projection is told by the latitude where its scale is true.
fn settle_poles(projection: &str, terms: &mut Vec<String>) {
    let value = |terms: &[String], name: &str| {
        let word = terms.iter().find_map(|term| term.strip_prefix(name))?;
        word.parse::<f64>().ok()
    };
    if projection != "stere" {
        return;
    }
    let origin = value(terms, "+lat_0=");
    if let (None, Some(parallel)) = (origin, value(terms, "+lat_ts=")) {
        terms.push(format!("+lat_0={}", 90f64.copysign(parallel)));
    } else if let Some(parallel) = origin.filter(|at| at.abs() < 90.0 && at.abs() > 0.0) {
        // The first variant in WKT of version 1 has the latitude of true scale as its origin.
        terms.retain(|term| !term.starts_with("+lat_0="));
        terms.push(format!(
            "+lat_0={} +lat_ts={parallel}",
            90f64.copysign(parallel)
        ));
    }
}

/// Ellipsoid and datum of a geographic system as terms of PROJ: those of the registry where it is known.
fn ground(system: &Node) -> Option<String> {
    if let Some(def) = geographic_code(system).and_then(known) {
        let kept = def.proj4.split_whitespace().filter(|term| {
            [
                "+datum=",
                "+ellps=",
                "+towgs84=",
                "+nadgrids=",
                "+pm=",
                "+a=",
                "+b=",
                "+rf=",
            ]
            .iter()
            .any(|start| term.starts_with(start))
        });
        return Some(kept.collect::<Vec<_>>().join(" "));
    }
    let datum = system.child(&["DATUM", "TRF", "GEODETICDATUM", "ENSEMBLE"])?;
    let mut numbers = datum.child(&["SPHEROID", "ELLIPSOID"])?.numbers();
    let (a, rf) = (numbers.next()?, numbers.next()?);
    let mut text = if rf == 0.0 {
        format!("+a={a} +b={a}")
    } else {
        format!("+a={a} +rf={rf}")
    };
    if let Some(shift) = datum.child(&["TOWGS84"]) {
        let numbers: Vec<String> = shift.numbers().map(|n| n.to_string()).collect();
        text += &format!(" +towgs84={}", numbers.join(","));
    }
    let meridian = system.child(&["PRIMEM"]).and_then(|m| m.numbers().next());
    if let Some(meridian) = meridian.filter(|m| *m != 0.0) {
        text += &format!(" +pm={meridian}");
    }
    Some(text)
}
