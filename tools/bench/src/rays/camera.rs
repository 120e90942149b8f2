//! Pinhole cameras.

use bth::rays::Ray;
use glam::DVec3;

/// Pixels of a tile's side. Neighbours in a camera's rays come from one tile.
const TILE: u32 = 4;

/// A ray in single precision from t = 0; the direction is a unit vector.
pub(crate) fn ray(origin: DVec3, direction: DVec3, tmax: f64) -> Ray {
    Ray {
        origin: origin.to_array().map(|x| x as f32),
        tmin: 0.0,
        direction: direction.to_array().map(|x| x as f32),
        tmax: tmax as f32,
    }
}

/// A pinhole camera; up is +y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The point from which all rays start.
    pub eye: DVec3,
    /// The point in the middle of the picture.
    pub target: DVec3,
    /// Tangent of half the vertical field of view.
    pub tangent: f64,
    /// Pixels across and down, multiples of the tile's side.
    pub size: (u32, u32),
}

impl Camera {
    /// Unit vectors to the front, right and top.
    pub fn axes(&self) -> (DVec3, DVec3, DVec3) {
        let front = (self.target - self.eye).normalize();
        let up = if front.y.abs() > 0.99 { DVec3::X } else { DVec3::Y };
        let right = front.cross(up).normalize();
        (front, right, right.cross(front))
    }

    fn aspect(&self) -> f64 {
        f64::from(self.size.0) / f64::from(self.size.1)
    }

    /// Returns true if a point is in the picture.
    fn sees(&self, p: DVec3) -> bool {
        let ((front, right, top), to) = (self.axes(), p - self.eye);
        let depth = to.dot(front);
        depth > 0.0
            && to.dot(right).abs() <= depth * self.tangent * self.aspect()
            && to.dot(top).abs() <= depth * self.tangent
    }

    /// A ray through the centre of every pixel, tile by tile.
    pub fn rays(&self) -> Vec<Ray> {
        let ((width, height), (front, right, top)) = (self.size, self.axes());
        let through = |x: u32, y: u32| {
            let across = 2.0 * (f64::from(x) + 0.5) / f64::from(width) - 1.0;
            let down = 2.0 * (f64::from(y) + 0.5) / f64::from(height) - 1.0;
            let direction =
                front + right * (across * self.tangent * self.aspect()) - top * (down * self.tangent);
            ray(self.eye, direction.normalize(), f64::INFINITY)
        };
        let tiles = (0..height / TILE).flat_map(|y| (0..width / TILE).map(move |x| (x, y)));
        tiles
            .flat_map(|(x, y)| (0..TILE * TILE).map(move |i| (x * TILE + i % TILE, y * TILE + i / TILE)))
            .map(|(x, y)| through(x, y))
            .collect()
    }

    /// The camera in the direction `from` of the middle that is as near as possible while all
    /// points are in the picture.
    pub fn framing(points: &[DVec3], middle: DVec3, diagonal: f64, from: DVec3, size: (u32, u32)) -> Camera {
        let from = from.normalize();
        let at = |distance: f64| Camera {
            eye: middle + from * distance,
            target: middle,
            tangent: 20f64.to_radians().tan(),
            size,
        };
        // Beyond some distance the camera sees all points, and nearer it does not: bisection finds
        // that distance.
        let (mut near, mut far) = (0.0, 20.0 * diagonal);
        for _ in 0..30 {
            let half = 0.5 * (near + far);
            let camera = at(half);
            if points.iter().all(|p| camera.sees(*p)) { far = half } else { near = half }
        }
        at(far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_framing_camera_sees_all_points_and_is_near() {
        let points: Vec<DVec3> =
            (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
        let middle = DVec3::splat(0.5);
        let camera = Camera::framing(&points, middle, 3f64.sqrt(), DVec3::new(0.8, 0.5, 1.0), (64, 36));
        assert!(points.iter().all(|p| camera.sees(*p)));
        let nearer = Camera { eye: middle + (camera.eye - middle) * 0.99, ..camera };
        assert!(!points.iter().all(|p| nearer.sees(*p)));
    }
}
