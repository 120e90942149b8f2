//! Parts of deforming meshes that a joint moves rigidly, as instances below its node: its transform
//! to world space times the inverse bind matrix, which is what the skin does to their vertices
//! (glTF 2.0 specification, §3.7.3.1).

use bth_scene::{Deformer, Interpolation, JointSet, Node, Object, Property, Source, Transform};
use glam::{DMat3, DVec3};

use crate::error::Result;
use crate::gltf::placed_mesh::GltfPart;
use crate::gltf::rigid_parts::RigidParts;
use crate::gltf::scene::importer::Importer;

/// Triangles from which a part is an instance, where something else is left in the object that
/// deforms: placing an instance takes about as long as 100 to 150 triangles do that are deformed
/// and refitted (`docs/notes/scenes.md`).
const LEAST_TRIANGLES: u64 = 128;

/// The largest condition number of a part's transform; instances may reach 2^24.
const MOST_CONDITION: f64 = (1u64 << 20) as f64;
/// The largest norm of the transform of a part and of its inverse, so that both stay in the range
/// of f32.
const MOST_NORM: f64 = (1u64 << 60) as f64;

/// Rows of a matrix that is applied to columns (x, y, z, 1).
type AffineMatrix = [[f64; 4]; 3];

impl Importer<'_, '_> {
    /// Takes the parts that joints move rigidly out of the objects that deform. The nodes, tracks
    /// and deformers of the manifest are complete.
    ///
    /// # Errors
    /// As for the import of the meshes.
    pub(super) fn rigid_parts(&mut self) -> Result<()> {
        let (mut left, mut gone) = (Vec::new(), Vec::new());
        for deformer in std::mem::take(&mut self.manifest.deformers) {
            let list = if self.take_parts(&deformer)? { &mut left } else { &mut gone };
            list.push(deformer);
        }
        self.manifest.deformers = left;
        // From the last row on, so that the rows of the others stay.
        gone.sort_by_key(|deformer| std::cmp::Reverse(deformer.object));
        for Deformer { node, object, .. } in gone {
            self.manifest.tracks.retain(|track| track.node != node || track.property != Property::Weights);
            self.manifest.nodes.set_shown(node, None, None);
            self.remove_object(object);
        }
        Ok(())
    }

    /// Takes the rigid parts out of the object of a deformer. Returns whether anything is left.
    fn take_parts(&mut self, deformer: &Deformer) -> Result<bool> {
        let Source::Deforming { mesh, .. } = self.manifest.objects[deformer.object].source else {
            return Ok(true);
        };
        let Some(skin) = deformer.skin else { return Ok(true) };
        let parts = RigidParts::of(self.file, mesh as usize)?;
        let (counts, mut others) = parts.counts();
        let mut taken = Vec::new();
        for (joint, triangles) in counts {
            match self.can_be_placed(skin, joint as usize) {
                true => taken.push((joint, triangles)),
                false => others += triangles,
            }
        }
        if others > 0 {
            taken.retain(|(_, triangles)| *triangles >= LEAST_TRIANGLES);
        }
        for (joint, _) in &taken {
            self.place_part(deformer, skin, mesh, *joint);
        }
        self.report.rigid_parts += taken.len() as u64;
        let without: JointSet = taken.iter().map(|(joint, _)| *joint).collect();
        let path = self.path.to_owned();
        self.manifest.objects[deformer.object].source = Source::Deforming { path, mesh, without };
        Ok(others > 0 || taken.is_empty())
    }

    /// Adds the instance of a part.
    fn place_part(&mut self, deformer: &Deformer, skin: usize, mesh: u32, joint: u32) {
        let skin = &self.manifest.skins[skin];
        let parent = skin.joints[joint as usize];
        let inverse_bind = skin.inverse_binds.as_ref().map(|all| all[joint as usize]);
        let joint_name = self.manifest.nodes.name(parent).to_owned();
        let key = GltfPart::Rigid { mesh, joint };
        let object = match self.objects.get(&key) {
            Some(object) => *object,
            None => {
                let name = format!("{}/{joint_name}", self.manifest.objects[deformer.object].name);
                let source = Source::RigidPart { path: self.path.to_owned(), mesh, joint };
                let object = self.new_object(&name, mesh as usize, source);
                self.objects.insert(key, object);
                object
            }
        };
        let name = format!("{}/{joint_name}", self.manifest.nodes.name(deformer.node));
        let name = self.names.nodes.unique(&name, String::new());
        let visible = self.chain(deformer.node).all(|node| node.visible);
        let transform = inverse_bind.map_or_else(Transform::default, Transform::Matrix);
        let (parent, object) = (Some(parent), Some(object));
        self.manifest.nodes.push(Node { name: &name, parent, transform, object, group: None, visible });
    }

