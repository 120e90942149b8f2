//! Formats of models that are not read, told by their first bytes, so that an error can name them.

use crate::text::without_mark;

/// What an error says of a file of another format.
#[derive(Debug, PartialEq)]
pub(crate) struct Foreign {
    /// What the file is.
    pub(crate) what: &'static str,
    /// What the user can do.
    pub(crate) hint: &'static str,
}

const EXPORT: &str = "export the model as glTF, for example with Blender or assimp";
const USD: &str = "python -m bth usd compiles it (pip install bth-rays[usd]); or export the model as glTF";
const UNPACK: &str = "unpack it first";

/// What files of other formats begin with.
const STARTS: [(&[u8], &str, &str); 11] = [
    (b"BLENDER", "a Blender file", EXPORT),
    (b"PXR-USDC", "a USD file", USD),
    (b"#usda", "a USD file", USD),
    (b"ISO-10303-21", "a STEP or IFC file", EXPORT),
    (b"#VRML", "a VRML file", EXPORT),
    (b"# vtk DataFile", "a VTK file", "write it as PLY, for example with meshio"),
    (b"Ogawa", "an Alembic file", EXPORT),
    (
        b"PK\x03\x04",
        "a ZIP archive, as USDZ files are",
        "python -m bth usd compiles USDZ files; else unpack it, or export the model as glTF",
    ),
    (b"\x1F\x8B", "a file compressed with gzip", UNPACK),
    (b"\x28\xB5\x2F\xFD", "a file compressed with Zstandard", UNPACK),
    (b"\xFD7zXZ", "a file compressed with xz", UNPACK),
];

/// Bytes of a file in which the first element of XML is looked for.
const XML_HEAD: usize = 1024;

/// Guesses the format of an unsupported file, for the error message.
pub(crate) fn of(data: &[u8]) -> Option<Foreign> {
    let text = without_mark(data).trim_ascii_start();
    if let Some((_, what, hint)) = STARTS.iter().find(|(start, ..)| text.starts_with(start)) {
        return Some(Foreign { what, hint });
    }
    let head = &text[..text.len().min(XML_HEAD)];
    let has = |tag: &[u8]| head.windows(tag.len()).any(|window| window == tag);
    let what = match data {
        _ if text.starts_with(b"<") && has(b"<COLLADA") => "a Collada file",
        _ if text.starts_with(b"<") && has(b"<X3D") => "an X3D file",
        // The first chunk of a 3DS file is the whole file.
        [b'M', b'M', a, b, c, d, ..] if u32::from_le_bytes([*a, *b, *c, *d]) as usize == data.len() => {
            "a 3DS file"
        }
        _ => return None,
    };
    Some(Foreign { what, hint: EXPORT })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_formats_are_named() {
        let what = |data: &[u8]| of(data).map(|foreign| foreign.what);
        for (start, name, _) in STARTS {
            assert_eq!(what(&[start, b" and more"].concat()), Some(name));
            assert_eq!(what(&start[..start.len() - 1]), None, "{name}");
        }
        let collada = b"\xEF\xBB\xBF<?xml version=\"1.0\"?>\n<!-- a chair -->\n<COLLADA version=\"1.4.1\">";
        assert_eq!(what(collada), Some("a Collada file"));
        assert_eq!(what(b"<X3D profile='Interchange'>"), Some("an X3D file"));
        assert_eq!(what(b"MM\x08\0\0\0ab"), Some("a 3DS file"));
        assert_eq!(what(b"MM\x09\0\0\0ab"), None);
        for unknown in [&b""[..], b"M", b"MM", b"<", b"<html>", b"COLLADA", b"words"] {
            assert_eq!(what(unknown), None);
        }
    }
}
