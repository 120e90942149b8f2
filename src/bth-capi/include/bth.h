/* C interface of bth: opens compiled BTH files and traces rays. Link with libbth.
 *
 * All functions may be called from any thread. Functions that take a const bth_scene may run on one scene at the same time;
 * functions that take a bth_scene without const must not run at the same time as any other function on that scene.
 *
 * In a file without scene sections, such as a compiled model, each object has one instance with the same index, and object
 * space is world space.
 *
 * Every pointer must be null or valid. Functions that return a code return BTH_ERROR_ARGUMENT for a null pointer that is not
 * documented as allowed, and a query of no rays does nothing and returns BTH_OK (bth_all_hits still stores its one offset).
 * Functions that return no code treat a null scene as one without instances. From C++, bth.hpp closes scenes and throws errors.
 */
#ifndef BTH_H
#define BTH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bth_scene bth_scene;

/* A ray in world space: the points origin + t * direction with tmin <= t <= tmax. The direction need not be normalized; t is
 * in units of its length. tmin and tmax may be infinite, but the t of a hit never is. A ray hits
 * nothing if its origin or direction is not finite, its direction is zero, tmin or tmax is NaN, or
 * tmin exceeds tmax. 32 bytes. */
typedef struct {
    float origin[3];
    float tmin;
    float direction[3];
    float tmax;
} bth_ray;

/* The index that stands for no instance, triangle or node. */
#define BTH_NONE 0xFFFFFFFFu

/* A triangle of an instance; both fields are BTH_NONE for no triangle. The triangle is an index into the triangles of the
 * object's source file after fan triangulation of its faces. 8 bytes. */
typedef struct {
    uint32_t instance;
    uint32_t triangle;
} bth_surface;

/* The nearest hit of a ray, or a miss. t is in units of the length of the ray's direction, and infinite for a miss. u and v, from
 * 0 to 1, are the barycentric weights of the triangle's second and third vertex. The surface of a miss is BTH_NONE. 20 bytes. */
typedef struct {
    float t;
    float u;
    float v;
    bth_surface surface;
} bth_hit;

/* Flags of bth_open. */
#define BTH_READ 0u /* reads the file into memory and checks every index: safe for any file */
#define BTH_MAP 1u  /* maps the file into memory and does not check the contents of objects: it must not be changed or
                       truncated until bth_close, and must have been written by a trusted compiler */

/* Results of functions. */
#define BTH_OK 0
#define BTH_ERROR_ARGUMENT (-1)    /* a null pointer, an unknown flag, a path that is not UTF-8, an object or instance that
                                      does not exist, a start that is not a point of a surface, or a time that is not
                                      finite */
#define BTH_ERROR_FILE (-2)        /* the file could not be read */
#define BTH_ERROR_FORMAT (-3)      /* not a BTH file, or one that violates the specification */
#define BTH_ERROR_VERSION (-4)     /* a version or feature that this library does not support */
#define BTH_ERROR_INTERNAL (-5)    /* a defect of this library */
#define BTH_ERROR_SCENE (-6)       /* an instance cannot be placed: its transform, at the given time, cannot be inverted or
                                      is not finite; the text of the error gives the node or the instance */
#define BTH_ERROR_MISSING (-7)     /* the file does not keep what is asked for, or there is none; the text of the error says
                                      which option of the compiler keeps it */

/* Opens a compiled file; path is in UTF-8. On success stores the scene in *scene and returns BTH_OK. On failure stores null,
 * unless path or scene is null, and returns a negative code; bth_last_error then describes what is wrong, where, and what can
 * be done. */
int32_t bth_open(const char *path, uint32_t flags, bth_scene **scene);

/* As bth_open, for the `length` bytes of a compiled file in memory, which are copied and need no alignment; `flags` must be
 * BTH_READ. */
int32_t bth_open_memory(const uint8_t *bytes, size_t length, uint32_t flags, bth_scene **scene);

/* Closes a scene and frees its memory; null is allowed. */
void bth_close(bth_scene *scene);

/* Text of the last error on the calling thread, never null. It is valid until the next call on this thread that
 * can fail. */
const char *bth_last_error(void);

/* Stores the nearest hits of `count` rays in `hits`, which must not overlap `rays`. `reserved` is
 * ignored: pass NULL. Returns BTH_OK or a negative code. After BTH_ERROR_ARGUMENT nothing is stored,
 * and after BTH_ERROR_INTERNAL all rays are misses. */
int32_t bth_nearest(const bth_scene *scene, const bth_ray *rays, const bth_surface *reserved, bth_hit *hits, size_t count);

/* Stores in `hit` for each of `count` rays 1 if it hits anything, else 0. `hit` must not overlap
 * `rays`. `reserved` is ignored: pass NULL. Returns what bth_nearest does. */
