//! Animated scenes: the committed manifests are those that the generators make, and they can be
//! read.

use bth_scenes::animations::ANIMATIONS;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn committed(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("manifests").join(format!("{name}.manifest"))
}

#[test]
fn committed_manifests_are_those_made_here() {
    for animation in &ANIMATIONS {
        let text = (animation.make)().manifest.to_toml();
        if std::env::var_os("BTH_BLESS").is_some() {
            std::fs::write(committed(animation.name), &text).unwrap();
        }
        let found = std::fs::read_to_string(committed(animation.name)).unwrap();
        assert!(found == text, "{} differs from what is made (BTH_BLESS=1 writes it)", animation.name);
    }
}

#[test]
fn manifests_are_read_and_refer_to_the_models_that_are_made() {
    for animation in &ANIMATIONS {
        let scene = (animation.make)();
        let read = bth_scene::parse(&scene.manifest.to_toml(), Path::new(animation.name)).unwrap();
        assert_eq!(read, scene.manifest, "{}", animation.name);
        let named: BTreeSet<_> = read.objects.iter().map(|o| o.source.path().to_owned()).collect();
        // Manifests write the numbers of frames as `#`.
        let numbered = |path: &str| match path.strip_suffix(".ply").and_then(|path| path.rsplit_once('_')) {
            Some((name, digits)) => format!("{name}_{}.ply", "#".repeat(digits.len())),
            None => path.to_owned(),
        };
        let made: BTreeSet<_> = scene.models.iter().map(|(path, _)| numbered(path)).collect();
        assert_eq!(named, made, "{}", animation.name);
        assert!(scene.models.iter().all(|(_, model)| !model.triangles.is_empty()));
    }
}
