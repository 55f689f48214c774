use super::*;
use crate::vector::Vec2;

/// From, to, a place and where it is by PROJ 9.
type Row = (u32, u32, Vec2, Vec2);

/// Places by pyproj 3.7.2, between systems whose datums are taken for one.
const OF_ONE_DATUM: &[Row] = &[
    (
        4326,
        32733,
        [20.5, -34.0],
        [1008207.2501954278, 6224178.920222426],
    ),
    (
        4326,
        32733,
        [15.0, -10.0],
        [500000.00000000175, 8894587.508698922],
    ),
    (
        4326,
        32733,
        [17.9, -79.0],
        [561748.6724941476, 1228491.6552108582],
    ),
    (
        4326,
        32632,
        [8.0, 46.5],
        [423268.310033186, 5150089.103963713],
    ),
    (4326, 32632, [9.0, 0.0], [500000.0, 0.0]),
    (
        4326,
        32632,
        [6.1, 79.9],
        [443247.87180748046, 8871838.627135225],
    ),
    (
        4326,
        3857,
        [8.0, 47.0],
        [890555.9263461885, 5942074.072431109],
    ),
    (
        4326,
        3857,
        [-179.9, -80.0],
        [-20026376.393709917, -15538711.09630922],
    ),
    (
        4326,
        3857,
        [0.001, 85.0],
        [111.31949079327357, 19971868.880408566],
    ),
    (4326, 3035, [10.0, 52.0], [4321000.0, 3210000.0]),
    (
        4326,
        3035,
        [-9.0, 38.0],
        [2659511.6534543983, 1865785.3853637718],
    ),
    (
        4326,
        3035,
        [30.0, 70.0],
        [5081405.570743285, 5319011.507119936],
    ),
    (
        25832,
        3035,
        [500000.0, 5500000.0],
        [4248779.49157386, 2949361.1783119217],
    ),
    (
        25832,
        3035,
        [300000.0, 5200000.0],
        [4044632.075953909, 2652301.2715325877],
    ),
    (
        32733,
        4326,
        [969491.25, 6250297.0],
        [20.06856780630218, -33.78337672212391],
    ),
    (
        32733,
        4326,
        [500000.0, 9000000.0],
        [14.999999999999982, -9.046562463768952],
    ),
    (4326, 2154, [3.0, 46.5], [700000.0, 6600000.0]),
    (
        4326,
        2154,
        [-4.0, 48.0],
        [178626.39694432466, 6789748.646358649],
    ),
    (4326, 5070, [-96.0, 37.0], [0.0, 1550756.1682043842]),
    (
        4326,
        5070,
        [-120.0, 45.0],
        [-1869811.891981741, 2683087.8653375464],
    ),
    (4326, 3413, [-45.0, 75.0], [0.0, -1633879.4974707854]),
    (
        4326,
        3413,
        [10.0, 82.0],
        [711001.3016387973, -497848.4710844016],
    ),
    (
        32633,
        3857,
        [500000.0, 5000000.0],
        [1669792.3618991016, 5645715.775436708],
    ),
    (
        4326,
        2048,
        [19.5, -33.5],
        [-46461.50419318378, 3708314.3955029557],
    ),
    (
        4326,
        3031,
        [30.0, -75.0],
        [819391.6192036181, 1419227.9157567972],
    ),
];

/// Places by pyproj 3.7.2, between datums that it relates by other numbers or by grids.
const OF_TWO_DATUMS: &[Row] = &[
    (
        4326,
        23030,
        [-3.0, 40.3],
        [500109.2983764693, 4461263.012545815],
    ),
    (
        4326,
        23030,
        [-5.0, 40.0],
        [329383.7442478044, 4429879.430436466],
    ),
    (
        4326,
        28992,
        [5.4, 52.1],
        [155876.81394940955, 456861.6182695369],
    ),
    (
        4326,
        27700,
        [-2.0, 52.0],
        [400096.82934256934, 233506.47389757365],
    ),
    (
        4326,
        2056,
        [7.4, 46.95],
        [2597059.009115286, 1199880.3888370986],
    ),
    (
        4326,
        21781,
        [8.0, 47.0],
        [642695.4201549252, 205590.52228722392],
    ),
];

/// The largest difference in metres; degrees count as those of a meridian.
fn largest(rows: &[Row]) -> f64 {
    let mut worst: f64 = 0.0;
    for (from, to, place, wanted) in rows {
        let [from, to] = [from, to].map(|code| Crs::from_epsg(*code));
        let way = Reprojector::new(&from, &to).unwrap_or_else(|e| panic!("{from} to {to}: {e}"));
        let got = way
            .apply(*place)
            .unwrap_or_else(|| panic!("{from} to {to}: nowhere"));
        let unit = if to.is_geographic() == Some(true) {
            111_320.0
        } else {
            1.0
        };
        let off = unit * (got[0] - wanted[0]).hypot(got[1] - wanted[1]);
        worst = worst.max(off);
    }
    worst
}

#[test]
fn places_are_those_of_proj() {
    let off = largest(OF_ONE_DATUM);
    assert!(off < 1e-5, "{off} m");
    let off = largest(OF_TWO_DATUMS);
    assert!(off < 10.0, "{off} m");
}

