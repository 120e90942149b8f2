//! Measures bth beside other CPU ray tracers on identical rays.
//!
//! `rays` makes the seeded sets, `ours` and `rivals` the [`tracer::Contender`]s; `speed`, `accuracy`, `load`, `stress`, `costs`, `paper`, `quality` and `scenes` are
//! the measurements, each of which fills a record that `output` writes as Markdown, JSON and SVG.
#![warn(missing_docs)]

pub mod accuracy;
pub mod args;
pub mod chart;
pub mod clock;
pub mod compare;
pub mod costs;
pub mod isa;
pub mod load;
pub mod machine;
pub mod markdown;
pub mod model;
pub mod names;
pub mod ours;
pub mod output;
pub mod paper;
pub mod progress;
pub mod quality;
pub mod rays;
pub mod records;
pub mod rivals;
pub mod rounds;
pub mod scatter;
pub mod scenes;
pub mod speed;
pub mod stress;
pub mod tracer;
