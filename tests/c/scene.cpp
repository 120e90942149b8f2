// Compiles a mesh and traces it through bth.hpp. Exits with the line of the first check that fails.
#include "bth.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <type_traits>

static_assert(std::is_nothrow_move_constructible_v<bth::scene> && std::is_nothrow_move_assignable_v<bth::scene>);
static_assert(!std::is_copy_constructible_v<bth::scene> && !std::is_copy_assignable_v<bth::scene>);

#define CHECK(condition)                                                                                                 \
    do {                                                                                                                 \
        if (!(condition)) {                                                                                              \
            std::fprintf(stderr, "%d: %s\n", __LINE__, #condition);                                                      \
            return __LINE__;                                                                                             \
        }                                                                                                                \
    } while (0)

int main(int argc, char **argv) {
    const std::array<float, 12> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    const std::array<std::uint32_t, 6> triangles = {0, 1, 2, 1, 3, 2};
    const bth_mesh mesh = {positions.data(), 4, triangles.data(), 2};
    bth::scene first = bth::compile(mesh).open();

    bth::scene scene = std::move(first);
    CHECK(first.get() == nullptr && scene.get() != nullptr);
    const bth_ray down = {{0.25F, 0.25F, 2}, 0, {0, 0, -1}, INFINITY};
    const bth_ray beside = {{3, 3, 2}, 0, {0, 0, -1}, INFINITY};
    const bth_hit hit = scene.nearest(down);
    CHECK(hit.t == 2 && hit.surface.triangle == 0 && !bth::is_miss(hit) && bth::is_miss(scene.nearest(beside)));
    CHECK(scene.any(down) && !scene.any(beside));
    const std::vector<bth_ray> rays = {beside, down};
    const std::vector<bth_hit> hits = scene.nearest_of(rays);
    CHECK(bth::is_miss(hits[0]) && std::memcmp(&hits[1], &hit, sizeof hit) == 0);
    CHECK((scene.any_of(rays) == std::vector<std::uint8_t>{0, 1}));

    /* The ray along the surface does not hit the neighbour, which lies in the same plane. */
    const std::vector<bth_start> starts = {bth::start_of(hit), bth::start_of(hits[0])};
    const std::vector<std::array<float, 3>> across = {{1, 1, 0}, {0, 0, -1}};
    CHECK(bth::is_miss(scene.nearest(starts[0], {1, 1, 0})) && !scene.any(starts[0], {0, 0, -1}, 5));
    const std::vector<bth_hit> onward = scene.nearest_of(starts, across);
    CHECK(bth::is_miss(onward[0]) && bth::is_miss(onward[1]));
    CHECK((scene.any_of(starts, across) == std::vector<std::uint8_t>{0, 0}));
    scene.check_start(starts[0]);

    CHECK(scene.instance_count() == 1 && scene.instance(0).visible == 1 && scene.frames().rate == 1);
    CHECK(scene.resident_bytes() > 0 && scene.seconds() == 0);

    const bth_accept no_back = {~0U, BTH_CULL_BACK, nullptr, nullptr};
    const bth_ray up = {{0.25F, 0.25F, -2}, 0, {0, 0, 1}, INFINITY};
    CHECK(scene.any(up) && !scene.any_accepted(up, no_back) && bth::is_miss(scene.nearest_accepted(up, no_back)));
    const bth_ray diagonal = {{0.5F, 0.5F, 2}, 0, {0, 0, -1}, INFINITY};
    CHECK(scene.count_hits(diagonal) == 2 && scene.all_hits(diagonal).size() == 2 && scene.all_hits(diagonal, 1).size() == 1);
    CHECK(scene.all_hits(beside).empty() && scene.surface(hit).geometric_normal[2] == 1);
    CHECK(!scene.contains({0.25F, 0.25F, -1}) && scene.closest({0.25F, 0.25F, -3}, 9).distance == 3);
    CHECK(std::abs(scene.signed_distance({0.25F, 0.25F, 3})) == 3 && scene.object_name(0).empty());

    /* In double: float would lose what the rays are above the triangles. */
    const bth_ray64 close = {{0.25, 0.25, 0x1p-40}, 0, {0, 0, -1}, INFINITY};
    const bth_ray64 below = {{0.25, 0.25, -0x1p-40}, 0, {0, 0, -1}, INFINITY};
    CHECK(scene.nearest(close).t == 0x1p-40 && bth::is_miss(scene.nearest(below)));
    CHECK(scene.any(close) && !scene.any(below));
    const std::vector<bth_ray64> double_rays = {below, close};
    const std::vector<bth_hit64> double_hits = scene.nearest_of(double_rays);
    CHECK(bth::is_miss(double_hits[0]) && double_hits[1].t == 0x1p-40 && double_hits[1].u == 0.25);
    CHECK((scene.any_of(double_rays) == std::vector<std::uint8_t>{0, 1}));
    const bth_ray64 along = {{0.5, 0.5, 2}, 0, {0, 0, -1}, INFINITY}, upward = {{0.25, 0.25, -2}, 0, {0, 0, 1}, INFINITY};
    CHECK(scene.count_hits(along) == 2 && scene.all_hits(along).size() == 2 && scene.all_hits(along, 1)[0].t == 2);
    CHECK(!scene.any_accepted(upward, no_back) && bth::is_miss(scene.nearest_accepted(upward, no_back)));
    CHECK(scene.hit_f64({{0.25, 0.25, 2}, 0, {0, 0, -1}, INFINITY}, hit).t == 2);
    CHECK(scene.closest_f64({0.25, 0.25, 0x1p-40}, 9).distance == 0x1p-40 && !scene.contains_f64({9, 9, 9}));
    CHECK(std::abs(scene.signed_distance_f64({0.25, 0.25, 0x1p-40})) == 0x1p-40 && scene.winding_f64({9, 9, 9}) == 0);
    /* Ranges, in float and in double. */
    const std::vector<std::array<float, 3>> points = {{0.25F, 0.25F, -1}, {9, 9, 9}};
    const std::vector<std::array<double, 3>> double_points = {{0.25, 0.25, 0x1p-40}};
    CHECK((scene.contains_of(points) == std::vector<std::uint8_t>{0, 0}) && scene.winding_of(double_points)[0] == 0);
    CHECK(scene.closest_of(points, 2)[0].distance == 1 && scene.closest_of(points, 2)[1].surface.triangle == BTH_NONE);
    CHECK(scene.closest_of(double_points)[0].distance == 0x1p-40);
    CHECK(std::abs(scene.signed_distance_of(points)[0]) == 1 && std::abs(scene.signed_distance_of(double_points)[0]) == 0x1p-40);
    CHECK((scene.count_hits_of(rays) == std::vector<std::uint64_t>{0, 1}) && scene.count_hits_of(double_rays)[1] == 1);
    CHECK(scene.crossings_of(rays)[1].count == 1 && scene.crossings_of(double_rays)[0].count == 0);
    CHECK((scene.any_accepted_of(rays, no_back) == std::vector<std::uint8_t>{0, 1}));
    CHECK(scene.nearest_accepted_of(rays, no_back)[1].t == 2 && scene.nearest_accepted_of(double_rays, no_back)[1].t == 0x1p-40);
    CHECK(scene.triangles_in({0.1F, 0.1F, 0}, 0.01F).size() == 1 && scene.triangles_in(bth::box{{0, 0, 0}, {1, 1, 1}}).size() == 2);
    CHECK(scene.bounds().lower[0] <= 0 && scene.bounds().upper[1] >= 1 && scene.object_count() == 1);
    CHECK(scene.group_count(0) == 1 && scene.material_count(0) == 0 && scene.triangle_positions({0, 1})[2][1] == 1);
    scene.set_instance_mask(0, 2);
    CHECK(bth::is_miss(scene.nearest_accepted(down, {1, BTH_CULL_NONE, nullptr, nullptr})));
    CHECK(scene.winding({9, 9, 9}) == 0);

    bth_compile_options options{};
    options.flags = BTH_COMPILE_DEFORMABLE;
    bth::compiled made = bth::compile(mesh, options);
    CHECK(made.size() > 1000 && made.data() != nullptr);
    bth::scene elastic = bth::compiled(std::move(made)).open();
    CHECK(made.data() == nullptr);
    CHECK(elastic.vertex_count(0) == 4 && elastic.vertex_count(1) == 0 && scene.vertex_count(0) == 0);
    std::array<float, 12> moved = positions;
    for (int i = 0; i < 4; i++) moved[3 * i + 2] = -1;
    const bth_update update = elastic.set_positions(0, moved.data(), 4);
    CHECK(update.deformed == 1 && update.deformed_cost_ratio == 1 && update.visible == 1 && elastic.nearest(down).t == 3);
    const bth_update half = elastic.set_positions_between(0, positions.data(), moved.data(), 4, 0.5);
    CHECK(half.deformed == 1 && elastic.nearest(down).t == 2.5);
    const float *const unknown[2] = {positions.data(), nullptr};
    CHECK(bth_set_positions_between(elastic.get(), 0, unknown, 4, 0.5, nullptr) == BTH_ERROR_ARGUMENT);
    const float *const ends[2] = {positions.data(), moved.data()};
    CHECK(bth_set_positions_between(elastic.get(), 0, ends, 4, 1.5, nullptr) == BTH_ERROR_ARGUMENT);
    CHECK(bth_set_positions_between(elastic.get(), 0, ends, 4, 1, nullptr) == BTH_OK && elastic.nearest(down).t == 3);
    moved[5] = NAN;
    CHECK(bth_set_positions_between(elastic.get(), 0, ends, 4, 0.5, nullptr) == BTH_ERROR_ARGUMENT);
    CHECK(bth_set_positions(elastic.get(), 0, moved.data(), 4, nullptr) == BTH_ERROR_ARGUMENT);
    CHECK(bth_set_positions(elastic.get(), 0, positions.data(), 3, nullptr) == BTH_ERROR_ARGUMENT);
    CHECK(bth_set_positions(elastic.get(), 1, positions.data(), 4, nullptr) == BTH_ERROR_ARGUMENT);
    CHECK(bth_set_positions(elastic.get(), 0, nullptr, 4, nullptr) == BTH_ERROR_ARGUMENT);
    CHECK(bth_set_positions(scene.get(), 0, positions.data(), 4, nullptr) == BTH_ERROR_MISSING);
    CHECK(elastic.nearest(down).t == 3 && elastic.surface(elastic.nearest(down)).position[2] == -1);
    bth::builder builder;
    const std::uint32_t object = builder.add(elastic), id = builder.instance(object);
    const auto height = [&] { return builder.query([&](const bth::scene &all) { return all.nearest(down).t; }); };
    builder.commit();
    // The positions of another scene are not taken over.
    CHECK(height() == 2);
    moved[5] = -1;
    builder.set_positions(object, moved.data(), 4);
    const bth_update commit = builder.commit();
    CHECK(commit.deformed == 1 && commit.placed == 1 && height() == 3);
    CHECK(bth_builder_set_positions(builder.get(), 5, moved.data(), 4) == BTH_ERROR_ARGUMENT);
    CHECK(bth_builder_set_positions(builder.get(), object, nullptr, 4) == BTH_ERROR_ARGUMENT);
    CHECK(bth_builder_set_positions_between(builder.get(), object, unknown, 4, 0.5) == BTH_ERROR_ARGUMENT);
    builder.set_positions_between(object, positions.data(), moved.data(), 4, 0.25);
    builder.commit();
    CHECK(height() == 2.25);
    builder.set_transforms({id}, std::vector<bth::transform<double>>{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1}});
    const std::uint32_t whole = builder.subscene(object);
    CHECK(builder.subscene_instances(whole).size() == 1);
    builder.commit();
    CHECK(height() == 2.25);
    builder.remove_subscene(whole);
    builder.commit();
    CHECK(height() == 3.25);
    builder.set_visible(id, false);
    builder.commit();
    CHECK(std::isinf(height()));

    int caught = 0;
    try {
        bth::compile_file("no such file.ply");
    } catch (const bth::compile_error &e) {
        caught += e.code() == BTH_COMPILE_ERROR_FILE;
    }
    try {
        builder.set_transforms({id}, std::vector<bth::transform<float>>{});
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT;
    }
    try {
        scene.instance(1);
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT && std::strlen(e.what()) > 0;
    }
    try {
        scene = bth::scene::open(argc > 1 ? argv[1] : "");
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_FILE && std::strstr(e.what(), "BTH-O001") != nullptr;
    }
    try {
        first.nearest(down);
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT;
    }
    try {
        scene.nearest(static_cast<const bth_ray *>(nullptr), nullptr, 3);
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT;
    }
    try {
        bth::scene::open(std::string(argc > 1 ? argv[1] : "") + '\0' + ".bth");
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT;
    }
    try {
        scene.check_start(starts[1]);
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT && std::strstr(e.what(), "BTH-S003") != nullptr;
    }
    try {
        scene.nearest_of(starts, std::vector<std::array<float, 3>>(1));
    } catch (const bth::error &e) {
        caught += e.code() == BTH_ERROR_ARGUMENT;
    }
    scene.nearest(static_cast<const bth_ray64 *>(nullptr), nullptr, 0);
    CHECK(caught == 9 && scene.any(down));
    return 0;
}
