//! The figures of the paper's Tables 1 and 2, milliseconds: construction on one thread, rendering on six cores.

/// A scene of the paper.
pub(super) struct Published {
    /// Its name there.
    pub(super) name: &'static str,
    /// Faces there.
    pub(super) faces: u64,
    /// How our names of such models begin.
    pub(super) ours: &'static str,
    /// Construction and rendering of BTH32, BTH20, Tet32, Tet20, BVH and k-d tree.
    pub(super) figures: [Option<[f64; 2]>; 6],
}

/// The structures, in the order of the figures.
pub(super) const STRUCTURES: [&str; 6] = ["BTH32", "BTH20", "Tet32", "Tet20", "BVH", "k-d tree"];

const fn direct(bth32: [f64; 2], bth20: [f64; 2], bvh: [f64; 2], kd: [f64; 2]) -> [Option<[f64; 2]>; 6] {
    [Some(bth32), Some(bth20), None, None, Some(bvh), Some(kd)]
}

/// Table 1, and of Table 2 Armadillo-2, which is the same model tetrahedralized whole.
pub(super) const SCENES: [Published; 8] = [
    Published {
        name: "Torus knot",
        faces: 2_880,
        ours: "neptun_torus_knot",
        figures: direct([103.20, 14.94], [101.79, 14.66], [2.43, 17.50], [24.26, 15.13]),
    },
    Published {
        name: "Armadillo",
        faces: 345_938,
        ours: "armadillo",
        figures: [
            Some([2398.8, 79.54]),
            Some([3367.7, 77.95]),
            Some([8392.1, 150.84]),
            Some([8380.4, 118.28]),
            Some([373.1, 78.71]),
            Some([1460.6, 98.18]),
        ],
    },
    Published {
        name: "Bmw",
        faces: 385_162,
        ours: "bmw",
        figures: direct([4293.72, 92.18], [4197.93, 87.73], [359.97, 94.36], [2489.23, 88.345]),
    },
    Published {
        name: "Hairball",
        faces: 2_880_000,
        ours: "hairball",
        figures: direct([14527.3, 274.73], [14541.7, 266.58], [2976.25, 271.20], [62846.8, 313.78]),
    },
    Published {
        name: "Crown",
        faces: 3_540_310,
        ours: "crown",
        figures: direct([24365.3, 241.61], [24311.9, 231.10], [3808.49, 242.66], [26292.0, 247.21]),
    },
    Published {
        name: "Sponza",
        faces: 262_267,
        ours: "sponza",
        figures: direct([1944.0, 378.73], [1951.73, 349.98], [245.38, 384.20], [2028.37, 213.80]),
    },
    Published {
        name: "San Miguel",
        faces: 9_980_699,
        ours: "sanmiguel",
        figures: direct([18569.9, 550.58], [18536.5, 516.49], [11185.1, 586.89], [77815.5, 315.46]),
    },
    Published {
        name: "Vokselia",
        faces: 1_875_632,
        ours: "vokselia",
        figures: direct([4690.44, 186.13], [4643.17, 173.60], [1546.62, 190.15], [4521.61, 194.70]),
    },
];

/// The paper's scene that a model of ours stands for.
pub(super) fn of(model: &str) -> Option<&'static Published> {
    // The box of knots is none of the paper's.
    let name = model.to_lowercase();
    SCENES.iter().find(|s| name.starts_with(s.ours) && !name.contains("_in_a_box"))
}

impl Published {
    /// Construction and rendering time of a structure.
    pub(super) fn figure(&self, structure: &str) -> Option<[f64; 2]> {
        self.figures[STRUCTURES.iter().position(|s| *s == structure)?]
    }

    /// Ratio of the rendering (1) or construction (0) times of two structures.
    pub(super) fn ratio(&self, of: &str, to: &str, which: usize) -> Option<f64> {
        Some(self.figure(of)?[which] / self.figure(to)?[which])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_stand_for_the_papers_scenes() {
        assert_eq!(of("armadillo86k").map(|s| s.name), Some("Armadillo"));
        assert_eq!(of("neptun_torus_knot").map(|s| s.name), Some("Torus knot"));
        assert!(of("neptun_torus_knots_in_a_box").is_none() && of("igea").is_none());
        let ratio = of("sponza_dabrovic").and_then(|s| s.ratio("BTH20", "BVH", 1)).unwrap();
        assert!((ratio - 0.911).abs() < 1e-3);
    }
}
