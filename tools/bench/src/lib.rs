//! Measures bth beside other CPU ray tracers on identical rays.
//!
//! `rays` makes the seeded ray sets, `structures` and `rivals` the [`tracer::Contender`]s. `speed`, `compare`, `accuracy`, `load`,
//! `stress`, `inside`, `costs`, `paper`, `quality`, `scales`, `scenes`, `instances`, `refit`, `animation` and `shutter` are the measurements; `output` writes their
//! reports as Markdown, JSON and SVG, and `records` keeps the figures of `benchmarks/`.
#![warn(missing_docs)]

pub mod accuracy;
pub mod animation;
pub mod args;
pub mod chart;
pub mod clock;
pub mod compare;
pub mod costs;
pub mod inside;
pub mod instances;
pub mod isa;
pub mod load;
pub mod machine;
pub mod markdown;
pub mod model;
pub mod names;
pub mod output;
pub mod paper;
pub mod progress;
pub mod quality;
pub mod rays;
pub mod records;
pub mod refit;
pub mod rivals;
pub mod rounds;
pub mod scales;
pub mod scatter;
pub mod scenes;
pub mod shutter;
pub mod speed;
pub mod stress;
pub mod structures;
pub mod tracer;
pub mod triangle_tests;
mod twist;
