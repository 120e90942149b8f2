//! The triangles of all visible instances of a scene at its time, in world space, as one mesh.

use bth::Scene;

/// Positions and triangles; positions of the instances follow each other, so that their number is the same in all frames in which the
/// same instances are visible.
pub(super) struct FrameMesh {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl FrameMesh {
    /// The mesh of a scene at its time.
    pub(super) fn of(scene: &Scene) -> FrameMesh {
        let mut mesh = FrameMesh { positions: Vec::new(), triangles: Vec::new() };
        for instance in (0..scene.instance_count()).map(|row| scene.instance(row)).filter(|i| i.visible) {
            let first = mesh.positions.len() as u32;
            let place = |p: &[f32; 3]| {
                instance.to_world.map(|[x, y, z, w]| {
                    (x * f64::from(p[0]) + y * f64::from(p[1]) + z * f64::from(p[2]) + w) as f32
                })
            };
            mesh.positions.extend(scene.positions(instance.object).iter().map(place));
            let triangles = scene.object(instance.object).triangles.iter();
            mesh.triangles.extend(triangles.map(|corners| corners.map(|corner| first + corner)));
        }
        mesh
    }
}