int32_t bth_any(const bth_scene *scene, const bth_ray *rays, const bth_surface *reserved, uint8_t *hit, size_t count);

/* Rays that start on a surface. Such a ray is all points S + t * direction with t > 0 and t <=
 * tmax, where S is the exact point of its start. It never hits the surface that it leaves, nor
 * another one through S, and never skips a wall, however near. It needs no offset from the surface
 * and no tmin.
 *
 * A start is the point a + u(b - a) + v(c - a) of the stored vertices a, b and c of a triangle,
 * not rounded. u and v, from 0 to 1, are the weights of the second and the third vertex, as in
 * bth_hit. Where their rounded sum exceeds 1, the start is the point (ub + vc) / (u + v) of the
 * edge. The start of a hit is {hit.surface.instance, hit.surface.triangle, hit.u, hit.v}.
 * 16 bytes. */
typedef struct {
    uint32_t instance;
    uint32_t triangle;
    float u;
    float v;
} bth_start;

/* Stores the nearest hits of `count` rays that start on surfaces in `hits`, which must not overlap
 * the other arrays. `directions` holds three floats for each ray, in world space, of any length
 * except zero; t is in units of that length. `tmax` holds the largest t of each ray, and may be
 * null: then no ray has an end. A ray is a miss if its start is not a point of a visible instance;
 * bth_check_start says why. Returns BTH_OK or a negative code. After BTH_ERROR_ARGUMENT nothing is
 * stored. */
int32_t bth_nearest_starts(const bth_scene *scene, const bth_start *starts, const float *directions, const float *tmax,
                           bth_hit *hits, size_t count);

/* As bth_nearest_starts; stores in `hit` for each ray 1 if it hits anything, else 0. */
int32_t bth_any_starts(const bth_scene *scene, const bth_start *starts, const float *directions, const float *tmax,
                       uint8_t *hit, size_t count);

/* Checks that rays can start at a point. Returns BTH_OK, or BTH_ERROR_ARGUMENT if there is no such
 * instance, it is hidden, it has no such triangle, the triangle has no area, or u and v are not the
 * weights of a point of it. The text of the error says which. */
int32_t bth_check_start(const bth_scene *scene, const bth_start *start);

/* Stores the first and the last frame and the number of frames per second of the scene; each of the three pointers may be
 * null. A file without scene sections has only frame 0, at one frame per second. */
void bth_frames(const bth_scene *scene, int32_t *first, int32_t *last, double *rate);

/* Time of the scene in seconds: after bth_open that of its first frame; 0 in a file without scene sections. */
double bth_seconds(const bth_scene *scene);

/* Sets the time of the scene, in seconds or to that of a frame (frame / rate). It may lie outside of the range of frames. The
 * animation is evaluated, and the instances that moved are placed anew. Without scene sections this has no effect. Returns
 * BTH_OK, or a negative code, and the scene is then unchanged. */
int32_t bth_set_seconds(bth_scene *scene, double seconds);
int32_t bth_set_frame(bth_scene *scene, int32_t frame);

/* An instance at the scene's time. 112 bytes. */
typedef struct {
    double to_world[3][4]; /* transform from object space to world space: rows, applied to columns (x, y, z, 1) */
    uint32_t object;       /* index of its object; BTH_NONE if a builder has removed the instance */
    uint32_t node;         /* index of the node to which it is attached, in the file of its object; BTH_NONE in a file without
                              scene sections, and for instances that the caller of a builder has placed */
    uint32_t visible;      /* 1 if rays can hit it, else 0 */
    uint32_t reserved;     /* 0 */
} bth_instance;

/* Number of instances of the scene, visible or not. bth_surface.instance is an index below this number. */
uint32_t bth_instance_count(const bth_scene *scene);

/* Stores the instance with index `row` in *instance. Returns BTH_OK, or BTH_ERROR_ARGUMENT if there is no such instance or a
 * pointer is null. */
int32_t bth_get_instance(const bth_scene *scene, uint32_t row, bth_instance *instance);

/* Stores the rows on the way to an instance, that in the world first, and returns their number: 1 without groups, where the row is
 * the instance; in a file they are rows of its instances, in a scene of a builder ids. 0 if there is no such instance or a pointer is
 * null. */
uint32_t bth_instance_path(const bth_scene *scene, uint32_t instance, uint32_t rows[16]);

/* The point of the triangles that is closest to a given point. 36 bytes. */
typedef struct {
    float distance;        /* in world space; infinite if there is none within the radius */
    float point[3];        /* the closest point, in world space */
    float u, v;            /* barycentric weights of the triangle's second and third vertex */
    bth_surface surface;   /* the triangle; BTH_NONE in both fields if there is none */
    uint32_t feature;      /* where on the triangle: 0 inside, 1 to 3 on the edge from the first, second or third vertex to the
                              next, 4 to 6 at that vertex */
} bth_closest;

