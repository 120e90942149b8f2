/* C++17 interface of bth: what bth.h declares, with scenes and builders that close themselves and errors that are thrown. Header
 * only; link with libbth. Where bth_compile.h is found, also what that declares; link with libbth_compile to use it.
 *
 *     bth::scene scene = bth::compile_file("dragon.ply").open(); // or bth::scene::open("dragon.bth")
 *     bth_hit hit = scene.nearest(bth_ray{{0, 0, 5}, 0, {0, 0, -1}, INFINITY});
 *
 * Functions that end in _of take ranges that are adjacent in memory, such as std::vector, std::array and std::span, and return a
 * vector. The elements of ranges of points and of directions are three numbers: std::array<float, 3> or a struct. Constant member
 * functions may run on one scene at the same time, as those of bth.h; the others must run alone.
 */
#ifndef BTH_HPP
#define BTH_HPP

#include "bth.h"
#if __has_include("bth_compile.h")
#include "bth_compile.h"
#define BTH_HAS_COMPILER 1
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace bth {

/* What bth.h reports as a negative code and a text. */
class error : public std::runtime_error {
public:
    error(std::int32_t code, const char *text) : std::runtime_error(text), code_(code) {}
    /* BTH_ERROR_... */
    std::int32_t code() const noexcept { return code_; }

private:
    std::int32_t code_;
};

/* Throws unless the code is BTH_OK. */
inline void check(std::int32_t code) {
    if (code != BTH_OK) throw error(code, bth_last_error());
}

/* Whether a hit is none. */
inline bool is_miss(const bth_hit &hit) noexcept { return hit.surface.triangle == BTH_NONE; }
inline bool is_miss(const bth_hit64 &hit) noexcept { return hit.surface.triangle == BTH_NONE; }

/* The point that was hit, at which another ray may start. The start of a miss is none: rays from it
 * are misses. */
inline bth_start start_of(const bth_hit &hit) noexcept {
    return {hit.surface.instance, hit.surface.triangle, hit.u, hit.v};
}

/* The hit of a kind of rays. */
template <typename Ray>
using hit_of = std::conditional_t<std::is_same_v<std::remove_cv_t<Ray>, bth_ray64>, bth_hit64, bth_hit>;

/* The numbers of a range of points or directions: double if its elements are three doubles, else float. */
template <typename Vectors>
using number_of = std::conditional_t<sizeof(*std::data(std::declval<const Vectors &>())) == 3 * sizeof(double), double, float>;

/* The first number of a range of points or directions. */
template <typename Vectors>
const number_of<Vectors> *numbers_of(const Vectors &vectors) {
    static_assert(sizeof(*std::data(vectors)) == 3 * sizeof(number_of<Vectors>), "expected elements of three floats or doubles");
    return reinterpret_cast<const number_of<Vectors> *>(std::data(vectors));
}

/* A transform of a builder: three rows of four, applied to columns (x, y, z, 1). */
template <typename Number>
using transform = std::array<Number, 12>;
inline constexpr transform<float> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* A box in world space. */
struct box {
    std::array<float, 3> lower, upper;
};

/* Frames of a scene. */
struct frame_range {
    std::int32_t first;
    std::int32_t last;
    double rate; /* frames per second */
};

/* An open scene. It can be moved but not copied; one that was moved from can only be destroyed or assigned to. */
class scene {
public:
    /* Reads a file in full and checks it. The path is in UTF-8. */
    static scene open(const std::string &path) { return open(path, BTH_READ); }

    /* Maps a file, whose contents are not checked; see BTH_MAP. */
    static scene map(const std::string &path) { return open(path, BTH_MAP); }

    /* Copies and checks the contents of a file. */
    static scene from_bytes(const void *bytes, std::size_t length) {
        bth_scene *opened = nullptr;
        check(bth_open_memory(static_cast<const std::uint8_t *>(bytes), length, BTH_READ, &opened));
        return scene(opened);
    }

    /* The nearest hit of a ray, or a miss. */
    bth_hit nearest(const bth_ray &ray) const {
        bth_hit hit{};
        check(bth_nearest(opened(), &ray, nullptr, &hit, 1));
        return hit;
    }

    /* Whether a ray hits anything. */
    bool any(const bth_ray &ray) const {
        std::uint8_t hit = 0;
        check(bth_any(opened(), &ray, nullptr, &hit, 1));
        return hit != 0;
    }

    /* The same in double. */
    bth_hit64 nearest(const bth_ray64 &ray) const {
        bth_hit64 hit{};
        check(bth_nearest_f64(opened(), &ray, nullptr, &hit, 1));
        return hit;
    }

    bool any(const bth_ray64 &ray) const {
        std::uint8_t hit = 0;
        check(bth_any_f64(opened(), &ray, nullptr, &hit, 1));
        return hit != 0;
    }

    void nearest(const bth_ray64 *rays, bth_hit64 *hits, std::size_t count) const {
        check(bth_nearest_f64(opened(), rays, nullptr, hits, count));
    }

    void any(const bth_ray64 *rays, std::uint8_t *hit, std::size_t count) const {
        check(bth_any_f64(opened(), rays, nullptr, hit, count));
    }

    /* As bth_nearest. */
    void nearest(const bth_ray *rays, bth_hit *hits, std::size_t count) const {
        check(bth_nearest(opened(), rays, nullptr, hits, count));
    }

    /* As bth_any. */
    void any(const bth_ray *rays, std::uint8_t *hit, std::size_t count) const {
        check(bth_any(opened(), rays, nullptr, hit, count));
    }

    template <typename Rays>
    auto nearest_of(const Rays &rays) const {
        std::vector<hit_of<std::remove_pointer_t<decltype(std::data(rays))>>> hits(std::size(rays));
        nearest(std::data(rays), hits.data(), hits.size());
        return hits;
    }

    template <typename Rays>
    std::vector<std::uint8_t> any_of(const Rays &rays) const {
        std::vector<std::uint8_t> hit(std::size(rays));
        any(std::data(rays), hit.data(), hit.size());
        return hit;
    }

    /* The nearest hit of a ray that starts on a surface, or a miss; see bth_start. */
    bth_hit nearest(const bth_start &start, const float (&direction)[3], float tmax = infinite) const {
        bth_hit hit;
        check(bth_nearest_starts(opened(), &start, direction, &tmax, &hit, 1));
        return hit;
    }

    /* Whether a ray that starts on a surface hits anything. */
    bool any(const bth_start &start, const float (&direction)[3], float tmax = infinite) const {
        std::uint8_t hit = 0;
        check(bth_any_starts(opened(), &start, direction, &tmax, &hit, 1));
        return hit != 0;
    }

    /* For ranges of starts and of directions in float. */
    template <typename Starts, typename Directions>
    std::vector<bth_hit> nearest_of(const Starts &starts, const Directions &directions, const float *tmax = nullptr) const {
        std::vector<bth_hit> hits(std::size(starts));
        check(bth_nearest_starts(opened(), std::data(starts), floats_of(directions, hits.size()), tmax, hits.data(), hits.size()));
        return hits;
    }

    template <typename Starts, typename Directions>
    std::vector<std::uint8_t> any_of(const Starts &starts, const Directions &directions, const float *tmax = nullptr) const {
        std::vector<std::uint8_t> hit(std::size(starts));
        check(bth_any_starts(opened(), std::data(starts), floats_of(directions, hit.size()), tmax, hit.data(), hit.size()));
        return hit;
    }

    /* Throws unless rays can start at a point; queries report misses instead. */
    void check_start(const bth_start &start) const { check(bth_check_start(opened(), &start)); }

    /* Moves the scene to a time in seconds, or to that of a frame; on an error the scene is unchanged. */
    void set_seconds(double seconds) { check(bth_set_seconds(get(), seconds)); }
    void set_frame(std::int32_t frame) { check(bth_set_frame(get(), frame)); }

    /* Gives an object new positions, three floats for each vertex of its source; see bth_set_positions. */
    bth_update set_positions(std::uint32_t object, const float *positions, std::size_t count) {
        bth_update update;
        check(bth_set_positions(get(), object, positions, count, &update));
        return update;
    }

    /* The same with positions at a share of the way between those at two times; see bth_set_positions_between. */
    bth_update set_positions_between(std::uint32_t object, const float *first, const float *last, std::size_t count,
                                     double share) {
        bth_update update;
        const float *const ends[2] = {first, last};
        check(bth_set_positions_between(get(), object, ends, count, share, &update));
        return update;
    }

    std::size_t vertex_count(std::uint32_t object) const noexcept { return bth_vertex_count(get(), object); }

    double seconds() const noexcept { return bth_seconds(get()); }

    frame_range frames() const noexcept {
        frame_range found{};
        bth_frames(get(), &found.first, &found.last, &found.rate);
        return found;
    }

    std::uint32_t instance_count() const noexcept { return bth_instance_count(get()); }

    /* The rows on the way to an instance, that in the world first. */
    std::vector<std::uint32_t> instance_path(std::uint32_t instance) const {
        std::uint32_t rows[16];
        return {rows, rows + bth_instance_path(get(), instance, rows)};
    }

    bth_instance instance(std::uint32_t row) const {
        bth_instance found;
        check(bth_get_instance(get(), row, &found));
        return found;
    }

    /* Hits with conditions and several hits of a ray: by ascending t, then instance, then triangle. */
    bth_hit nearest_accepted(const bth_ray &ray, const bth_accept &accept) const {
        bth_hit hit;
        check(bth_nearest_accepted(get(), &ray, &accept, &hit, 1));
        return hit;
    }

    bool any_accepted(const bth_ray &ray, const bth_accept &accept) const {
        std::uint8_t found = 0;
        check(bth_any_accepted(get(), &ray, &accept, &found, 1));
        return found != 0;
    }

    /* The same in double. */
    bth_hit64 nearest_accepted(const bth_ray64 &ray, const bth_accept &accept) const {
        bth_hit64 hit;
        check(bth_nearest_f64(get(), &ray, &accept, &hit, 1));
        return hit;
    }

    bool any_accepted(const bth_ray64 &ray, const bth_accept &accept) const {
        std::uint8_t found = 0;
        check(bth_any_f64(get(), &ray, &accept, &found, 1));
        return found != 0;
    }

    std::uint64_t count_hits(const bth_ray &ray, const bth_accept &accept = BTH_ACCEPT_EVERYTHING) const {
        std::uint64_t count = 0;
        check(bth_count_hits(get(), &ray, &accept, &count, 1));
        return count;
    }

    std::uint64_t count_hits(const bth_ray64 &ray, const bth_accept &accept = BTH_ACCEPT_EVERYTHING) const {
        std::uint64_t count = 0;
        check(bth_count_hits_f64(get(), &ray, &accept, &count, 1));
        return count;
    }

    /* The `most` nearest hits, all by default. */
    std::vector<bth_hit> all_hits(const bth_ray &ray, std::uint64_t most = BTH_ALL_HITS,
                                  const bth_accept &accept = BTH_ACCEPT_EVERYTHING) const {
        return all_hits_of<bth_hit_list>(bth_all_hits, ray, most, accept);
    }

    std::vector<bth_hit64> all_hits(const bth_ray64 &ray, std::uint64_t most = BTH_ALL_HITS,
                                    const bth_accept &accept = BTH_ACCEPT_EVERYTHING) const {
        return all_hits_of<bth_hit64_list>(bth_all_hits_f64, ray, most, accept);
    }

    /* For ranges of rays, in float or in double. */
    template <typename Rays>
    auto nearest_accepted_of(const Rays &rays, const bth_accept &accept) const {
        return of_rays<bth_hit, bth_hit64>(rays, bth_nearest_accepted, bth_nearest_f64, &accept);
    }
    template <typename Rays>
    std::vector<std::uint8_t> any_accepted_of(const Rays &rays, const bth_accept &accept) const {
        return of_rays<std::uint8_t, std::uint8_t>(rays, bth_any_accepted, bth_any_f64, &accept);
    }
    template <typename Rays>
    std::vector<std::uint64_t> count_hits_of(const Rays &rays, const bth_accept &accept = BTH_ACCEPT_EVERYTHING) const {
        return of_rays<std::uint64_t, std::uint64_t>(rays, bth_count_hits, bth_count_hits_f64, &accept);
    }
    template <typename Rays>
    std::vector<bth_crossing_count> crossings_of(const Rays &rays) const {
        return of_rays<bth_crossing_count, bth_crossing_count>(rays, bth_crossings, bth_crossings_f64);
    }

    /* The numbers in double of a hit of the ray with these numbers. */
    bth_hit64 hit_f64(const bth_ray64 &ray, const bth_hit &hit) const {
        bth_hit64 numbers;
        check(bth_hit_f64(get(), &ray, &hit, &numbers));
        return numbers;
    }

    void set_instance_mask(std::uint32_t instance, std::uint32_t mask) {
        check(bth_set_instance_mask(get(), instance, mask));
    }
    void set_group_mask(std::uint32_t object, std::uint32_t group, std::uint32_t mask) {
        check(bth_set_group_mask(get(), object, group, mask));
    }

    /* Whether closed surfaces enclose a point, x, y and z in world space, and how often. */
    bool contains(const float (&point)[3]) const {
        std::uint8_t inside = 0;
        check(bth_contains(get(), point, &inside, 1));
        return inside != 0;
    }

    std::int32_t winding(const float (&point)[3]) const {
        std::int32_t found = 0;
        check(bth_winding(get(), point, &found, 1));
        return found;
    }

    /* The closest point of the triangles within a radius; its surface is BTH_NONE if there is none. */
    bth_closest closest(const float (&point)[3], float radius) const {
        bth_closest found;
        check(bth_closest_points(get(), point, radius, &found, 1));
        return found;
    }

    /* The distance to the closest triangle, negative inside of closed meshes. */
    float signed_distance(const float (&point)[3]) const {
        float distance = 0;
        check(bth_signed_distances(get(), point, &distance, 1));
        return distance;
    }

    /* The same in double. */
    bool contains_f64(const double (&point)[3]) const {
        std::uint8_t inside = 0;
        check(bth_contains_f64(get(), point, &inside, 1));
        return inside != 0;
    }

    std::int32_t winding_f64(const double (&point)[3]) const {
        std::int32_t found = 0;
        check(bth_winding_f64(get(), point, &found, 1));
        return found;
    }

    bth_closest64 closest_f64(const double (&point)[3], double radius) const {
        bth_closest64 found;
        check(bth_closest_points_f64(get(), point, radius, &found, 1));
        return found;
    }

    double signed_distance_f64(const double (&point)[3]) const {
        double distance = 0;
        check(bth_signed_distances_f64(get(), point, &distance, 1));
        return distance;
    }

    /* For ranges of points, in float or in double. */
    template <typename Points>
    std::vector<std::uint8_t> contains_of(const Points &points) const {
        return of_points<std::uint8_t, std::uint8_t>(points, bth_contains, bth_contains_f64);
    }
    template <typename Points>
    std::vector<std::int32_t> winding_of(const Points &points) const {
        return of_points<std::int32_t, std::int32_t>(points, bth_winding, bth_winding_f64);
    }
    template <typename Points>
    auto closest_of(const Points &points, number_of<Points> radius = std::numeric_limits<number_of<Points>>::infinity()) const {
        return of_points<bth_closest, bth_closest64>(points, bth_closest_points, bth_closest_points_f64, radius);
    }
    template <typename Points>
    auto signed_distance_of(const Points &points) const {
        return of_points<float, double>(points, bth_signed_distances, bth_signed_distances_f64);
    }

    /* The triangles that a box or a ball touches. */
    std::vector<bth_surface> triangles_in(const box &where) const {
        return found([&](bth_surface *to, std::size_t size, std::size_t *count) {
            return bth_triangles_in_box(opened(), where.lower.data(), where.upper.data(), to, size, count);
        });
    }
    std::vector<bth_surface> triangles_in(const float (&center)[3], float radius) const {
        return found([&](bth_surface *to, std::size_t size, std::size_t *count) {
            return bth_triangles_in_sphere(opened(), center, radius, to, size, count);
        });
    }

    /* A box around all that is visible; throws BTH_ERROR_MISSING if nothing is. */
    box bounds() const {
        float ends[2][3];
        check(bth_bounds(opened(), ends));
        return {{ends[0][0], ends[0][1], ends[0][2]}, {ends[1][0], ends[1][1], ends[1][2]}};
    }

    std::uint32_t object_count() const noexcept { return bth_object_count(get()); }
    std::uint32_t group_count(std::uint32_t object) const noexcept { return bth_group_count(get(), object); }
    std::uint32_t material_count(std::uint32_t object) const noexcept { return bth_material_count(get(), object); }

    /* The vertices of a triangle in world space. */
    std::array<std::array<double, 3>, 3> triangle_positions(bth_surface triangle) const {
        std::array<std::array<double, 3>, 3> corners;
        check(bth_triangle_positions(opened(), triangle, reinterpret_cast<double(*)[3]>(corners.data())));
        return corners;
    }

    /* The surface at a hit. */
    bth_surface_point surface(const bth_hit &hit) const {
        bth_surface_point point;
        check(bth_surface_at(get(), &hit, &point));
        return point;
    }

    /* How a material of an object looks. */
    bth_material_look material(std::uint32_t object, std::uint32_t material) const {
        bth_material_look look;
        check(bth_material(get(), object, material, &look));
        return look;
    }

    /* A texture of an object; its bytes are those of the scene. */
    bth_texture_image texture(std::uint32_t object, std::uint32_t texture) const {
        bth_texture_image image;
        check(bth_texture(get(), object, texture, &image));
        return image;
    }

    std::string object_name(std::uint32_t object) const {
        return name([&](char *to, std::size_t size) { return bth_object_name(get(), object, to, size); });
    }
    std::string group_name(std::uint32_t object, std::uint32_t group) const {
        return name([&](char *to, std::size_t size) { return bth_group_name(get(), object, group, to, size); });
    }
    std::string material_name(std::uint32_t object, std::uint32_t material) const {
        return name([&](char *to, std::size_t size) { return bth_material_name(get(), object, material, to, size); });
    }

    std::uint64_t resident_bytes() const noexcept { return bth_resident_bytes(get()); }

    /* The scene for functions of bth.h; it stays open. */
    bth_scene *get() const noexcept { return handle_.get(); }

private:
    friend class builder;

    /* The answers of a query of a range of rays or points, by the function for its numbers. */
    template <typename Single, typename Double, typename Asked, typename QuerySingle, typename QueryDouble, typename... More>
    auto answers(const Asked *asked, std::size_t count, std::bool_constant<true>, QuerySingle, QueryDouble query, More... more) const {
        std::vector<Double> found(count);
        check(query(opened(), asked, more..., found.data(), count));
        return found;
    }
    template <typename Single, typename Double, typename Asked, typename QuerySingle, typename QueryDouble, typename... More>
    auto answers(const Asked *asked, std::size_t count, std::bool_constant<false>, QuerySingle query, QueryDouble, More... more) const {
        std::vector<Single> found(count);
        check(query(opened(), asked, more..., found.data(), count));
        return found;
    }
    template <typename Single, typename Double, typename Rays, typename QuerySingle, typename QueryDouble, typename... More>
    auto of_rays(const Rays &rays, QuerySingle single, QueryDouble twice, More... more) const {
        using ray = std::remove_cv_t<std::remove_pointer_t<decltype(std::data(rays))>>;
        using is_double = std::bool_constant<std::is_same_v<ray, bth_ray64>>;
        return answers<Single, Double>(std::data(rays), std::size(rays), is_double{}, single, twice, more...);
    }
    template <typename Single, typename Double, typename Points, typename QuerySingle, typename QueryDouble, typename... More>
    auto of_points(const Points &points, QuerySingle single, QueryDouble twice, More... more) const {
        using is_double = std::bool_constant<std::is_same_v<number_of<Points>, double>>;
        return answers<Single, Double>(numbers_of(points), std::size(points), is_double{}, single, twice, more...);
    }

    /* The triangles that a query stores, which tells how many there are. */
    template <typename Find>
    static std::vector<bth_surface> found(Find find) {
        std::vector<bth_surface> triangles(64);
        for (;;) {
            std::size_t count = 0;
            check(find(triangles.data(), triangles.size(), &count));
            const bool complete = count <= triangles.size();
            triangles.resize(count);
            if (complete) return triangles;
        }
    }

    static constexpr float infinite = std::numeric_limits<float>::infinity();

    /* The hits that a query stores in a list. */
    template <typename List, typename Query, typename Ray>
    std::vector<hit_of<Ray>> all_hits_of(Query query, const Ray &ray, std::uint64_t most, const bth_accept &accept) const {
        std::vector<hit_of<Ray>> hits(8);
        for (;;) {
            std::uint64_t offsets[2];
            List list{offsets, hits.data(), hits.size(), 0};
            check(query(get(), &ray, &accept, most, &list, 1));
            const bool complete = list.needed <= hits.size();
            hits.resize(static_cast<std::size_t>(list.needed));
            if (complete) return hits;
        }
    }

    /* The floats of a range of vectors, one for each of `count` rays. */
    template <typename Directions>
    static const float *floats_of(const Directions &directions, std::size_t count) {
        if (std::size(directions) != count) throw error(BTH_ERROR_ARGUMENT, "expected a direction for each start");
        return numbers_of(directions);
    }

    struct close {
        void operator()(bth_scene *scene) const noexcept { bth_close(scene); }
    };

    /* The scene, if this object has one. */
    bth_scene *opened() const {
        if (!handle_) throw error(BTH_ERROR_ARGUMENT, "the scene was moved from");
        return handle_.get();
    }

    explicit scene(bth_scene *opened) noexcept : handle_(opened) {}

    /* The text that a function copies to a buffer of some size. */
    template <typename Copy>
    static std::string name(Copy copy) {
        std::string text(copy(nullptr, 0) + 1, '\0');
        text.resize(copy(&text[0], text.size()));
        return text;
    }

    static scene open(const std::string &path, std::uint32_t flags) {
        /* bth_open would end the path there and open another file. */
        if (path.find('\0') != std::string::npos) throw error(BTH_ERROR_ARGUMENT, "the path holds a zero byte");
        bth_scene *opened = nullptr;
        check(bth_open(path.c_str(), flags, &opened));
        return scene(opened);
    }

    std::unique_ptr<bth_scene, close> handle_;
};

/* A scene of the objects of several files, whose instances the caller places; see bth_builder_new. It can be moved but not
 * copied. Changes are visible after the next commit. */
class builder {
public:
    builder() : handle_(bth_builder_new()) {}

    /* Adds the objects of a scene, which may be closed then; returns the number of the first. */
    std::uint32_t add(const scene &from) {
        return stored([&](std::uint32_t *id) { return bth_builder_add(get(), from.opened(), id); });
    }

    /* Places an object; returns the id of the instance. */
    std::uint32_t instance(std::uint32_t object, const transform<float> &place = identity) {
        return stored([&](std::uint32_t *id) { return bth_builder_instance(get(), object, place.data(), id); });
    }
    /* Adds a group; returns its number. */
    std::uint32_t group() {
        return stored([&](std::uint32_t *id) { return bth_builder_group(get(), id); });
    }
    /* Places an object (kind BTH_OBJECT) or a group (BTH_GROUP) in a group; returns the id of the instance. */
    std::uint32_t place(std::uint32_t kind, std::uint32_t content, std::uint32_t within = BTH_NONE,
                        const transform<float> &at = identity) {
        return stored(
            [&](std::uint32_t *id) { return bth_builder_place(get(), kind, content, within, at.data(), id); });
    }
    void remove(std::uint32_t instance) { check(bth_builder_remove(get(), instance)); }
    void set_visible(std::uint32_t instance, bool visible) { check(bth_builder_set_visible(get(), instance, visible)); }
    void set_transform(std::uint32_t instance, const transform<float> &place) {
        check(bth_builder_set_transforms(get(), &instance, place.data(), 1));
    }
    void set_transform(std::uint32_t instance, const transform<double> &place) {
        check(bth_builder_set_transforms_f64(get(), &instance, place.data(), 1));
    }
    void set_transforms(const std::vector<std::uint32_t> &instances, const std::vector<transform<float>> &places) {
        same_size(instances.size(), places.size());
        check(bth_builder_set_transforms(get(), instances.data(), places.empty() ? nullptr : places[0].data(), places.size()));
    }
    void set_transforms(const std::vector<std::uint32_t> &instances, const std::vector<transform<double>> &places) {
        same_size(instances.size(), places.size());
        check(bth_builder_set_transforms_f64(get(), instances.data(), places.empty() ? nullptr : places[0].data(), places.size()));
    }

    /* Places a whole file, with its animation. */
    std::uint32_t subscene(std::uint32_t first_object, const transform<float> &place = identity) {
        return stored([&](std::uint32_t *id) { return bth_builder_subscene(get(), first_object, place.data(), id); });
    }
    std::vector<std::uint32_t> subscene_instances(std::uint32_t subscene) {
        std::size_t count = 0;
        check(bth_builder_subscene_instances(get(), subscene, nullptr, 0, &count));
        std::vector<std::uint32_t> ids(count);
        check(bth_builder_subscene_instances(get(), subscene, ids.data(), count, &count));
        return ids;
    }
    void set_subscene_transform(std::uint32_t subscene, const transform<float> &place) {
        check(bth_builder_set_subscene_transform(get(), subscene, place.data()));
    }
    void set_subscene_transform(std::uint32_t subscene, const transform<double> &place) {
        check(bth_builder_set_subscene_transform_f64(get(), subscene, place.data()));
    }
    void set_subscene_seconds(std::uint32_t subscene, double seconds) {
        check(bth_builder_set_subscene_seconds(get(), subscene, seconds));
    }
    void set_subscene_visible(std::uint32_t subscene, bool visible) {
        check(bth_builder_set_subscene_visible(get(), subscene, visible));
    }
    void remove_subscene(std::uint32_t subscene) { check(bth_builder_remove_subscene(get(), subscene)); }

    /* Masks have an effect at once. */
    void set_instance_mask(std::uint32_t instance, std::uint32_t mask) {
        check(bth_builder_set_instance_mask(get(), instance, mask));
    }
    void set_group_mask(std::uint32_t object, std::uint32_t group, std::uint32_t mask) {
        check(bth_builder_set_group_mask(get(), object, group, mask));
    }

    void set_positions(std::uint32_t object, const float *positions, std::size_t count) {
        check(bth_builder_set_positions(get(), object, positions, count));
    }
    void set_positions_between(std::uint32_t object, const float *first, const float *last, std::size_t count, double share) {
        const float *const ends[2] = {first, last};
        check(bth_builder_set_positions_between(get(), object, ends, count, share));
    }

    /* Makes all changes visible, or none if it throws. */
    bth_update commit() {
        bth_update update;
        check(bth_builder_commit(get(), &update));
        return update;
    }

    /* The scene, for queries; it lives as long as the builder does and is not moved, changed or closed by itself. */
    template <typename Query>
    auto query(Query ask) const {
        const borrowed scene(bth_builder_scene(get()));
        return ask(static_cast<const bth::scene &>(scene.of_builder));
    }

    /* The builder for functions of bth.h. */
    bth_builder *get() const noexcept { return handle_.get(); }

private:
    struct free {
        void operator()(bth_builder *builder) const noexcept { bth_builder_free(builder); }
    };
    /* The scene of a builder as a bth::scene, which does not close it. */
    struct borrowed {
        scene of_builder;
        explicit borrowed(const bth_scene *opened) noexcept : of_builder(const_cast<bth_scene *>(opened)) {}
        ~borrowed() { of_builder.handle_.release(); }
    };

    template <typename Store>
    static std::uint32_t stored(Store store) {
        std::uint32_t id = 0;
        check(store(&id));
        return id;
    }
    static void same_size(std::size_t instances, std::size_t places) {
        if (instances != places) throw error(BTH_ERROR_ARGUMENT, "expected a transform for each instance");
    }

    std::unique_ptr<bth_builder, free> handle_;
};

#ifdef BTH_HAS_COMPILER
/* What bth_compile.h reports as a negative code, BTH_COMPILE_ERROR_..., and a text. */
class compile_error : public error {
public:
    using error::error;
};

/* The bytes of a compiled file. They can be moved but not copied. */
class compiled {
public:
    explicit compiled(bth_bytes bytes) noexcept : bytes_(bytes) {}
    compiled(compiled &&other) noexcept : bytes_(other.bytes_) { other.bytes_ = {}; }
    compiled &operator=(compiled &&other) noexcept {
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~compiled() { bth_free_bytes(&bytes_); }

    const std::uint8_t *data() const noexcept { return bytes_.data; }
    std::size_t size() const noexcept { return bytes_.length; }
    scene open() const { return scene::from_bytes(data(), size()); }

private:
    bth_bytes bytes_;
};

/* The bytes that a function of bth_compile.h stores. */
template <typename Compile>
compiled compiled_by(Compile compile) {
    bth_bytes bytes{};
    const std::int32_t code = compile(&bytes);
    if (code != BTH_COMPILE_OK) throw compile_error(code, bth_compile_last_error());
    return compiled(bytes);
}

/* Compile a mesh, or a scene of meshes, from memory; see bth_compile_mesh and bth_compile_scene. */
inline compiled compile(const bth_mesh &mesh, const bth_compile_options &options = {}) {
    return compiled_by([&](bth_bytes *to) { return bth_compile_mesh(&mesh, &options, to); });
}
inline compiled compile(const bth_mesh64 &mesh, const bth_compile_options &options = {}) {
    return compiled_by([&](bth_bytes *to) { return bth_compile_mesh_f64(&mesh, &options, to); });
}
inline compiled compile(const std::vector<bth_mesh> &meshes, const std::vector<bth_mesh_instance> &instances,
                        const bth_compile_options &options = {}) {
    return compiled_by([&](bth_bytes *to) {
        return bth_compile_scene(meshes.data(), meshes.size(), instances.data(), instances.size(), &options, to);
    });
}
inline compiled compile(const std::vector<bth_mesh64> &meshes, const std::vector<bth_mesh_instance> &instances,
                        const bth_compile_options &options = {}) {
    return compiled_by([&](bth_bytes *to) {
        return bth_compile_scene_f64(meshes.data(), meshes.size(), instances.data(), instances.size(), &options, to);
    });
}

/* Compiles a model file as one object; see bth_compile_file. The path is in UTF-8. */
inline compiled compile_file(const std::string &path, const bth_compile_options &options = {}) {
    /* The path would end there. */
    if (path.find('\0') != std::string::npos) throw compile_error(BTH_COMPILE_ERROR_ARGUMENT, "the path holds a zero byte");
    return compiled_by([&](bth_bytes *to) { return bth_compile_file(path.c_str(), &options, to); });
}
#endif

} // namespace bth

#endif
