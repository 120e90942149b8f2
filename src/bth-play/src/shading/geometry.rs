//! Normals at hits, computed from the corners of triangles, in world space.

use crate::failure::Failure;
use crate::smooth::SmoothNormals;
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef};
use bth_format::object::ObjectView;
use glam::{DVec3, Vec3};
use std::path::Path;

/// The geometry of a scene at the time to which it is set. Normals are computed in f64, so that no
/// product of two f32 lengths overflows or underflows.
pub(crate) struct ShadingGeometry<'a> {
    scene: &'a Scene,
    objects: Vec<ObjectView<'a>>,
    /// True if the vertices of each object can be elsewhere than in the file, so that its normals
    /// are, too.
    deformable: Vec<bool>,
    /// The object of each instance; empty where groups make them many.
    objects_of: Vec<u32>,
    /// Of each object; empty in modes that show no smooth normals.
    smooth: &'a [SmoothNormals],
}

fn to_f64(p: [f32; 3]) -> DVec3 {
    Vec3::from_array(p).as_dvec3()
}

impl<'a> ShadingGeometry<'a> {
    pub(crate) fn new(scene: &'a Scene, smooth: &'a [SmoothNormals]) -> Self {
        Self {
            scene,
            objects: (0..scene.object_count()).map(|i| scene.object(i)).collect(),
            deformable: (0..scene.object_count()).map(|i| scene.vertex_count(i).is_some()).collect(),
            objects_of: match scene.has_groups() {
                true => Vec::new(),
                false => (0..scene.instance_count()).map(|i| scene.object_of(i)).collect(),
            },
            smooth,
        }
    }

    /// Fails when the file tells neither the places of triangles in leaves nor their positions in
    /// the source. Normals need one of both.
    pub(crate) fn require_triangles(&self, file: &Path) -> Result<(), Failure> {
        if self.objects.iter().all(ObjectView::has_corners) {
            return Ok(());
        }
        Err(Failure::Lacks {
            file: file.into(),
            what: "the file tells neither places nor positions of triangles, which normals need",
            hint: "compile the model again, or use --mode steps",
        })
    }

    /// The object of a primitive.
    pub(super) fn object(&self, primitive: PrimitiveRef) -> &ObjectView<'a> {
        &self.objects[self.object_of(primitive.instance) as usize]
    }

    fn object_of(&self, instance: u32) -> u32 {
        let known = self.objects_of.get(instance as usize).copied();
        known.unwrap_or_else(|| self.scene.object_of(instance))
    }

    fn to_world(&self, primitive: PrimitiveRef, normal: DVec3) -> Option<DVec3> {
        let normal = DVec3::from_array(self.scene.normal_to_world(primitive.instance, normal.to_array()));
        // Scaled first, since the square of a tiny length underflows.
        (normal / normal.abs().max_element()).try_normalize()
    }

    /// The geometric normal of a hit triangle in the world: unit, on the side that `towards` points
    /// to.
    pub(crate) fn geometric_normal(&self, primitive: PrimitiveRef, towards: DVec3) -> DVec3 {
        let normal = self.front_normal(primitive).unwrap_or(towards);
        if normal.dot(towards) < 0.0 { -normal } else { normal }
    }

    /// Returns true if a ray in a direction hits the front of a triangle: the side from which its
    /// vertices are seen counter-clockwise, in the space of the object.
    pub(super) fn is_front(&self, primitive: PrimitiveRef, direction: [f32; 3]) -> bool {
        let direction = to_f64(direction);
        self.front_normal(primitive).is_none_or(|normal| normal.dot(direction) < 0.0)
    }

    /// Returns true if a normal of a triangle is on its front.
    pub(super) fn is_front_normal(&self, primitive: PrimitiveRef, normal: DVec3) -> bool {
        self.front_normal(primitive).is_none_or(|front| front.dot(normal) > 0.0)
    }

    /// The unit normal of a triangle's plane in the world on the side of its front; `None` where it
    /// cannot be computed.
    fn front_normal(&self, primitive: PrimitiveRef) -> Option<DVec3> {
        let object = self.object_of(primitive.instance);
        let [a, b, c] = self.scene.triangle_of(object, primitive.triangle)?.map(DVec3::from_array);
        let (e, f) = (b - a, c - a);
        // Scaled first: the square of the cross product of two edges of 1e-20 underflows in f64.
        let scale = e.abs().max_element().max(f.abs().max_element());
        self.to_world(primitive, (e / scale).cross(f / scale))
    }

    /// The interpolated normal of the source, or a smooth one, on the side of the geometric one; or
    /// the geometric one when there is neither.
    pub(crate) fn shading_normal(&self, hit: &Hit, geometric: DVec3) -> DVec3 {
        let (object, row) = (self.object(hit.primitive), self.object_of(hit.primitive.instance) as usize);
        let PrimitiveRef { instance, triangle } = hit.primitive;
        let corners = object.corners.get(triangle as usize).filter(|_| !object.normals.is_empty());
        let Some(corners) = corners else {
            let smooth = self.smooth.get(row).and_then(|smooth| smooth.at(triangle, hit.u, hit.v));
            let normal = smooth.and_then(|normal| self.to_world(PrimitiveRef { instance, triangle }, normal));
            return match normal {
                Some(normal) if normal.dot(geometric) < 0.0 => -normal,
                Some(normal) => normal,
                None => geometric,
            };
        };
        let normal = if self.deformable[row] {
            self.scene.surface(hit).map(|surface| DVec3::from_array(surface.normal))
        } else {
            let [a, b, c] = corners.map(|row| to_f64(object.normals[row as usize]));
            let (u, v) = (f64::from(hit.u), f64::from(hit.v));
            self.to_world(hit.primitive, a * (1.0 - u - v) + b * u + c * v)
        };
        match normal {
            Some(normal) if normal.dot(geometric) < 0.0 => -normal,
            Some(normal) => normal,
            None => geometric,
        }
    }
}
