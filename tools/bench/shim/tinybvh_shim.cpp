// C functions over tinybvh's CPU layouts, so that they can be loaded at run time. The Rust crate that ships the
// header has no any-hit query and no BVH4_CPU.
#include <cstddef>
#include <cstdint>
#include <limits>

#define TINYBVH_IMPLEMENTATION
#include "tiny_bvh.h"

namespace {

constexpr uint32_t kNone = 0xffffffffu;

// bth::rays::Ray.
struct RayArgument {
    float origin[3];
    float tmin;
    float direction[3];
    float tmax;
};

struct Answer {
    float t, u, v;
    uint32_t triangle;
};

// Fields are set one by one: the library's constructor normalizes the direction, which changes the ray.
void set(tinybvh::Ray &ray, const RayArgument &in) {
    ray.O = tinybvh::bvhvec3(in.origin[0], in.origin[1], in.origin[2]);
    ray.D = tinybvh::bvhvec3(in.direction[0], in.direction[1], in.direction[2]);
    ray.rD = tinybvh::tinybvh_rcp(ray.D);
    ray.hit.t = in.tmax < BVH_FAR ? in.tmax : BVH_FAR;
    ray.hit.prim = kNone;
}

class Bvh {
public:
    virtual ~Bvh() = default;
    virtual size_t bytes() const = 0;
    virtual void nearest(const RayArgument *rays, size_t count, Answer *answers) const = 0;
    virtual void occluded(const RayArgument *rays, size_t count, uint8_t *answers) const = 0;
};

template <typename Layout>
class LayoutBvh final : public Bvh {
public:
    LayoutBvh(const tinybvh::bvhvec4 *corners, uint32_t triangles, bool spatial_splits) {
        if (spatial_splits) {
            layout_.BuildHQ(corners, triangles);
        } else {
            layout_.Build(corners, triangles);
        }
    }

    // Leaves hold copies of their triangles.
    size_t bytes() const override { return layout_.usedBlocks * sizeof(typename Layout::CacheLine); }

    void nearest(const RayArgument *rays, size_t count, Answer *answers) const override {
        tinybvh::Ray ray{};
        ray.mask = RAY_MASK_INTERSECT_ALL;
        for (size_t i = 0; i < count; ++i) {
            set(ray, rays[i]);
            layout_.Intersect(ray);
            if (ray.hit.prim == kNone) {
                answers[i] = {std::numeric_limits<float>::infinity(), 0, 0, kNone};
            } else {
                answers[i] = {ray.hit.t, ray.hit.u, ray.hit.v, ray.hit.prim};
            }
        }
    }

    void occluded(const RayArgument *rays, size_t count, uint8_t *answers) const override {
        tinybvh::Ray ray{};
        ray.mask = RAY_MASK_INTERSECT_ALL;
        for (size_t i = 0; i < count; ++i) {
            set(ray, rays[i]);
            answers[i] = layout_.IsOccluded(ray) ? 1 : 0;
        }
    }

private:
    Layout layout_;
};

} // namespace

#define EXPORT extern "C" __attribute__((visibility("default")))

// corners: for each triangle three times x, y, z and an unused float; they must outlive the structure.
EXPORT Bvh *tb_build(const float *corners, uint32_t triangles, uint32_t width, uint32_t spatial_splits) {
    const auto *points = reinterpret_cast<const tinybvh::bvhvec4 *>(corners);
    if (width == 4) {
        return new LayoutBvh<tinybvh::BVH4_CPU>(points, triangles, spatial_splits != 0);
    }
    return new LayoutBvh<tinybvh::BVH8_CPU>(points, triangles, spatial_splits != 0);
}
EXPORT void tb_free(Bvh *bvh) { delete bvh; }
EXPORT size_t tb_bytes(const Bvh *bvh) { return bvh->bytes(); }
EXPORT void tb_nearest(const Bvh *bvh, const RayArgument *rays, size_t count, Answer *answers) {
    bvh->nearest(rays, count, answers);
}
EXPORT void tb_occluded(const Bvh *bvh, const RayArgument *rays, size_t count, uint8_t *answers) {
    bvh->occluded(rays, count, answers);
}