    /// A node of the manifest and all above it, upwards.
    fn chain(&self, row: usize) -> impl Iterator<Item = Node<'_>> {
        let nodes = &self.manifest.nodes;
        std::iter::successors(Some(nodes.get(row)), |node| Some(nodes.get(node.parent?)))
    }

    /// Returns true if an instance can take the place of what a joint moves, at all times: the
    /// joint is visible, and its transform has an inverse that is accurate enough for rays and
    /// keeps left and right.
    fn can_be_placed(&self, skin: usize, joint: usize) -> bool {
        let skin = &self.manifest.skins[skin];
        let Some(&row) = skin.joints.get(joint) else { return false };
        let mut bounds =
            skin.inverse_binds.as_ref().map_or(Some(Bounds::IDENTITY), |all| Bounds::of(&all[joint]));
        let mut next = Some(row);
        while let Some(row) = next {
            let node = self.manifest.nodes.get(row);
            bounds = bounds.zip(self.bounds(row)).map(|(a, b)| a.times(&b)).filter(|_| node.visible);
            next = node.parent;
        }
        bounds.is_some_and(|bounds| bounds.are_usable())
    }

    /// Bounds of the linear part of a node's transform at all times; `None` if it is unbounded.
    fn bounds(&self, row: usize) -> Option<Bounds> {
        let tracks = &self.manifest.tracks;
        match self.manifest.nodes.get(row).transform {
            Transform::Matrix(rows) => Bounds::of(&rows),
            Transform::Parts { scale, .. } => {
                match tracks.iter().find(|t| t.node == row && t.property == Property::Scale) {
                    None => Bounds::of_scales(&scale),
                    // Between keys splines reach any value.
                    Some(track) if track.interpolation == Interpolation::Cubic => None,
                    Some(track) => {
                        let positive = track.values.iter().all(|x| *x > 0.0);
                        Bounds::of_scales(&track.values).filter(|_| positive)
                    }
                }
            }
        }
    }

    /// Removes an object to which no node and no deformer refers.
    fn remove_object(&mut self, row: usize) {
        let Object { name, .. } = self.manifest.objects.remove(row);
        self.names.objects.remove(&name);
        let nodes = &mut self.manifest.nodes;
        for node in 0..nodes.len() {
            if let Some(object) = nodes.object(node).filter(|object| *object > row) {
                nodes.set_shown(node, Some(object - 1), None);
            }
        }
        let deformers = self.manifest.deformers.iter_mut().map(|deformer| &mut deformer.object);
        for object in deformers.chain(self.objects.values_mut()).filter(|object| **object > row) {
            *object -= 1;
        }
    }
}

/// Bounds of the linear part of a transform that changes with time.
#[derive(Clone, Copy)]
struct Bounds {
    /// Of the spectral norm, and of the inverse's spectral norm.
    norm: f64,
    inverse: f64,
    /// True if it exchanges left and right.
    mirrors: bool,
}

impl Bounds {
    const IDENTITY: Bounds = Bounds { norm: 1.0, inverse: 1.0, mirrors: false };

    /// Of a matrix; `None` if it is singular.
    fn of(rows: &AffineMatrix) -> Option<Bounds> {
        let [a, b, c] = rows.map(|[x, y, z, _]| DVec3::new(x, y, z));
        let linear = DMat3::from_cols(a, b, c);
        let determinant = linear.determinant();
        let inverse = linear.inverse();
        let usable = determinant != 0.0 && inverse.is_finite() && linear.is_finite();
        let of = |m| spectral_norm(m);
        usable.then(|| Bounds { norm: of(linear), inverse: of(inverse), mirrors: determinant < 0.0 })
    }

