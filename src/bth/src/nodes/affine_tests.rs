//! Tests of affine transforms and of their inverses for rays.

use super::affine::*;
use crate::intersect::origin::RoundedLine;
use crate::rays::Ray;
use crate::simd::LANES;
use bth_random::Rng;

fn unit(rng: &mut Rng) -> f64 {
    rng.below(1 << 40) as f64 / (1u64 << 39) as f64 - 1.0
}

fn of_object(inverse: &Inverse, accuracy: Accuracy, ray: &Ray) -> ObjectRay {
    ObjectRay::of(inverse.line(accuracy, &RoundedLine::of_ray(ray)), ray.tmin, ray.tmax)
}

fn random(rng: &mut Rng, scale: f64) -> Affine {
    let mut parts = [0.0; 10];
    parts.iter_mut().for_each(|x| *x = unit(rng));
    let shear = Affine::from_parts(&parts);
    parts.iter_mut().for_each(|x| *x = unit(rng));
    let mut product = shear.times(&Affine::from_parts(&parts));
    product.linear = product.linear.map(|row| row.map(|x| x * scale));
    product
}

#[test]
fn inverses_undo_sheared_and_mirrored_transforms_at_any_scale() {
    let mut rng = Rng::new(1);
    let mut checked = 0;
    for case in 0..2000 {
        let scale = [1.0, 1e-30, 1e30, 1e-5, 1e4][case % 5];
        let affine = random(&mut rng, scale);
        let Some((inverse, accuracy)) = affine.inverse() else { continue };
        let condition = accuracy.condition();
        let p = [(); 3].map(|()| unit(&mut rng));
        let world = affine.apply(p);
        let back = inverse.linear.map(|row| dot(row, [0, 1, 2].map(|k| world[k] - inverse.origin[k])));
        // The subtraction loses what the translation took from tiny objects.
        let lost = (1.0 + 2.0 / scale) * condition * f64::EPSILON * 16.0;
        for k in 0..3 {
            assert!((back[k] - p[k]).abs() <= lost, "{p:?} came back as {back:?}, condition {condition}");
        }
        checked += 1;
    }
    assert!(checked > 1900, "{checked}");
}

#[test]
fn singular_and_infinite_transforms_have_no_inverse() {
    let mut flat = Affine::IDENTITY;
    flat.linear[2] = [0.0; 3];
    assert!(flat.inverse().is_none());
    flat.linear[2] = [0.0, 0.0, 2f64.powi(-23)];
    assert!(flat.inverse().is_some());
    flat.linear[2] = [0.0, 0.0, 2f64.powi(-25)];
    assert!(flat.inverse().is_none(), "beyond the greatest condition");
    let mut dependent = Affine::IDENTITY;
    dependent.linear = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
    assert!(dependent.inverse().is_none());
    let mut endless = Affine::IDENTITY;
    endless.translation[1] = f64::INFINITY;
    assert!(endless.inverse().is_none());
    assert!(Affine { linear: [[0.0; 3]; 3], ..Affine::IDENTITY }.inverse().is_none());
}

#[test]
fn rays_keep_their_t_whatever_the_scale() {
    let mut rng = Rng::new(5);
    for case in 0..2000 {
        let scale = [1.0, 1e-25, 1e25, 3.0, 1e-3][case % 5];
        let mut affine = random(&mut rng, scale);
        affine.translation = affine.translation.map(|x| x * scale);
        let Some((inverse, accuracy)) = affine.inverse() else { continue };
        let condition = accuracy.condition();
        let point = |rng: &mut Rng| [(); 3].map(|()| (unit(rng) * scale) as f32);
        let ray = Ray { origin: point(&mut rng), tmin: 0.0, direction: point(&mut rng), tmax: 2.0 };
        let found = of_object(&inverse, accuracy, &ray);
        assert_eq!(f64::from(found.ray.tmax) * f64::from(found.t_scale), 2.0);
        // The point at t = 2 of both rays, compared in the world.
        let t = 2.0 / f64::from(found.t_scale);
        let object =
            [0, 1, 2].map(|k| f64::from(found.ray.origin[k]) + t * f64::from(found.ray.direction[k]));
        let back = affine.apply(object);
        for k in 0..3 {
            let expected = f64::from(ray.origin[k]) + 2.0 * f64::from(ray.direction[k]);
            // Condition number times the rounding of origin (|p - o| <= 3) and direction (2 |d|).
            let bound = condition * scale * 5.0 * 2f64.powi(-23);
            assert!((back[k] - expected).abs() <= bound, "case {case}: {back:?}, {expected}");
        }
    }
}

