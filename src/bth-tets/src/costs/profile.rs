//! The costs of tracing on a machine, as `bthc calibrate` measures them.

use bth_format::layout::RecordKind;
use bth_import::error::{Error, Place, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// Bytes of a profile that are read; all of one takes a few thousand.
const LONGEST: u64 = 1 << 20;

/// Times on one thread, nanoseconds a ray in batches unless stated otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Version of the profile format.
    pub profile: u32,
    /// Instruction set that was measured; informative only.
    pub isa: String,
    /// The BVH.
    pub bvh: BvhCosts,
    /// Tetrahedra, by name of the record.
    pub tets: BTreeMap<String, TetCosts>,
    /// Sizes in bytes of the tetrahedra that the two costs of a step were measured on.
    pub bytes: [f64; 2],
    /// Tetrahedralization, microseconds a triangle.
    pub tetrahedralize: f64,
}

/// Costs of the BVH.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BvhCosts {
    /// Fixed cost of a ray, apart from nodes and leaves.
    pub ray: f64,
    /// An entered node of the *binary* BVH, for rays from outside: C_t and C_i of the paper. A
    /// visit of a wide node or leaf counts as several of these.
    pub outside: f64,
    /// An entered node of the binary BVH, for rays from surfaces.
    pub surface: f64,
    /// A visit of a wide node.
    pub node: f64,
    /// A visit of a leaf of up to 16 triangles.
    pub block: f64,
}

/// Costs of walks through tetrahedra in one record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TetCosts {
    /// Entered through the box, sixteen rays at a time: where the tetrahedra are the whole object.
    pub outside: Walk,
    /// From a known triangle, sixteen rays at a time.
    pub surface: Walk,
    /// Entered through the box, ray by ray: where they are a leaf of a BVH.
    pub alone: Walk,
}

/// Costs of a walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Walk {
    /// Preparation of the ray and search for the first tetrahedron.
    pub entry: f64,
    /// Intersection of the triangle at which the walk ends.
    pub hit: f64,
    /// C_tet, a step: in tetrahedra that fit the caches, and in tetrahedra of many times that size.
    pub step: [f64; 2],
}

impl Walk {
    /// Cost of a walk of `steps` steps in tetrahedra of `bytes` bytes, if the share `hits` of walks
    /// ends at a triangle. The cost of a step is interpolated by the logarithm of the size between
    /// the two measured sizes.
    pub fn cost(&self, steps: f64, hits: f64, bytes: f64, sizes: [f64; 2]) -> f64 {
        let share = (bytes / sizes[0]).max(1.0).log2() / (sizes[1] / sizes[0]).log2();
        let [small, large] = self.step;
        self.entry + hits * self.hit + steps * (small + share.clamp(0.0, 1.0) * (large - small))
    }
}

impl Default for Profile {
    fn default() -> Self {
        serde_json::from_str(include_str!("default-profile.json")).expect("a test reads it")
    }
}

/// The text of a regular file of at most [`LONGEST`] bytes.
///
/// # Errors
/// Those of the system; when it is no such file.
fn read(path: &Path) -> std::io::Result<String> {
    bth_files::regular_file(path)?;
    let mut text = String::new();
    std::fs::File::open(path)?.take(LONGEST + 1).read_to_string(&mut text)?;
    if text.len() as u64 > LONGEST {
        return Err(std::io::Error::other(format!("no profile: it has more than {LONGEST} bytes")));
    }
    Ok(text)
}

impl Profile {
    /// Reads a profile.
    ///
    /// # Errors
    /// `BTH-O060` when it cannot be read, `BTH-I060` when it is not a profile.
    pub fn read(path: &Path) -> Result<Profile> {
        let text = read(path).map_err(|e| Error::File {
            code: "BTH-O060",
            path: path.to_owned(),
            message: e.to_string(),
        })?;
        let wrong = |message: String| Error::Input {
            code: "BTH-I060",
            place: Place::File(path.to_owned()),
            message,
            hint: "write one with bthc calibrate".to_owned(),
        };
        let profile: Profile = serde_json::from_str(&text)
            .map_err(|e| wrong(format!("expected a profile of this machine's costs: {e}")))?;
        profile.check().map_err(wrong)?;
        Ok(profile)
    }

