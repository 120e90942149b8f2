//! Reads a manifest strictly.

use crate::error::{Error, Result, code};
use crate::groups::NodeGroups;
use crate::joint_set::JointSet;
use crate::limits::MAX_MANIFEST;
use crate::model::*;
use crate::names::Names;
use crate::node_tables::NodeTables;
use crate::nodes::{Node, Nodes};
use crate::read_deformers::{DEFORMER_KEYS, SKIN_KEYS, deformers, skin};
use crate::read_material::{color, material};
use crate::read_path::path;
use crate::read_sequence::{OBJECT_KEYS, index, sequence, vertex_cache};
use crate::read_tracks::{TRACK_KEYS, tracks};
use crate::read_transform::transform;
use crate::segments::Segments;
use crate::table::{Document, Table, Value};
use std::io::Read;
use std::path::Path;

pub(crate) const SCENE_KEYS: &[&str] =
    &["version", "camera", "frames", "objects", "nodes", "cameras", "lights", "skins", "deformers", "tracks"];
pub(crate) const FRAMES_KEYS: &[&str] = &["first", "last", "rate"];
pub(crate) const CAMERA_KEYS: &[&str] = &["name", "node", "fov", "height", "aspect", "near", "far"];
pub(crate) const LIGHT_KEYS: &[&str] =
    &["name", "node", "kind", "color", "intensity", "range", "inner", "outer"];

/// Max magnitude of a frame number: their times are exact enough at any rate.
const FRAME_LIMIT: i64 = 1 << 24;

