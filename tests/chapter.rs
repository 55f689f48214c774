//! The manual's chapter on the trade, `man/trade.md`: from real runs on the fixtures.
//!
//! `UPDATE_TRADE=1 cargo test --release --test all chapter` writes it anew. The test holds it to
//! the errors, which do not vary, and not to the seconds.

use crate::support::{Workplace, root, updating};
use serde_json::Value;
use std::fmt::Write;
use std::fs;

/// A command's part of the chapter.
struct Part {
    command: &'static str,
    /// Its input and options.
    words: &'static str,
    vary: &'static str,
    /// Which setting to choose and why.
    advice: &'static str,
    /// Options for the run at the extremes.
    extremes: Option<&'static str>,
}

const PARTS: &[Part] = &[
    Part {
        command: "voxelize",
        words: "fixtures/shapes/torus-knot.ply",
        vary: "--vary resolution=16,32,64,128 --vary mode --repeat 5",
        advice: "Choose `three-axis` where voxels are to lie near the surface: at one resolution it errs least, for it sets no voxel that the surface only grazes. Choose `conservative` where nothing may be missed: it alone has a proven bound, and one step up in resolution buys the difference back.",
        extremes: Some("--resolution 48"),
    },
    Part {
        command: "shadow",
        words: "fixtures/shapes/torus-knot.ply --size 128x96",
        vary: "--vary method --vary resolution=32,128,512 --vary rays=1,16,64 --repeat 3",
        advice: ADVICE_ON_SHADOW,
        extremes: Some("--resolution 48 --rays 4"),
    },
    Part {
        command: "smooth-mc",
        words: "fixtures/shapes/staircase.ply",
        vary: "--vary energy --vary constraint=cell-edge,diamond --vary max-iterations=5,10,20,40,80 --repeat 5",
        advice: "Choose `bilaplacian` in the `diamond`, and as many steps as the time allows: twenty take off most of the staircase, forty more of the long waves. The `laplacian` ends elsewhere, for it shrinks until the constraint stops it, and more steps do not bring it closer. On its edge alone a vertex cannot leave the grid's lines, and the surface stays rough. No voxel changes sides in any row.",
        extremes: Some(""),
    },
    Part {
        command: "tunnels",
        words: "fixtures/molecules/porthole.xyzr --start 0,0,0",
        vary: "--vary method --repeat 5",
        advice: ADVICE_ON_TUNNELS,
        extremes: Some("--shell-radius 3"),
    },
    Part {
        command: "splat-gen",
        words: "fixtures/clouds/ball.xyz --max-radius 20%",
        vary: "--vary delta=5%,2%,1%,0.5% --vary perc=0.8,0.5,0.2 --vary cover --repeat 3",
        advice: ADVICE_ON_DISCS,
        extremes: Some("--delta 2%"),
    },
    Part {
        command: "splat-trace",
        words: "fixtures/splats/sphere.ply --size 96x72 --material 0:gloss --sphere 1.6,-0.5,0.8,0.5 --material 1:mirror",
        vary: "--vary depth=0,1,2,4 --vary samples=1,2 --vary blend --repeat 3",
        advice: ADVICE_ON_TRACING,
        extremes: Some(""),
    },
    Part {
        command: "vector-overlay",
        words: "--terrain fixtures/terrain/hills.tif --vectors fixtures/vectors/hills.geojson --size 480x320",
        vary: "--vary method=texture:16,texture:32,texture:64,texture:128,texture:256,texture:512,texture:1024,stencil,distance --repeat 5",
        advice: ADVICE_ON_OVERLAYS,
        extremes: None,
    },
    Part {
        command: "compress-anim encode",
        words: "fixtures/animations/wave.pc2 --base fixtures/animations/wave.obj",
        vary: "--vary target-kg=2,0.5,0.1,0.02 --vary method=auto,trajectory,rlpca,pca,delta --repeat 3",
        advice: ADVICE_ON_ANIMATIONS,
        extremes: Some(""),
    },
];

const ADVICE_ON_DISCS: &str = "Choose `--delta` by what the discs are for: the bound holds for every point, and the number of discs falls with it until they are as small as the spacing of the points. `greedy` takes about as many discs as the surface needs at one bound and is the choice where they are kept or sent; `paper` overlaps more, which hides seams in pictures. A larger `--perc` leaves fewer discs and, from about 0.8 on, holes, which `--verify` counts.";

