//! The formats of models, in the order in which their content is looked for.
//!
//! A new format is a file of this folder with a constant `FORMAT`, and a line in [`FORMATS`].

mod mtl;
mod obj;
mod off;
mod ply;
mod stl;

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::gltf::made::MadeFormat;
use crate::gltf::{fbx, threemf};
use crate::materials::{ImageFile, Looks};
use crate::mesh::Wanted;
use crate::raw::Raw;
use crate::source::Source;
use crate::text::without_mark;
use crate::{foreign, gltf};

/// All formats.
pub(crate) const FORMATS: [Format; 7] =
    [GLTF, FBX, THREEMF, ply::FORMAT, stl::FORMAT, off::FORMAT, obj::FORMAT];

/// glTF and GLB.
pub(crate) const GLTF: Format = Format {
    name: "gltf",
    titles: &["glTF", "GLB"],
    extensions: &["gltf", "glb"],
    is_like: |data| data.starts_with(b"glTF") || without_mark(data).trim_ascii_start().starts_with(b"{"),
    read: gltf::flatten::read,
    files: gltf::files,
    images: |source, _| gltf::materials::images(source),
};

/// Formats that are read as glTF documents.
const FBX: Format = made(&fbx::FORMAT, &["FBX"], &["fbx"]);
const THREEMF: Format = made(&threemf::FORMAT, &["3MF"], &["3mf"]);

const fn made(
    format: &MadeFormat,
    titles: &'static [&'static str],
    extensions: &'static [&'static str],
) -> Format {
    Format { name: format.name, titles, extensions, is_like: format.is_like, ..GLTF }
}

/// How a format is recognized and read.
pub(crate) struct Format {
    /// Its name in reports.
    pub(crate) name: &'static str,
    /// Its names in messages.
    pub(crate) titles: &'static [&'static str],
    /// The extensions of its files, in small letters.
    extensions: &'static [&'static str],
    /// Returns true for content of the format.
    is_like: fn(&[u8]) -> bool,
    /// Reads a source with its own rows.
    read: for<'a> fn(&'a Source<'a>, Wanted) -> Result<Raw<'a>>,
    /// Returns the files that a model refers to. What cannot be read is reported when it is read.
    files: fn(&Path, Looks) -> Result<Vec<PathBuf>>,
    /// Returns the images of a model's materials that can be read.
    pub(crate) images: fn(&Source<'_>, Looks) -> Result<Vec<ImageFile>>,
}

impl Format {
    /// What a format without materials and other files has.
    const ALONE: Format = Format {
        name: "",
        titles: &[],
        extensions: &[],
        is_like: |_| false,
        read: |_, _| unreachable!("each format has a reader"),
        files: |_, _| Ok(Vec::new()),
        images: |_, _| Ok(Vec::new()),
    };

    /// Returns true for glTF and what is read like it: formats whose files hold scenes.
    pub(crate) fn is_scene(&self) -> bool {
        [GLTF.name, FBX.name, THREEMF.name].contains(&self.name)
    }

    /// Reads a source with its own rows.
    pub(crate) fn read<'a>(&self, source: &'a Source<'a>, wanted: Wanted) -> Result<Raw<'a>> {
        (self.read)(source, wanted).map_err(|e| e.of_model(source.path))
    }
}

/// Returns the extensions of model files, in small letters.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().flat_map(|format| format.extensions).copied()
}

/// Returns true if a file is compiled as a scene, by its extension.
pub fn is_scene(path: &Path) -> bool {
    by_extension(extension(path).as_deref()).is_some_and(Format::is_scene)
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase())
}

fn by_extension(extension: Option<&str>) -> Option<&'static Format> {
    FORMATS.iter().find(|format| extension.is_some_and(|e| format.extensions.contains(&e)))
}

fn by_content(data: &[u8]) -> Option<&'static Format> {
    FORMATS.iter().find(|format| (format.is_like)(data))
}

/// Returns the first word of a text, behind its byte order mark.
fn first_word(data: &[u8]) -> &[u8] {
    let text = without_mark(data).trim_ascii_start();
    text.split(|c| c.is_ascii_whitespace()).next().unwrap_or_default()
}

/// Returns the format of a source by its extension, or else by its content.
///
/// # Errors
/// `BTH-I001` for a file that is not a model.
pub(crate) fn format(source: &Source<'_>) -> Result<&'static Format> {
    source.fetched()?;
    let refused =
        |found: &str, hint: &str| Err(source.error("BTH-I001", format!("expected a model{found}"), hint));
    if source.data.starts_with(&bth_format::layout::IDENTIFIER) {
        let hint = "name the model that it was compiled from, or see what it contains with `bthc info`";
        return refused(", found a compiled file", hint);
    }
    let extension = extension(source.path);
    if extension.as_deref() == Some("manifest") {
        let hint = "compile the manifest, or name one of its models";
        return refused(", found the name of a scene manifest", hint);
    }
    if let Some(format) = by_extension(extension.as_deref()).or_else(|| by_content(source.data)) {
        return Ok(format);
    }
    let found = foreign::of(source.data).unwrap_or(foreign::Foreign {
        what: "something else",
        hint: "give the file its format's extension if it is one of these, or convert it",
    });
    let titles: Vec<&str> = FORMATS.iter().flat_map(|format| format.titles).copied().collect();
    let (last, first) = titles.split_last().unwrap_or((&"", &[]));
    refused(&format!(" in {} or {last} format, found {}", first.join(", "), found.what), found.hint)
}

/// Returns the files that a model consists of: the model, then those that it refers to, in order.
/// Images and material libraries that do not exist are skipped; reading them reports an error.
///
/// # Errors
/// `BTH-O001` when the model cannot be read.
pub fn source_files(path: &Path, looks: impl Into<Looks>) -> Result<Vec<PathBuf>> {
    let extension = extension(path);
    let mut files = vec![path.to_owned()];
    if extension.as_deref() != Some("bth") {
        let format = by_extension(extension.as_deref()).unwrap_or(&GLTF);
        files.extend((format.files)(path, looks.into())?);
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_is_found_by_content() {
        let mut binary_stl = vec![7; 84];
        binary_stl[80..].copy_from_slice(&0u32.to_le_bytes());
        for (data, name) in [
            (&b"glTF\x02\0\0\0"[..], "gltf"),
            (b"\n{\"asset\":{}}", "gltf"),
            (b"\xEF\xBB\xBF{}", "gltf"),
            (b"ply\r\nformat ascii 1.0", "ply"),
            (b"\xEF\xBB\xBFply\n", "ply"),
            (b"solid name", "stl"),
            (b"SOLID name", "stl"),
            (&binary_stl, "stl"),
            (b"COFF\n3 1 0", "off"),
            (b"\xEF\xBB\xBFv 1 2 3\n", "obj"),
            (b"# comment\n\nv 1 2 3\n", "obj"),
            (b"Kaydara FBX Binary  \0\x1A\0", "fbx"),
            (b"; FBX 7.5.0 project file\n", "fbx"),
            (b"PK\x03\x04 3D/3dmodel.model", "3mf"),
            (b"PK\x03\x04", ""),
            (b"", ""),
        ] {
            let found = by_content(data).map_or("", |format| format.name);
            assert_eq!(found, name, "{}", String::from_utf8_lossy(data));
        }
    }
}
