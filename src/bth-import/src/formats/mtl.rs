//! Material libraries of OBJ files (MTL): diffuse colour, emission, opacity and their images.
//! Colours count as linear.

use crate::error::{Error, Place, Result};
use crate::image_file::{self, Refused};
use crate::materials::{ImageFile, MaterialRecorder, PLAIN, Unreadable, warn_left_out};
use crate::monitor::{Monitor, Silent};
use crate::source::{IMAGE, MALFORMED, MALFORMED_HINT, Source, input_error};
use crate::text::{Lines, float, shown, words};
use crate::text::{file_name, name, statements};
use bth_format::layout::*;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

/// A statement that names a material library, and its line in the OBJ file.
pub(super) struct Library {
    pub(super) line: u64,
    pub(super) names: String,
}

/// The colour of a material that no library defines.
const UNDEFINED: [f32; 4] = [0.8, 0.8, 0.8, 1.0];

/// A material of a library.
#[derive(Clone, Debug, Default, PartialEq)]
struct MtlMaterial {
    diffuse: Option<[f32; 3]>,
    emissive: Option<[f32; 3]>,
    opacity: Option<f32>,
    diffuse_map: Option<Map>,
    emissive_map: Option<Map>,
    opacity_map: Option<Map>,
}

/// An image and how its coordinates are changed.
#[derive(Clone, Debug, PartialEq)]
struct Map {
    /// File, or the name in the library where that is not relative.
    file: std::result::Result<PathBuf, String>,
    /// Place of the statement.
    place: Place,
    scale: [f32; 2],
    offset: [f32; 2],
    clamp: bool,
}

/// What libraries define.
#[derive(Default)]
struct Libraries {
    materials: HashMap<String, MtlMaterial>,
    /// Keywords of images that are not kept.
    left_out: BTreeSet<String>,
}

/// Reads the libraries of an OBJ file: the parameters of the materials with these names, in order.
/// Without libraries there is nothing to read.
///
/// # Errors
/// `BTH-I016` for a library or image that cannot be read, `BTH-I002` for a malformed library,
/// `BTH-L003` for too large an image.
pub(super) fn read(
    source: &Source<'_>,
    libraries: &[Library],
    names: &[String],
    unreadable: Unreadable,
    recorder: &mut MaterialRecorder,
) -> Result<()> {
    if libraries.is_empty() {
        return Ok(());
    }
    let found = read_libraries(source, libraries, unreadable)?;
    let mut images = Images { unreadable, monitor: source.monitor, read: HashMap::new() };
    for name in names {
        let parameters = match found.materials.get(name) {
            Some(material) => parameters(material, recorder, &mut images)?,
            None => {
                let warning = format!("material \"{}\" is in no library; it is grey", shown(name.as_bytes()));
                source.monitor.warn(&warning);
                MaterialParameters { base_color: UNDEFINED, ..PLAIN }
            }
        };
        recorder.parameters.push(parameters);
    }
    warn_left_out(&found.left_out, source.monitor);
    Ok(())
}

/// The files that the libraries of an OBJ file are, and their images, as far as they exist and can
/// be read.
pub(super) fn files(path: &Path, data: &[u8]) -> Vec<PathBuf> {
    let (mut files, mut read, mut listed) = (Vec::new(), LibrariesRead::default(), HashSet::new());
    for library in libraries_of(data) {
        for file in read.new_files(path, &library.names) {
            // What cannot be read is reported when it is read.
            let Ok(text) = image_file::read(&file) else { continue };
            let mut found = Libraries::default();
            // What is malformed is reported when it is read.
            let _ = parse(&file, &text, &mut found);
            let maps: BTreeSet<&PathBuf> = found.materials.values().flat_map(kept_files).collect();
            let maps = maps.into_iter().filter(|map| map.is_file());
            files.extend(
                std::iter::once(&file).chain(maps).filter(|file| listed.insert((*file).clone())).cloned(),
            );
        }
    }
    files
}

/// The images of an OBJ file's materials that can be read.
pub(super) fn images(source: &Source<'_>, unreadable: Unreadable) -> Result<Vec<ImageFile>> {
    let libraries: Vec<Library> = libraries_of(source.data).collect();
    // The warnings about skipped files came when the materials were read.
    let quiet = Source::new(source.path, source.data, &Silent);
    let found = read_libraries(&quiet, &libraries, unreadable)?;
    let maps: BTreeSet<&PathBuf> = found.materials.values().flat_map(kept_files).collect();
    // Materials that no face has may refer to images that cannot be read.
    Ok(maps.into_iter().filter_map(|file| image_file::read(file).ok().map(ImageFile::new)).collect())
}