const ADVICE_ON_OVERLAYS: &str = "Choose `distance`: it is exact, and no slower than a texture that is fine enough to look exact. `stencil` is the paper's way, which graphics hardware likes; here it costs more the more features there are, and a pixel whose place is within a 512th of a pixel of an edge may fall on either side. A texture errs along every edge by a quarter of a texel on average, whatever it costs to make. [On a real map](overlay.md) the three differ more.";

const ADVICE_ON_TRACING: &str = "Choose the depth by the scene: without mirrors and glass none is needed, and each bounce that light takes through glass costs two. Most wrong pixels are edges, which only `--samples` mends. Blended normals cost little and take away the seams between discs; blended places move the surface too, where discs lie apart.";

const ADVICE_ON_ANIMATIONS: &str = "Choose the error, and leave the method at `auto`: its streams, [on four animations of research](compress-anim.md), took between a half and nine tenths of those of `rlpca`, and a fifth to a sixtieth of those of differences packed by xz. A smaller error costs bits more than seconds.";

const ADVICE_ON_TUNNELS: &str = "Choose `exact`: it costs two or three times what `approximate` does, some hundredths of a second for a protein, and leaves nothing to doubt. `approximate` is for many thousands of frames; its two bounds say of each how far it may be off. `balls:12` is nearest to the truth of those that do not know it, at several times the cost of `exact`. Grids are what others use: [on three enzymes](tunnels.md) they err more than `approximate` at any spacing that costs less than `exact`.";

const ADVICE_ON_SHADOW: &str = "Choose `exact` for meshes of this size: its rays cost no more than those through voxels, and what error is left is the noise of few rays, which `--rays` buys down. Choose `octree` where many small triangles stand apart, as the twigs of [a tree](shadow.md) do: there its shadow rays take about four fifths of the time of exact ones. Against walking the grid it answers the same rays, to the bit, in less than a quarter of the time at 512 voxels and 16 rays, from 1.6 % of the nodes. With conservative voxels neither lets light through; the error is false shadow of about a voxel around the true one.";

const NOT_MOVED: &str = "`stability` takes one input, and land comes with its features: how far these results hold is tested, not reported here.";

const OPENING: &str = "\
# The trade

What the settings of each command cost, how exact they are, and how far its results hold. Each part is a real run on a file of this repository; the seconds are those of the machine that wrote it, the errors are the same everywhere. Run the lines on your own data.
";

fn run(place: &Workplace, line: &str) -> Value {
    let ran = place.run(line);
    assert_eq!(ran.code, 0, "{line}: {}", ran.stderr);
    ran.document()
}

/// A figure in four digits.
fn figure(value: &Value) -> String {
    value
        .as_f64()
        .map_or("none".to_owned(), |v| format!("{v:.4}"))
}

/// The lines of the table: setting, error, bound and share, which do not vary, then the costs.
fn table(report: &Value) -> Vec<(String, String)> {
    let rows = report["result"]["rows"].as_array().expect("rows");
    let line = |row: &Value| {
        let setting = row["setting"].as_object().expect("a setting");
        let mut fixed: Vec<String> = setting
            .values()
            .map(|v| match v {
                Value::Null => "-".to_owned(),
                Value::String(name) => name.clone(),
                number => number.to_string(),
            })
            .collect();
        let share = row["modelled"]["share"].as_f64().expect("a share");
        fixed.extend([
            figure(&row["error"]),
            figure(&row["bound"]),
            format!("{:.2} %", 100.0 * share),
        ]);
        let seconds = row["wall_s"]["median"].as_f64().expect("seconds");
        let peak = row["peak_bytes"]
            .as_f64()
            .map_or("-".to_owned(), |b| format!("{:.1}", b / 1048576.0));
        let front = if row["on_front"] == true { "front" } else { "" };
        let costs = format!("{:.2} | {peak} | {front} |", 1e3 * seconds);
        (format!("| {} |", fixed.join(" | ")), costs)
    };
    rows.iter().map(line).collect()
}