/* Stores for each of `count` points, x, y and z in world space, the closest point of the triangles whose distance is at most
 * `radius`. There is none for a point that is not finite, or with a radius that is negative or NaN. Many points in
 * one call are faster. Returns BTH_OK, or a negative code. */
int32_t bth_closest_points(const bth_scene *scene, const float *points, float radius, bth_closest *closest, size_t count);

/* Stores for each of `count` points the distance to the closest triangle, negative inside of closed meshes; infinite if nothing
 * can be hit, NaN for a point that is not finite. Returns BTH_OK, or a negative code. */
int32_t bth_signed_distances(const bth_scene *scene, const float *points, float *distances, size_t count);

/* Stores the number of triangles that overlap an axis-aligned box in world space in *count, and the first `capacity` of them, by
 * ascending instance and triangle, in `triangles`, which may be null if `capacity` is 0. Touching counts; the answer is exact.
 * Returns BTH_OK, or a negative code. */
int32_t bth_triangles_in_box(const bth_scene *scene, const float lower[3], const float upper[3], bth_surface *triangles,
                             size_t capacity, size_t *count);

/* As bth_triangles_in_box, for triangles whose distance from `center`, rounded to float, is at most `radius`. */
int32_t bth_triangles_in_sphere(const bth_scene *scene, const float center[3], float radius, bth_surface *triangles,
                                size_t capacity, size_t *count);

/* Size in bytes of the sections that traversal reads; 0 if the scene is null. */
uint64_t bth_resident_bytes(const bth_scene *scene);

/* Queries for several hits and with conditions. Hits come in order: by ascending t, then instance, then triangle. Among hits of
 * one instance whose t is equal as it is reported, rounded to float, those that are nearer before the rounding come first. A
 * triangle is hit at most once. A ray through an edge or a vertex hits every triangle to which the edge or vertex belongs. */

/* Decides about a hit: returns 0 to ignore it, any other value to accept it. `user` is that of bth_accept. Both pointers are valid
 * during the call. Calls come in any order; for the nearest hits, only for hits nearer than those found so far. The function may
 * be called on any thread, and on several at the same time if queries are. It must return, without a jump out of it. */
typedef int32_t (*bth_filter)(void *user, const bth_ray *ray, const bth_hit *hit);

/* Sides of triangles that are ignored. The front is the side from which the vertices appear counter-clockwise in object space; a
 * transform that mirrors an instance does not exchange the sides. */
#define BTH_CULL_NONE 0u
#define BTH_CULL_BACK 1u  /* hits on the back are ignored */
#define BTH_CULL_FRONT 2u /* hits on the front are ignored */

/* What a ray is allowed to hit. 24 bytes where pointers have 8. */
typedef struct {
    uint32_t mask;     /* instances and groups whose mask has no bit in common with this one are not hit */
    uint32_t cull;     /* one of BTH_CULL_NONE, BTH_CULL_BACK and BTH_CULL_FRONT */
    bth_filter filter; /* null, or called for each hit that passes the conditions above */
    void *user;        /* passed to the filter */
} bth_accept;

/* The initializer of a bth_accept that accepts everything. */
#define BTH_ACCEPT_EVERYTHING {0xFFFFFFFFu, BTH_CULL_NONE, 0, 0}

/* Stores the nearest hit of each of `count` rays that is accepted. If `accept` is null, everything is, as in the other queries
 * below. They return BTH_OK or a negative code. After BTH_ERROR_INTERNAL the results are not valid. The results must not overlap
 * the other arrays. */
int32_t bth_nearest_accepted(const bth_scene *scene, const bth_ray *rays, const bth_accept *accept, bth_hit *hits,
                             size_t count);

/* Stores in `found` for each of `count` rays 1 if it has a hit that is accepted, else 0. */
int32_t bth_any_accepted(const bth_scene *scene, const bth_ray *rays, const bth_accept *accept, uint8_t *found,
                         size_t count);

/* Stores in `counts` the number of hits of each of `count` rays that are accepted. */
int32_t bth_count_hits(const bth_scene *scene, const bth_ray *rays, const bth_accept *accept, uint64_t *counts,
                       size_t count);

/* The hits of several rays, one ray after the other. */
typedef struct {
    uint64_t *offsets; /* one more number than there are rays: the hits of ray i are those from offsets[i] to offsets[i + 1] */
    bth_hit *hits;     /* `capacity` hits; null is allowed if that is 0 */
    uint64_t capacity;
    uint64_t needed;   /* set by the query: number of all hits, of which those that exceed the capacity were not stored */
} bth_hit_list;

/* The number of hits with which bth_all_hits stores all. */
#define BTH_ALL_HITS 0xFFFFFFFFFFFFFFFFull

