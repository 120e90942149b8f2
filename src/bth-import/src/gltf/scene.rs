//! A manifest from a glTF scene: nodes, animations, cameras, lights, instancing.

use super::scene_tracks::{self, Chosen};
use crate::error::{Error, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::buffer::Buffers;
use crate::gltf::json::{self as json, Root};
use crate::gltf::{self, GRAPH, SCENE_EXTENSIONS, SUPPORTED};
use crate::monitor::Monitor;
use crate::source::{MALFORMED, Source, UNSUPPORTED};
use bth_scene::{Camera, Frames, Lens, Light, LightKind, Manifest, Node, Object, Transform};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// What of a glTF file becomes a manifest.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Scene by name or number; by default the document's.
    pub scene: Option<String>,
    /// Animations.
    pub animation: Chosen,
    /// Frames per second.
    pub rate: f64,
    /// Whether what would be ignored with a warning is an error: skins, morph targets, animations of other things.
    pub strict: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self { scene: None, animation: Chosen::All, rate: Frames::default().rate, strict: false }
    }
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Name or number of the scene.
    pub scene: String,
    /// Nodes of the manifest.
    pub nodes: u64,
    /// Nodes at which an object stands.
    pub instances: u64,
    /// Meshes that are used.
    pub objects: u64,
    /// Names or numbers of the animations.
    pub animations: Vec<String>,
    /// Animated properties of nodes.
    pub tracks: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights.
    pub lights: u64,
    /// What was ignored.
    pub ignored: Vec<String>,
    /// Row of the manifest's nodes for each node of the document.
    #[serde(skip)]
    pub node_rows: Vec<Option<usize>>,
}

/// Reads the scene of a glTF or GLB file. `name` is the file's path as it is to stand in the manifest.
///
/// # Errors
/// `BTH-O001` when it cannot be read, `BTH-I…` with the place when it cannot be used; with `strict` `BTH-I015` for
/// what would be ignored.
pub fn import(
    path: &Path,
    name: &str,
    options: &ImportOptions,
    monitor: &dyn Monitor,
) -> Result<(Manifest, ImportReport)> {
    let data = crate::read_file(path)?;
    monitor.stage("import", Some(data.len() as u64));
    let source = Source::new(path, &data, monitor);
    // Pointers animate what tracks do not; required ones cannot be ignored.
    let known = SUPPORTED.iter().filter(|s| **s != "KHR_animation_pointer");
    let known: Vec<&str> = known.chain(&SCENE_EXTENSIONS).copied().collect();
    let (root, binary) = gltf::document(&source, &known)?;
    let accessors = Accessors { source: &source, root: &root, buffers: Buffers::new(&source, &root, binary) };
    let mut importer = Importer {
        source: &source,
        root: &root,
        accessors,
        strict: options.strict,
        file: name,
        manifest: Manifest::default(),
        report: ImportReport { node_rows: vec![None; root.nodes.len()], ..ImportReport::default() },
        names: HashSet::new(),
        object_names: HashSet::new(),
        objects: HashMap::new(),
    };
    importer.nodes(options)?;
    let (tracks, last) = importer.tracks(options)?;
    importer.manifest.tracks = tracks;
    let last = (last * options.rate).ceil().clamp(0.0, f64::from(1 << 24)) as i32;
    importer.manifest.frames = Frames { first: 0, last, rate: options.rate };
    source.progress(data.len())?;
    Ok(importer.finish())
}

pub(super) struct Importer<'a> {
    pub(super) source: &'a Source<'a>,
    pub(super) root: &'a Root,
    pub(super) accessors: Accessors<'a>,
    strict: bool,
    /// As it stands in the manifest.
    file: &'a str,
    pub(super) manifest: Manifest,
    pub(super) report: ImportReport,
    /// Names of nodes so far.
    names: HashSet<String>,
    object_names: HashSet<String>,
    /// Row of the object of each mesh.
    objects: HashMap<usize, usize>,
}

