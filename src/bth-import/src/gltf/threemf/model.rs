//! Reads the parts of a 3MF package: resources, objects and what is built (3MF core specification
//! 1.3, materials and production extensions).

use std::collections::{BTreeMap, HashMap};

use serde_json::json;

use crate::error::{Error, Result};
use crate::gltf::made::Made;
use crate::gltf::threemf::EXPORT;
use crate::gltf::threemf::object::{Key, Look, Object, Placed, WHITE, floats};
use crate::gltf::threemf::package::Package;
use crate::gltf::threemf::part::{PartElement, Then};
use crate::source::{INDEX, MALFORMED, Source, UNSUPPORTED};

const CORE: &[u8] = b"http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const MATERIAL: &[u8] = b"http://schemas.microsoft.com/3dmanufacturing/material/2015/02";
/// Extensions that a file may require: what they add is read or skipped with a warning.
const KNOWN: [&str; 7] = [
    "material/2015/02",
    "production/2015/06",
    "slice/2015/07",
    "beamlattice/2017/02",
    "beamlattice/balls/2020/07",
    "trianglesets/2021/07",
    "securecontent/2019/04",
];
/// Where the namespaces of extensions are.
const EXTENSIONS: &str = "http://schemas.microsoft.com/3dmanufacturing/";
const RELATIONSHIPS: &str = "_rels/.rels";
const ROOT: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// Kinds of elements that are skipped and counted apart.
const MOST_KINDS: usize = 16;
/// Micrometres of units by their names.
const UNITS: [(&str, u32); 6] = [
    ("micron", 1),
    ("millimeter", 1_000),
    ("centimeter", 10_000),
    ("inch", 25_400),
    ("foot", 304_800),
    ("meter", 1_000_000),
];
const DEFAULT_UNIT: &str = "millimeter";

/// What is in a package.
pub(super) struct Model<'m> {
    source: &'m Source<'m>,
    pub(super) made: &'m mut Made,
    /// The parts that are named, in the order of their first names.
    pub(super) parts: Vec<String>,
    numbers: HashMap<String, usize>,
    pub(super) objects: HashMap<Key, Object>,
    pub(super) items: Vec<Placed>,
    /// The name of the unit.
    unit: String,
    /// Set by the element of the open part that holds all others.
    has_model: bool,
    /// Elements that are skipped: how many, and where the first is.
    left_out: BTreeMap<String, (u64, String)>,
    part: usize,
    groups: HashMap<u32, Properties>,
    group: u32,
    object: Option<(u32, Object)>,
}

/// What the properties of triangles are taken from.
enum Properties {
    /// Materials from this one on.
    Materials {
        first: usize,
        count: u32,
    },
    Colors(Vec<[u8; 4]>),
    /// What is not read.
    LeftOut,
}

/// Reads all parts of a package that are needed.
pub(super) fn read<'m>(source: &'m Source<'m>, made: &'m mut Made) -> Result<Model<'m>> {
    let mut package = Package::open(source)?;
    let mut root = None;
    let relationship = |root: &mut Option<String>, _: &[u8], name: &[u8], element: &PartElement<'_>| {
        let [kind, target] = element.texts(["Type", "Target"])?;
        if name == b"Relationship" && kind == ROOT {
            root.get_or_insert(target);
        }
        Ok(Then::Inside)
    };
    package.part(RELATIONSHIPS)?.elements(&mut root, relationship, |_, _| Ok(()))?;
    let Some(root) = root else {
        let message = "expected a relationship to a 3D model, found none";
        return Err(source.error_in_part(MALFORMED, RELATIONSHIPS, message, EXPORT));
    };
    let mut model = Model {
        source,
        made,
        parts: Vec::new(),
        numbers: HashMap::new(),
        objects: HashMap::new(),
        items: Vec::new(),
        unit: DEFAULT_UNIT.to_owned(),
        has_model: false,
        left_out: BTreeMap::new(),
        part: 0,
        groups: HashMap::new(),
        group: 0,
        object: None,
    };
    model.named(name(&root));
    while let Some(part) = model.parts.get(model.part) {
        let part = package.part(part)?;
        model.groups.clear();
        model.object = None;
        model.has_model = false;
        part.elements(&mut model, Model::start, Model::end)?;
        if !model.has_model {
            let message = "expected an element model of 3MF, found none";
            return Err(source.error_in_part(MALFORMED, part.name, message, EXPORT));
        }
        model.part += 1;
    }
    Ok(model)
}

fn name(path: &str) -> String {
    path.trim_start_matches('/').to_owned()
}