/// The image files of a material that compiled files keep.
fn kept_files(material: &MtlMaterial) -> impl Iterator<Item = &PathBuf> {
    material.diffuse_map.iter().chain(&material.emissive_map).filter_map(|map| map.file.as_ref().ok())
}

/// The statements of an OBJ file that name libraries.
fn libraries_of(data: &[u8]) -> impl Iterator<Item = Library> + '_ {
    statements(data).filter_map(|(line, text)| {
        let mut words = words(&text);
        (words.next() == Some(b"mtllib")).then(|| Library { line, names: file_name(words) })
    })
}

/// The libraries that are read already. Programs may write the statement `mtllib` before every
/// face; a library is parsed once.
#[derive(Default)]
struct LibrariesRead {
    /// Names of statements.
    statements: HashSet<String>,
    /// Files, without symbolic links where they exist.
    files: HashSet<PathBuf>,
}

impl LibrariesRead {
    /// The files of a statement that no statement before has, which count as read from now on.
    fn new_files(&mut self, obj: &Path, names: &str) -> Vec<PathBuf> {
        if !self.statements.insert(names.to_owned()) {
            return Vec::new();
        }
        let mut files = library_files(obj, names);
        files.retain(|file| self.files.insert(std::fs::canonicalize(file).unwrap_or_else(|_| file.clone())));
        files
    }
}

/// The files of a statement: one whose name has spaces, or several.
fn library_files(obj: &Path, names: &str) -> Vec<PathBuf> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let whole = beside(folder, names);
    if let Some(file) = whole.as_ref().filter(|file| file.exists()) {
        return vec![file.clone()];
    }
    names.split(' ').filter_map(|name| beside(folder, name)).collect()
}

/// The file of a relative name; back slashes count as slashes. `None` for absolute names.
fn beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let path = Path::new(&name);
    let absolute = path.components().any(|c| matches!(c, Component::RootDir | Component::Prefix(_)));
    (!absolute && !name.is_empty() && name.as_bytes().get(1) != Some(&b':')).then(|| folder.join(path))
}

fn read_libraries(source: &Source<'_>, libraries: &[Library], unreadable: Unreadable) -> Result<Libraries> {
    let (mut found, mut read) = (Libraries::default(), LibrariesRead::default());
    for library in libraries {
        let hint =
            "put the material library there, or compile with --lenient-materials or without --materials";
        let files = read.new_files(source.path, &library.names);
        if files.is_empty() && library.names.split(' ').all(|name| beside(Path::new(""), name).is_none()) {
            let found = shown(library.names.as_bytes());
            let message = format!("expected a relative name of a material library, found \"{found}\"");
            let refused = Err(source.error_at_line(IMAGE, library.line, message, hint));
            unreadable.check::<()>(refused, source.monitor)?;
        }
        for file in files {
            let text = image_file::read(&file).map_err(|e| match e {
                Error::File { path, message, .. } => {
                    let message = format!("expected the material library {}: {message}", path.display());
                    source.error_at_line(IMAGE, library.line, message, hint)
                }
                other => other,
            });
            if let Some(text) = unreadable.check(text, source.monitor)? {
                parse(&file, &text, &mut found)?;
            }
        }
    }
    Ok(found)
}

