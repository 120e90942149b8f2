//! The specification agrees with the code: byte tables, kinds, invariants and the worked hexdump.

use bth_format::layout::kind;
use bth_format::layout::*;
use std::collections::BTreeMap;
use std::mem::offset_of;
use std::path::PathBuf;

fn spec(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../format-spec").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Cells of the rows of the tables below each heading `### Name (size bytes)`.
fn byte_tables(text: &str) -> BTreeMap<String, (usize, Vec<Vec<String>>)> {
    let mut tables = BTreeMap::new();
    let mut current = None;
    for line in text.lines() {
        if line.starts_with('#') {
            current = line
                .strip_prefix("### ")
                .and_then(|l| l.strip_suffix(" bytes)"))
                .and_then(|l| l.split_once(" ("));
            if let Some((name, size)) = current {
                tables.insert(name.to_owned(), (size.parse().unwrap(), Vec::new()));
            }
        } else if let Some((name, _)) = current
            && line.starts_with("| ")
            && !line.starts_with("| offset")
        {
            let cells = line.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect();
            tables.get_mut(name).unwrap().1.push(cells);
        }
    }
    tables
}

/// Bytes of a type such as `[[f32; 16]; 3]`.
fn size_of_type(name: &str) -> usize {
    if let Some(array) = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')) {
        let (element, count) = array.rsplit_once("; ").unwrap();
        return size_of_type(element) * count.parse::<usize>().unwrap();
    }
    match name {
        "u8" => 1,
        "u16" => 2,
        "u32" | "i32" | "f32" => 4,
        "u64" | "f64" | "Link" => 8,
        _ => panic!("unknown type {name}"),
    }
}

#[test]
fn byte_tables_are_those_of_the_structures() {
    macro_rules! structures {
        ($($type:ident { $($field:ident)* })*) => {
            vec![$((stringify!($type), size_of::<$type>(), vec![$((stringify!($field), offset_of!($type, $field))),*])),*]
        };
    }
    let structures = structures! {
        Header { identifier writer_version minimum_reader_version file_length section_offset section_count reserved
            required_features optional_features content_id table_hash header_hash }
        SectionEntry { kind flags object alignment offset length stride reserved count hash }
        Object { lower upper root record triangles dropped depth coordinates grid_origin displacement }
        WideNode { bounds child }
        IndexedLeaf { vertex corner first triangles vertices reserved }
        RawLeaf { corner first triangles reserved }
        IndexedLeaf16 { vertex corner first triangles vertices reserved }
        IndexedLeaf21 { vertex high corner first triangles vertices reserved }
        RawLeaf16 { corner first triangles reserved }
        RawLeaf21 { corner high first triangles reserved }
        Group { name name_length material reserved }
        GroupRun { first group }
        Material { name name_length reserved }
        ObjectName { name name_length }
        MaterialParameters { base_color emissive alpha_cutoff alpha_mode flags base_color_texture emissive_texture reserved }
        GlossParameters { metallic roughness normal_scale occlusion_strength metallic_roughness_texture normal_texture
            occlusion_texture reserved }
        Texture { image wrap filter transform uv_set reserved }
        Image { name first length }
        FreeDirections { sectors bins }
        FreeDistances { sectors }
        FreeLevels { distance reserved }
        Deformation { joints influence_sets targets reserved }
        Morph { deltas first_delta first_row reserved }
        Deformer { node object skin weights first_weight reserved }
        Skin { first_joint joints reserved }
        SkinJoint { inverse_bind node reserved }
        TetLeaf { lower upper first_tet tets first_vertex vertices first_face faces first_hull hulls subtree flags }
        TetVertex { position reserved }
        TetFace { vertex triangle tet opposite }
        HullFace { vertex tet opposite }
        Link32 { link }
        Link { next opposite }
        Scene { rate first_frame last_frame camera reserved }
        Node { transform parent flags name name_length reserved }
        Instance { node object flags first }
        Tree { magnitude condition first_line lines depth first_row rows visible instances extent origin_slack end_node
            reserved }
        Track { node property interpolation keys first_time first_value reserved }
        Camera { node projection name name_length size aspect near far reserved }
        Light { node kind name name_length color intensity range inner outer reserved }
    };
    let mut tables = byte_tables(&spec("README.md"));
    for (name, size, fields) in structures {
        let (said, rows) = tables.remove(name).unwrap_or_else(|| panic!("no table of {name}"));
        assert_eq!(said, size, "size of {name}");
        let said: Vec<_> = rows.iter().map(|r| (r[3].as_str(), r[0].parse::<usize>().unwrap())).collect();
        assert_eq!(said, fields, "fields of {name}");
        let mut end = 0;
        for row in &rows {
            assert_eq!(row[0].parse::<usize>().unwrap(), end, "{name} has no padding before {}", row[3]);
            assert_eq!(row[1].parse::<usize>().unwrap(), size_of_type(&row[2]), "size of {name}.{}", row[3]);
            end += size_of_type(&row[2]);
        }
        assert_eq!(end, size, "fields fill {name}");
    }
    assert!(tables.is_empty(), "tables of unknown structures: {:?}", tables.keys());
}

