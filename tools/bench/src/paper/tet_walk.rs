//! The paper's walk through tetrahedra, one ray at a time. The three vertices of the entry face are
//! kept in projection on a plane perpendicular to the ray; the fourth vertex is projected, and
//! signs of cross products give the exit face.

use super::tet_records::{FACE, HULL, Tets};
use crate::moller_trumbore::{cross, dot, moller_trumbore, sub};
use bth::rays::Ray;

/// A plane perpendicular to a ray, with the origin on the ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    origin: [f32; 3],
    u: [f32; 3],
    v: [f32; 3],
}

impl Plane {
    /// For a direction of length 1 (Duff et al. 2017, without branches).
    pub(super) fn new(ray: &Ray) -> Plane {
        let [x, y, z] = ray.direction;
        let sign = 1f32.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        let u = [1.0 + sign * x * x * a, sign * b, -sign * x];
        let v = [b, sign + y * y * a, -y];
        Plane { origin: ray.origin, u, v }
    }

    #[inline(always)]
    fn project(&self, p: [f32; 3]) -> [f32; 2] {
        let d = sub(p, self.origin);
        [dot(self.u, d), dot(self.v, d)]
    }
}

/// Twice the area of the triangle of the ray's point and two others.
#[inline(always)]
fn side(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    /// At a face: its row and t.
    Face(u32, f32),
    /// Outside of the box, or beyond the end of the ray.
    Left,
    /// Without a result, because rounding errors led the walk astray.
    Lost,
}

impl<const STORED: usize> Tets<STORED> {
    fn corners_of(&self, vertex: [u32; 3]) -> [[f32; 3]; 3] {
        vertex.map(|v| self.vertices[v as usize])
    }

    /// Walks from outside, through the nearest face of the hull.
    pub(super) fn enter(&self, ray: &Ray, plane: &Plane, best: f32) -> End {
        let mut entry: Option<(f32, usize)> = None;
        for (row, face) in self.hull.iter().enumerate() {
            let limit = entry.map_or(best, |e| e.0);
            if let Some(hit) = moller_trumbore(ray, self.corners_of(face.vertex), limit) {
                entry = Some((hit.t, row));
            }
        }
        match entry {
            Some((_, row)) => self.walk(ray, plane, self.hull[row].tet, self.hull[row].vertex, best),
            None => End::Left,
        }
    }

    /// Walks from the tetrahedron that holds the ray's origin.
    pub(super) fn start(&self, ray: &Ray, plane: &Plane, tet: u32, best: f32) -> End {
        let vertex = self.corners[tet as usize];
        // The face through which the line comes in: behind the origin, its corners around the line.
        for k in 0..4 {
            let mut face = [1, 2, 3].map(|i| vertex[(k + i) % 4]);
            let p = face.map(|v| plane.project(self.vertices[v as usize]));
            let s = [side(p[0], p[1]), side(p[1], p[2]), side(p[2], p[0])];
            let around = s.iter().all(|s| *s >= 0.0) || s.iter().all(|s| *s <= 0.0);
            if !around {
                continue;
            }
            let [a, b, c] = self.corners_of(face);
            let normal = cross(sub(b, a), sub(c, a));
            let t = dot(normal, sub(a, ray.origin)) / dot(normal, ray.direction);
            if t <= 0.0 {
                face.sort_unstable();
                return self.walk(ray, plane, tet, face, best);
            }
        }
        End::Lost
    }

    /// Walks from a tetrahedron that was entered through a face.
    #[inline(always)]
    fn walk(&self, ray: &Ray, plane: &Plane, mut tet: u32, mut id: [u32; 3], best: f32) -> End {
        let mut p = id.map(|v| plane.project(self.vertices[v as usize]));
        // Counterclockwise around the ray, so that a vertex to the left of one edge and right of
        // the next names the exit.
        if side(p[0], p[1]) < 0.0 || side(p[1], p[2]) < 0.0 || side(p[2], p[0]) < 0.0 {
            id.swap(1, 2);
            p.swap(1, 2);
        }
        for _ in 0..=self.records.len() {
            let record = &self.records[tet as usize];
            let apex = record.xor ^ id[0] ^ id[1] ^ id[2];
            let q = plane.project(self.vertices[apex as usize]);
            let s = [side(q, p[0]), side(q, p[1]), side(q, p[2])];
            // Closed sectors: one of them always holds the ray.
            let out = if s[0] >= 0.0 && s[1] <= 0.0 {
                2
            } else if s[2] >= 0.0 && s[0] <= 0.0 {
                1
            } else {
                0
            };
            let leaving = id[out];
            let rank = usize::from(id[0] < leaving)
                + usize::from(id[1] < leaving)
                + usize::from(id[2] < leaving)
                + usize::from(apex < leaving);
            let next = record.next[rank & 3];
            (id[out], p[out]) = (apex, q);
            if next & FACE != 0 {
                return match next {
                    HULL => End::Left,
                    _ => self.at_face(ray, next & !FACE, best),
                };
            }
            tet = next;
        }
        End::Lost
    }

    /// The end of a walk at a constrained face, with the t of its plane.
    #[inline(always)]
    fn at_face(&self, ray: &Ray, row: u32, best: f32) -> End {
        let [a, b, c] = self.corners_of(self.faces[row as usize].1);
        let normal = cross(sub(b, a), sub(c, a));
        let t = dot(normal, sub(a, ray.origin)) / dot(normal, ray.direction);
        if t >= ray.tmin && t <= best { End::Face(row, t) } else { End::Left }
    }

    /// The tetrahedron that holds a point, found by testing all of them.
    pub(super) fn holding(&self, point: [f32; 3]) -> Option<u32> {
        let p = point.map(f64::from);
        let volume = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| {
            let [x, y, z] = [b, c, d].map(|v| [v[0] - a[0], v[1] - a[1], v[2] - a[2]]);
            x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
                + x[2] * (y[0] * z[1] - y[1] * z[0])
        };
        let holds = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|v| self.vertices[v as usize].map(f64::from));
            let whole = volume(a, b, c, d).signum();
            [volume(p, b, c, d), volume(a, p, c, d), volume(a, b, p, d), volume(a, b, c, p)]
                .iter()
                .all(|v| v * whole >= 0.0)
        };
        self.corners.iter().position(holds).map(|t| t as u32)
    }
}