#[test]
fn ways_back_lead_back() {
    for (from, to, place, _) in OF_ONE_DATUM {
        let [from, to] = [from, to].map(|code| Crs::from_epsg(*code));
        let there = Reprojector::new(&from, &to).expect("a way");
        let back = Reprojector::new(&to, &from).expect("a way back");
        let got = there
            .apply(*place)
            .and_then(|there| back.apply(there))
            .expect("a place");
        let unit = if from.is_geographic() == Some(true) {
            111_320.0
        } else {
            1.0
        };
        let off = unit * (got[0] - place[0]).hypot(got[1] - place[1]);
        assert!(off < 1e-3, "{from} to {to}: {off} m");
    }
}

const ESRI: &str = r#"PROJCS["WGS_1984_UTM_Zone_33S",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",10000000.0],PARAMETER["Central_Meridian",15.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]"#;
const ED50: &str = r#"PROJCS["ED50_UTM_zone_30N",GEOGCS["GCS_European_1950",DATUM["D_European_1950",SPHEROID["International_1924",6378388,297]],PRIMEM["Greenwich",0],UNIT["Degree",0.017453292519943295]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",-3],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["Meter",1]]"#;
const OWN: &str = r#"PROJCRS["mine",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563,LENGTHUNIT["metre",1]]],ID["EPSG",4326]],CONVERSION["c",METHOD["Lambert Azimuthal Equal Area",ID["EPSG",9820]],PARAMETER["Latitude of natural origin",-34,ANGLEUNIT["degree",0.0174532925199433]],PARAMETER["Longitude of natural origin",20],PARAMETER["False easting",1000,LENGTHUNIT["metre",1]],PARAMETER["False northing",0]],CS[Cartesian,2],AXIS["(E)",east],AXIS["(N)",north],LENGTHUNIT["metre",1]]"#;

#[test]
fn definitions_are_told_apart() {
    for (text, code) in [
        ("EPSG:32733", 32733),
        ("urn:ogc:def:crs:EPSG::32733", 32733),
        ("urn:ogc:def:crs:OGC:1.3:CRS84", 4326),
        ("http://www.opengis.net/def/crs/EPSG/0/3035", 3035),
        (ESRI, 32733),
        (ED50, 23030),
        (
            r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["Degree",0.017453292519943295]]"#,
            4326,
        ),
        (&ESRI.replace("WGS_1984_UTM_Zone_33S", "somewhere"), 32733),
    ] {
        assert_eq!(
            Crs::parse(text).expect("a system").epsg,
            Some(code),
            "{text}"
        );
    }
    // With the same name, but other numbers, it is another one.
    let moved = Crs::parse(&ESRI.replace("15.0", "14.5")).expect("a system");
    assert_eq!((moved.epsg, moved.title()), (None, "WGS_1984_UTM_Zone_33S"));
    assert!(!moved.same(&Crs::from_epsg(32733)));
    assert!(Crs::parse("PROJCS[").is_err());
    assert!(Crs::parse("mars").is_err());
}

#[test]
fn definitions_without_a_number_are_used() {
    let own = Crs::parse(OWN).expect("a system");
    assert_eq!((own.epsg, own.title()), (None, "mine"));
    let way = Reprojector::new(&Crs::lon_lat(), &own).expect("a way");
    let [x, y] = way.apply([20.0, -34.0]).expect("a place");
    assert!((x - 1000.0).abs() < 1e-6 && y.abs() < 1e-6, "{x} {y}");
    let text =
        Crs::parse("+proj=utm +zone=33 +south +datum=WGS84 +units=m +no_defs").expect("a system");
    assert!(text.same(&Crs::from_epsg(32733)));
    assert!(Reprojector::new(&text, &Crs::from_epsg(32733)).is_ok_and(|way| way.is_identity()));
}

#[test]
fn what_cannot_be_is_refused_with_both_names() {
    let unknown = Crs {
        name: "site grid".to_owned(),
        epsg: None,
    };
    let error = Reprojector::new(&unknown, &Crs::from_epsg(32733))
        .map(|_| ())
        .expect_err("refused");
    assert_eq!(
        error.to_string(),
        "coordinates of site grid cannot be made those of EPSG:32733 (WGS 84 / UTM zone 33S): site grid has no known definition"
    );
    let way = Reprojector::new(&Crs::lon_lat(), &Crs::from_epsg(3857)).expect("a way");
    assert_eq!(way.apply([0.0, f64::NAN]), None);
}

#[test]
fn units_and_axes_are_known() {
    assert_eq!(Crs::lon_lat().is_geographic(), Some(true));
    assert_eq!(Crs::from_epsg(32733).metres_in_unit(), Some(1.0));
    let feet = Crs::from_epsg(2227).metres_in_unit().expect("feet");
    assert!((feet - 1200.0 / 3937.0).abs() < 1e-12);
    assert_eq!(Crs::from_epsg(1).is_geographic(), None);
    assert_eq!(
        Crs::from_epsg(32733).to_string(),
        "EPSG:32733 (WGS 84 / UTM zone 33S)"
    );
}