/* Stores in `list` the `most` nearest hits of each of `count` rays that are accepted, in order, or all with BTH_ALL_HITS. If the
 * capacity does not suffice, the result is BTH_OK nevertheless; offsets and `needed` are those of a list that suffices. */
int32_t bth_all_hits(const bth_scene *scene, const bth_ray *rays, const bth_accept *accept, uint64_t most,
                     bth_hit_list *list, size_t count);

/* Sets the mask of an instance, which has all bits set before: rays of the queries above meet the instance only if their mask has a
 * bit in common with it. bth_nearest and bth_any ignore masks. Must not run at the same time as any other function on the scene.
 * Returns BTH_OK, or BTH_ERROR_ARGUMENT if there is no such instance. In a scene with groups it is the mask of a row, which holds for
 * all that the row shows. */
int32_t bth_set_instance_mask(bth_scene *scene, uint32_t instance, uint32_t mask);

/* As bth_set_instance_mask, for a group of triangles of an object in all its instances. Triangles of an object without groups form
 * group 0. A ray meets a triangle only if its mask has a bit in common with the mask of the instance and one in common with the
 * mask of the group. */
int32_t bth_set_group_mask(bth_scene *scene, uint32_t object, uint32_t group, uint32_t mask);

/* Crossings of surfaces by a ray. 8 bytes. */
typedef struct {
    uint32_t count;  /* crossings in the ray's range; each passage of a closed surface counts once */
    int32_t winding; /* crossings from the back of a triangle to its front, from which its vertices are seen counterclockwise,
                        minus those from the front to the back */
} bth_crossing_count;

/* Stores the crossings of triangles by each of `count` rays. Unlike hits, they never meet an edge, a vertex or the plane of a
 * triangle: they are those of the ray with its origin moved by an infinitely small vector, decided exactly. So a line crosses a
 * surface without boundary as often in as out, and each crossing lies in exactly one of two ranges of t that share an end.
 * `crossings` must not overlap the rays. Returns BTH_OK or a negative code; after BTH_ERROR_INTERNAL there are none. */
int32_t bth_crossings(const bth_scene *scene, const bth_ray *rays, bth_crossing_count *crossings, size_t count);

/* Stores for each of `count` points in world space how often the closed surfaces of the scene enclose it: its winding number, 0
 * outside of all. It is exact where every mesh is closed and its triangles are seen counterclockwise from outside; elsewhere it is the
 * number of crossings, counted as above, by a ray along an axis to the nearest side of an object's bounds. A point on a surface counts
 * as if it were moved by an infinitely small vector. `points` holds x, y and z of each; `winding` must not overlap it. Points that are not
 * finite are outside. Returns BTH_OK or a negative code; after BTH_ERROR_INTERNAL all points are outside. */
int32_t bth_winding(const bth_scene *scene, const float *points, int32_t *winding, size_t count);

/* Stores in `inside` for each of `count` points 1 if its winding number is not 0, else 0. The rest is as for bth_winding. */
int32_t bth_contains(const bth_scene *scene, const float *points, uint8_t *inside, size_t count);

/* Double precision. The functions below decide about the caller's own numbers, exactly: nothing is rounded to float before. They are
 * the functions of the same names without _f64, with the differences that are stated. */

/* A bth_ray in double. An origin beyond the range of float in the space of an object does not hit it, nor does a direction whose
 * length is beyond 2^164 or below 2^-164. 64 bytes. */
typedef struct {
    double origin[3];
    double tmin;
    double direction[3];
    double tmax;
} bth_ray64;

/* A bth_hit in double. t has a relative error of at most 2^-40; u and v are off by at most 2^-28. The range of t is compared with t
 * rounded to double. A t beyond the range of float is not hit. 32 bytes. */
typedef struct {
    double t;
    double u;
    double v;
    bth_surface surface;
} bth_hit64;

/* Stores the nearest hit of each of `count` rays that is accepted: the one with the smallest exact t. If `accept` is null, everything
 * is accepted, as in the other queries below. Its filter gets the ray and the hit rounded to float. Returns BTH_OK or a negative code;
 * after BTH_ERROR_INTERNAL the results are not valid. The results must not overlap the other arrays. */
int32_t bth_nearest_f64(const bth_scene *scene, const bth_ray64 *rays, const bth_accept *accept, bth_hit64 *hits, size_t count);

/* Stores in `found` for each of `count` rays 1 if it has a hit that is accepted, else 0. */
int32_t bth_any_f64(const bth_scene *scene, const bth_ray64 *rays, const bth_accept *accept, uint8_t *found, size_t count);

/* Stores in `counts` the number of hits of each of `count` rays that are accepted. */
int32_t bth_count_hits_f64(const bth_scene *scene, const bth_ray64 *rays, const bth_accept *accept, uint64_t *counts,
                           size_t count);