/// How far results hold, in a sentence.
fn reach(result: &Value) -> String {
    let number = |value: &Value| {
        value
            .as_f64()
            .map_or("none".to_owned(), |n| format!("{n:e}"))
    };
    let name = |key: &str| result["unchanged"][key].to_string();
    let shifts = match &result["unchanged"]["offset"] {
        Value::Null => String::new(),
        offset => format!(" and exact shifts of up to {} extents", number(offset)),
    };
    let drift = match result["drift"].as_f64() {
        Some(0.0) => "there is no drift".to_owned(),
        _ => format!("the largest drift is {}", number(&result["drift"])),
    };
    format!(
        "No result changes under scales from 2^{} to 2^{}{shifts}; under all changes that the command promises to bear {drift}.",
        name("smallest_scale"),
        name("largest_scale"),
    )
}

#[test]
fn the_chapter_on_the_trade_is_current() {
    let place = Workplace::new();
    let named = place.run("tradeoff nonsense --vary x").stderr;
    let with_trade: Vec<&str> = PARTS.iter().map(|part| part.command).collect();
    let wanted = format!("those with a trade: {}\n", with_trade.join(", "));
    assert!(
        named.ends_with(&wanted),
        "a command without a part: {named}"
    );

    let path = root().join("man/trade.md");
    let kept = fs::read_to_string(&path).unwrap_or_default();
    let mut text = OPENING.to_owned();
    let mut missing = Vec::new();
    for Part {
        command,
        words,
        vary,
        advice,
        extremes,
    } in PARTS
    {
        let name = command.split(' ').next().unwrap_or(command);
        let trade = format!("tradeoff {command} {words} {vary}");
        let report = run(&place, &format!("{trade} -q --plot plot.svg"));
        assert!(
            !report["result"]["front"]
                .as_array()
                .expect("a front")
                .is_empty()
        );
        let extreme = extremes.map(|more| format!("stability {command} {words} {more}"));
        let extreme = extreme.as_deref().map(str::trim_end);
        let held = extreme.map(|line| reach(&run(&place, &format!("{line} -q"))["result"]));
        let first = &report["result"]["rows"][0]["setting"];
        let knobs: Vec<&str> = first
            .as_object()
            .expect("a setting")
            .keys()
            .map(String::as_str)
            .collect();
        let error = &report["result"]["error"];
        let (measure, unit) = (error["measure"].as_str(), error["unit"].as_str());
        let _ = write!(
            text,
            "\n## {command}\n\n```sh\nscantle {trade}\n```\n\nThe error is the {} ({}).\n\n",
            measure.unwrap_or_default(),
            unit.unwrap_or_default()
        );
        let _ = writeln!(
            text,
            "| {} | error | bound | modelled | ms | MiB | |",
            knobs.join(" | ")
        );
        let _ = writeln!(text, "|{}", "---|".repeat(knobs.len() + 6));
        for (fixed, costs) in table(&report) {
            if !kept.contains(&format!("\n{fixed} ")) {
                missing.push(fixed.clone());
            }
            let _ = writeln!(text, "{fixed} {costs}");
        }
        let _ = write!(
            text,
            "\n![Error against time, the front marked](trade-{name}.svg)\n\n{advice}\n"
        );
        match extreme.zip(held) {
            Some((line, held)) => {
                let _ = write!(text, "\n```sh\nscantle {line}\n```\n\n{held}\n");
                if !kept.contains(&format!("\n{held}\n")) {
                    missing.push(held);
                }
            }
            None => {
                let _ = write!(text, "\n{NOT_MOVED}\n");
            }
        }
        if updating("UPDATE_TRADE") {
            let plot = fs::read(place.path("plot.svg")).expect("the plot");
            fs::write(root().join(format!("man/trade-{name}.svg")), plot).expect("a plot");
        }
    }
    if updating("UPDATE_TRADE") {
        fs::write(&path, text).expect("the chapter");
        return;
    }
    let way_out = "run `UPDATE_TRADE=1 cargo test --release --test all chapter`";
    assert!(
        missing.is_empty(),
        "not in man/trade.md: {missing:#?}\n{way_out}"
    );
    assert!(kept.contains("| front |"));
}