    /// Fails with a message unless all costs can be used.
    fn check(&self) -> std::result::Result<(), String> {
        if self.profile != 1 {
            return Err(format!("expected profile version 1, found {}", self.profile));
        }
        let bvh = self.bvh;
        let mut numbers = vec![bvh.ray, bvh.outside, bvh.surface, bvh.node, bvh.block];
        numbers.extend(self.bytes);
        numbers.push(self.tetrahedralize);
        for costs in self.tets.values() {
            for walk in [costs.outside, costs.surface, costs.alone] {
                numbers.extend([walk.entry, walk.hit]);
                numbers.extend(walk.step);
            }
        }
        for kind in RecordKind::ALL {
            if !self.tets.contains_key(kind.name()) {
                return Err(format!("expected the costs of {}, found none", kind.name()));
            }
        }
        if let Some(x) = numbers.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
            return Err(format!("expected costs of 0 or more, found {x}"));
        }
        if self.bytes[0] < 1.0 || self.bytes[1] < 2.0 * self.bytes[0] {
            return Err(format!(
                "expected two sizes, the second at least twice the first, found {:?}",
                self.bytes
            ));
        }
        Ok(())
    }

    /// Costs of a record.
    pub fn record(&self, kind: RecordKind) -> &TetCosts {
        self.tets.get(kind.name()).or_else(|| self.tets.values().next()).expect("checked when it was read")
    }

    /// The profile with three decimals; further digits are noise.
    pub fn rounded(mut self) -> Profile {
        let round = |x: &mut f64| *x = (*x * 1e3).round() / 1e3;
        let bvh = &mut self.bvh;
        [&mut bvh.ray, &mut bvh.outside, &mut bvh.surface, &mut bvh.node, &mut bvh.block]
            .into_iter()
            .for_each(round);
        for costs in self.tets.values_mut() {
            for walk in [&mut costs.outside, &mut costs.surface, &mut costs.alone] {
                round(&mut walk.entry);
                round(&mut walk.hit);
                walk.step.iter_mut().for_each(round);
            }
        }
        self.bytes.iter_mut().for_each(round);
        round(&mut self.tetrahedralize);
        self
    }

    /// BLAKE3 of the numbers, hexadecimal; the only part of a profile that compiled files contain.
    pub fn hash(&self) -> String {
        let text = serde_json::to_string(self).expect("numbers and names");
        blake3::hash(text.as_bytes()).to_hex().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_profile_can_be_used() {
        assert_eq!(Profile::default().check(), Ok(()));
    }

    #[test]
    fn a_file_that_is_too_long_for_a_profile_is_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        // Blanks are no part of the profile before them.
        let text = serde_json::to_string(&Profile::default()).unwrap();
        for (length, is_read) in [(LONGEST, true), (LONGEST + 1, false)] {
            std::fs::write(file.path(), text.clone() + &" ".repeat(length as usize - text.len())).unwrap();
            let found = Profile::read(file.path()).map_err(|e| e.to_string());
            assert_eq!(found.is_ok(), is_read, "{found:?}");
            assert!(found.err().is_none_or(|error| error.contains("more than 1048576 bytes")));
        }
    }

    #[test]
    fn a_step_costs_more_where_tetrahedra_exceed_the_caches() {
        let walk = Walk { entry: 8.0, hit: 4.0, step: [2.0, 4.0] };
        let cost = |bytes: f64| walk.cost(1.0, 0.5, bytes, [1e6, 4e6]);
        assert_eq!([1e3, 1e6, 2e6, 4e6, 1e9].map(cost), [12.0, 12.0, 13.0, 14.0, 14.0]);
    }

    #[test]
    fn profiles_with_costs_that_cannot_be_are_refused() {
        let refused = |change: fn(&mut Profile)| {
            let mut profile = Profile::default();
            change(&mut profile);
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), serde_json::to_string(&profile).unwrap()).unwrap();
            Profile::read(file.path()).unwrap_err().to_string()
        };
        assert!(refused(|p| p.bvh.ray = -1.0).contains("-1"));
        assert!(refused(|p| p.bytes = [0.0, 0.0]).contains("two sizes"));
        assert!(refused(|p| p.tets.clear()).contains("link32"));
        assert!(refused(|p| p.profile = 2).contains("version 1"));
    }

    #[test]
    fn a_profile_that_is_no_profile_is_bad_input() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "{\"profile\": 1, \"isa\": 3}").unwrap();
        assert!(matches!(Profile::read(file.path()), Err(Error::Input { code: "BTH-I060", .. })));
        assert!(matches!(Profile::read(Path::new("/nowhere/x")), Err(Error::File { code: "BTH-O060", .. })));
    }
}
