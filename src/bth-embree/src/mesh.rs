//! The triangles of a scene: of all its triangle meshes, quads and grids, as one object.
#![allow(unsafe_code)] // Reads buffers of the program.

use crate::abi::*;
use crate::device::Device;
use crate::error::{Result, operation};
use crate::geometry::Geometry;
use crate::handles::Shared;
use bth_cache::Pin;
use bth_compile::cached::Cache;
use bth_compile::memory::{self, PositionRows, TriangleMesh};
use bth_compile::pipeline::{self, CompileOptions, Structure};
use bth_compile::{Monitor, bvh};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Positions from this magnitude on are not hit, nor are those that are not finite: programs rely
/// on it to hide primitives (`FLT_LARGE` of Embree).
const TOO_LARGE: f32 = 1.844e18;

/// Triangles that a thread gathers at a time.
const CHUNK: usize = 1 << 12;

/// What a part of the triangles was made from.
#[derive(Debug)]
enum Layout {
    Triangles,
    /// Two triangles each: (v0, v1, v3) and (v2, v3, v1).
    Quads,
    /// Two triangles for each cell of each grid.
    Grids(Vec<GridRow>),
}

/// Where a grid begins.
#[derive(Clone, Copy, Debug)]
struct GridRow {
    /// Its first triangle in the part.
    first: u32,
    width: u32,
    height: u32,
}

/// The triangles of one geometry.
#[derive(Debug)]
pub(crate) struct Part {
    /// Its first triangle in the mesh.
    first: u32,
    /// Id of the geometry in its scene.
    pub(crate) id: u32,
    pub(crate) mask: u32,
    pub(crate) geometry: Arc<Shared<Geometry>>,
    layout: Layout,
}

/// A hit on the surface as programs see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface<'a> {
    pub(crate) part: &'a Part,
    pub(crate) primitive: u32,
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) normal: [f32; 3],
}

/// What a mesh was made from, with ids and numbers of commits: it is made again only if this
/// changes. The geometries are held, so that none that comes later has the address of one of them.
pub(crate) type Key = Vec<(u32, Arc<Shared<Geometry>>, u64)>;

/// The triangles of a scene.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    /// `None` without triangles that can be hit.
    pub(crate) scene: Option<bth::Scene>,
    /// The file in the cache that the scene is mapped from.
    _stored: Option<Pin>,
    parts: Vec<Part>,
    /// By triangle, in the space of the object.
    normals: Vec<[f32; 3]>,
    bounds: Option<Bounds>,
    key: Key,
    /// True if the scene of these triangles allows filters in the arguments of queries.
    pub(crate) allows_argument_filter: bool,
}

/// How a mesh is built.
pub(crate) struct Build<'a> {
    pub(crate) quality: bvh::Quality,
    pub(crate) allows_argument_filter: bool,
    pub(crate) device: &'a Device,
    pub(crate) monitor: &'a (dyn Monitor + 'a),
}

/// The geometries of a mesh, by id.
pub(crate) type Sources = Vec<(u32, Arc<Shared<Geometry>>)>;

/// The key of a mesh of these geometries.
fn key(sources: &Sources) -> Key {
    let version = |geometry: &Shared<Geometry>| geometry.state().version;
    sources.iter().map(|(id, geometry)| (*id, geometry.clone(), version(geometry))).collect()
}

impl Mesh {
    /// Builds the mesh of geometries. Also returns true if an earlier commit had built it.
    ///
    /// # Errors
    /// If there are too many triangles, the build fails, or the program cancels it.
    pub(crate) fn build(sources: &Sources, build: &Build<'_>) -> Result<(Mesh, bool)> {
        let key = key(sources);
        let mut gathered = Gathered::default();
        for (id, geometry) in sources {
            gathered.add(*id, geometry)?;
        }
        let Gathered { parts, positions, triangles, normals, bounds, has_area } = gathered;
        if !has_area {
            return Ok((Mesh { parts, normals, key, ..Mesh::default() }, false));
        }
        let mut options =
            CompileOptions { structure: Structure::Bvh, geometry: false, ..CompileOptions::default() };
        options.bvh.quality = build.quality;
        let mesh = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
        let (scene, stored, was_cached) = open(mesh, &options, build)?;
        let allows_argument_filter = build.allows_argument_filter;
        let (scene, bounds) = (Some(scene), Some(bounds));
        let built = Mesh { scene, _stored: stored, parts, normals, bounds, key, allows_argument_filter };
        Ok((built, was_cached))
    }

    /// Returns true if the mesh was made from these geometries as they were last committed.
    pub(crate) fn is_of(&self, sources: &Sources) -> bool {
        self.key.len() == sources.len()
            && self.key.iter().zip(sources).all(|((id, of, version), (new_id, new))| {
                id == new_id && Arc::ptr_eq(of, new) && *version == new.state().version
            })
    }

    pub(crate) fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The box of all triangles, exactly.
    pub(crate) fn bounds(&self) -> Bounds {
        self.bounds.unwrap_or(Bounds::EMPTY)
    }