/// Reads a manifest file.
///
/// # Errors
/// [`code::READ`] when it cannot be read, else the errors of [`parse`].
pub fn read(path: &Path) -> Result<Manifest> {
    let cannot =
        |e: std::io::Error| failed(path, format!("cannot read: {e}"), "check the path and its permissions");
    let file = bth_files::regular_file(path).and_then(|_| std::fs::File::open(path)).map_err(cannot)?;
    let mut bytes = Vec::new();
    // Reading one byte more than allowed detects longer files without trusting the size that the
    // system reports.
    file.take(MAX_MANIFEST + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > MAX_MANIFEST {
        return Err(too_long(path));
    }
    let text = String::from_utf8(bytes).map_err(|e| not_utf8(path, &e))?;
    parse(&text, path)
}

/// The first byte of a file that is not UTF-8, by its place.
fn not_utf8(path: &Path, error: &std::string::FromUtf8Error) -> Error {
    let (before, wrong) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
    let text = std::str::from_utf8(before).unwrap_or_default();
    let message = format!("expected UTF-8, found the byte 0x{:02x}", wrong.first().unwrap_or(&0));
    Document { path, text, pieces: &[] }.error(
        text.len()..text.len(),
        code::SYNTAX,
        message,
        "save the manifest as UTF-8",
    )
}

/// Reads the text of a manifest; `path` is for messages.
///
/// # Errors
/// One of [`code`], with line and column.
pub fn parse(text: &str, path: &Path) -> Result<Manifest> {
    if text.len() as u64 > MAX_MANIFEST {
        return Err(too_long(path));
    }
    let segments = Segments::of(text);
    let doc = Document { path, text, pieces: &segments.pieces };
    let root = doc.parse(&segments.rest)?;
    let scene = Table::new(doc, root.get_ref(), 0..0, SCENE_KEYS)?;
    check_version(&scene.need("version")?)?;

    let objects = scene.tables("objects", OBJECT_KEYS)?;
    let nodes = NodeTables::new(&scene, doc, &segments.nodes)?;
    let cameras = scene.tables("cameras", CAMERA_KEYS)?;
    let lights = scene.tables("lights", LIGHT_KEYS)?;
    let object_names = Names::collect("object", &objects)?;
    let node_names = nodes.names()?;
    let camera_names = Names::collect("camera", &cameras)?;
    Names::collect("light", &lights)?;

    let frames = scene.get("frames").map(|v| frames(&v)).transpose()?.unwrap_or_default();
    let camera = scene.get("camera").map(|v| camera_names.row(&v)).transpose()?;
    let mut read_nodes = Nodes::with_capacity(nodes.len());
    for row in 0..nodes.len() {
        nodes.with(row, |table| node(table, &node_names, &object_names, &mut read_nodes))?;
    }
    check_cycles(&nodes, &read_nodes)?;
    let skins = scene.tables("skins", SKIN_KEYS)?;
    let skin_names = Names::collect("skin", &skins)?;
    let deformer_tables = scene.tables("deformers", DEFORMER_KEYS)?;
    let deformers = deformers(&deformer_tables, &node_names, &object_names, &skin_names)?;
    let tracks = tracks(&scene.tables("tracks", TRACK_KEYS)?, &node_names, &read_nodes, &deformers)?;
    if let Some(groups) = node_groups(&nodes, &read_nodes)? {
        let skinned: Vec<_> = deformers.iter().filter(|of| of.skin.is_some()).map(|of| of.object).collect();
        let is_skinned = |node: Node<'_>| node.object.is_some_and(|object| skinned.contains(&object));
        let is_wrong = |row: &usize| groups.is_in_group(*row) && is_skinned(read_nodes.get(*row));
        if let Some(row) = (0..nodes.len()).find(is_wrong) {
            return nodes.with(row, |table| Err(in_group(&table.need("object")?, "an object with a skin")));
        }
        let others = [("a camera", &cameras), ("a light", &lights), ("a deformer", &deformer_tables)];
        for (what, table) in others.iter().flat_map(|(what, of)| of.iter().map(move |table| (what, table))) {
            let node = table.need("node")?;
            if groups.is_in_group(node_names.row(&node)?) {
                return Err(in_group(&node, what));
            }
        }
    }
    Ok(Manifest {
        frames,
        camera,
        objects: objects.iter().map(object).collect::<Result<_>>()?,
        nodes: read_nodes,
        cameras: cameras.iter().map(|t| self::camera(t, &node_names)).collect::<Result<_>>()?,
        lights: lights.iter().map(|t| light(t, &node_names)).collect::<Result<_>>()?,
        skins: skins.iter().map(|t| skin(t, &node_names)).collect::<Result<_>>()?,
        deformers,
        tracks,
    })
}

/// The error for a manifest that is too long.
fn too_long(path: &Path) -> Error {
    let message = format!("expected a manifest of at most {MAX_MANIFEST} bytes, found more");
    failed(path, message, "is this a manifest? split the scene if it is")
}

fn failed(path: &Path, message: String, hint: &str) -> Error {
    let path = path.to_owned();
    Error { code: code::READ, path, line: 0, column: 0, message, hint: hint.to_owned() }
}

fn check_version(value: &Value<'_>) -> Result<()> {
    let version = value.integer(1..=i64::MAX)?;
    if version == VERSION {
        return Ok(());
    }
    let message = format!("expected version {}, found {version}", VERSION);
    Err(value.error(code::VERSION, message, "a newer version of bthc can read the manifest"))
}

fn name(table: &Table<'_>) -> Result<String> {
    Ok(table.need("name")?.string()?.to_owned())
}

fn frames(value: &Value<'_>) -> Result<Frames> {
    let table = value.table(FRAMES_KEYS)?;
    let frame = |key| -> Result<Option<i32>> {
        table.get(key).map(|v| v.integer(-FRAME_LIMIT..=FRAME_LIMIT).map(|n| n as i32)).transpose()
    };
    let first = frame("first")?.unwrap_or(0);
    let last = frame("last")?.unwrap_or(first);
    if last < first {
        return Err(table.need("last")?.not_allowed("a frame not before the first", last));
    }
    let rate = table.get("rate").map(|v| v.number_that("a number above 0", |n| n > 0.0)).transpose()?;
    Ok(Frames { first, last, rate: rate.unwrap_or(Frames::default().rate) })
}

fn object(table: &Table<'_>) -> Result<Object> {
    for (a, b) in [
        ("model", "file"),
        ("model", "object"),
        ("file", "mesh"),
        ("file", "deforms"),
        ("file", "joint"),
        ("file", "node"),
        ("node", "mesh"),
        ("node", "deforms"),
        ("node", "joint"),
        ("joint", "deforms"),
    ] {
        table.exclude(a, b)?;
    }
    let deforms = table.get("deforms").map_or(Ok(false), |v| v.boolean())?;
    if let Some(value) = table.get("without_joints").filter(|_| !deforms) {
        let message = "`without_joints` belongs to objects with `deforms`";
        return Err(value.error(code::CONFLICT, message, "remove it"));
    }
    let moving = match sequence(table)? {
        Some(source) => Some(source),
        None => vertex_cache(table)?,
    };
    let source = match moving {
        Some(source) => source,
        None => unmoved(table, deforms)?,
    };
    Ok(Object { name: name(table)?, source, material: material(table)? })
}

/// The source of an object that is neither a sequence nor moved by a vertex cache.
fn unmoved(table: &Table<'_>, deforms: bool) -> Result<Source> {
    let index = |key| index(table, key);
    Ok(match table.get("file") {
        Some(file) => Source::Compiled { path: path(&file)?, object: index("object")? },
        None => {
            let path = path(&table.need("model")?)?;
            let joint = table.get("joint").map(|v| joint(&v)).transpose()?;
            match (index("node")?, index("mesh")?, joint) {
                (Some(node), ..) => Source::AtRest { path, node },
                (None, Some(mesh), Some(joint)) => Source::RigidPart { path, mesh, joint },
                (None, None, Some(_)) => return Err(missing_mesh(table, "joint")?),
                (None, Some(mesh), None) if deforms => {
                    Source::Deforming { path, mesh, without: without_joints(table)? }
                }
                (None, None, None) if deforms => return Err(missing_mesh(table, "deforms")?),
                (None, mesh, None) => Source::Model { path, mesh },
            }
        }
    })
}

/// The error for an object with `deforms` or `joint` without a mesh.
fn missing_mesh(table: &Table<'_>, key: &'static str) -> Result<Error> {
    let message = "only single meshes of glTF files deform or have parts of joints";
    Ok(table.need(key)?.error(code::CONFLICT, message, "name a mesh by its number"))
}

/// The number of a joint whose rigid part can be named.
fn joint(value: &Value<'_>) -> Result<u32> {
    Ok(value.integer(0..=i64::from(JointSet::LIMIT) - 1)? as u32)
}

/// The joints whose rigid parts are skipped of an object that deforms.
fn without_joints(table: &Table<'_>) -> Result<JointSet> {
    let Some(value) = table.get("without_joints") else { return Ok(JointSet::default()) };
    value.array()?.iter().map(joint).collect()
}

/// Reads a node.
fn node(table: &Table<'_>, nodes: &Names, objects: &Names, into: &mut Nodes) -> Result<()> {
    table.exclude("object", "group")?;
    into.push(Node {
        name: table.need("name")?.string()?,
        parent: table.get("parent").map(|v| nodes.row(&v)).transpose()?,
        transform: transform(table)?,
        object: table.get("object").map(|v| objects.row(&v)).transpose()?,
        group: table.get("group").map(|v| nodes.row(&v)).transpose()?,
        visible: table.get("visible").map_or(Ok(true), |v| v.boolean())?,
    });
    Ok(())
}

/// The groups of nodes. Fails when a node with a parent is named as one, or groups show each other
/// in a circle or too deeply.
fn node_groups(tables: &NodeTables<'_>, nodes: &Nodes) -> Result<Option<NodeGroups>> {
    let error = |row: usize, code: &'static str, message: String, hint: &'static str| {
        tables.with(row, |table| Err(table.need("group")?.error(code, message, hint)))
    };
    for (row, node) in nodes.iter().enumerate() {
        if let Some(group) = node.group.map(|group| nodes.get(group)).filter(|group| group.parent.is_some()) {
            let message = format!("the node \"{}\" has a parent: a group is a node without one", group.name);
            return error(row, code::CONFLICT, message, "name the first node of a tree");
        }
    }
    NodeGroups::of(nodes).or_else(|node| {
        let message = "the group shows itself, or groups are nested in more than 16 levels".to_owned();
        error(node, code::CYCLE, message, "name another group")
    })
}

/// The error for what cannot be in a group.
fn in_group(value: &Value<'_>, what: &str) -> Error {
    value.error(code::CONFLICT, format!("{what} cannot be in a group"), "put it at a node of the world")
}

/// Fails when a node is its own ancestor. Every node is visited once.
fn check_cycles(tables: &NodeTables<'_>, nodes: &Nodes) -> Result<()> {
    const UNSEEN: usize = usize::MAX;
    let mut seen_from = vec![UNSEEN; nodes.len()];
    for start in 0..nodes.len() {
        let mut next = Some(start);
        while let Some(at) = next.filter(|at| seen_from[*at] == UNSEEN) {
            seen_from[at] = start;
            next = nodes.parent(at);
        }
        // A node that was visited from this same start closes a cycle.
        if let Some(at) = next.filter(|at| seen_from[*at] == start) {
            let message = format!("the node \"{}\" is its own ancestor", nodes.name(at));
            let hint = "give one node of the circle another parent";
            return tables.with(at, |table| Err(table.need("parent")?.error(code::CYCLE, message, hint)));
        }
    }
    Ok(())
}

fn camera(table: &Table<'_>, nodes: &Names) -> Result<Camera> {
    table.exclude("fov", "height")?;
    let positive = |key| -> Result<Option<f64>> {
        table.get(key).map(|v| v.number_that("a number above 0", |n| n > 0.0)).transpose()
    };
    let lens = match positive("height")? {
        Some(height) => Lens::Orthographic(height),
        None => {
            let fov =
                table.need("fov")?.number_that("degrees between 0 and 180", |n| 0.0 < n && n < 180.0)?;
            Lens::Perspective(fov)
        }
    };
    let near = table.get("near").map(|v| v.number_that("a number from 0", |n| n >= 0.0)).transpose()?;
    let far = positive("far")?;
    if let (Some(near), Some(far)) = (near, far)
        && near >= far
    {
        return Err(table.need("far")?.not_allowed("a number above `near`", far));
    }
    Ok(Camera {
        name: name(table)?,
        node: nodes.row(&table.need("node")?)?,
        lens,
        aspect: positive("aspect")?,
        near,
        far,
    })
}

fn light(table: &Table<'_>, nodes: &Names) -> Result<Light> {
    #[derive(Clone, Copy, PartialEq)]
    enum Kind {
        Directional,
        Point,
        Spot,
    }
    let kinds = [("directional", Kind::Directional), ("point", Kind::Point), ("spot", Kind::Spot)];
    let kind_value = table.need("kind")?;
    let kind = kind_value.choice(&kinds)?;
    let not_negative = |v: Value<'_>| v.number_that("a number from 0", |n| n >= 0.0);
    for key in ["inner", "outer"] {
        if let Some(value) = table.get(key).filter(|_| kind != Kind::Spot) {
            let message = format!("`{key}` belongs to lights of kind \"spot\"");
            return Err(value.error(code::CONFLICT, message, "remove it, or make the light a spot"));
        }
    }
    let kind = match kind {
        Kind::Directional => LightKind::Directional,
        Kind::Point => LightKind::Point,
        Kind::Spot => {
            let outer = table
                .get("outer")
                .map(|v| v.number_that("degrees above 0, up to 90", |n| 0.0 < n && n <= 90.0))
                .transpose()?
                .unwrap_or(45.0);
            let inner = table
                .get("inner")
                .map(|v| v.number_that("degrees from 0 to below `outer`", |n| 0.0 <= n && n < outer))
                .transpose()?
                .unwrap_or(0.0);
            LightKind::Spot { inner, outer }
        }
    };
    let color = match table.get("color") {
        None => [1.0; 3],
        Some(value) => color(&value, f64::INFINITY)?,
    };
    Ok(Light {
        name: name(table)?,
        node: nodes.row(&table.need("node")?)?,
        kind,
        color,
        intensity: table.get("intensity").map(not_negative).transpose()?.unwrap_or(1.0),
        range: table.get("range").map(|v| v.number_that("a number above 0", |n| n > 0.0)).transpose()?,
    })
}
