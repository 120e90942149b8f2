/* C interface of bth: opens compiled BTH files and traces rays.
 *
 * Link with libbth. All functions may be called from any thread; queries on one scene may run
 * side by side, but not beside bth_set_seconds, bth_set_frame and bth_close. Rays are in world space; directions need not be normalized, and t is in
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

/* Results. */
#define BTH_OK 0
#define BTH_ERROR_ARGUMENT (-1)    /* a null pointer, an unknown flag, a path that is not UTF-8, no such row */
#define BTH_ERROR_FILE (-2)        /* the file could not be read */
#define BTH_ERROR_FORMAT (-3)      /* not a BTH file, or one that breaks the specification */
#define BTH_ERROR_VERSION (-4)     /* a version or feature that this library does not know */
#define BTH_ERROR_INTERNAL (-5)    /* a defect of this library */
#define BTH_ERROR_SCENE (-6)       /* an instance cannot be shown at this time: its transform cannot be inverted or
                                      is not finite; the text names the node */

/* Opens a compiled file. On success stores the scene and returns 0; else leaves *scene null
 * and returns a negative code, and bth_last_error tells what is wrong, where, and what to do. */
int32_t bth_open(const char *path, uint32_t flags, bth_scene **scene);

/* Closes a scene; null is allowed. */
void bth_close(bth_scene *scene);

/* Text of the last error on this thread, never null; valid until the next call here that can fail. */
const char *bth_last_error(void);

/* Nearest hits of `count` rays. `from` (or null) names, per ray, the surface that it starts on:
 * a hint where to begin, which never changes an answer. */
void bth_nearest(const bth_scene *scene, const bth_ray *rays, const bth_surface *from, bth_hit *hits, size_t count);

/* For each ray 1 if it hits anything, else 0. */
void bth_any(const bth_scene *scene, const bth_ray *rays, const bth_surface *from, uint8_t *hit, size_t count);

/* First and last frame and frames per second of the scene; the pointers may be null. A file without a scene has frame 0
 * alone. */
void bth_frames(const bth_scene *scene, int32_t *first, int32_t *last, double *rate);

/* Seconds that the scene is shown at: after bth_open those of its first frame. */
double bth_seconds(const bth_scene *scene);

/* Moves the scene to a time or to a frame (frame / rate seconds), which may lie outside its range: evaluates the tracks and
 * places what moved. No query may be running on the scene. Does nothing in a file without a scene. Returns 0, or a
 * negative code and leaves the scene as it was. */
int32_t bth_set_seconds(bth_scene *scene, double seconds);
int32_t bth_set_frame(bth_scene *scene, int32_t frame);

/* An instance at the scene's time. 112 bytes. */
typedef struct {
    double to_world[3][4]; /* from the object's space to the world: rows, applied to columns (x, y, z, 1) */
    uint32_t object;
    uint32_t node;         /* that carries it; BTH_NONE in files without a scene */
    uint32_t visible;      /* 1 if rays can meet it, else 0 */
    uint32_t reserved;     /* 0 */
} bth_instance;

/* Instances of the scene, seen or not; surfaces name them by row. */
uint32_t bth_instance_count(const bth_scene *scene);

/* Writes what an instance is; BTH_ERROR_ARGUMENT if there is no such row. */
int32_t bth_get_instance(const bth_scene *scene, uint32_t row, bth_instance *instance);

/* Bytes of the sections that traversal reads. */
uint64_t bth_resident_bytes(const bth_scene *scene);

#ifdef __cplusplus
}
#endif
#endif
