//! Regret: by how much the selections of the rules are slower than the best one, found by measuring every selection.

use super::results::{Regret, Selection};
use crate::clock::Clock;
use crate::model::Model;
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::rounds::least;
use crate::structures::{self, Use};
use crate::tracer::Tracer;
use anyhow::{Result, ensure};
use bth::rays::Hit;
use bth_compile::bvh::BinaryBvh;
use bth_compile::costs::{self, Select};
use bth_compile::marks::Marks;
use bth_compile::pipeline::{self, CompileOptions};
use bth_compile::{Silent, bvh, marks, tets};
use std::collections::BTreeMap;

/// Levels of the binary BVH whose nodes are tried: 26 selections.
const LEVELS: u32 = 3;
/// Nodes of fewer triangles are not tried, nor offered to the rules.
const LEAST_TRIANGLES: u32 = 128;
/// Pixels of the camera.
const SIZE: (u32, u32) = (256, 144);

/// Measures every selection of the topmost nodes of a small model, and the selections of the rules.
///
/// # Errors
/// If the model cannot be used.
pub(super) fn measure(model: &Model, rounds: usize, progress: &Progress) -> Result<Regret> {
    let options = CompileOptions { geometry: false, ..CompileOptions::default() };
    let (tree, _) = bvh::build(&model.mesh, &options.bvh, &Silent)?;
    let (marks, _) = marks::mark(&model.mesh, &tree, &Silent)?;
    let mut selections = all(&tree, &marks, 0, LEVELS);
    let tried = selections.len();
    let mut names: Vec<(String, Vec<u32>)> = Vec::new();
    for (name, select) in [("default", Select::Best), ("paper's rule", Select::Paper)] {
        let costs =
            costs::CostOptions { select, minimum_triangles: LEAST_TRIANGLES, ..options.costs.clone() };
        let (choice, _) = costs::choose(&model.mesh, &tree, &marks, &costs, options.storage(), &Silent)?;
        let (built, _) = tets::build(&model.mesh, &tree, &choice.chosen, &options.tets, &Silent)?;
        let (built, _) = costs::probe(&model.mesh, &tree, built, &costs, options.storage(), &Silent)?;
        let nodes: Vec<u32> = built.iter().map(|b| b.0).collect();
        if !selections.contains(&nodes) {
            selections.push(nodes.clone());
        }
        names.push((name.to_owned(), nodes));
    }
    names.push(("plain BVH".to_owned(), Vec::new()));

    let mut wanted: Vec<u32> = selections.iter().flatten().copied().collect();
    wanted.sort_unstable();
    wanted.dedup();
    let mut meshes = BTreeMap::new();
    for node in wanted {
        progress.show(format!("{}: tetrahedra of node {node}", model.name));
        let (built, _) = tets::build(&model.mesh, &tree, &[node], &options.tets, &Silent)?;
        if let [(at, _)] = built[..]
            && at == node
        {
            meshes.extend(built);
        }
    }
    selections.retain(|nodes| nodes.iter().all(|n| meshes.contains_key(n)));
    let mut tracers: Vec<Box<dyn Tracer>> = Vec::new();
    for nodes in &selections {
        let built: Vec<(u32, tets::TetMesh)> = nodes.iter().map(|n| (*n, meshes[n].clone())).collect();
        let file = pipeline::assemble(&model.mesh, &tree, &built, &options, &Silent)?;
        tracers.push(structures::tracer(&file.bytes, Use::Batch)?);
    }
    progress.show(format!("{}: {} selections", model.name, selections.len()));
    let times = mixed(model, &tracers, rounds)?;
    let best = times.iter().copied().fold(f64::INFINITY, f64::min);
    let selection = |name: String, row: usize| Selection {
        name,
        nodes: selections[row].clone(),
        nanoseconds: times[row],
        regret: times[row] / best - 1.0,
    };
    let row_of = |nodes: &[u32]| selections.iter().position(|s| s == nodes);
    let fastest = times.iter().position(|t| *t == best);
    let mut shown: Vec<Selection> =
        fastest.map(|row| selection("best found".to_owned(), row)).into_iter().collect();
    shown.extend(names.into_iter().filter_map(|(name, nodes)| Some(selection(name, row_of(&nodes)?))));
    Ok(Regret { model: model.name.clone(), triangles: model.triangles(), tried, selections: shown })
}

/// All selections of suitable nodes in so many levels from a node down, none below another.
fn all(tree: &BinaryBvh, marks: &Marks, node: u32, levels: u32) -> Vec<Vec<u32>> {
    let at = &tree.nodes[node as usize];
    if levels == 0 || at.count < LEAST_TRIANGLES {
        return vec![Vec::new()];
    }
    let mut found = Vec::new();
    let (left, right) = (all(tree, marks, node + 1, levels - 1), all(tree, marks, at.right, levels - 1));
    for a in &left {
        found.extend(right.iter().map(|b| a.iter().chain(b).copied().collect::<Vec<u32>>()));
    }
    if marks.suitable[node as usize] {
        found.push(vec![node]);
    }
    found
}

/// Nanoseconds of a ray through each: a quarter from the camera, the others bounces and ambient occlusion.
fn mixed(model: &Model, tracers: &[Box<dyn Tracer>], rounds: usize) -> Result<Vec<f64>> {
    let plain = structures::compile(model, &structures::BVH)?;
    let scene = bth::from_bytes(&plain.bytes)?;
    let options = rays::Options { size: SIZE, most: 40_000, view: None };
    let (_, sets) = rays::sets(&Finder::new(model, &scene), &options);
    let weight = |set: &RaySet| match set.name {
        "primary" => 0.25,
        "diffuse-beside" | "ao-beside" => 0.375,
        _ => 0.0,
    };
    let sets: Vec<&RaySet> = sets.iter().filter(|s| weight(s) > 0.0 && !s.rays.is_empty()).collect();
    ensure!(sets.len() == 3, "{}: too few rays hit", model.name);
    let mut total = vec![0.0; tracers.len()];
    for set in sets {
        let mut hits = vec![Hit::MISS; set.rays.len()];
        let mut found = vec![false; set.rays.len()];
        let times = least(tracers, rounds, |_, tracer| {
            Some(Clock::ThreadCpu.time(|| match set.any {
                true => tracer.any(set.batch(), &mut found),
                false => tracer.nearest(set.batch(), &mut hits),
            }))
        });
        for (total, seconds) in total.iter_mut().zip(times) {
            *total += weight(set) * 1e9 * seconds.unwrap_or(0.0) / set.rays.len() as f64;
        }
    }
    Ok(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_selections_are_disjoint_and_all_there() {
        let model = Model::load("blob:2000").unwrap();
        let (tree, _) = bvh::build(&model.mesh, &bvh::BvhOptions::default(), &Silent).unwrap();
        let marks = Marks { suitable: vec![true; tree.nodes.len()] };
        let found = all(&tree, &marks, 0, 3);
        assert_eq!(found.len(), 26);
        for nodes in &found {
            let mut end = 0;
            for n in nodes {
                assert!(*n >= end, "{nodes:?}");
                end = n + 2 * tree.nodes[*n as usize].count - 1;
            }
        }
        let none = Marks { suitable: vec![false; tree.nodes.len()] };
        assert_eq!(all(&tree, &none, 0, 3), [Vec::<u32>::new()]);
    }
}
