//! The picture of tunnels inside a molecule that is cut open.

use super::plot::colour_of;
use scantle::error::Result;
use scantle::image::colour::{CLAY, Srgb};
use scantle::mesh::Mesh;
use scantle::numeric::vector::{add, scale};
use scantle::progress::Progress;
use scantle::protein::clearance::Ball;
use scantle::protein::tunnels::Tunnel;
use scantle::protein::tunnels::cut::{Fineness, cut_open};
use scantle::render::preview::{self, Panel, View, What};
use scantle::spatial::aabb::Aabb;

/// Side of a cell of the tunnels' surface.
const TUNNEL_SPACING: f64 = 0.2;

/// Side of a cell of the molecule's surface, unless that makes more than so many cells.
const SPACING: f64 = 0.5;
const MOST_CELLS: f64 = 4e6;

/// Rows of the picture at most.
const ROWS: usize = 640;

/// Tunnels that are drawn: as many as there are colours.
const MOST: usize = 7;

/// Draws the molecule of the balls in clay, cut open along its first tunnel, with its seven widest
/// tunnels in their colours, as a PNG file.
///
/// `label` stands under it, and the width of the first tunnel in the corner; without tunnels the molecule
/// alone is drawn. Errs where what is to be drawn takes more than `memory` bytes.
pub fn picture(
    balls: &[Ball],
    tunnels: &[Tunnel],
    label: &str,
    memory: u64,
    progress: &dyn Progress,
) -> Result<Vec<u8>> {
    let tunnels = &tunnels[..tunnels.len().min(MOST)];
    let fineness = Fineness {
        molecule: spacing(balls),
        tunnels: TUNNEL_SPACING,
    };
    let cut = cut_open(balls, tunnels, fineness, memory, progress)?;
    progress.stage("draw", 0);
    let tubes = cut.tunnels.iter().enumerate();
    let tubes = tubes.map(|(k, tube)| (tube, colour_of(k)));
    let parts: Vec<(&Mesh, Srgb)> = [(&cut.mesh, CLAY)].into_iter().chain(tubes).collect();
    let caption = match tunnels.first() {
        Some(tunnel) => format!("bottleneck {:.3} Å", tunnel.narrowest.radius),
        None => "no tunnel".to_owned(),
    };
    let panel = Panel {
        label,
        what: What::Parts(&parts),
        colour: CLAY,
    };
    let params = preview::Params {
        rows: ROWS,
        view: Some(View {
            viewer: cut.viewer,
            // The light comes from above, and is to fall on the cut.
            up: add(scale(cut.up, 0.65), scale(cut.viewer, 0.76)),
        }),
        ..preview::Params::DEFAULT
    };
    preview::side_by_side(&[panel], &caption, "Å", &params)
}

/// The side of a cell for a molecule of these balls.
fn spacing(balls: &[Ball]) -> f64 {
    let extent = Aabb::around(balls.iter().map(|ball| &ball.centre)).extent();
    let volume: f64 = extent.iter().map(|wide| wide + 4.0).product();
    SPACING.max((volume / MOST_CELLS).cbrt())
}