    /// Of a scale of each axis by one of these factors, three for each time, none of them zero.
    fn of_scales(factors: &[f64]) -> Option<Bounds> {
        let sizes = || factors.iter().map(|x| x.abs());
        let (norm, least) = (sizes().fold(0.0, f64::max), sizes().fold(f64::INFINITY, f64::min));
        let mirrors = factors.iter().take(3).filter(|x| **x < 0.0).count() % 2 == 1;
        (least > 0.0).then(|| Bounds { norm, inverse: 1.0 / least, mirrors })
    }

    fn times(&self, other: &Bounds) -> Bounds {
        Bounds {
            norm: self.norm * other.norm,
            inverse: self.inverse * other.inverse,
            mirrors: self.mirrors != other.mirrors,
        }
    }

    fn are_usable(&self) -> bool {
        let accurate = self.norm * self.inverse <= MOST_CONDITION;
        !self.mirrors && accurate && self.norm <= MOST_NORM && self.inverse <= MOST_NORM
    }
}

/// The largest factor by which a matrix lengthens a vector, from above by at most 1 %: the
/// Frobenius norm of a power of AᵀA, whose eigenvalues are the squares of the singular values of A.
fn spectral_norm(a: DMat3) -> f64 {
    const SQUARINGS: i32 = 6;
    let frobenius = |m: &DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = frobenius(&a);
    let a = a * (1.0 / size);
    let mut power = a.transpose() * a;
    // The logarithm of the factors that have been taken out of the power, divided by its exponent.
    let (mut taken, mut exponent) = (0.0, 1.0);
    for _ in 0..SQUARINGS {
        let own = frobenius(&power);
        taken += own.ln() / exponent;
        power *= 1.0 / own;
        power = power * power;
        exponent *= 2.0;
    }
    size * (0.5 * (taken + frobenius(&power).ln() / exponent)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    #[test]
    fn spectral_norms_bound_and_are_nearly_reached() {
        let mut rng = Rng::new(3);
        let mut unit = || rng.below(1 << 30) as f64 / (1u64 << 29) as f64 - 1.0;
        for size in [1e-30, 1.0, 1e30] {
            for _ in 0..50 {
                let m = DMat3::from_cols_array(&std::array::from_fn(|_| size * unit()));
                let norm = spectral_norm(m);
                let mut greatest = 0.0f64;
                for _ in 0..4000 {
                    let v = DVec3::new(unit(), unit(), unit()).normalize();
                    greatest = greatest.max((m * v).length());
                }
                assert!(greatest <= norm * (1.0 + 1e-12) && norm <= 1.03 * greatest, "{norm} {greatest}");
            }
        }
        let rotation = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(1.0);
        assert!((spectral_norm(rotation) - 1.0).abs() < 0.01);
    }

    #[test]
    fn bounds_are_those_of_all_factors_and_matrices() {
        let turned = [[0.0, -2.0, 0.0, 9.0], [2.0, 0.0, 0.0, 9.0], [0.0, 0.0, 2.0, 9.0]];
        let bounds = Bounds::of(&turned).unwrap();
        assert!(
            (bounds.norm - 2.0).abs() < 0.03 && (bounds.inverse - 0.5).abs() < 0.01 && bounds.are_usable()
        );
        assert!(Bounds::of(&[[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]).is_none());
        let scales = Bounds::of_scales(&[1.0, 2.0, 3.0, 0.5, 1.0, 1.0]).unwrap();
        assert_eq!((scales.norm, scales.inverse, scales.mirrors), (3.0, 2.0, false));
        assert!(Bounds::of_scales(&[1.0, 0.0, 1.0]).is_none());
        let mirrored = Bounds::of_scales(&[-1.0, 1.0, 1.0]).unwrap();
        assert!(!mirrored.are_usable() && mirrored.times(&mirrored).are_usable());
        assert!(!Bounds::of_scales(&[1.0, 1.0, 1e-7]).unwrap().are_usable());
        assert!(!Bounds::of_scales(&[1e-30; 3]).unwrap().are_usable());
    }
}