/* A bth_hit_list in double. */
typedef struct {
    uint64_t *offsets;
    bth_hit64 *hits;
    uint64_t capacity;
    uint64_t needed;
} bth_hit64_list;

/* As bth_all_hits. The order is the same: by t rounded to float, then instance, then triangle. */
int32_t bth_all_hits_f64(const bth_scene *scene, const bth_ray64 *rays, const bth_accept *accept, uint64_t most,
                         bth_hit64_list *list, size_t count);

/* Stores the numbers of one hit in double, for a hit that another function has found for the ray with the same numbers. A miss stays
 * a miss. Returns BTH_OK, or BTH_ERROR_ARGUMENT if a pointer is null, or the instance or triangle does not exist or is hidden. */
int32_t bth_hit_f64(const bth_scene *scene, const bth_ray64 *ray, const bth_hit *hit, bth_hit64 *numbers);

/* As bth_crossings. */
int32_t bth_crossings_f64(const bth_scene *scene, const bth_ray64 *rays, bth_crossing_count *crossings, size_t count);

/* A bth_closest in double. The distance is off by at most 2^-40 of the distance plus the triangle's longest edge, and by at most 2^-28
 * of the distance. Each coordinate of the point is off by the former and half a unit in its last place. u and v are off by at most
 * 2^-26. 64 bytes. */
typedef struct {
    double distance;
    double point[3];
    double u, v;
    bth_surface surface;
    uint32_t feature;
    uint32_t reserved; /* 0 */
} bth_closest64;

/* As bth_closest_points. Triangles are compared by their exact distances; there is none if the exact distance exceeds `radius`. */
int32_t bth_closest_points_f64(const bth_scene *scene, const double *points, double radius, bth_closest64 *closest, size_t count);

/* As bth_signed_distances, with the distances of bth_closest_points_f64. */
int32_t bth_signed_distances_f64(const bth_scene *scene, const double *points, double *distances, size_t count);

/* As bth_winding and bth_contains. */
int32_t bth_winding_f64(const bth_scene *scene, const double *points, int32_t *winding, size_t count);
int32_t bth_contains_f64(const bth_scene *scene, const double *points, uint8_t *inside, size_t count);

/* As bth_triangles_in_box, and as bth_triangles_in_sphere with exact distances. */
int32_t bth_triangles_in_box_f64(const bth_scene *scene, const double lower[3], const double upper[3], bth_surface *triangles,
                                 size_t capacity, size_t *count);
int32_t bth_triangles_in_sphere_f64(const bth_scene *scene, const double center[3], double radius, bth_surface *triangles,
                                    size_t capacity, size_t *count);

/* What hits lead to. A file keeps the corners of triangles that can be hit, normals and texture coordinates with --attributes, and
 * groups, materials and names with --names. */

/* Version of the library, such as "0.9.0". Valid forever. */
const char *bth_version(void);

/* Stores in bounds[0] the lower and in bounds[1] the upper end of a box in world space that contains all visible instances at the
 * scene's time, slightly enlarged to cover roundings. Returns BTH_OK, or BTH_ERROR_MISSING if nothing is visible. */
int32_t bth_bounds(const bth_scene *scene, float bounds[2][3]);

/* Number of objects of the file; 0 if the scene is null. */
uint32_t bth_object_count(const bth_scene *scene);

/* Number of groups of an object's triangles, at least 1, and of its materials; 0 if the scene is null or has no such object. */
uint32_t bth_group_count(const bth_scene *scene, uint32_t object);
uint32_t bth_material_count(const bth_scene *scene, uint32_t object);

/* Stores the three vertices of a triangle in world space, at the scene's time. Returns BTH_OK; BTH_ERROR_MISSING for a
 * triangle without area in a file without geometry; BTH_ERROR_ARGUMENT if there is no such instance or triangle. */
int32_t bth_triangle_positions(const bth_scene *scene, bth_surface triangle, double positions[3][3]);

/* Flag of bth_surface_point: the file has texture coordinates. */
#define BTH_HAS_UV 1u

/* The surface at a hit, in world space. Normals have length 1. 96 bytes. */
typedef struct {
    double position[3];         /* the point on the triangle */
    double geometric_normal[3]; /* of the triangle's plane, on the side from which the object's vertices are seen counterclockwise */
    double normal[3];           /* the source's normals interpolated, on whatever side it has them; the geometric normal where the
                                   file keeps none */
    float uv[2];                /* texture coordinates; zeros without BTH_HAS_UV */
    uint32_t object;            /* index of the object */
    uint32_t group;             /* index of the group of triangles; 0 if the file keeps no groups */
    uint32_t material;          /* index of the object's material; BTH_NONE if there is none */
    uint32_t flags;             /* BTH_HAS_UV or 0 */
} bth_surface_point;

