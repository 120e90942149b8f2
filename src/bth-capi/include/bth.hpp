/* C++17 interface of bth: what bth.h declares, with scenes that close themselves and errors that are thrown. Header only; link
 * with libbth.
 *
 *     bth::scene scene = bth::scene::open("dragon.bth");
 *     bth_hit hit = scene.nearest(bth_ray{{0, 0, 5}, 0, {0, 0, -1}, INFINITY});
 *
 * Constant member functions may run on one scene at the same time, as those of bth.h; the others must run alone.
 */
#ifndef BTH_HPP
#define BTH_HPP

#include "bth.h"

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

/* Throws if a query of some rays has no rays or no room for results. */
inline void check_arrays(const void *rays, const void *results, std::size_t count) {
    if (count > 0 && (rays == nullptr || results == nullptr))
        throw error(BTH_ERROR_ARGUMENT, "rays and results of a query must not be null");
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
        bth_nearest(opened(), &ray, nullptr, &hit, 1);
        return hit;
    }

    /* Whether a ray hits anything. */
    bool any(const bth_ray &ray) const {
        std::uint8_t hit = 0;
        bth_any(opened(), &ray, nullptr, &hit, 1);
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
        check_arrays(rays, hits, count);
        bth_nearest(opened(), rays, nullptr, hits, count);
    }

    /* As bth_any. */
    void any(const bth_ray *rays, std::uint8_t *hit, std::size_t count) const {
        check_arrays(rays, hit, count);
        bth_any(opened(), rays, nullptr, hit, count);
    }

    /* For any range of rays that are adjacent in memory: std::vector, std::array, std::span. */
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

    /* For ranges of starts and of directions that are adjacent in memory; the elements of the
     * latter are three floats: std::array<float, 3> or a struct. */
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
        static_assert(sizeof(*std::data(directions)) == 3 * sizeof(float), "a direction is three floats");
        if (std::size(directions) != count) throw error(BTH_ERROR_ARGUMENT, "expected a direction for each start");
        return reinterpret_cast<const float *>(std::data(directions));
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

} // namespace bth

#endif
