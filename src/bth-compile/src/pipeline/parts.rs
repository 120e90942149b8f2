//! The wide BVH of a mesh of very many triangles, built in parts: a binary tree takes several times
//! the memory of the mesh and of the wide tree.

use super::hashed::Hashed;
use super::object::Hierarchy;
use super::tree::{BuildTree, CountVisits, TreeOptions, rebuilt};
use crate::bvh::{self, BvhReport, CollapseOptions, CollapseReport, Part, Parts, Weighed};
use crate::error::Result;
use crate::free::KeepFree;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::stage::Stage;
use bth_import::{Mesh, TRIANGLES_AT_ONCE};
use std::cell::OnceCell;

/// Builds the wide tree of a mesh in parts of at most `most` triangles.
pub(super) struct BuildInParts<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) options: TreeOptions<'a>,
    pub(super) most: usize,
}

/// Returns true if a mesh of this size is built in parts with these options: those that need the
/// binary tree of all triangles exclude it.
pub(super) fn in_parts(triangles: usize, options: &CompileOptions) -> bool {
    triangles as u64 > TRIANGLES_AT_ONCE
        && !options.deformable
        && options.structure != Structure::Tets
        && options.free.keep == KeepFree::None
        && options.costs.rays.is_none()
}

impl Stage for BuildInParts<'_> {
    type Output = (Hierarchy, BvhReport, CollapseReport);
    const NAME: &'static str = "parts";
    const VERSION: &'static str = "1";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { mesh, options, most } = self;
        let Parts { ids, whole } = Parts::of(mesh, most, monitor)?;
        let area = whole.map_or(0.0, |whole| whole.half_area());
        let (mut parts, mut reports) = (Vec::with_capacity(ids.len()), BvhReport::default());
        for ids in ids {
            let built = bvh::build_part(mesh, &ids, options.bvh.quality, monitor)?;
            drop(ids);
            let (tree, report) = rebuilt(mesh, built, &options, monitor)?;
            let hashed = Hashed { mesh, known: &OnceCell::new() };
            let visits =
                CountVisits { built: BuildTree { mesh: hashed, options }, tree: &tree }.run(monitor)?;
            let weighed = Weighed { bvh: &tree, probabilities: visits.as_deref() };
            let collapse = CollapseOptions { whole, ..CollapseOptions::default() };
            let (wide, of_part) = bvh::collapse(mesh, weighed, &[], &collapse, monitor)?;
            let root = tree.nodes[0];
            reports.add(&report, if area > 0.0 { root.half_area() / area } else { 0.0 });
            parts.push(Part { wide, root, report: of_part });
        }
        reports.dropped = mesh.triangles.len() as u64 - reports.triangles;
        let (wide, report) = bvh::join(parts)?;
        let bounds = whole.map(|whole| (whole.lower, whole.upper));
        Ok((Hierarchy { wide, bounds, dropped: reports.dropped as u32 }, reports, report))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::object::{Object, ObjectSource};
    use crate::pipeline::{build_tree, compile};
    use crate::source::TriangleMesh;
    use bth::rays::Ray;
    use bth_import::{PositionRows, Silent, import_triangles};
    use std::path::Path;

    /// The file of a mesh that is built in parts.
    fn file_in_parts(model: &TriangleMesh<'_>, most: usize, options: &CompileOptions) -> bth_format::File {
        let TriangleMesh { positions, triangles } = *model;
        let (mesh, _) =
            import_triangles(Path::new("mesh"), positions, triangles, options.wanted(), &Silent).unwrap();
        let stage = BuildInParts { mesh: &mesh, options: TreeOptions::of(options), most };
        let (hierarchy, bvh, _) = stage.run(&Silent).unwrap();
        let (tree, whole) = build_tree(&mesh, options, &Silent).unwrap();
        assert_eq!((bvh.triangles, bvh.dropped), (whole.triangles, whole.dropped));
        assert_eq!(hierarchy.bounds, tree.nodes.first().map(|root| (root.lower, root.upper)));
        let source = ObjectSource { mesh, on_grid: None, free: None, motion: None };
        Object::new(source, hierarchy, Vec::new()).file(String::new(), &[], options).unwrap().0
    }

    /// Answers equal the answers of the file that is built at once, and every byte is verified.
    #[test]
    fn files_of_parts_are_whole_and_answer_alike() {
        let mut random = bth_random::Rng::new(11);
        let mut positions: Vec<[f32; 3]> = Vec::new();
        let mut triangles = vec![[0, 0, 1]];
        for i in 0..3000 {
            let center = [0; 3].map(|_: i32| random.unit_f64() as f32 * 10.0);
            positions.extend([0; 3].map(|_: i32| center.map(|x| x + random.unit_f64() as f32)));
            triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let model = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
        for options in
            [CompileOptions::fast(), CompileOptions { structure: Structure::Bvh, ..Default::default() }]
        {
            let (whole, _) = compile(model, &options, &Silent).unwrap();
            let whole = bth::from_bytes(&whole.bytes).unwrap();
            for most in [17, 400, 2999] {
                let file = file_in_parts(&model, most, &options);
                bth_format::verify::verify(&file).unwrap();
                let scene = bth::from_file(file).unwrap();
                for _ in 0..500 {
                    let [origin, to] = [0; 2].map(|_| [0; 3].map(|_: i32| random.unit_f64() as f32 * 10.0));
                    let ray = Ray::new(origin, [0, 1, 2].map(|k| to[k] - origin[k]));
                    assert_eq!(scene.nearest(&ray), whole.nearest(&ray));
                }
            }
        }
    }

    #[test]
    fn only_what_needs_no_tree_of_all_triangles_is_built_in_parts() {
        let many = TRIANGLES_AT_ONCE as usize + 1;
        let mut options = CompileOptions::default();
        assert!(in_parts(many, &options) && !in_parts(many - 1, &options));
        options.deformable = true;
        assert!(!in_parts(many, &options));
        let tets = CompileOptions { structure: Structure::Tets, ..CompileOptions::default() };
        assert!(!in_parts(many, &tets));
    }
}
