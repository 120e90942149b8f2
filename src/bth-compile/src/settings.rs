//! Settings for experts, by name: `bthc compile --set KEY=VALUE`, `settings` in Python.

use crate::costs::{OptimizeFor, Probe};
use crate::pipeline::CompileOptions;
use std::fmt::Write;
use std::time::Duration;

/// A setting that has a name.
#[derive(Debug)]
struct Key {
    name: &'static str,
    /// The values, as the help shows them.
    values: &'static str,
    /// Says what the key does, in one sentence.
    about: &'static str,
    /// Changes the options, or says which value was expected.
    apply: fn(&str, &mut CompileOptions) -> Result<(), String>,
}

const KEYS: [Key; 9] = [
    Key {
        name: "c-tet",
        values: "NANOSECONDS",
        about: "assumed time of a step through a tetrahedron; less makes more tetrahedra",
        apply: |text, options| set(&mut options.costs.c_tet, positive(text).map(Some)),
    },
    Key {
        name: "free-reach",
        values: "SHARE",
        about: "the middle one of three free distances, as a share of the diagonal of the object's box",
        apply: |text, options| set(&mut options.free.reach, positive(text)),
    },
    Key {
        name: "min-tet-triangles",
        values: "N",
        about: "fewest triangles that are worth a tetrahedralization",
        apply: |text, options| set(&mut options.costs.minimum_triangles, whole(text, 1, u32::MAX)),
    },
    Key {
        name: "optimize-for",
        values: "camera|secondary|balanced",
        about: "which rays decide: from outside, from surfaces, or three from surfaces for one from outside",
        apply: |text, options| {
            let values = [
                ("camera", OptimizeFor::Camera),
                ("secondary", OptimizeFor::Secondary),
                ("balanced", OptimizeFor::Balanced),
            ];
            set(&mut options.costs.optimize_for, one_of(text, &values))
        },
    },
    Key {
        name: "part-triangles",
        values: "N",
        about: "objects of more triangles are built in parts of at most N; 16777216 by default",
        apply: |text, options| set(&mut options.part_triangles, whole(text, 256, u32::MAX).map(u64::from)),
    },
    Key {
        name: "poses",
        values: "N",
        about: "poses over which the tree of an animated mesh is built, 1 to 16; 1 is the first pose",
        apply: |text, options| set(&mut options.motion.poses, whole(text, 1, 16)),
    },
    Key {
        name: "probe",
        values: "steps|off",
        about: "drop tetrahedra that save no time for sampled rays, or keep them all",
        apply: |text, options| {
            set(&mut options.costs.probe, one_of(text, &[("steps", Probe::Steps), ("off", Probe::Off)]))
        },
    },
    Key {
        name: "tet-deadline",
        values: "SECONDS",
        about: "time of one attempt to tetrahedralize a node; by default according to its size",
        apply: |text, options| {
            let seconds = whole(text, 1, 86_400)?;
            options.tets.deadline = Duration::from_secs(seconds.into());
            options.tets.deadline_per_triangle = Duration::ZERO;
            Ok(())
        },
    },
    Key {
        name: "tet-memory",
        values: "MIB",
        about: "memory of a tetrahedralization worker",
        apply: |text, options| {
            set(&mut options.tets.memory, whole(text, 16, 1 << 20).map(|mib| u64::from(mib) << 20))
        },
    },
];

/// A key with a value that it takes.
#[derive(Clone, Debug)]
pub struct Setting {
    key: &'static Key,
    value: String,
}

impl Setting {
    /// Parses `KEY=VALUE`.
    ///
    /// # Errors
    /// Says what was expected, if there is no such key or the value does not fit it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let key = KEYS.iter().find(|key| key.name == name).ok_or_else(|| {
            let names: Vec<&str> = KEYS.iter().map(|key| key.name).collect();
            format!("expected KEY=VALUE with a key among {}; found {text:?}", names.join(", "))
        })?;
        (key.apply)(value, &mut CompileOptions::default())
            .map_err(|expected| format!("{expected}; {name} takes {}", key.values))?;
        Ok(Self { key, value: value.to_owned() })
    }

    /// The key.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.key.name
    }

    /// Changes the options.
    pub fn apply(&self, options: &mut CompileOptions) {
        let applied = (self.key.apply)(&self.value, options);
        assert_eq!(applied, Ok(()), "parsing has tried the value");
    }
}

/// Lists the keys with their values, for help.
#[must_use]
pub fn long_help() -> String {
    let mut text = "Change a setting for experts. Later settings win. Keys:\n".to_owned();
    for Key { name, values, about, .. } in &KEYS {
        let _ = write!(text, "\n- {name}={values}: {about}");
    }
    text
}

fn set<T>(place: &mut T, value: Result<T, String>) -> Result<(), String> {
    *place = value?;
    Ok(())
}

fn one_of<T: Clone>(text: &str, values: &[(&str, T)]) -> Result<T, String> {
    let found = values.iter().find(|(name, _)| *name == text);
    found.map(|(_, value)| value.clone()).ok_or_else(|| format!("{text:?} is not a value"))
}

fn whole(text: &str, min: u32, max: u32) -> Result<u32, String> {
    let number = text.parse().ok().filter(|n| (min..=max).contains(n));
    number.ok_or_else(|| format!("expected a number from {min} to {max}"))
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "expected a number above 0".to_owned())
}
