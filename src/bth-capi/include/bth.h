/* C interface of bth: opens compiled BTH files and traces rays.
 *
 * Link with libbth. All functions may be called from any thread; queries on one scene may run
 * side by side. Rays are in world space; directions need not be normalized, and t is in
 * units of the direction. A ray whose origin or direction is not finite, whose direction is zero, or
 * whose tmin exceeds its tmax hits nothing.
 */
#ifndef BTH_H
#define BTH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bth_scene bth_scene;

/* The points origin + t * direction with tmin <= t <= tmax (which may be infinite). 32 bytes. */
typedef struct {
    float origin[3];
    float tmin;
    float direction[3];
    float tmax;
} bth_ray;

#define BTH_NONE 0xFFFFFFFFu

/* A triangle of an instance; BTH_NONE in both fields for none. The triangle is the face of the
 * source file after fan triangulation; the instance is 0 in the file of a single object. */
typedef struct {
    uint32_t instance;
    uint32_t triangle;
} bth_surface;

/* The nearest hit. t is infinite for a miss. u and v are the barycentric weights of the triangle's
 * second and third vertex. 20 bytes. */
typedef struct {
    float t;
    float u;
    float v;
    bth_surface surface;
} bth_hit;

/* Flags of bth_open. */
#define BTH_READ 0u /* read the file into memory and check every index: safe for any file */
#define BTH_MAP 1u  /* map the file: nobody may change or shrink it until bth_close, and its contents
                       must come from a trusted compiler (section contents are not checked) */

/* Results of bth_open. */
#define BTH_OK 0
#define BTH_ERROR_ARGUMENT (-1)    /* a null pointer, an unknown flag, a path that is not UTF-8 */
#define BTH_ERROR_FILE (-2)        /* the file could not be read */
#define BTH_ERROR_FORMAT (-3)      /* not a BTH file, or one that breaks the specification */
#define BTH_ERROR_VERSION (-4)     /* a version or feature that this library does not know */
#define BTH_ERROR_INTERNAL (-5)    /* a defect of this library */

/* Opens a compiled file. On success stores the scene and returns 0; else leaves *scene null
 * and returns a negative code, and bth_last_error tells what is wrong, where, and what to do. */
int32_t bth_open(const char *path, uint32_t flags, bth_scene **scene);

/* Closes a scene; null is allowed. */
void bth_close(bth_scene *scene);

/* Text of the last error on this thread, never null; valid until the next call of bth_open here. */
const char *bth_last_error(void);

/* Nearest hits of `count` rays. `from` (or null) names, per ray, the surface that it starts on:
 * a hint where to begin, which never changes an answer. */
void bth_nearest(const bth_scene *scene, const bth_ray *rays, const bth_surface *from, bth_hit *hits, size_t count);

/* For each ray 1 if it hits anything, else 0. */
void bth_any(const bth_scene *scene, const bth_ray *rays, const bth_surface *from, uint8_t *hit, size_t count);

/* Bytes of the sections that traversal reads. */
uint64_t bth_resident_bytes(const bth_scene *scene);

#ifdef __cplusplus
}
#endif
#endif
