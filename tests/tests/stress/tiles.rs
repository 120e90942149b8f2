//! Instances that share borders exactly, as real numbers: nothing leaks between them.

use bth::{Isa, SceneBuilder};
use bth_tests::by_day;
use bth_tests::stress::{Statistics, run_tiles, tiles};

#[test]
fn nothing_leaks_between_tiles_and_bits_are_equal_everywhere() {
    for seed in 0..by_day(2, 8) {
        for tiles in tiles(seed) {
            let mut tally = Statistics::default();
            let hash = run_tiles(&tiles, 4096, 256, seed, false, &mut tally);
            assert_eq!(tally.defects(), 0, "{}: {tally:#?}", tiles.name);
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                isa.choose().expect("it is available");
                let of =
                    |in_parallel| run_tiles(&tiles, 4096, 0, seed, in_parallel, &mut Statistics::default());
                assert_eq!([false, true].map(of), [hash; 2], "{}: {isa}", tiles.name);
            }
            Isa::best().choose().expect("it is available");
        }
    }
}

/// The tiles themselves: every border is an edge of two images.
#[test]
fn images_share_their_borders_exactly() {
    for tiles in tiles(5) {
        let key = |edge: &[[f64; 3]; 2]| {
            let mut key = edge.map(|p| p.map(|x| (x + 0.0).to_bits()));
            key.sort_unstable();
            key
        };
        let mut edges: Vec<_> = tiles.borders.iter().map(key).collect();
        edges.sort_unstable();
        assert!(edges.len() > 64 && edges.chunks(2).all(|pair| pair[0] == pair[1]), "{}", tiles.name);
        assert!(
            edges.chunks(2).collect::<Vec<_>>().windows(2).all(|pair| pair[0] != pair[1]),
            "{}",
            tiles.name
        );
    }
}

/// The checks themselves: a hole is found, and exact arithmetic leaks nothing.
#[test]
fn a_missing_tile_leaks() {
    for mut tiles in tiles(6) {
        let mut tally = Statistics::default();
        run_tiles(&tiles, 64, 1, 6, false, &mut tally);
        assert!(tally.compared >= 100, "{}: {tally:#?}", tiles.name);
        let mut builder = SceneBuilder::new();
        builder.add(&tiles.scene);
        for instance in 1..tiles.scene.instance_count() {
            let view = tiles.scene.instance(instance - 1);
            let rows = view.to_world.concat().iter().map(|x| *x as f32).collect::<Vec<_>>();
            builder.instance(view.object, rows.as_slice().try_into().unwrap()).unwrap();
        }
        builder.commit().unwrap();
        tiles.scene = builder.into_scene();
        let mut tally = Statistics::default();
        run_tiles(&tiles, 1024, 256, 6, false, &mut tally);
        assert!(tally.leaks > 0, "{}: {tally:#?}", tiles.name);
    }
}
