//! The shader of each mode.

use super::context::{Counters, FrameContext, Sample, Shaded};
use super::lights::{Lights, room_lamp};
use super::studio::Studio;
use super::{path_tracer, surface_modes, visibility};
use crate::args::Mode;
use crate::camera::up_vector;
use bth::rays::{Hit, Ray};

/// Shades batches of samples; what it needs besides the frame is computed once a frame.
pub(crate) enum Shader<'a> {
    Studio(Studio),
    Path(Lights<'a>),
    Normals,
    AmbientOcclusion,
    Instances,
    Steps,
}

impl<'a> Shader<'a> {
    /// The shader of the frame's mode.
    pub(crate) fn new(frame: &FrameContext<'a>) -> Self {
        let vertical = up_vector(frame.args.up());
        match frame.args.mode {
            Mode::Shaded | Mode::Clay => Shader::Studio(Studio::new(frame, vertical)),
            Mode::Path => {
                let lamp = frame.interior.then(|| {
                    let position = room_lamp(frame, vertical);
                    (position, 1.5 * (position - frame.camera.eye).length())
                });
                Shader::Path(Lights::new(frame, lamp))
            }
            Mode::Normals => Shader::Normals,
            Mode::Ao => Shader::AmbientOcclusion,
            Mode::Steps => Shader::Steps,
            Mode::Instances => Shader::Instances,
        }
    }

    /// Traces the camera rays of a batch of samples and shades their hits. The colours are linear,
    /// but for [`Shader::Normals`], whose components are shown as they are, and [`Shader::Steps`],
    /// whose first component is the number of steps.
    pub(crate) fn shade(
        &self,
        frame: &FrameContext<'_>,
        samples: &[Sample],
        counters: &mut Counters,
    ) -> Vec<Shaded> {
        let rays: Vec<Ray> = samples.iter().map(|sample| sample.ray.to_ray()).collect();
        fetch(frame, &rays);
        if let Shader::Steps = self {
            let steps = surface_modes::steps(frame.scene, &rays, &mut counters.steps);
            return steps.into_iter().map(Shaded::plain).collect();
        }
        let mut hits = vec![Hit::MISS; rays.len()];
        let direction = |ray: &Ray| ray.direction;
        visibility::nearest(frame, &rays, Some(direction), |row| samples[row].chance(0), &mut hits);
        let colors = match self {
            Shader::Path(lights) => return path_tracer::shade(frame, lights, samples, &hits, counters),
            Shader::Studio(studio) => studio.shade(frame, samples, &hits, &mut counters.any_rays),
            Shader::Normals => surface_modes::normals(frame, samples, &hits),
            Shader::AmbientOcclusion => {
                surface_modes::ambient_occlusion(frame, samples, &hits, &mut counters.any_rays)
            }
            Shader::Instances => surface_modes::instances(frame, samples, &hits),
            Shader::Steps => unreachable!("handled above"),
        };
        colors.into_iter().map(Shaded::plain).collect()
    }
}

/// One of 64 camera rays of a square is traced before the others, to read what lies around its hit.
const SPARSE: usize = 64;

/// Reads ahead for camera rays that are close to each other, where the file does not fit in memory.
fn fetch(frame: &FrameContext<'_>, rays: &[Ray]) {
    if frame.scene.file().is_paged() {
        let hits = rays.iter().step_by(SPARSE).filter_map(|ray| frame.scene.nearest(ray));
        hits.for_each(|hit| frame.scene.fetch_around(hit.primitive));
    }
}