#[test]
fn kinds_have_the_names_and_strides_of_the_table() {
    let text = spec("README.md");
    let (_, table) = text.split_once("### Kinds").unwrap();
    let rows: Vec<Vec<&str>> = table
        .lines()
        .take_while(|l| !l.starts_with('#'))
        .filter(|l| l.starts_with("| ") && !l.starts_with("| kind"))
        .map(|l| l.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    assert_eq!(rows.len(), (0..1000).filter(|k| kind::name(*k) != "unknown").count());
    for row in rows {
        let kind = row[0].parse().unwrap();
        assert_eq!(kind::name(kind), row[1]);
        let stride = bth_format::file::kind_stride(kind).unwrap();
        assert!(stride == 0 && kind == kind::TETS || stride.to_string() == row[3], "stride of {}", row[1]);
        assert_eq!(row[5] == "yes", kind::is_required(kind), "{}", row[1]);
        assert_eq!(row[4] == "file", kind::is_of_file(kind), "{}", row[1]);
    }
}

#[test]
fn invariants_are_those_of_the_error_codes() {
    let text = spec("README.md");
    let said: Vec<_> = text
        .lines()
        .filter_map(|l| l.strip_prefix("| F")?.strip_suffix(" |")?.split_once(" | "))
        .map(|(number, rule)| (format!("BTH-F{number}"), rule.to_owned()))
        .collect();
    let coded: Vec<_> = bth::Code::ALL
        .iter()
        .filter(|c| c.as_str().starts_with("BTH-F"))
        .map(|c| (c.as_str().to_owned(), c.rule().to_owned()))
        .collect();
    assert_eq!(said, coded);
}

#[test]
fn worked_hexdump_is_the_file() {
    let bytes = std::fs::read(
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../format-spec/conformance/valid/triangle.bth"),
    )
    .unwrap();
    let text = spec("hexdump.md");
    let (mut shown, mut repeat): (Vec<u8>, bool) = (Vec::new(), false);
    let mut in_block = false;
    for line in text.lines() {
        if line == "```" {
            in_block = !in_block;
        } else if in_block && line == "*" {
            repeat = true;
        } else if in_block {
            let (at, rest) = line.split_once("  ").unwrap();
            let at = usize::from_str_radix(at, 16).unwrap();
            let (hex, ascii) = rest.split_once("  |").unwrap();
            let row: Vec<u8> = hex.split_whitespace().map(|b| u8::from_str_radix(b, 16).unwrap()).collect();
            while repeat && shown.len() < at {
                shown.extend_from_within(shown.len() - 16..);
            }
            repeat = false;
            assert_eq!(shown.len(), at, "rows follow each other");
            let text: String =
                row.iter().map(|&b| if (32..127).contains(&b) { b as char } else { '.' }).collect();
            assert_eq!(ascii, format!("{text}|"), "text of row {at:#x}");
            shown.extend(row);
        }
    }
    assert!(shown == bytes, "the hexdump differs from the file");
}