impl Model<'_> {
    /// Metres of the unit.
    pub(super) fn unit(&self) -> f64 {
        let unit = UNITS.iter().find(|(name, _)| *name == self.unit).unwrap_or(&UNITS[1]);
        f64::from(unit.1) / f64::from(1_000_000)
    }

    /// Warns of what is skipped.
    pub(super) fn warn(&self) {
        for (what, (count, place)) in &self.left_out {
            self.source.monitor.warn(&format!("{count} {what} left out, the first at {place}"));
        }
    }

    fn start(&mut self, namespace: &[u8], name: &[u8], element: &PartElement<'_>) -> Result<Then> {
        match (namespace, name) {
            (CORE, b"vertex") => self.object(element)?.vertices.push(element.numbers(["x", "y", "z"])?),
            (CORE, b"triangle") => self.triangle(element)?,
            (CORE, b"model") => self.model(element)?,
            (CORE, b"object") => self.open_object(element)?,
            (CORE, b"component") => {
                let placed = self.placed(element)?;
                self.object(element)?.components.push(placed);
            }
            // Only the root is built.
            (CORE, b"item") if self.part == 0 => {
                let placed = self.placed(element)?;
                self.items.push(placed);
            }
            (CORE, b"basematerials") => {
                let first = self.made.document.materials.len();
                self.open_group(element, Properties::Materials { first, count: 0 })?;
            }
            (CORE, b"base") => self.material(element)?,
            (MATERIAL, b"colorgroup") => self.open_group(element, Properties::Colors(Vec::new()))?,
            (MATERIAL, b"color") => {
                let color = color(element, "color")?;
                if let Some(Properties::Colors(colors)) = self.groups.get_mut(&self.group) {
                    colors.push(color);
                }
            }
            (CORE, _) => {}
            _ => return self.leave_out(namespace, name, element),
        }
        Ok(Then::Inside)
    }

    fn end(&mut self, name: &[u8]) -> Result<()> {
        if name == b"object"
            && let Some((id, mut object)) = self.object.take()
        {
            object.finish(self.made)?;
            self.objects.insert((self.part, id), object);
        }
        Ok(())
    }

    fn model(&mut self, element: &PartElement<'_>) -> Result<()> {
        self.has_model = true;
        let [unit, required] = element.texts(["unit", "requiredextensions"])?;
        if self.part == 0 && !unit.is_empty() {
            self.unit = unit;
        } else if !unit.is_empty() && unit != self.unit {
            let message = format!("expected the unit of the root, {}, found {unit}", self.unit);
            return Err(element.error(UNSUPPORTED, message));
        }
        if !UNITS.iter().any(|(name, _)| *name == self.unit) {
            let names = UNITS.map(|unit| unit.0).join(", ");
            return Err(element.error(MALFORMED, format!("expected a unit of {names}, found {}", self.unit)));
        }
        for prefix in required.split_ascii_whitespace() {
            let namespace = element.namespace(prefix);
            if !namespace.strip_prefix(EXTENSIONS).is_some_and(|name| KNOWN.contains(&name)) {
                let message = format!(
                    "expected required extensions that are known, found {prefix} ({namespace}), which may change geometry"
                );
                return Err(element.error(UNSUPPORTED, message));
            }
        }
        Ok(())
    }

    /// Counts an element of an extension that is not read. What refers to it has no look.
    fn leave_out(&mut self, namespace: &[u8], name: &[u8], element: &PartElement<'_>) -> Result<Then> {
        if let [Some(id)] = element.values(["id"])?
            && let Some(id) = element.number("id", &Some(id))?
        {
            self.groups.insert(id, Properties::LeftOut);
        }
        let [name, namespace] = [name, namespace].map(String::from_utf8_lossy);
        let namespace = namespace.strip_prefix(EXTENSIONS).unwrap_or(&namespace);
        let mut what = format!("elements \"{name}\" of {namespace} are");
        if self.left_out.len() >= MOST_KINDS && !self.left_out.contains_key(&what) {
            what = "other elements are".to_owned();
        }
        self.left_out.entry(what).or_insert_with(|| (0, element.place())).0 += 1;
        Ok(Then::Behind)
    }

    /// The object that is open.
    fn object(&mut self, element: &PartElement<'_>) -> Result<&mut Object> {
        let outside = || element.error(MALFORMED, "expected this element in an object");
        self.object.as_mut().map(|(_, object)| object).ok_or_else(outside)
    }

    fn open_object(&mut self, element: &PartElement<'_>) -> Result<()> {
        let [id] = element.numbers(["id"])?;
        if self.objects.contains_key(&(self.part, id)) || self.object.is_some() {
            return Err(element.error(MALFORMED, format!("expected an object of a new id, found {id}")));
        }
        let [group, row] = element.values(["pid", "pindex"])?;
        let property = element.number("pid", &group)?.zip(element.number("pindex", &row)?);
        let [name] = element.texts(["name"])?;
        let name = if name.is_empty() { format!("object {id}") } else { name };
        self.object = Some((id, Object::new(name, property)));
        Ok(())
    }

    fn open_group(&mut self, element: &PartElement<'_>, group: Properties) -> Result<()> {
        let [id] = element.numbers(["id"])?;
        if self.groups.insert(id, group).is_some() {
            return Err(element.error(MALFORMED, format!("expected a group of a new id, found {id}")));
        }
        self.group = id;
        Ok(())
    }

    fn material(&mut self, element: &PartElement<'_>) -> Result<()> {
        let Some(Properties::Materials { count, .. }) = self.groups.get_mut(&self.group) else {
            return Ok(());
        };
        *count += 1;
        let [r, g, b, a] = floats(color(element, "displaycolor")?);
        let [name] = element.texts(["name"])?;
        self.made.document.materials.push(json!({
            "name": name,
            "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, a], "metallicFactor": 0.0, "roughnessFactor": 1.0},
            "doubleSided": true,
            "alphaMode": if a < 1.0 { "BLEND" } else { "OPAQUE" },
        }));
        Ok(())
    }

    fn placed(&mut self, element: &PartElement<'_>) -> Result<Placed> {
        let [id] = element.numbers(["objectid"])?;
        let [path] = element.texts(["path"])?;
        let [transform] = element.texts(["transform"])?;
        let mut matrix = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
        if !transform.is_empty() {
            let number = |word: &str| word.parse().ok().filter(|x: &f64| x.is_finite());
            let numbers: Option<Vec<f64>> = transform.split_ascii_whitespace().map(number).collect();
            let Some(numbers) = numbers.filter(|numbers| numbers.len() == 12) else {
                let message = format!("expected a transform of twelve finite numbers, found \"{transform}\"");
                return Err(element.error(MALFORMED, message));
            };
            for (k, x) in numbers.into_iter().enumerate() {
                matrix[k / 3 * 4 + k % 3] = x;
            }
        }
        let part = if path.is_empty() { self.part } else { self.named(name(&path)) };
        Ok(Placed { key: (part, id), matrix })
    }

    /// The number of a part. Names of parts are equal in any case.
    fn named(&mut self, name: String) -> usize {
        let next = self.parts.len();
        let number = *self.numbers.entry(name.to_ascii_lowercase()).or_insert(next);
        if number == next {
            self.parts.push(name);
        }
        number
    }

    fn triangle(&mut self, element: &PartElement<'_>) -> Result<()> {
        const NAMES: [&str; 7] = ["v1", "v2", "v3", "pid", "p1", "p2", "p3"];
        let values = element.values(NAMES)?;
        let mut numbers = [None; 7];
        for ((number, value), name) in numbers.iter_mut().zip(&values).zip(NAMES) {
            *number = element.number::<u32>(name, value)?;
        }
        let [v1, v2, v3, group, p1, p2, p3] = numbers;
        let (Some(v1), Some(v2), Some(v3)) = (v1, v2, v3) else {
            return Err(element.missing("v1, v2 or v3"));
        };
        let object = self.object(element)?;
        let count = object.vertices.len();
        if let Some(outside) = [v1, v2, v3].into_iter().find(|row| *row as usize >= count) {
            return Err(element.error(INDEX, format!("expected a vertex below {count}, found {outside}")));
        }
        let first = p1.or(object.property.map(|property| property.1));
        let group = group.or(object.property.map(|property| property.0));
        let look = match group.zip(first) {
            Some((group, first)) => {
                self.look(element, group, [first, p2.unwrap_or(first), p3.unwrap_or(first)])?
            }
            None => Look::default(),
        };
        self.object(element)?.push([v1, v2, v3], look)
    }

    /// How a triangle looks whose corners have these properties of a group.
    fn look(&self, element: &PartElement<'_>, group: u32, rows: [u32; 3]) -> Result<Look> {
        let missing = |count: usize, row: u32| {
            element.error(INDEX, format!("expected a property below {count} of group {group}, found {row}"))
        };
        match self.groups.get(&group) {
            Some(Properties::Materials { first, count }) => match rows[0] < *count {
                true => Ok(Look { material: Some(first + rows[0] as usize), colors: [WHITE; 3] }),
                false => Err(missing(*count as usize, rows[0])),
            },
            Some(Properties::Colors(colors)) => {
                let mut look = Look::default();
                for (color, row) in look.colors.iter_mut().zip(rows) {
                    *color = *colors.get(row as usize).ok_or_else(|| missing(colors.len(), row))?;
                }
                Ok(look)
            }
            Some(Properties::LeftOut) => Ok(Look::default()),
            None => Err(element.error(INDEX, format!("expected a group of properties, found {group}"))),
        }
    }

    /// The error for a reference to an object that is not there.
    pub(super) fn no_object(&self, (part, id): Key) -> Error {
        let message = "expected this object, which is referred to, found none";
        self.source.error_in_part(INDEX, format!("{} object {id}", self.parts[part]), message, EXPORT)
    }
}

/// A colour in sRGB, `#RRGGBB` or `#RRGGBBAA`.
fn color(element: &PartElement<'_>, name: &str) -> Result<[u8; 4]> {
    let [text] = element.texts([name])?;
    let digits = text.strip_prefix('#').filter(|digits| [6, 8].contains(&digits.len()) && digits.is_ascii());
    let number = digits.and_then(|digits| u32::from_str_radix(&format!("{digits:F<8}"), 16).ok());
    let message = || format!("expected a colour such as #FF8000 as {name}, found \"{text}\"");
    number.map(u32::to_be_bytes).ok_or_else(|| element.error(MALFORMED, message()))
}