    /// The geometry of a triangle.
    #[inline]
    pub(crate) fn part(&self, triangle: u32) -> &Part {
        match &self.parts[..] {
            [part] => part,
            parts => &parts[parts.partition_point(|part| part.first <= triangle) - 1],
        }
    }

    /// A point of a triangle as programs see it.
    #[inline]
    pub(crate) fn surface(&self, triangle: u32, u: f32, v: f32) -> Surface<'_> {
        let part = self.part(triangle);
        let (primitive, u, v) = part.locate(triangle - part.first, u, v);
        Surface { part, primitive, u, v, normal: self.normals[triangle as usize] }
    }
}

impl Part {
    /// The primitive of a triangle of this part, with the coordinates there.
    #[inline]
    fn locate(&self, triangle: u32, u: f32, v: f32) -> (u32, f32, f32) {
        // Coordinates in a cell, from those in the first or the second triangle of it.
        let in_cell = || if triangle.is_multiple_of(2) { (u, v) } else { (1.0 - u, 1.0 - v) };
        match &self.layout {
            Layout::Triangles => (triangle, u, v),
            Layout::Quads => {
                let (u, v) = in_cell();
                (triangle / 2, u, v)
            }
            Layout::Grids(rows) => {
                let grid = rows.partition_point(|row| row.first <= triangle) - 1;
                let GridRow { first, width, height } = rows[grid];
                let cell = (triangle - first) / 2;
                let (columns, lines) = (width - 1, height - 1);
                let (u, v) = in_cell();
                let u = ((cell % columns) as f32 + u) / columns as f32;
                let v = ((cell / columns) as f32 + v) / lines as f32;
                (grid as u32, u, v)
            }
        }
    }
}

/// Compiles triangles and opens the result: with a cache by mapping what it holds, which is kept
/// from eviction. Also returns true if an earlier commit had built it.
fn open(
    mesh: TriangleMesh<'_>,
    options: &CompileOptions,
    build: &Build<'_>,
) -> Result<(bth::Scene, Option<Pin>, bool)> {
    let Some(store) = &build.device.cache else {
        return Ok((memory::open(mesh, options, build.monitor)?, None, false));
    };
    let cache = Cache::new(store, "bth-embree");
    let compiled = pipeline::compile_cached(mesh, options, &cache, &|_| false, build.monitor)?;
    let was_cached = compiled.built.is_none();
    if let Some(pin) = compiled.record.as_ref().and_then(|record| store.pin(record)) {
        // SAFETY: files in a cache are written once, under the name of their hash, which was
        // checked; `pin` keeps this one. The compiler wrote the contents.
        return Ok((unsafe { bth::map(&pin.path)? }, Some(pin), was_cached));
    }
    // The cache could not keep it, or has lost it meanwhile.
    let scene = match compiled.content {
        Some(content) => bth::from_bytes(&content.bytes()?)?,
        None => memory::open(mesh, options, build.monitor)?,
    };
    Ok((scene, None, was_cached))
}

/// The triangles of some geometries.
#[derive(Default)]
struct Gathered {
    parts: Vec<Part>,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<[f32; 3]>,
    bounds: Bounds,
    /// True if some triangle can be hit.
    has_area: bool,
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds::EMPTY
    }
}

