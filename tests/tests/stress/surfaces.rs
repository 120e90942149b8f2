//! Hard rays on hard surfaces, checked exactly; `bth-bench stress` traces many more of them.

use bth::rays::{Hit, PrimitiveRef};
use bth_compile::pipeline::Structure;
use bth_tests::by_day;
use bth_tests::stress::{Kind, Statistics, rays, run, shapes};
use bth_tests::structures::{Traced, compiled, deformed, every_structure, options};

#[test]
fn no_ray_leaks_misses_or_hits_a_ghost_on_any_closed_surface() {
    for (i, shape) in shapes(1).iter().enumerate() {
        let mut structures = every_structure(&shape.grid.model(), shape.whole);
        structures.push(deformed(&shape.grid.model(), i as u64));
        let mut tally = Statistics::default();
        run(shape, &structures, by_day(1024, 2048), 32, i as u64, &mut tally);
        assert_eq!(tally.defects(), 0, "{}: {tally:#?}", shape.name);
        assert!(tally.hits > tally.rays / 3 && tally.compared >= 32, "{}: {tally:?}", shape.name);
        // t is rounded once; half an ulp more where it is subnormal.
        assert!(tally.worst <= 0.5 + 1e-6, "{}: t is off by {} ulp", shape.name, tally.worst);
    }
}

/// Where coordinates are beyond the range in which boxes are tested, every box is entered at the
/// smallest t. Where that is -infinity, the sort keys of stacked nodes must not become NaN.
#[test]
fn hierarchies_beyond_all_scales_are_walked_from_minus_infinity() {
    for shape in shapes(4).iter().filter(|shape| shape.name.contains("scale 2^")) {
        let scene = compiled(&shape.grid.model(), &options(Structure::Bvh));
        let mut tally = Statistics::default();
        // Three batches: one for each instruction set.
        run(shape, &[Traced { name: "bvh".into(), scene }], 3 * by_day(1024, 4096), 0, 8, &mut tally);
        assert_eq!(tally.defects(), 0, "{}: {tally:#?}", shape.name);
    }
}

/// The checks themselves: wrong answers are counted under the right kind of defect.
#[test]
fn a_missed_and_a_made_up_hit_are_counted() {
    let shape = &shapes(1)[0];
    let mut all = Statistics::default();
    for aimed in rays(shape, 200, 3) {
        let mut tally = Statistics::default();
        tally.check(shape, &aimed, &Hit::MISS);
        assert_eq!(tally.leaks, u64::from(aimed.kind == Kind::Inside), "{aimed:?}");
        let missed = (0..shape.grid.triangles.len() as u32)
            .find(|row| shape.grid.intersection(&aimed.ray, *row).is_none());
        let primitive = PrimitiveRef { instance: 0, triangle: missed.expect("no ray meets all") };
        tally.check(shape, &aimed, &Hit { t: 0.5, u: 0.0, v: 0.0, primitive });
        assert_eq!(tally.ghosts, 1, "{aimed:?}");
        all.add(&tally);
    }
    // Seven of ten kinds surely hit something, unless their range ends before or they lie in the
    // plane of all around.
    assert!(all.misses >= 100, "{all:#?}");
}