/// Adds the materials of a library; of several with one name the first counts.
fn parse(path: &Path, text: &[u8], found: &mut Libraries) -> Result<()> {
    let mut current: Option<(String, MtlMaterial)> = None;
    for (line, text) in Lines::new(text) {
        let mut words = words(text);
        let Some(keyword) = words.next().filter(|word| !word.starts_with(b"#")) else { continue };
        let keyword = keyword.to_ascii_lowercase();
        if keyword == b"newmtl" {
            keep(found, current.take());
            current = Some((name(words), MtlMaterial::default()));
            continue;
        }
        let Some((_, material)) = &mut current else { continue };
        let place = Place::Line(path.to_owned(), line);
        match keyword.as_slice() {
            b"kd" => material.diffuse = color(&place, words)?,
            b"ke" => material.emissive = color(&place, words)?,
            b"d" | b"tr" => {
                let number = words.find(|word| *word != b"-halo").and_then(float::<f32>);
                let Some(number) = number.filter(|x| (0.0..=1.0).contains(x)) else {
                    return Err(malformed(place, "expected a number from 0 to 1"));
                };
                // An opacity counts more than a transparency: some programs write the opposite.
                match keyword == b"d" {
                    true => material.opacity = Some(number),
                    false => material.opacity = material.opacity.or(Some(1.0 - number)),
                }
            }
            b"map_kd" | b"map_ke" | b"map_d" => {
                let map = map(path, place, words)?;
                if map.is_none() {
                    found.left_out.insert(format!("{} without a file", String::from_utf8_lossy(&keyword)));
                }
                match keyword.as_slice() {
                    b"map_kd" => material.diffuse_map = map,
                    b"map_ke" => material.emissive_map = map,
                    _ => material.opacity_map = map,
                }
            }
            b"bump" | b"disp" | b"decal" | b"norm" | b"refl" => {
                found.left_out.insert(String::from_utf8_lossy(&keyword).into_owned());
            }
            other if other.starts_with(b"map_") => {
                found.left_out.insert(String::from_utf8_lossy(other).into_owned());
            }
            _ => {}
        }
    }
    keep(found, current);
    Ok(())
}

/// Adds a material that has ended.
fn keep(found: &mut Libraries, material: Option<(String, MtlMaterial)>) {
    let Some((name, material)) = material else { return };
    if material.opacity_map.is_some() && !has_alpha_in_color(&material) {
        found.left_out.insert("map_d".to_owned());
    }
    found.materials.entry(name).or_insert(material);
}

/// Returns true if the opacity of a material is the alpha of its colour image.
fn has_alpha_in_color(material: &MtlMaterial) -> bool {
    let file = |map: &Option<Map>| map.as_ref().map(|map| map.file.clone());
    material.opacity_map.is_some() && file(&material.opacity_map) == file(&material.diffuse_map)
}

/// Three numbers from 0; `None` for spectral curves and CIE colours, which are rare.
fn color<'w>(place: &Place, words: impl Iterator<Item = &'w [u8]>) -> Result<Option<[f32; 3]>> {
    // A comment may follow one number for all three.
    let words: Vec<&[u8]> = words.take_while(|word| !word.starts_with(b"#")).take(3).collect();
    if matches!(words.first(), Some(&b"spectral" | &b"xyz")) {
        return Ok(None);
    }
    let numbers: Option<Vec<f32>> = words.iter().map(|word| float(word)).collect();
    let color = match numbers.as_deref() {
        Some([r, g, b]) => Some([*r, *g, *b]),
        Some([grey]) => Some([*grey; 3]),
        _ => None,
    };
    match color.filter(|color| color.iter().all(|x| x.is_finite() && *x >= 0.0)) {
        Some(color) => Ok(Some(color)),
        None => Err(malformed(place.clone(), "expected red, green and blue from 0")),
    }
}

/// The image of a statement, behind its options; `None` where it names none, as programs write it
/// for materials without an image.
fn map<'w>(library: &Path, place: Place, words: impl Iterator<Item = &'w [u8]>) -> Result<Option<Map>> {
    let words: Vec<&[u8]> = words.collect();
    let (mut scale, mut offset, mut clamp, mut at) = ([1.0; 2], [0.0; 2], false, 0);
    while let Some(option) = words.get(at).filter(|word| word.starts_with(b"-") && word.len() > 1) {
        let numbers: Vec<f32> = words[at + 1..].iter().map_while(|word| float(word)).take(3).collect();
        match option.to_ascii_lowercase().as_slice() {
            b"-s" => scale.iter_mut().zip(&numbers).for_each(|(to, x)| *to = *x),
            b"-o" => offset.iter_mut().zip(&numbers).for_each(|(to, x)| *to = *x),
            b"-clamp" => clamp = words.get(at + 1).is_some_and(|word| word.eq_ignore_ascii_case(b"on")),
            _ => {}
        }
        at += match option.to_ascii_lowercase().as_slice() {
            b"-s" | b"-o" | b"-t" => 1 + numbers.len(),
            b"-mm" => 3,
            _ => 2,
        };
    }
    let name = file_name(words.iter().skip(at).copied());
    let folder = library.parent().unwrap_or(Path::new(""));
    if !scale.iter().chain(&offset).all(|x| x.is_finite()) {
        return Err(malformed(place, "expected finite numbers behind -s and -o"));
    }
    if name.is_empty() {
        return Ok(None);
    }
    let file = beside(folder, &name).ok_or(name);
    Ok(Some(Map { file, place, scale, offset, clamp }))
}

