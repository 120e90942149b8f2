//! The cameras that a scene brings along.

use super::projection::{Camera, Projection};
use crate::args::Args;
use bth::Scene;
use glam::{DVec2, DVec3};

/// The camera in a row of the scene's table, at the time to which the scene is set.
///
/// # Panics
/// If the scene has no such camera.
pub(crate) fn scene_camera(scene: &Scene, row: u32, args: &Args) -> Camera {
    let lens = scene.description().expect("a scene with this camera").cameras[row as usize];
    let (rows, _) = scene.node(lens.node);
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let aspect = f64::from(args.size.0) / f64::from(args.size.1);
    let (projection, half) = if lens.projection == 1 {
        (Projection::Orthographic, lens.size / 2.0 * column(1).length())
    } else {
        (Projection::Perspective, (args.fov.unwrap_or(lens.size) / 2.0).to_radians().tan())
    };
    let forward = (-column(2)).normalize_or(DVec3::NEG_Z);
    let half_extent = DVec2::new(half * aspect, half) / args.zoom;
    let mut camera = Camera::look_along(column(3), forward, column(1), half_extent);
    camera.projection = projection;
    camera.near = lens.near;
    camera.far = if lens.far > 0.0 { lens.far } else { f64::INFINITY };
    camera
}