/// A hit counts in an object if and only if its t is in the range when it is rounded in world
/// space.
#[test]
fn ranges_of_scaled_rays_hold_the_t_that_are_in_range_in_world_space() {
    let mut rng = Rng::new(12);
    let (mut inside, mut outside) = (0, 0);
    for case in 0..20_000 {
        let scale = [2f64.powi(70), 2f64.powi(100), 2f64.powi(-70), 2f64.powi(-100)][case % 4];
        let t_scale = (1.0 / scale) as f32;
        // An end of the range: denormal, close to the smallest normal number, or any.
        let bits = match case / 4 % 3 {
            0 => rng.below(64) as u32,
            1 => f32::MIN_POSITIVE.to_bits() - 8 + rng.below(16) as u32,
            _ => rng.below(u64::from(f32::INFINITY.to_bits())) as u32,
        };
        let end = f32::from_bits(bits | (rng.below(2) as u32) << 31);
        let (last, first) = (greatest_below(end, scale, t_scale), -greatest_below(-end, scale, t_scale));
        let near = (f64::from(end) * scale) as f32;
        for t in [last, last.next_up(), last.next_down(), first, first.next_up(), first.next_down(), near] {
            let in_world = t * t_scale;
            if !t.is_finite() || !in_world.is_finite() {
                continue;
            }
            assert_eq!(t <= last, in_world <= end, "{end:e}, {scale:e}: {t:e}, {in_world:e}, {last:e}");
            assert_eq!(t >= first, in_world >= end, "{end:e}, {scale:e}: {t:e}, {in_world:e}, {first:e}");
            inside += u32::from(t <= last);
            outside += u32::from(t > last);
        }
    }
    assert!(inside > 10_000 && outside > 10_000, "{inside}, {outside}");
    assert!(greatest_below(f32::NAN, 2f64.powi(70), 2f32.powi(-70)).is_nan());
}

/// Of a range without ends, an object's ray has what is finite in world space.
#[test]
fn no_t_of_a_scaled_ray_is_infinite_in_world_space() {
    for size in [1e-38, 1e-30, 1e30, 1e36] {
        let affine =
            Affine { linear: [[size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]], ..Affine::IDENTITY };
        let (inverse, accuracy) = affine.inverse().unwrap();
        let ray = Ray::new([0.0; 3], [1.0, 0.0, 0.0]).with_range(f32::NEG_INFINITY, f32::INFINITY);
        let ObjectRay { ray, t_scale, .. } = of_object(&inverse, accuracy, &ray);
        assert!(t_scale != 1.0);
        for t in [ray.tmin, ray.tmax] {
            assert!((t * t_scale).is_finite() && t.is_finite(), "{size}: {ray:?}");
        }
    }
}

#[test]
fn sixteen_rays_at_once_are_the_same_to_the_bit() {
    let mut rng = Rng::new(9);
    let mut unscaled = 0;
    for case in 0..500 {
        let scale = [1.0, 1e-12, 1e12, 1e25, 1e-25, 3.0][rng.below(6) as usize];
        let Some((inverse, accuracy)) = random(&mut rng, scale).inverse() else { continue };
        let mut lanes = RayLanes::NONE;
        let mut expected = vec![];
        for lane in 0..LANES {
            let mut point = |size: f64| [(); 3].map(|()| (unit(&mut rng) * size) as f32);
            let mut ray = Ray { origin: point(3.0), tmin: 0.5, direction: point(1.0), tmax: 2.0 };
            ray.direction[lane % 3] *= [1.0, 0.0, -0.0, f32::INFINITY, f32::NAN][(case + lane) % 5];
            for k in 0..3 {
                (lanes.origin[k][lane], lanes.direction[k][lane]) = (ray.origin[k], ray.direction[k]);
            }
            expected.push(of_object(&inverse, accuracy, &ray));
        }
        inverse.transform(&mut lanes, [0.0; 3]);
        for (lane, ObjectRay { ray, t_scale, .. }) in expected.into_iter().enumerate() {
            let finite = ray.direction.iter().all(|x| x.is_finite());
            assert!(lanes.unscaled[lane] == 0 || t_scale == 1.0 && finite, "{ray:?}");
            if lanes.unscaled[lane] == 0 {
                continue;
            }
            unscaled += 1;
            for k in 0..3 {
                assert_eq!(lanes.origin[k][lane].to_bits(), ray.origin[k].to_bits());
                assert_eq!(lanes.direction[k][lane].to_bits(), ray.direction[k].to_bits());
            }
        }
    }
    assert!(unscaled > 2000, "{unscaled}");
}

#[test]
fn identity_changes_no_ray() {
    let (inverse, accuracy) = Affine::IDENTITY.inverse().unwrap();
    assert!((1.0..1.02).contains(&accuracy.condition()));
    let ray = Ray { origin: [1.5, -2.25, 1e-30], tmin: 0.5, direction: [0.1, -0.0, 3.0], tmax: 7.0 };
    let found = of_object(&inverse, accuracy, &ray);
    assert_eq!((found.ray, found.t_scale), (ray, 1.0));
}
