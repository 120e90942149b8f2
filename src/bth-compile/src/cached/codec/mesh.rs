//! Bytes of a mesh and of all that belongs to it.

use super::super::rows::{RowReader, Sink};
use super::{Codec, by_fields};
use bth_format::layout::{self, NONE};
use bth_import::{
    Attributes, Deformation, Exact, Group, Groups, Materials, Mesh, Sequence, TriangleOpacities,
};

by_fields! {
    Mesh { positions, exact, triangles, attributes, opacity, groups, materials, sequence, deformation } fits;
    Attributes { corners, normals, uvs } |_| true;
    TriangleOpacities { rows, micro } |_| true;
    Materials { parameters, gloss, textures, color_corners, colors, second_corners, second_uvs } textures_exist;
    Sequence { times, positions } |_| true;
    // Rows that do not fit each other are found in the file that is made from them.
    Deformation { counts, joints, weights, morphs, morph_rows, deltas } |_| true;
}

impl Codec for layout::Deformation {
    fn write(&self, to: &mut impl Sink) {
        to.add(std::slice::from_ref(self));
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        from.one()
    }
}

impl Codec for Exact {
    fn write(&self, to: &mut impl Sink) {
        to.add(&[self.anchor]);
        to.add(&self.positions);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        Some(Exact { anchor: from.one()?, positions: from.take()? })
    }
}

/// Returns true if all rows of a mesh are in range and fit each other.
fn fits(mesh: &Mesh) -> bool {
    let Mesh {
        positions,
        exact,
        triangles,
        attributes,
        opacity,
        groups,
        materials,
        sequence,
        deformation: _,
    } = mesh;
    let within = |rows: &[[u32; 3]], count: usize| rows.as_flattened().iter().all(|r| (*r as usize) < count);
    let one_each = |rows: usize| rows == triangles.len();
    let none_or_one_each = |rows: usize| rows == 0 || one_each(rows);
    let known = groups.as_ref().map_or(0, |g| g.materials.len());
    within(triangles, positions.len())
        && exact.as_ref().is_none_or(|exact| exact.positions.len() == positions.len())
        && attributes.as_ref().is_none_or(|a| {
            one_each(a.corners.len())
                && [a.normals.len(), a.uvs.len()].iter().all(|&n| n == 0 || within(&a.corners, n))
        })
        && opacity.as_ref().is_none_or(|o| one_each(o.rows.len()))
        && groups.as_ref().is_none_or(|g| g.runs.last().is_none_or(|run| (run[0] as usize) < triangles.len()))
        && materials.as_ref().is_none_or(|m| {
            [m.parameters.len(), m.gloss.len()].iter().all(|rows| *rows == 0 || *rows == known)
                && none_or_one_each(m.color_corners.len())
                && within(&m.color_corners, m.colors.len())
                && none_or_one_each(m.second_corners.len())
                && within(&m.second_corners, m.second_uvs.len())
        })
        && sequence.as_ref().is_none_or(|s| {
            !s.times.is_empty() && s.times.len().checked_mul(positions.len()) == Some(s.positions.len())
        })
}

/// Returns true if all textures that parameters refer to exist.
fn textures_exist(materials: &Materials) -> bool {
    let known = |row: u32| row == NONE || (row as usize) < materials.textures.len();
    materials.parameters.iter().all(|p| known(p.base_color_texture) && known(p.emissive_texture))
        && materials.gloss.iter().all(|p| {
            [p.metallic_roughness_texture, p.normal_texture, p.occlusion_texture].into_iter().all(known)
        })
}