impl Importer<'_> {
    /// Something that is not read: an error when strict, else a warning.
    pub(super) fn ignore(&mut self, part: &str, what: String) -> Result<()> {
        if self.strict {
            let hint = "leave out --strict to go on without it";
            return Err(self.source.error_in_part("BTH-I015", part, what, hint));
        }
        let message = format!("{part}: {what}");
        if !self.report.ignored.contains(&message) {
            self.source.monitor.warn(&message);
            self.report.ignored.push(message);
        }
        Ok(())
    }

    pub(super) fn error(&self, part: impl Into<String>, message: impl Into<String>) -> Error {
        self.source.error_in_part(GRAPH, part, message, "export the model again")
    }

    /// A part of the document as a structure.
    pub(super) fn typed<T: DeserializeOwned>(&self, value: &serde_json::Value, part: &str) -> Result<T> {
        T::deserialize(value).map_err(|e| {
            let message = format!("expected what glTF says, found: {e}");
            self.source.error_in_part(MALFORMED, part, message, "export the model again")
        })
    }

    /// A name that no node has yet.
    fn node_name(&mut self, given: &str, fallback: String) -> String {
        unique(&mut self.names, given, fallback)
    }

    fn scene(&self, wanted: Option<&str>) -> Result<(Vec<usize>, String)> {
        let scenes = &self.root.scenes;
        let index = match wanted {
            Some(name) => {
                let found = scenes.iter().position(|s| s.name == name);
                let number = || name.parse().ok().filter(|n: &usize| *n < scenes.len());
                Some(found.or_else(number).ok_or_else(|| {
                    let names: Vec<_> =
                        scenes.iter().enumerate().map(|(i, s)| format!("{i} \"{}\"", s.name)).collect();
                    let message = format!("expected one of its scenes ({}), found {name}", names.join(", "));
                    self.source.error_in_part(
                        UNSUPPORTED,
                        "scenes",
                        message,
                        "name one of these, or its number",
                    )
                })?)
            }
            None => self.root.scene.or((!scenes.is_empty()).then_some(0)),
        };
        let Some(index) = index else {
            let mut is_child = vec![false; self.root.nodes.len()];
            for &child in self.root.nodes.iter().flat_map(|node| &node.children) {
                is_child.get_mut(child).into_iter().for_each(|c| *c = true);
            }
            let roots = (0..is_child.len()).filter(|node| !is_child[*node]).collect();
            return Ok((roots, "all nodes".to_owned()));
        };
        let scene =
            scenes.get(index).ok_or_else(|| self.error(format!("scene {index}"), "it does not exist"))?;
        let name = if scene.name.is_empty() { index.to_string() } else { scene.name.clone() };
        Ok((scene.nodes.clone(), name))
    }

    /// The scene's nodes, parents before children, in depth-first order.
    fn nodes(&mut self, options: &ImportOptions) -> Result<()> {
        let (roots, name) = self.scene(options.scene.as_deref())?;
        self.report.scene = name;
        let mut stack: Vec<(usize, Option<usize>)> = roots.into_iter().rev().map(|n| (n, None)).collect();
        while let Some((index, parent)) = stack.pop() {
            let part = || format!("node {index}");
            let node = self.root.nodes.get(index).ok_or_else(|| self.error(part(), "it does not exist"))?;
            if self.report.node_rows[index].is_some() {
                let message = "expected a node with one parent, found it twice in the scene";
                return Err(self.error(part(), message));
            }
            let row = self.manifest.nodes.len();
            self.report.node_rows[index] = Some(row);
            self.node(index, node, parent)?;
            stack.extend(node.children.iter().rev().map(|&child| (child, Some(row))));
        }
        Ok(())
    }

    fn node(&mut self, index: usize, node: &json::Node, parent: Option<usize>) -> Result<()> {
        let part = format!("node {index}");
        let row = self.manifest.nodes.len();
        let visible = match node.extensions.get("KHR_node_visibility") {
            Some(value) => self.typed::<json::Visibility>(value, &part)?.visible.unwrap_or(true),
            None => true,
        };
        let name = self.node_name(&node.name, part.clone());
        let transform = self.transform(node, &part)?;
        self.manifest.nodes.push(Node { name: name.clone(), parent, transform, object: None, visible });
        if let Some(mesh) = node.mesh {
            let object = self.object(mesh, &part)?;
            if node.skin.is_some() {
                self.ignore(&part, "its skin is ignored: the mesh stays in its bind pose".to_owned())?;
            }
            match node.extensions.get("EXT_mesh_gpu_instancing") {
                Some(value) => self.instancing(&self.typed(value, &part)?, row, object, &name, &part)?,
                None => self.manifest.nodes[row].object = Some(object),
            }
        }
        if let Some(camera) = node.camera {
            self.camera(camera, row, &part)?;
        }
        if let Some(value) = node.extensions.get("KHR_lights_punctual") {
            let reference: json::LightReference = self.typed(value, &part)?;
            self.light(reference.light, row, &part)?;
        }
        Ok(())
    }

    fn transform(&self, node: &json::Node, part: &str) -> Result<Transform> {
        let transform = match node.matrix {
            Some(m) => Transform::Matrix([0, 1, 2].map(|row| [m[row], m[row + 4], m[row + 8], m[row + 12]])),
            None => Transform::Parts {
                translation: node.translation.unwrap_or([0.0; 3]),
                rotation: node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
                scale: node.scale.unwrap_or([1.0; 3]),
            },
        };
        let numbers: Vec<f64> = match transform {
            Transform::Matrix(rows) => rows.as_flattened().to_vec(),
            Transform::Parts { translation, rotation, scale } => {
                if rotation == [0.0; 4] {
                    return Err(self.error(part, "expected a rotation that is not zero"));
                }
                [translation.as_slice(), &rotation, &scale].concat()
            }
        };
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(self.error(part, format!("expected a finite transform, found {numbers:?}")));
        }
        Ok(transform)
    }

    /// The object of a mesh.
    fn object(&mut self, mesh: usize, part: &str) -> Result<usize> {
        if let Some(row) = self.objects.get(&mesh) {
            return Ok(*row);
        }
        let Some(found) = self.root.meshes.get(mesh) else {
            let message = format!("expected a mesh below {}, found {mesh}", self.root.meshes.len());
            return Err(self.error(part, message));
        };
        if gltf::has_targets(self.root, mesh) {
            let part = format!("mesh {mesh}");
            self.ignore(&part, "its morph targets are ignored: it stays in its base shape".to_owned())?;
        }
        let row = self.manifest.objects.len();
        let name = unique(&mut self.object_names, &found.name, format!("mesh {mesh}"));
        let source = bth_scene::Source::Model { path: self.file.to_owned(), mesh: Some(mesh as u32) };
        self.manifest.objects.push(Object { name, source });
        self.objects.insert(mesh, row);
        Ok(row)
    }

    /// A child node for each instance of EXT_mesh_gpu_instancing.
    fn instancing(
        &mut self,
        instancing: &json::Instancing,
        parent: usize,
        object: usize,
        name: &str,
        part: &str,
    ) -> Result<()> {
        let attribute = |name: &str| instancing.attributes.get(name).copied();
        let vectors = |name: &str| attribute(name).map(|a| self.accessors.vectors::<3>(a)).transpose();
        let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
        let rotations = attribute("ROTATION").map(|a| self.accessors.vectors::<4>(a)).transpose()?;
        let lengths = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let mut counts = lengths.into_iter().flatten();
        let count = counts.next().unwrap_or(0);
        if counts.any(|n| n != count) {
            let message =
                format!("expected equally many rows of each attribute of instances, found {lengths:?}");
            return Err(self.error(part, message));
        }
        for i in 0..count {
            let wide = |v: [f32; 3]| v.map(f64::from);
            let transform = Transform::Parts {
                translation: translations.as_ref().map_or([0.0; 3], |t| wide(t[i])),
                rotation: rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i].map(f64::from)),
                scale: scales.as_ref().map_or([1.0; 3], |s| wide(s[i])),
            };
            if let Transform::Parts { translation, rotation, scale } = transform {
                let finite = [&translation[..], &rotation, &scale].concat().iter().all(|x| x.is_finite());
                if !finite || rotation == [0.0; 4] {
                    let message = format!("instance {i}: expected a finite transform with a rotation");
                    return Err(self.error(part, message));
                }
            }
            let name = self.node_name(&format!("{name}/{i}"), String::new());
            let parent = Some(parent);
            self.manifest.nodes.push(Node { name, parent, transform, object: Some(object), visible: true });
        }
        Ok(())
    }

    fn camera(&mut self, index: usize, node: usize, part: &str) -> Result<()> {
        let value = self.root.cameras.get(index);
        let value = value.ok_or_else(|| self.error(part, format!("its camera {index} does not exist")))?;
        let camera_part = format!("camera {index}");
        let camera: json::Camera = self.typed(value, &camera_part)?;
        let (lens, aspect, near, far) = match (&camera.perspective, &camera.orthographic) {
            (Some(p), _) => (Lens::Perspective(p.yfov.to_degrees()), p.aspect_ratio, p.znear, p.zfar),
            (None, Some(o)) => {
                (Lens::Orthographic(2.0 * o.ymag), Some(o.xmag / o.ymag), o.znear, Some(o.zfar))
            }
            (None, None) => return Err(self.error(camera_part, "it has no projection")),
        };
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let lens_good = match lens {
            Lens::Perspective(fov) => positive(fov) && fov < 180.0,
            Lens::Orthographic(height) => positive(height),
        };
        let depths = near.is_finite() && near >= 0.0 && far.is_none_or(|far| positive(far) && far > near);
        if !(lens_good && depths && aspect.is_none_or(positive)) {
            let message = "expected a field of view or height above 0, and znear below zfar";
            return Err(self.error(camera_part, message));
        }
        let mut names = self.manifest.cameras.iter().map(|c| c.name.clone()).collect();
        let given = if camera.name.is_empty() { self.manifest.nodes[node].name.clone() } else { camera.name };
        let name = unique(&mut names, &given, camera_part);
        self.manifest.cameras.push(Camera { name, node, lens, aspect, near: Some(near), far });
        self.manifest.camera = Some(0);
        Ok(())
    }

    fn light(&mut self, index: usize, node: usize, part: &str) -> Result<()> {
        let lights: json::Lights = match self.root.extensions.get("KHR_lights_punctual") {
            Some(value) => self.typed(value, "KHR_lights_punctual")?,
            None => json::Lights::default(),
        };
        let light = lights.lights.into_iter().nth(index);
        let light = light.ok_or_else(|| self.error(part, format!("its light {index} does not exist")))?;
        let light_part = format!("light {index}");
        let kind = match light.kind.as_str() {
            "directional" => LightKind::Directional,
            "point" => LightKind::Point,
            "spot" => LightKind::Spot {
                inner: light.spot.inner_cone_angle.unwrap_or(0.0).to_degrees(),
                outer: light.spot.outer_cone_angle.unwrap_or(std::f64::consts::FRAC_PI_4).to_degrees(),
            },
            other => {
                return self.ignore(&light_part, format!("lights of kind \"{other}\" are ignored"));
            }
        };
        let (color, intensity) = (light.color.unwrap_or([1.0; 3]), light.intensity.unwrap_or(1.0));
        let from_zero = |x: f64| x.is_finite() && x >= 0.0;
        let cone = match kind {
            LightKind::Spot { inner, outer } => from_zero(inner) && inner < outer && outer <= 90.0,
            _ => true,
        };
        let range = light.range.is_none_or(|r| from_zero(r) && r > 0.0);
        if !(cone && range && color.iter().chain([&intensity]).all(|x| from_zero(*x))) {
            let message = "expected a color, intensity, range and cone that glTF allows";
            return Err(self.error(light_part, message));
        }
        let mut names = self.manifest.lights.iter().map(|l| l.name.clone()).collect();
        let name = unique(&mut names, &light.name, light_part);
        self.manifest.lights.push(Light { name, node, kind, color, intensity, range: light.range });
        Ok(())
    }

    fn tracks(&mut self, options: &ImportOptions) -> Result<(Vec<bth_scene::Track>, f64)> {
        scene_tracks::read(self, &options.animation)
    }

    fn finish(self) -> (Manifest, ImportReport) {
        let manifest = self.manifest;
        let report = ImportReport {
            nodes: manifest.nodes.len() as u64,
            instances: manifest.nodes.iter().filter(|n| n.object.is_some()).count() as u64,
            objects: manifest.objects.len() as u64,
            tracks: manifest.tracks.len() as u64,
            cameras: manifest.cameras.len() as u64,
            lights: manifest.lights.len() as u64,
            ..self.report
        };
        (manifest, report)
    }
}

/// A name that is not among `names` yet, without control characters; added to them.
fn unique(names: &mut HashSet<String>, given: &str, fallback: String) -> String {
    let base: String = given.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let base = if base.is_empty() { fallback } else { base };
    let mut name = base.clone();
    let mut number = 2;
    while !names.insert(name.clone()) {
        name = format!("{base} {number}");
        number += 1;
    }
    name
}