/* Stores the surface at a hit of this scene, at the scene's time, in *point. Returns BTH_OK; BTH_ERROR_ARGUMENT for a miss;
 * BTH_ERROR_MISSING if the triangle has no area, or the instance is hidden by now. */
int32_t bth_surface_at(const bth_scene *scene, const bth_hit *hit, bth_surface_point *point);

/* Copy the name of an object, or of a group or material of an object, to `name`, in UTF-8 with a zero at the end; where it does not fit
 * into `capacity` bytes, only the characters that do. Return the length of the whole name in bytes, without the zero: 0 if there is no
 * name. `name` may be null if the capacity is 0. */
size_t bth_object_name(const bth_scene *scene, uint32_t object, char *name, size_t capacity);
size_t bth_group_name(const bth_scene *scene, uint32_t object, uint32_t group, char *name, size_t capacity);
size_t bth_material_name(const bth_scene *scene, uint32_t object, uint32_t material, char *name, size_t capacity);

/* How surfaces look, in files compiled with `bthc compile --materials`. Colors are linear, with the primaries of sRGB. */

/* What the alpha of a material means: the fourth component of its base color, times that of the texture and of the vertex color. */
#define BTH_ALPHA_OPAQUE 0u /* nothing */
#define BTH_ALPHA_MASK 1u   /* there is a surface where alpha is at least the cutoff */
#define BTH_ALPHA_BLEND 2u  /* it is the share of light that the surface stops */
/* Flags of materials. */
#define BTH_DOUBLE_SIDED 1u /* the back of triangles is seen too */
#define BTH_UNLIT 2u        /* the base color is shown as it is, without light */

/* How a material looks. 76 bytes. Metallic and the numbers below it are as in glTF 2.0; matte materials have 0, 1, 1, 1 and no
 * textures. Texels of their textures are linear. */
typedef struct {
    float base_color[4];         /* red, green, blue and alpha; to be multiplied by the texel of the texture and the vertex color */
    float emissive[3];           /* emitted radiance; to be multiplied by the texel of the texture */
    float alpha_cutoff;          /* of BTH_ALPHA_MASK; 0 otherwise */
    uint32_t alpha_mode;         /* BTH_ALPHA_... */
    uint32_t flags;              /* BTH_DOUBLE_SIDED and BTH_UNLIT, or 0 */
    uint32_t base_color_texture; /* index of a texture of the object, or BTH_NONE */
    uint32_t emissive_texture;   /* the same for the emission */
    float metallic;              /* 0 to 1; to be multiplied by blue of the texture of both */
    float roughness;             /* from 0, smooth, to 1; to be multiplied by green of the texture of both */
    float normal_scale;          /* factor of the first two components of the normals in the normal texture */
    float occlusion_strength;    /* how much the occlusion texture counts, 0 to 1 */
    uint32_t metallic_roughness_texture; /* index of a texture, or BTH_NONE */
    uint32_t normal_texture;     /* the same: red to the right, green up, blue out of the surface, 0 to 1 for -1 to 1 */
    uint32_t occlusion_texture;  /* the same: red is the share of light from all around that reaches the surface */
} bth_material_look;

/* How texture coordinates beyond 0 and 1 find texels. */
#define BTH_WRAP_REPEAT 0u
#define BTH_WRAP_MIRROR 1u /* every second time mirrored */
#define BTH_WRAP_CLAMP 2u  /* the texels at the edge go on */

/* A texture of an object: an image file and how it lies on the surface. */
typedef struct {
    const uint8_t *bytes;  /* the image file: PNG, JPEG or WebP; valid until the scene is closed. Red, green and blue of texels of
                              colors are sRGB; alpha and other texels are linear. */
    size_t length;         /* number of bytes */
    float transform[2][3]; /* rows of the transform from (u, v, 1), where u and v are those of its set, to coordinates of the
                              image: (0, 0) is its upper left corner, (1, 1) its lower right one */
    uint32_t image;        /* equal for textures of the same image of a file */
    uint32_t wrap[2];      /* BTH_WRAP_... for u and for v */
    uint32_t nearest;      /* 1: the nearest texel is taken; 0: four are interpolated, after they have been made linear */
    uint32_t uv_set;       /* 0: u and v are those of bth_surface_point; 1: those of a second set, see bth_texture_coordinates */
    uint32_t reserved;     /* 0 */
} bth_texture_image;

/* Stores how a material of an object looks in *look. Returns BTH_OK; BTH_ERROR_MISSING if the file keeps no more of it than its name;
 * BTH_ERROR_ARGUMENT if there is no such object or material. */
int32_t bth_material(const bth_scene *scene, uint32_t object, uint32_t material, bth_material_look *look);