fn parameters(
    material: &MtlMaterial,
    recorder: &mut MaterialRecorder,
    images: &mut Images<'_>,
) -> Result<MaterialParameters> {
    let [r, g, b] = material.diffuse.unwrap_or([1.0; 3]);
    let opacity = material.opacity.unwrap_or(1.0);
    let mut texture = |map: &Option<Map>| match map {
        None => Ok(NONE),
        Some(map) => Ok(images.name(map)?.map_or(NONE, |image| recorder.texture(texture(map, image)))),
    };
    let base_color_texture = texture(&material.diffuse_map)?;
    let emissive_texture = texture(&material.emissive_map)?;
    Ok(MaterialParameters {
        base_color: [r, g, b, opacity],
        emissive: match (&material.emissive_map, emissive_texture) {
            (None, _) => material.emissive.unwrap_or_default(),
            // Without its texture all of the surface would glow.
            (Some(_), NONE) => [0.0; 3],
            (Some(_), _) => material.emissive.unwrap_or([1.0; 3]),
        },
        alpha_mode: match has_alpha_in_color(material) {
            true => ALPHA_MASK,
            false if opacity < 1.0 => ALPHA_BLEND,
            false => ALPHA_OPAQUE,
        },
        base_color_texture,
        emissive_texture,
        ..PLAIN
    })
}

/// The texture of a map. The second coordinate of OBJ grows upwards.
fn texture(map: &Map, image: [u8; 16]) -> Texture {
    let Map { scale, offset, clamp, .. } = map;
    let wrap = if *clamp { WRAP_CLAMP } else { WRAP_REPEAT };
    Texture {
        image,
        wrap: [wrap; 2],
        filter: FILTER_LINEAR,
        transform: [[scale[0], 0.0, offset[0]], [0.0, -scale[1], 1.0 - offset[1]]],
        uv_set: UV_SET_FIRST,
        reserved: [0; 2],
    }
}

/// The images that were read, and what becomes of those that cannot be.
struct Images<'m> {
    unreadable: Unreadable,
    monitor: &'m dyn Monitor,
    /// Names by files; `None` for skipped files.
    read: HashMap<PathBuf, Option<[u8; 16]>>,
}

impl Images<'_> {
    /// Returns the name of a map's image after checking format and size; `None` if it is skipped.
    fn name(&mut self, map: &Map) -> Result<Option<[u8; 16]>> {
        if let Some(name) = map.file.as_ref().ok().and_then(|file| self.read.get(file)) {
            return Ok(*name);
        }
        let name = self.unreadable.check(image_name(map), self.monitor)?;
        if let Ok(file) = &map.file {
            self.read.insert(file.clone(), name);
        }
        Ok(name)
    }
}

/// The name of a map's image, whose format and size are checked.
fn image_name(map: &Map) -> Result<[u8; 16]> {
    let file = map.file.as_ref().map_err(|name| {
        let message = format!("expected a relative file name, found \"{}\"", shown(name.as_bytes()));
        let hint = "put the image beside the library and refer to it by its name";
        input_error(IMAGE, map.place.clone(), message, hint)
    })?;
    let shown = file.display();
    let bytes = image_file::read(file).map_err(|e| {
        let hint = "put the image there, or compile with --lenient-materials or without --materials";
        match e {
            Error::File { message, .. } => {
                input_error(IMAGE, map.place.clone(), format!("expected the image {shown}: {message}"), hint)
            }
            other => other,
        }
    })?;
    image_file::check(&bytes).map_err(|refused| match refused {
        Refused::Malformed(message) => {
            let hint =
                "save the image as PNG, JPEG or WebP, or compile with --lenient-materials or without --materials";
            input_error(IMAGE, map.place.clone(), format!("{shown}: {message}"), hint)
        }
        Refused::TooLarge(texels) => image_file::too_large(shown, texels),
    })?;
    Ok(ImageFile::new(bytes).name)
}

fn malformed(place: Place, message: &str) -> Error {
    input_error(MALFORMED, place, message, MALFORMED_HINT)
}
