//! Bytes of a mesh and of all that belongs to it.

use super::super::rows::{RowReader, RowWriter};
use super::Codec;
use bth_format::layout::{MaterialParameters, NONE, Texture};
use bth_import::{Attributes, Deformation, Group, Groups, Materials, Mesh, Sequence, TriangleOpacities};

impl Codec for Mesh {
    fn write(&self, to: &mut RowWriter) {
        to.add(&self.positions);
        to.add(&self.triangles);
        let has_groups = if self.groups.is_some() { HAS_GROUPS } else { 0 };
        let has_materials = if self.materials.is_some() { HAS_MATERIALS } else { 0 };
        let has_sequence = if self.sequence.is_some() { HAS_SEQUENCE } else { 0 };
        let has_deformation = if self.deformation.is_some() { HAS_DEFORMATION } else { 0 };
        let has_attributes = u8::from(self.attributes.is_some());
        to.add(&[has_attributes | has_groups | has_materials | has_sequence | has_deformation]);
        if let Some(attributes) = &self.attributes {
            to.add(&attributes.corners);
            to.add(&attributes.normals);
            to.add(&attributes.uvs);
        }
        if let Some(groups) = &self.groups {
            groups.write(to);
        }
        if let Some(materials) = &self.materials {
            materials.write(to);
        }
        if let Some(sequence) = &self.sequence {
            to.add(&sequence.times);
            to.add(&sequence.positions);
        }
        if let Some(deformation) = &self.deformation {
            deformation.write(to);
        }
        // Without opacity nothing is added, so that such meshes are the bytes that they were before there was any.
        if let Some(opacity) = &self.opacity {
            to.add(&opacity.rows);
            to.add(&opacity.micro);
        }
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let (positions, triangles): (Vec<[f32; 3]>, Vec<[u32; 3]>) = (from.take()?, from.take()?);
        let parts = from.one::<u8>()?;
        let attributes = match parts & 1 {
            0 => None,
            _ => Some(Attributes { corners: from.take()?, normals: from.take()?, uvs: from.take()? }),
        };
        let groups = match parts & HAS_GROUPS {
            0 => None,
            _ => Some(Groups::read(from)?),
        };
        let materials = match parts & HAS_MATERIALS {
            0 => None,
            _ => Some(Materials::read(from)?),
        };
        let sequence = match parts & HAS_SEQUENCE {
            0 => None,
            _ => Some(Sequence { times: from.take()?, positions: from.take()? }),
        };
        let deformation = match parts & HAS_DEFORMATION {
            0 => None,
            _ => Some(Deformation::read(from)?),
        };
        let opacity = match from.is_empty() {
            true => None,
            false => Some(TriangleOpacities { rows: from.take()?, micro: from.take()? }),
        };
        let within =
            |rows: &[[u32; 3]], count: usize| rows.as_flattened().iter().all(|r| (*r as usize) < count);
        let attributes_fit = attributes.as_ref().is_none_or(|a| {
            a.corners.len() == triangles.len()
                && [a.normals.len(), a.uvs.len()].iter().all(|&n| n == 0 || within(&a.corners, n))
        });
        let opacity_fits = opacity.as_ref().is_none_or(|o| o.rows.len() == triangles.len());
        let groups_fit = groups
            .as_ref()
            .is_none_or(|g| g.runs.last().is_none_or(|run| (run[0] as usize) < triangles.len()));
        let known = groups.as_ref().map_or(0, |g: &Groups| g.materials.len());
        let materials_fit = materials.as_ref().is_none_or(|m: &Materials| {
            (m.parameters.is_empty() || m.parameters.len() == known)
                && (m.color_corners.is_empty() || m.color_corners.len() == triangles.len())
                && within(&m.color_corners, m.colors.len())
                && (m.second_corners.is_empty() || m.second_corners.len() == triangles.len())
                && within(&m.second_corners, m.second_uvs.len())
        });
        let sequence_fits = sequence.as_ref().is_none_or(|s: &Sequence| {
            !s.times.is_empty() && s.times.len().checked_mul(positions.len()) == Some(s.positions.len())
        });
        let fits = attributes_fit
            && sequence_fits
            && opacity_fits
            && groups_fit
            && materials_fit
            && within(&triangles, positions.len());
        fits.then_some(Mesh {
            positions,
            triangles,
            attributes,
            opacity,
            groups,
            materials,
            sequence,
            deformation,
        })
    }
}

/// Bit of the byte that says what follows the triangles of a mesh; the lowest stands for attributes.
const HAS_GROUPS: u8 = 2;
/// As [`HAS_GROUPS`], for how materials look.
const HAS_MATERIALS: u8 = 4;
/// As [`HAS_GROUPS`], for the frames of a sequence.
const HAS_SEQUENCE: u8 = 16;

/// As [`HAS_GROUPS`], for what moves the vertices.
const HAS_DEFORMATION: u8 = 8;

// Whether the rows fit each other is not checked here: the file that is made from them is.
impl Codec for Deformation {
    fn write(&self, to: &mut RowWriter) {
        to.add(std::slice::from_ref(&self.counts));
        to.add(&self.joints);
        to.add(&self.weights);
        to.add(&self.morphs);
        to.add(&self.morph_rows);
        to.add(&self.deltas);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        Some(Deformation {
            counts: from.one()?,
            joints: from.take()?,
            weights: from.take()?,
            morphs: from.take()?,
            morph_rows: from.take()?,
            deltas: from.take()?,
        })
    }
}

impl Codec for Materials {
    fn write(&self, to: &mut RowWriter) {
        to.add(&self.parameters);
        to.add(&self.textures);
        to.add(&self.color_corners);
        to.add(&self.colors);
        to.add(&self.second_corners);
        to.add(&self.second_uvs);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let (parameters, textures): (Vec<MaterialParameters>, Vec<Texture>) = (from.take()?, from.take()?);
        let known = |row: u32| row == NONE || (row as usize) < textures.len();
        let fits = |p: &MaterialParameters| known(p.base_color_texture) && known(p.emissive_texture);
        let fits = parameters.iter().all(fits);
        let (color_corners, colors) = (from.take()?, from.take()?);
        let (second_corners, second_uvs) = (from.take()?, from.take()?);
        let all = Materials { parameters, textures, color_corners, colors, second_corners, second_uvs };
        fits.then_some(all)
    }
}

impl Codec for Groups {
    fn write(&self, to: &mut RowWriter) {
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
    use bth_format::layout::Morph;

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