/* Number of textures of an object; 0 if the scene is null or has no such object. */
uint32_t bth_texture_count(const bth_scene *scene, uint32_t object);

/* Stores a texture of an object in *image. Returns BTH_OK, or BTH_ERROR_ARGUMENT if there is no such object or texture. */
int32_t bth_texture(const bth_scene *scene, uint32_t object, uint32_t texture, bth_texture_image *image);

/* Stores the texture coordinates of a set at a hit of this scene, interpolated; those of set 0 are in bth_surface_point, too. Returns
 * BTH_OK; BTH_ERROR_MISSING if the file keeps none of this set for the triangle; BTH_ERROR_ARGUMENT for a miss or a set above 1. */
int32_t bth_texture_coordinates(const bth_scene *scene, const bth_hit *hit, uint32_t uv_set, float uv[2]);

/* Stores the vertex color at a hit of this scene, interpolated: linear red, green, blue and alpha. Returns BTH_OK; BTH_ERROR_MISSING if
 * the file keeps none for the triangle; BTH_ERROR_ARGUMENT for a miss. */
int32_t bth_vertex_color(const bth_scene *scene, const bth_hit *hit, float color[4]);

/* Scenes of the objects of several files, whose instances the caller places and moves at run time. A builder holds a scene, which
 * answers all queries above. Calls note what is to be, and bth_builder_commit makes all of it visible. Functions that take a
 * bth_builder without const must not run at the same time as any other function on the builder or its scene. Functions that return a
 * code return BTH_ERROR_ARGUMENT for objects, instances and subscenes that do not exist, and have no effect then.
 *
 * Transforms map object space to world space: the rows of a 3x4 matrix, one after the other, that is applied to columns (x, y, z, 1).
 * They may scale, shear and mirror. Functions whose names end in _f64 take them in double and do not round them. Instances have ids,
 * which stay the same until they are removed, and which are the instances of hits. A commit frees the ids of removed instances; the
 * least free id is used first. */
typedef struct bth_builder bth_builder;

/* A builder whose scene has no objects and no instances. */
bth_builder *bth_builder_new(void);

/* Frees a builder and its scene; null is allowed. */
void bth_builder_free(bth_builder *builder);

/* The scene of a builder as it was last committed, with all objects that were added; null if the builder is. The pointer is valid until
 * bth_builder_free, must not be given to bth_close, and its scene has no time: bth_set_seconds has no effect on it. */
const bth_scene *bth_builder_scene(const bth_builder *builder);

/* Adds the objects of another scene, without instances of them, and stores the index of the first in *first_object: the object with
 * index i there has index *first_object + i here. The memory of the file is shared, and lasts until the last of the scenes is closed;
 * a mapped file must not change until then. Masks and the time of the other scene have no effect here. Returns BTH_ERROR_ARGUMENT for
 * the scene of this builder. */
int32_t bth_builder_add(bth_builder *builder, const bth_scene *scene, uint32_t *first_object);

/* Adds an instance of an object and stores its id in *instance. bth_builder_commit decides whether the transform can be used; before
 * it, bth_builder_set_transforms_f64 may give the instance a transform in double. */
int32_t bth_builder_instance(bth_builder *builder, uint32_t object, const float transform[12], uint32_t *instance);

/* Adds an empty group and stores its number in *group: instances that are placed as a whole, any number of times, and are held once.
 * Hits number instances as if groups were written out; bth_instance_path leads back to ids. */
int32_t bth_builder_group(bth_builder *builder, uint32_t *group);

/* What bth_builder_place places. */
#define BTH_OBJECT 0u
#define BTH_GROUP 1u

/* Adds an instance of `content`, which is an object (`kind` BTH_OBJECT) or a group (BTH_GROUP), in the group `within`, or in the world
 * if that is BTH_NONE, and stores its id in *instance. A group may only hold groups that were added before it. */
int32_t bth_builder_place(bth_builder *builder, uint32_t kind, uint32_t content, uint32_t within, const float transform[12],
                          uint32_t *instance);

/* Sets the transforms of `count` instances: the twelve numbers from transforms[12 * i] on are that of instances[i]. If an instance is
 * given several times, its last transform counts. If one does not exist or belongs to a subscene, none is set. */
int32_t bth_builder_set_transforms(bth_builder *builder, const uint32_t *instances, const float *transforms, size_t count);
int32_t bth_builder_set_transforms_f64(bth_builder *builder, const uint32_t *instances, const double *transforms, size_t count);

/* Hides an instance from all queries if `visible` is 0, else shows it. An instance of a subscene is visible if the subscene and its
 * nodes are, too. */
int32_t bth_builder_set_visible(bth_builder *builder, uint32_t instance, uint32_t visible);

