//! Nodes of a glTF scene with their transforms, objects and instances.

use bth_scene::{Node, Transform};

use crate::error::{Error, Result};
use crate::gltf::extensions::INSTANCING;
use crate::gltf::placed_mesh::GltfPart;
use crate::gltf::scene::ImportOptions;
use crate::gltf::scene::importer::Importer;
use crate::gltf::schema::{GltfNode, Instancing, LightReference};
use crate::source::UNSUPPORTED;

impl Importer<'_, '_> {
    /// The root nodes and the name or number of the wanted scene, or else of the default one.
    fn scene(&self, wanted: Option<&str>) -> Result<(Vec<usize>, String)> {
        let scenes = &self.file.document.scenes;
        let index = match wanted {
            Some(name) => {
                let found = scenes.iter().position(|s| s.name == name);
                let number = || name.parse().ok().filter(|n: &usize| *n < scenes.len());
                let names = || scenes.iter().map(|scene| scene.name.as_str());
                Some(found.or_else(number).ok_or_else(|| self.no_such("scenes", names(), name))?)
            }
            None => self.file.document.scene.or((!scenes.is_empty()).then_some(0)),
        };
        let Some(index) = index else {
            return Ok((self.file.document.parentless_nodes(), "all nodes".to_owned()));
        };
        let scene = scenes
            .get(index)
            .ok_or_else(|| self.file.graph_error(format!("scene {index}"), "it does not exist"))?;
        let name = if scene.name.is_empty() { index.to_string() } else { scene.name.clone() };
        Ok((scene.nodes.clone(), name))
    }

