//! Scenes with instances: meshes that are placed by transforms, next to the triangles of the scene.

use crate::abi::*;
use crate::error::{Failure, Result};
use crate::geometry::Geometry;
use crate::handles::Shared;
use crate::mesh::Mesh;
use crate::statistics;
use crate::transform::Transform;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// An instance of a mesh.
#[derive(Debug)]
pub(crate) struct Place {
    /// Id of its geometry in the scene, and its number in an array; `INVALID_ID` for the triangles
    /// of the scene itself.
    pub(crate) instance: u32,
    pub(crate) instance_primitive: u32,
    pub(crate) mask: u32,
    pub(crate) mesh: Arc<Mesh>,
    /// Rows of four, from the space of the mesh to world space.
    pub(crate) to_world: [f32; 12],
}

/// The instances of a scene.
#[derive(Debug)]
pub(crate) struct World {
    pub(crate) scene: bth::Scene,
    /// By the index of the instance.
    pub(crate) places: Vec<Place>,
}

impl World {
    /// The world of a scene's own mesh and its instances. `None` without instances that can be hit.
    ///
    /// # Errors
    /// If an instance cannot be placed.
    pub(crate) fn build(own: &Arc<Mesh>, instances: Vec<Place>) -> Result<Option<World>> {
        if instances.is_empty() {
            return Ok(None);
        }
        let itself = Place {
            instance: INVALID_ID,
            instance_primitive: INVALID_ID,
            mask: u32::MAX,
            mesh: own.clone(),
            to_world: Transform::IDENTITY.rows(),
        };
        let mut places: Vec<Place> =
            std::iter::once(itself).chain(instances).filter(|place| place.mesh.scene.is_some()).collect();
        let scene = match placed(&places) {
            Ok(scene) => scene,
            Err(_) => {
                // Some transform has no inverse: rays cannot hit these, as in other libraries.
                let count = places.len();
                places.retain(|place| placed(std::slice::from_ref(place)).is_ok());
                (places.len()..count).for_each(|_| statistics::count_flat_instance());
                placed(&places)?
            }
        };
        Ok((!places.is_empty()).then_some(World { scene, places }))
    }
}

/// The scene of some places.
fn placed(places: &[Place]) -> std::result::Result<bth::Scene, Failure> {
    let mut builder = bth::SceneBuilder::new();
    let mut objects: Vec<(*const Mesh, u32)> = Vec::new();
    for place in places {
        let Some(scene) = &place.mesh.scene else { continue };
        let mesh = Arc::as_ptr(&place.mesh);
        // Programs most often place many instances of few meshes one after the other.
        let known = objects.iter().rev().find(|known| known.0 == mesh).map(|known| known.1);
        let object = known.unwrap_or_else(|| {
            let object = builder.add(scene);
            objects.push((mesh, object));
            object
        });
        builder.instance(object, &place.to_world)?;
    }
    builder.commit()?;
    Ok(builder.into_scene())
}

impl Geometry {
    /// The transform of an instance of this geometry at its first time step; `None` if there is no
    /// such instance.
    pub(crate) fn transform(&self, index: u32) -> Option<Transform> {
        let state = self.state();
        if self.kind == INSTANCE {
            return state.transforms.first().copied().filter(|_| index == 0);
        }
        let view = state.view(BUFFER_TRANSFORM, 0)?;
        let exists = (index as usize) < view.count;
        Transform::read(view.format, |word| view.float(index as usize, word)).filter(|_| exists)
    }
}

/// Adds the instances that a geometry makes.
pub(crate) fn add_places(id: u32, geometry: &Arc<Shared<Geometry>>, places: &mut Vec<Place>) {
    let (scenes, count, which) = {
        let state = geometry.state();
        let count = match geometry.kind {
            INSTANCE => 1,
            _ => state.view(BUFFER_TRANSFORM, 0).map_or(0, |view| view.count),
        };
        (state.scenes.clone(), count, state.view(BUFFER_INDEX, 0).cloned())
    };
    let meshes: Vec<Option<Arc<Mesh>>> =
        scenes.iter().map(|scene| scene.as_ref()?.triangles()?.downcast().ok()).collect();
    let mask = geometry.mask.load(Relaxed);
    for index in 0..count {
        let scene = match &which {
            Some(view) if index < view.count => view.float(index, 0).to_bits() as usize,
            _ => 0,
        };
        let mesh = meshes.get(scene).and_then(Option::as_ref).filter(|mesh| mesh.scene.is_some());
        let transform = geometry.transform(index as u32);
        if let (Some(mesh), Some(transform)) = (mesh, transform) {
            places.push(Place {
                instance: id,
                instance_primitive: index as u32,
                mask,
                mesh: mesh.clone(),
                to_world: transform.rows(),
            });
        }
    }
}
