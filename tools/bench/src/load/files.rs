//! The files that a start reads, and the state of the page cache.

use crate::rivals::embree::InstancePlace;
use anyhow::{Context, Result, ensure};
use bth::rays::Ray;
use bth_import::Mesh;
use serde::Serialize;
use std::fs::File;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use zerocopy::{FromBytes, IntoBytes};

/// A folder that is deleted when this value is dropped.
pub(super) struct Scratch(TempDir);

impl Scratch {
    pub(super) fn new(place: Option<&Path>) -> Result<Scratch> {
        let folder = match place {
            Some(place) => tempfile::tempdir_in(place).with_context(|| place.display().to_string())?,
            None => tempfile::tempdir()?,
        };
        Ok(Scratch(folder))
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf> {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes)?;
        // Only clean pages can be dropped from the cache.
        File::open(&path)?.sync_all()?;
        Ok(path)
    }
}

/// How much of a file is in memory when a process starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum PageCache {
    /// None of it: the system dropped its pages.
    Cold,
    /// All of it: it was just read.
    Warm,
}

impl PageCache {
    /// Both states.
    pub(super) const ALL: [PageCache; 2] = [PageCache::Warm, PageCache::Cold];

    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            PageCache::Cold => "cold",
            PageCache::Warm => "warm",
        }
    }

    /// Brings a file into this state.
    pub(super) fn prepare(self, path: &Path) -> Result<()> {
        match self {
            PageCache::Warm => {
                std::fs::read(path)?;
            }
            PageCache::Cold => drop_pages(&File::open(path)?)?,
        }
        Ok(())
    }
}

#[cfg(target_os = "linux")]
fn drop_pages(file: &File) -> Result<()> {
    Ok(rustix::fs::fadvise(file, 0, None, rustix::fs::Advice::DontNeed)?)
}

#[cfg(not(target_os = "linux"))]
fn drop_pages(_: &File) -> Result<()> {
    anyhow::bail!("a cold page cache can be had on Linux only")
}

/// Encodes rays.
pub(super) fn ray_bytes(rays: &[Ray]) -> &[u8] {
    rays.as_bytes()
}

/// Decodes a file of [`ray_bytes`].
pub(super) fn read_rays(path: &Path) -> Result<Vec<Ray>> {
    let bytes = std::fs::read(path)?;
    let rays = bytes.chunks(size_of::<Ray>()).map(|b| Ray::read_from_bytes(b).ok());
    rays.collect::<Option<_>>().context("not a file of rays")
}

/// Encodes a mesh: the number of positions, the positions, the triangles.
pub(super) fn mesh_bytes(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = (mesh.positions.len() as u64).to_le_bytes().to_vec();
    bytes.extend_from_slice(mesh.positions.as_slice().as_bytes());
    bytes.extend_from_slice(mesh.triangles.as_slice().as_bytes());
    bytes
}

/// Positions and triangles.
pub(super) type Triangles = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// Decodes a file of [`mesh_bytes`].
pub(super) fn read_mesh(path: &Path) -> Result<Triangles> {
    mesh(&std::fs::read(path)?)
}

fn mesh(bytes: &[u8]) -> Result<Triangles> {
    let (head, rest) = bytes.split_at_checked(8).context("not a file of triangles")?;
    let count = u64::from_le_bytes(head.try_into()?) as usize;
    let end = count.checked_mul(12).filter(|end| *end <= rest.len()).context("not a file of triangles")?;
    let (positions, triangles) = rest.split_at(end);
    ensure!(triangles.len().is_multiple_of(12), "not a file of triangles");
    let position = |b: &[u8]| <[f32; 3]>::read_from_bytes(b).expect("chunks of the right size");
    let triangle = |b: &[u8]| <[u32; 3]>::read_from_bytes(b).expect("chunks of the right size");
    Ok((positions.chunks(12).map(position).collect(), triangles.chunks(12).map(triangle).collect()))
}

/// Encodes a scene: the objects, each after its length, then object and transform of each visible instance.
pub(super) fn scene_bytes(scene: &bth::Scene) -> Vec<u8> {
    let mut bytes = u64::from(scene.object_count()).to_le_bytes().to_vec();
    for object in (0..scene.object_count()).map(|object| scene.object(object)) {
        let head = (object.positions.len() as u64).to_le_bytes();
        let object = [&head, object.positions.as_bytes(), object.triangles.as_bytes()].concat();
        bytes.extend_from_slice(&(object.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&object);
    }
    let instances = (0..scene.instance_count()).map(|instance| scene.instance(instance));
    for instance in instances.filter(|instance| instance.visible) {
        bytes.extend_from_slice(&instance.object.to_le_bytes());
        bytes.extend_from_slice(instance.to_world.map(|row| row.map(|x| x as f32)).as_bytes());
    }
    bytes
}

/// Decodes a file of [`scene_bytes`]: the objects, and the object and transform of each instance.
pub(super) fn read_scene(path: &Path) -> Result<(Vec<Triangles>, Vec<u32>, Vec<InstancePlace>)> {
    const BROKEN: &str = "not a file of a scene";
    let bytes = std::fs::read(path)?;
    let mut rest = bytes.as_slice();
    let number = |rest: &mut &[u8]| -> Result<usize> {
        let (head, behind) = rest.split_at_checked(8).context(BROKEN)?;
        *rest = behind;
        Ok(usize::try_from(u64::from_le_bytes(head.try_into()?))?)
    };
    let mut objects = Vec::new();
    for _ in 0..number(&mut rest)? {
        let length = number(&mut rest)?;
        let (object, behind) = rest.split_at_checked(length).context(BROKEN)?;
        objects.push(mesh(object)?);
        rest = behind;
    }
    ensure!(rest.len().is_multiple_of(52), BROKEN);
    let place = |b: &[u8]| {
        let object = u32::read_from_bytes(&b[..4]).expect("chunks of the right size");
        (object, Some(<[[f32; 4]; 3]>::read_from_bytes(&b[4..]).expect("chunks of the right size")))
    };
    let (object_of, places) = rest.chunks(52).map(place).unzip();
    Ok((objects, object_of, places))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_and_triangles_come_back_from_their_files() {
        let scratch = Scratch::new(None).unwrap();
        let ray = Ray { origin: [1.0, 2.0, 3.0], tmin: 0.5, direction: [0.0, 1.0, 0.0], tmax: 9.0 };
        let path = scratch.write("rays", ray_bytes(&[ray, Ray { tmin: 0.0, ..ray }])).unwrap();
        assert_eq!(read_rays(&path).unwrap(), [ray, Ray { tmin: 0.0, ..ray }]);

        let (positions, triangles) = (vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        let mesh = Mesh { positions: positions.clone(), triangles: triangles.clone(), ..Mesh::default() };
        let path = scratch.write("mesh", &mesh_bytes(&mesh)).unwrap();
        assert_eq!(read_mesh(&path).unwrap(), (positions, triangles));
        assert!(read_rays(&path).is_err());
    }
}
