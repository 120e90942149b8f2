//! The crates `bvh` and `parry3d`, in f32 and f64, for `bth-bench truth`. `src/truth/process.rs`
//! describes commands and files; `setup` builds this program.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

const NONE: u32 = u32::MAX;

unsafe extern "C" {
    /// Processor time of the process in microseconds (POSIX).
    safe fn clock() -> std::ffi::c_long;
}

/// The files of a set.
struct Set {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    origins: Vec<[f64; 3]>,
    directions: Vec<[f64; 3]>,
    query: String,
}

fn read<const BYTES: usize, T>(path: &Path, number: fn([u8; BYTES]) -> T) -> Vec<[T; 3]> {
    let bytes = std::fs::read(path).expect("a file of the set");
    let row = |row: &[u8]| {
        [0, 1, 2].map(|k| number(row[k * BYTES..][..BYTES].try_into().expect("enough bytes")))
    };
    bytes.chunks_exact(3 * BYTES).map(row).collect()
}

impl Set {
    fn read(folder: &Path) -> Set {
        let floats = |name: &str| read(&folder.join(name), f64::from_le_bytes);
        Set {
            positions: floats("positions"),
            triangles: read(&folder.join("triangles"), u32::from_le_bytes),
            origins: floats("origins"),
            directions: floats("directions"),
            query: std::fs::read_to_string(folder.join("query")).expect("the query"),
        }
    }
}

/// Answers query i: t and id.
type Answer = Box<dyn Fn(usize) -> (f64, u32)>;

fn flag(is_true: bool) -> (f64, u32) {
    (0.0, is_true.into())
}

macro_rules! engines {
    ($real:ident, $bvh:ident, $parry:ident, $crate_of_parry:ident) => {
        mod $bvh {
            use super::{Answer, NONE, Set, flag};
            use bvh::aabb::{Aabb, Bounded};
            use bvh::bounding_hierarchy::BHShape;
            use bvh::{bvh::Bvh, ray::Ray};
            use nalgebra::{Point3, Vector3};

            struct Triangle {
                corners: [Point3<$real>; 3],
                id: u32,
                node: usize,
            }

            impl Bounded<$real, 3> for Triangle {
                fn aabb(&self) -> Aabb<$real, 3> {
                    let [a, b, c] = &self.corners;
                    Aabb::empty().grow(a).grow(b).grow(c)
                }
            }

            impl BHShape<$real, 3> for Triangle {
                fn set_bh_node_index(&mut self, node: usize) {
                    self.node = node;
                }
                fn bh_node_index(&self) -> usize {
                    self.node
                }
            }

            pub fn load(set: Set) -> Result<Answer, &'static str> {
                let point = |p: [f64; 3]| Point3::from(p.map(|x| x as $real));
                let corners = |t: &[u32; 3]| t.map(|v| point(set.positions[v as usize]));
                let triangle = |(id, t)| Triangle { corners: corners(t), id: id as u32, node: 0 };
                let mut triangles: Vec<_> = set.triangles.iter().enumerate().map(triangle).collect();
                if set.query == "inside" {
                    return Err("has no such query");
                }
                let tree = Bvh::build(&mut triangles);
                let directions = set.directions.iter().map(|d| Vector3::from(d.map(|x| x as $real)));
                let directions: Vec<_> = directions.collect();
                let origins: Vec<_> = set.origins.iter().map(|p| point(*p)).collect();
                Ok(Box::new(move |i| {
                    let ray = Ray::new(origins[i], directions[i]);
                    let mut best = (<$real>::INFINITY, NONE);
                    for triangle in tree.traverse_iterator(&ray, &triangles) {
                        // Its test culls back faces.
                        let [a, b, c] = &triangle.corners;
                        for [b, c] in [[b, c], [c, b]] {
                            let t = ray.intersects_triangle(a, b, c).distance;
                            if t < best.0 {
                                best = (t, triangle.id);
                            }
                        }
                    }
                    // Its rays are normalized.
                    let t = best.0 / directions[i].norm();
                    if set.query == "visible" { flag(t >= 1.0) } else { (t.into(), best.1) }
                }))
            }
        }

        mod $parry {
            use super::{Answer, NONE, Set, flag};
            use $crate_of_parry::math::Vector;
            use $crate_of_parry::query::{PointQuery, Ray, RayCast};
            use $crate_of_parry::shape::{TriMesh, TriMeshFlags};

            pub fn load(set: Set) -> Result<Answer, &'static str> {
                let point = |p: &[f64; 3]| Vector::from(p.map(|x| x as $real));
                let positions = set.positions.iter().map(point).collect();
                let oriented = set.query == "inside";
                let flags = if oriented { TriMeshFlags::ORIENTED } else { TriMeshFlags::empty() };
                let mesh = TriMesh::with_flags(positions, set.triangles.clone(), flags);
                let mesh = mesh.map_err(|_| "refuses the mesh")?;
                Ok(Box::new(move |i| {
                    let ray = Ray::new(point(&set.origins[i]), point(&set.directions[i]));
                    match &*set.query {
                        "inside" => flag(mesh.contains_local_point(ray.origin)),
                        "visible" => flag(mesh.cast_local_ray(&ray, 1.0, false).is_none()),
                        _ => match mesh.cast_local_ray_and_get_normal(&ray, <$real>::MAX, false) {
                            None => (f64::INFINITY, NONE),
                            Some(hit) => (hit.time_of_impact.into(), hit.subshape as u32),
                        },
                    }
                }))
            }
        }
    };
}

engines!(f32, bvh32, parry32, parry3d);
engines!(f64, bvh64, parry64, parry3d_f64);

fn main() -> ExitCode {
    let engine = std::env::args().nth(1).unwrap_or_default();
    let load: fn(Set) -> Result<Answer, &'static str> = match &*engine {
        "bvh" => bvh32::load,
        "bvh f64" => bvh64::load,
        "parry3d" => parry32::load,
        "parry3d-f64" => parry64::load,
        _ => return ExitCode::FAILURE,
    };
    println!("ok {}", if engine.starts_with("bvh") { env!("BVH") } else { env!("PARRY3D") });
    let mut loaded: Option<(std::path::PathBuf, usize, Answer)> = None;
    for line in std::io::stdin().lines().map_while(Result::ok) {
        if let Some(folder) = line.strip_prefix("load ") {
            let (folder, start) = (Path::new(folder).to_owned(), clock());
            let set = Set::read(&folder);
            let count = set.origins.len();
            match load(set) {
                Ok(answer) => {
                    loaded = Some((folder, count, answer));
                    println!("ok {}", (clock() - start) as f64 * 1e-6);
                }
                Err(why) => println!("no {why}"),
            }
        } else if let Some((folder, count, answer)) = &loaded {
            let start = clock();
            let answers: Vec<(f64, u32)> = (0..*count).map(answer).collect();
            let seconds = (clock() - start) as f64 * 1e-6;
            let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.join(name), bytes);
            write("t", answers.iter().flat_map(|a| a.0.to_le_bytes()).collect()).expect("answers");
            write("id", answers.iter().flat_map(|a| a.1.to_le_bytes()).collect()).expect("answers");
            println!("ok {seconds}");
        }
        std::io::stdout().flush().expect("the reader");
    }
    ExitCode::SUCCESS
}