impl Codec for Groups {
    fn write(&self, to: &mut impl Sink) {
        let names = self.groups.iter().map(|group| group.name.as_str());
        let names: Vec<&str> = names.chain(self.materials.iter().map(String::as_str)).collect();
        let material = |group: &Group| group.material.unwrap_or(u32::MAX);
        to.add(&self.groups.iter().map(material).collect::<Vec<u32>>());
        to.add(&names.iter().map(|name| name.len() as u32).collect::<Vec<u32>>());
        to.add(names.concat().as_bytes());
        to.add(&self.runs);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let (materials, lengths, text): (Vec<u32>, Vec<u32>, Vec<u8>) =
            (from.take()?, from.take()?, from.take()?);
        let runs: Vec<[u32; 2]> = from.take()?;
        let mut rest = std::str::from_utf8(&text).ok()?;
        let mut names = Vec::with_capacity(lengths.len());
        for length in lengths {
            let (name, behind) = rest.split_at_checked(length as usize)?;
            names.push(name.to_owned());
            rest = behind;
        }
        let material_names = (materials.len() <= names.len()).then(|| names.split_off(materials.len()))?;
        let known = |row: u32| row == u32::MAX || (row as usize) < material_names.len();
        let fits = rest.is_empty()
            && materials.iter().all(|row| known(*row))
            && runs.iter().all(|run| (run[1] as usize) < materials.len())
            && runs.is_sorted_by(|a, b| a[0] < b[0]);
        let group = |(name, row): (String, u32)| Group { name, material: (row != u32::MAX).then_some(row) };
        let groups = names.into_iter().zip(materials).map(group).collect();
        fits.then_some(Groups { groups, materials: material_names, runs })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{decode, encode};
    use super::*;
    use bth_format::layout::{GlossParameters, MaterialParameters, Morph, Texture};

    fn parameters(base_color_texture: u32) -> MaterialParameters {
        MaterialParameters {
            base_color: [0.5; 4],
            emissive: [0.0; 3],
            alpha_cutoff: 0.5,
            alpha_mode: 0,
            flags: 0,
            base_color_texture,
            emissive_texture: NONE,
            reserved: [0; 4],
        }
    }

    fn gloss(normal_texture: u32) -> GlossParameters {
        GlossParameters { metallic: 0.5, normal_texture, ..bth_import::NO_GLOSS }
    }

    fn texture() -> Texture {
        let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        Texture { image: [7; 16], wrap: [0, 1], filter: 1, transform, uv_set: 1, reserved: [0; 2] }
    }

    #[test]
    fn meshes_with_rows_out_of_range_do_not_come_back() {
        let attributes =
            Attributes { corners: vec![[0, 1, 0]], normals: vec![[0.0; 3]; 2], uvs: vec![[0.5; 2]; 2] };
        let opacity = Some(TriangleOpacities { rows: vec![1], micro: vec![9] });
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0; 3], [2.0; 3]],
            exact: Some(Exact {
                anchor: [1e6, 0.0, -7.0],
                positions: vec![[1e6; 3], [0.1; 3], [f64::EPSILON; 3]],
            }),
            triangles: vec![[0, 1, 2]],
            attributes: Some(attributes),
            opacity,
            groups: Some(Groups {
                groups: vec![Group { name: "wheel".into(), material: Some(0) }],
                materials: vec!["rubber".into()],
                runs: vec![[0, 0]],
            }),
            materials: Some(Materials {
                parameters: vec![parameters(0)],
                gloss: vec![gloss(0)],
                textures: vec![texture()],
                color_corners: vec![[0, 1, 1]],
                colors: vec![[65535; 4], [0, 1, 2, 3]],
                second_corners: vec![[1, 0, 1]],
                second_uvs: vec![[0.5, 0.0], [0.0, 2.0]],
            }),
            sequence: Some(Sequence { times: vec![0.0, 2.0], positions: vec![[1.5; 3]; 6] }),
            deformation: Some(Deformation {
                counts: bth_format::layout::Deformation {
                    joints: 4,
                    influence_sets: 1,
                    targets: 1,
                    reserved: 0,
                },
                joints: vec![[3, 0, 1, 2]; 3],
                weights: vec![[0.5, 0.5, 0.0, 0.0]; 3],
                morphs: vec![Morph { deltas: 1, first_delta: 0, first_row: 0, reserved: 0 }],
                morph_rows: vec![2],
                deltas: vec![[0.0, 1.0, 0.0]],
            }),
        };
        assert_eq!(decode::<Mesh>(&encode(&mesh)), Some(mesh.clone()));
        let short = Sequence { times: vec![0.0, 2.0], positions: vec![[1.5; 3]; 5] };
        let short = Mesh { sequence: Some(short), ..mesh.clone() };
        assert_eq!(decode::<Mesh>(&encode(&short)), None);
        let plain = Mesh {
            exact: None,
            attributes: None,
            opacity: None,
            groups: None,
            materials: None,
            sequence: None,
            deformation: None,
            ..mesh.clone()
        };
        assert_eq!(decode::<Mesh>(&encode(&plain)), Some(plain.clone()));
        let short = Mesh { positions: vec![[0.0; 3]; 2], ..plain };
        assert_eq!(decode::<Mesh>(&encode(&short)), None);
        let mut short = mesh.clone();
        short.exact.as_mut().unwrap().positions.pop();
        assert_eq!(decode::<Mesh>(&encode(&short)), None);
        let changes: [fn(&mut Groups); 3] =
            [|g| g.runs[0][1] = 1, |g| g.runs[0][0] = 1, |g| g.groups[0].material = Some(1)];
        for change in changes {
            let mut other = mesh.clone();
            change(other.groups.as_mut().unwrap());
            assert_eq!(decode::<Mesh>(&encode(&other)), None);
        }
        let changes: [fn(&mut Materials); 6] = [
            |m| m.parameters[0] = parameters(1),
            |m| m.parameters.push(parameters(0)),
            |m| m.color_corners[0][2] = 2,
            |m| m.color_corners.push([0; 3]),
            |m| m.second_corners[0][0] = 2,
            |m| m.second_corners.push([0; 3]),
        ];
        for change in changes {
            let mut other = mesh.clone();
            change(other.materials.as_mut().unwrap());
            assert_eq!(decode::<Mesh>(&encode(&other)), None);
        }
        let mut other = mesh;
        other.attributes.as_mut().unwrap().corners[0] = [0, 2, 0];
        assert_eq!(decode::<Mesh>(&encode(&other)), None);
    }
}