impl Gathered {
    /// Adds a geometry.
    fn add(&mut self, id: u32, geometry: &Arc<Shared<Geometry>>) -> Result<()> {
        let state = geometry.state();
        let kind = if geometry.kind == GRID { BUFFER_GRID } else { BUFFER_INDEX };
        let (Some(vertices), Some(items)) = (state.view(BUFFER_VERTEX, 0), state.view(kind, 0)) else {
            return Ok(());
        };
        let (first, base) = (self.triangles.len(), self.positions.len());
        let (too_many, limit) = ("a scene can have at most 2^31 triangles and vertices", 1 << 31);
        if base + vertices.count > limit {
            return operation(too_many);
        }
        let Gathered { positions, triangles: corners, .. } = self;
        positions.reserve(vertices.count);
        for row in 0..vertices.count {
            // SAFETY: the row exists, and vertices are three floats.
            positions.push(unsafe { vertices.floats::<3>(row) });
        }
        let layout = match geometry.kind {
            TRIANGLE => {
                corners.reserve(items.count);
                for row in 0..items.count {
                    // SAFETY: the row exists, and triangles are three indices.
                    corners.push(unsafe { items.words::<3>(row) });
                }
                Layout::Triangles
            }
            QUAD => {
                corners.reserve(2 * items.count);
                for row in 0..items.count {
                    // SAFETY: the row exists, and quads are four indices.
                    corners.extend(halves(unsafe { items.words::<4>(row) }, vertices.count, positions, base));
                }
                Layout::Quads
            }
            _ => {
                let mut rows = Vec::with_capacity(items.count);
                for row in 0..items.count {
                    // SAFETY: the row exists, and grids are three words.
                    let [start, stride, size] = unsafe { items.words::<3>(row) };
                    let (width, height) = (size & 0xFFFF, size >> 16);
                    rows.push(GridRow { first: (corners.len() - first) as u32, width, height });
                    for y in 0..height.saturating_sub(1) {
                        for x in 0..width.saturating_sub(1) {
                            let at = |x: u32, y: u32| {
                                start.saturating_add(stride.saturating_mul(y)).saturating_add(x)
                            };
                            let quad = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                            corners.extend(halves(quad, vertices.count, positions, base));
                        }
                    }
                    if corners.len() > limit {
                        return operation(too_many);
                    }
                }
                Layout::Grids(rows)
            }
        };
        if corners.len() > limit {
            return operation(too_many);
        }
        let positions = &positions[base..];
        self.normals.resize(corners.len(), [0.0; 3]);
        let rows = corners[first..].par_chunks_mut(CHUNK).zip(self.normals[first..].par_chunks_mut(CHUNK));
        let join = |mut a: Bounds, b: Bounds| {
            a.join(&b);
            a
        };
        let bounds = rows.map(|(triangles, normals)| {
            let mut bounds = Bounds::EMPTY;
            for (triangle, of_triangle) in triangles.iter_mut().zip(normals) {
                // What cannot be hit keeps its number, as a triangle without area.
                *triangle = match usable(*triangle, positions) {
                    Some(points) => {
                        points.iter().for_each(|point| bounds.add(*point));
                        *of_triangle = normal(points);
                        triangle.map(|row| row + base as u32)
                    }
                    None => [u32::MAX; 3],
                };
            }
            bounds
        });
        let bounds = bounds.reduce(Bounds::default, join);
        self.has_area |= bounds.lower[0] <= bounds.upper[0];
        self.bounds.join(&bounds);
        self.fill_unusable(first);
        self.parts.push(Part {
            first: first as u32,
            id,
            mask: geometry.mask.load(Relaxed),
            geometry: geometry.clone(),
            layout,
        });
        Ok(())
    }

    /// Gives triangles that cannot be hit a corner that exists, and none without one.
    fn fill_unusable(&mut self, first: usize) {
        let all = &mut self.triangles;
        let anchor = all.iter().find(|triangle| triangle[0] != u32::MAX).map(|triangle| triangle[0]);
        let Some(anchor) = anchor else { return };
        // Earlier geometries may have had none.
        let start = if all.first().is_some_and(|triangle| triangle[0] == u32::MAX) { 0 } else { first };
        for triangle in &mut all[start..] {
            if triangle[0] == u32::MAX {
                *triangle = [anchor; 3];
            }
        }
    }
}

/// The two triangles of a quad; both cannot be hit if one of its corners is not usable.
fn halves([a, b, c, d]: [u32; 4], count: usize, positions: &[[f32; 3]], base: usize) -> [[u32; 3]; 2] {
    let is_usable = |row: u32| (row as usize) < count && is_in_range(positions[base + row as usize]);
    match [a, b, c, d].into_iter().all(is_usable) {
        true => [[a, b, d], [c, d, b]],
        false => [[u32::MAX; 3]; 2],
    }
}

fn is_in_range(point: [f32; 3]) -> bool {
    point.iter().all(|x| x.abs() < TOO_LARGE)
}

/// The corners of a triangle, if they exist and are in range.
fn usable(triangle: [u32; 3], positions: &[[f32; 3]]) -> Option<[[f32; 3]; 3]> {
    let exists = triangle.iter().all(|row| (*row as usize) < positions.len());
    let points = exists.then(|| triangle.map(|row| positions[row as usize]))?;
    points.iter().all(|point| is_in_range(*point)).then_some(points)
}

/// (b - a) x (c - a), in f64 and rounded once.
fn normal([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = [a, b, c].map(|point| point.map(f64::from));
    let (p, q): ([f64; 3], [f64; 3]) =
        (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]].map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_start_maps_what_the_first_has_built() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let text = format!("bth_cache={}", folder.path().display());
        let positions: Vec<[f32; 3]> =
            (0..50).map(|i| [i as f32, (i * i % 7) as f32, (i % 3) as f32]).collect();
        let triangles: Vec<[u32; 3]> = (0..48).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
        let ray = bth::rays::Ray::new([1.0, 1.625, 9.0], [0.0, 0.0, -1.0]);
        let mut hits = Vec::new();
        for start in 0..2 {
            let device = Device::without_fallback(&text).expect("a device");
            let (quality, monitor) = (bvh::Quality::Fast, &bth_compile::Silent);
            let build = Build { quality, allows_argument_filter: false, device: &device, monitor };
            let (scene, stored, was_cached) =
                open(mesh, &CompileOptions::default(), &build).expect("a scene");
            assert_eq!((was_cached, stored.is_some()), (start == 1, true));
            hits.push(scene.nearest(&ray).expect("a hit"));
        }
        assert_eq!(hits[0], hits[1]);
    }
}
