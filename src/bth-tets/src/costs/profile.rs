//! The costs of tracing, measured on one machine with AVX-512: the constants of the cost model.

use serde::{Deserialize, Serialize};

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
    /// Tetrahedra.
    pub tets: TetCosts,
    /// Sizes in bytes of the tetrahedra that the two costs of a step were measured on.
    pub bytes: [f64; 2],
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

/// Costs of walks through tetrahedra.
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

impl Profile {
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
    fn the_profile_has_two_sizes() {
        let profile = Profile::default();
        assert!(profile.bytes[0] >= 1.0 && profile.bytes[1] >= 2.0 * profile.bytes[0]);
    }

    #[test]
    fn a_step_costs_more_where_tetrahedra_exceed_the_caches() {
        let walk = Walk { entry: 8.0, hit: 4.0, step: [2.0, 4.0] };
        let cost = |bytes: f64| walk.cost(1.0, 0.5, bytes, [1e6, 4e6]);
        assert_eq!([1e3, 1e6, 2e6, 4e6, 1e9].map(cost), [12.0, 12.0, 13.0, 14.0, 14.0]);
    }
}