/* Removes an instance that belongs to no subscene. */
int32_t bth_builder_remove(bth_builder *builder, uint32_t instance);

/* Adds an instance of each instance of a file, placed by the nodes and tracks of the file and then by the transform, as at the first
 * frame of the file, and stores the id of the whole in *subscene. A file without scene sections has one instance of each object.
 * `first_object` is what bth_builder_add stored. A file may have several subscenes, each at a time of its own. */
int32_t bth_builder_subscene(bth_builder *builder, uint32_t first_object, const float transform[12], uint32_t *subscene);

/* Stores the number of a subscene's instances in *count, and the ids of the first `capacity` of them, in the order of the file, in
 * `instances`, which may be null if `capacity` is 0. */
int32_t bth_builder_subscene_instances(bth_builder *builder, uint32_t subscene, uint32_t *instances, size_t capacity,
                                       size_t *count);

/* Set the transform of a subscene, its time in seconds, and whether it is visible, and remove it with its instances. */
int32_t bth_builder_set_subscene_transform(bth_builder *builder, uint32_t subscene, const float transform[12]);
int32_t bth_builder_set_subscene_transform_f64(bth_builder *builder, uint32_t subscene, const double transform[12]);
int32_t bth_builder_set_subscene_seconds(bth_builder *builder, uint32_t subscene, double seconds);
int32_t bth_builder_set_subscene_visible(bth_builder *builder, uint32_t subscene, uint32_t visible);
int32_t bth_builder_remove_subscene(bth_builder *builder, uint32_t subscene);

/* As bth_set_instance_mask and bth_set_group_mask, for the scene of a builder. They have an effect at once, without a commit. The mask
 * of an instance that is removed is dropped. */
int32_t bth_builder_set_instance_mask(bth_builder *builder, uint32_t instance, uint32_t mask);
int32_t bth_builder_set_group_mask(bth_builder *builder, uint32_t object, uint32_t group, uint32_t mask);

/* What a commit or bth_set_positions has done. 64 bytes. */
typedef struct {
    uint64_t nodes;           /* nodes of subscenes that moved, were hidden or became visible */
    uint64_t placed;          /* instances that were placed again */
    uint64_t visible;         /* visible instances of the whole scene */
    double cost_ratio;        /* expected cost of rays through the top level relative to when it was last built */
    double top_level_seconds; /* time to rebuild or refit the top level */
    uint32_t rebuilt;         /* 1 if the top level was built anew, 0 if its boxes were computed again or nothing changed */
    uint32_t deformed;        /* objects that got new positions */
    double deformed_cost_ratio; /* expected cost of rays through a deformed object relative to that in the pose for which it was
                                   compiled, the greatest of several; 1 if no object got new positions */
    double refit_seconds;     /* time to refit these objects */
} bth_update;

/* Number of vertices for which bth_set_positions expects positions; 0 if there is no such object or it was not compiled with
 * --deformable (BTH_COMPILE_DEFORMABLE). */
size_t bth_vertex_count(const bth_scene *scene, uint32_t object);

/* Gives an object new positions, three floats for each of the `count` vertices of its source, in the source's order, in object space.
 * All queries then answer for them as exactly as for a file that is compiled with them; the file is not touched. `update` may be
 * null. No query may run on the scene meanwhile. Returns BTH_ERROR_MISSING if the object was not compiled for it, BTH_ERROR_ARGUMENT
 * if the number of positions is wrong or one is not finite, BTH_ERROR_SCENE if an instance could not be placed, and the scene is then
 * unchanged. */
int32_t bth_set_positions(bth_scene *scene, uint32_t object, const float *positions, size_t count, bth_update *update);

/* As bth_set_positions, with positions on the straight lines between those at two times, ends[0] and ends[1], at `share` of the way,
 * from 0 to 1: for motion blur. A coordinate is (1 - share) * a + share * b in double precision, rounded once. */
int32_t bth_set_positions_between(bth_scene *scene, uint32_t object, const float *const ends[2], size_t count, double share,
                                  bth_update *update);

/* As bth_set_positions and bth_set_positions_between, for an object of a builder. The next commit makes the positions visible. */
int32_t bth_builder_set_positions(bth_builder *builder, uint32_t object, const float *positions, size_t count);
int32_t bth_builder_set_positions_between(bth_builder *builder, uint32_t object, const float *const ends[2], size_t count,
                                          double share);

/* Makes all changes since the last commit visible. `update` may be null. If a visible instance cannot be placed, returns
 * BTH_ERROR_SCENE, and the text of the error gives the instance. The scene is then unchanged, and the changes still wait: correct the
 * transform, or hide or remove the instance, and commit again. */
int32_t bth_builder_commit(bth_builder *builder, bth_update *update);

#ifdef __cplusplus
}
#endif
#endif