    /// Returns the error for a scene or animation that the document does not have.
    pub(super) fn no_such<'n>(&self, what: &str, names: impl Iterator<Item = &'n str>, name: &str) -> Error {
        let names: Vec<_> = names.enumerate().map(|(i, name)| format!("{i} \"{name}\"")).collect();
        let message = format!("expected one of its {what} ({}), found {name}", names.join(", "));
        let hint = "name one of these, or its number";
        self.file.source.error_in_part(UNSUPPORTED, what, message, hint)
    }

    /// Adds the scene's nodes, parents before children, in depth-first order.
    pub(super) fn nodes(&mut self, options: &ImportOptions) -> Result<()> {
        let (roots, name) = self.scene(options.scene.as_deref())?;
        self.report.scene = name;
        let mut stack: Vec<(usize, Option<usize>)> = roots.into_iter().rev().map(|n| (n, None)).collect();
        while let Some((index, parent)) = stack.pop() {
            let part = || format!("node {index}");
            let node = self
                .file
                .document
                .nodes
                .get(index)
                .ok_or_else(|| self.file.graph_error(part(), "it does not exist"))?;
            if self.report.node_rows[index].is_some() {
                let message = "expected a node with one parent, found it twice in the scene";
                return Err(self.file.graph_error(part(), message));
            }
            let row = self.manifest.nodes.len();
            self.report.node_rows[index] = Some(row);
            self.node(index, node, parent)?;
            stack.extend(node.children.iter().rev().map(|&child| (child, Some(row))));
        }
        Ok(())
    }

    /// Adds a node with its object, instances, camera and light.
    fn node(&mut self, index: usize, node: &GltfNode, parent: Option<usize>) -> Result<()> {
        let part = format!("node {index}");
        let row = self.manifest.nodes.len();
        let visible = self.file.is_visible(index, node)?;
        let name = self.names.nodes.unique(&node.name, part.clone());
        let transform = self.transform(node, &part)?;
        self.manifest.nodes.push(Node { name: &name, parent, transform, object: None, group: None, visible });
        if let Some(mesh) = node.mesh {
            self.mesh(index, node, mesh, row, &name)?;
        }
        if let Some(camera) = node.camera {
            self.camera(camera, row, &part)?;
        }
        if let Some(value) = node.extensions.get("KHR_lights_punctual") {
            let reference: LightReference = self.file.typed(value, &part)?;
            self.light(reference.light, row, &part)?;
        }
        Ok(())
    }

    /// Places the mesh of a node.
    fn mesh(&mut self, index: usize, node: &GltfNode, mesh: usize, row: usize, name: &str) -> Result<()> {
        let part = format!("node {index}");
        self.check_mesh(mesh, &part)?;
        let deforms = node.skin.is_some() || self.file.document.has_targets(mesh);
        let object = match deforms {
            true => self.deforming(index, node, mesh, row)?,
            false => self.object(mesh, &part)?,
        };
        let instancing = node.extensions.get(INSTANCING);
        if node.skin.is_some() {
            if instancing.is_some() {
                let what = "its instances are ignored, since its skin places them all at the same place";
                self.ignore(&part, what.to_owned())?;
            }
            match self.manifest.objects[object].source {
                bth_scene::Source::AtRest { .. } => self.place_in_world(row, object),
                _ => self.manifest.nodes.set_shown(row, Some(object), None),
            }
            return Ok(());
        }
        match instancing {
            Some(value) => self.instancing(&self.file.typed(value, &part)?, row, object, name, &part)?,
            None => self.manifest.nodes.set_shown(row, Some(object), None),
        }
        Ok(())
    }

    /// A node's transform, checked to be finite.
    pub(super) fn transform(&self, node: &GltfNode, part: &str) -> Result<Transform> {
        let transform = match &node.matrix {
            Some(m) => Transform::Matrix([0, 1, 2].map(|row| [m[row], m[row + 4], m[row + 8], m[row + 12]])),
            None => {
                let (translation, rotation, scale) = node.parts();
                Transform::Parts { translation, rotation, scale }
            }
        };
        let numbers: Vec<f64> = match transform {
            Transform::Matrix(rows) => rows.as_flattened().to_vec(),
            Transform::Parts { translation, rotation, scale } => {
                [translation.as_slice(), &rotation, &scale].concat()
            }
        };
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(self
                .file
                .graph_error(part, format!("expected a finite transform, found {numbers:?}")));
        }
        Ok(transform)
    }

    /// Refuses meshes that do not exist.
    fn check_mesh(&self, mesh: usize, part: &str) -> Result<()> {
        if mesh < self.file.document.meshes.len() {
            return Ok(());
        }
        let message = format!("expected a mesh below {}, found {mesh}", self.file.document.meshes.len());
        Err(self.file.graph_error(part, message))
    }

    /// The row of the object of a mesh in its own space, which is added at its first use.
    pub(super) fn object(&mut self, mesh: usize, part: &str) -> Result<usize> {
        self.check_mesh(mesh, part)?;
        let key = GltfPart::Mesh(mesh as u32);
        if let Some(row) = self.objects.get(&key) {
            return Ok(*row);
        }
        let source = bth_scene::Source::Model { path: self.path.to_owned(), mesh: Some(mesh as u32) };
        let name = &self.file.document.meshes[mesh].name;
        let row = self.new_object(name, mesh, source);
        self.objects.insert(key, row);
        Ok(row)
    }

    /// Adds a child node for each instance of EXT_mesh_gpu_instancing.
    fn instancing(
        &mut self,
        instancing: &Instancing,
        parent: usize,
        object: usize,
        name: &str,
        part: &str,
    ) -> Result<()> {
        let attribute = |name: &str| instancing.attributes.get(name).copied();
        let vectors = |name: &str| attribute(name).map(|a| self.file.vectors::<3>(a)).transpose();
        let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
        let rotations = attribute("ROTATION").map(|a| self.file.vectors::<4>(a)).transpose()?;
        let lengths = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let mut counts = lengths.into_iter().flatten();
        let Some(count) = counts.next().filter(|count| *count > 0) else {
            let what = "EXT_mesh_gpu_instancing without rows of TRANSLATION, ROTATION or SCALE has no instances: its mesh is left out";
            return self.ignore(part, what.to_owned());
        };
        if counts.any(|n| n != count) {
            let message =
                format!("expected equally many rows of each attribute of instances, found {lengths:?}");
            return Err(self.file.graph_error(part, message));
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
                    return Err(self.file.graph_error(part, message));
                }
            }
            let name = self.names.nodes.unique(&format!("{name}/{i}"), String::new());
            let parent = Some(parent);
            self.manifest.nodes.push(Node {
                name: &name,
                parent,
                transform,
                object: Some(object),
                group: None,
                visible: true,
            });
        }
        Ok(())
    }
}
