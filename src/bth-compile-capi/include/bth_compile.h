/* C interface of the compiler of BTH files: compiles triangles in memory, and model files. Link with libbth_compile; libbth (bth.h) opens what it
 * makes, from memory or from a file, and does not need this library.
 *
 * All functions may be called from any thread, and several compilations may run at the same time.
 */
#ifndef BTH_COMPILE_H
#define BTH_COMPILE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Results of functions. */
#define BTH_COMPILE_OK 0
#define BTH_COMPILE_ERROR_ARGUMENT (-1)  /* a null pointer, an unknown option, options that exclude each other, a path
                                            that is empty or not UTF-8 */
#define BTH_COMPILE_ERROR_FILE (-2)      /* the model, the cache or the profile could not be read or written */
#define BTH_COMPILE_ERROR_INPUT (-3)     /* the triangles cannot be used: an index out of range, a position that is not finite; or the
                                            file does not follow its format */
#define BTH_COMPILE_ERROR_LIMIT (-4)     /* beyond a limit of the file format, or more threads than the system starts */
#define BTH_COMPILE_ERROR_INTERNAL (-5)  /* a defect of this library */
#define BTH_COMPILE_ERROR_CANCELLED (-6) /* the progress callback cancelled */

/* Values of bth_compile_options.structure: what to build. */
#define BTH_STRUCTURE_BTH 0u  /* a BVH, some nodes of which are tetrahedralized where that saves time and the program bth-tetgen
                                 is found */
#define BTH_STRUCTURE_BVH 1u  /* a BVH */
#define BTH_STRUCTURE_TETS 2u /* one tetrahedralization of the whole mesh */

/* Values of bth_compile_options.quality: effort of the BVH builder. */
#define BTH_QUALITY_BALANCED 0u
#define BTH_QUALITY_FAST 1u
#define BTH_QUALITY_BEST 2u

/* Values of bth_compile_options.free_directions: which directions are kept in which rays from a triangle meet nothing, and up to which
 * distance they do not, for rays that start on surfaces. */
#define BTH_FREE_NONE 0u
#define BTH_FREE_AUTO 1u      /* where that is worth its bytes: bthc --free-directions auto */
#define BTH_FREE_DISTANCES 2u /* distances alone, 8 bytes a triangle */
#define BTH_FREE_ALL 3u       /* 20 bytes a triangle */

/* Values of bth_compile_options.positions: in which numbers to keep double positions. */
#define BTH_POSITIONS_AUTO 0u /* in double where float would move a position by more than 2^-24 of the mesh's size, and where
                                 BTH_POSITIONS_F64 is possible */
#define BTH_POSITIONS_F32 1u
#define BTH_POSITIONS_F64 2u  /* in double, unless all numbers are floats. Excludes a deformable mesh, coordinate_bits, max_error,
                                 BTH_STRUCTURE_TETS, and free directions other than none and BTH_FREE_AUTO */

/* Bits of bth_compile_options.flags. */
#define BTH_COMPILE_NO_GEOMETRY 1u /* leaves out the positions and triangles of the source, which tracing does not need */
#define BTH_COMPILE_DEFORMABLE 4u  /* keeps what bth_set_positions needs; excludes the flag above and
                                      BTH_STRUCTURE_TETS; BTH_STRUCTURE_BTH then stands for a BVH */

/* Called when a stage begins and a few times a second during it: never by two threads at a time, but not always by the thread that
 * compiles. `stage` is its name, `done` of `total` units are done; total is 0 if it is not known. A result other than 0
 * cancels. */
typedef int32_t (*bth_progress)(void *user, const char *stage, uint64_t done, uint64_t total);

/* Called with each warning, as bth_progress is. */
typedef void (*bth_warning)(void *user, const char *message);

/* What rounding positions to float does to a mesh that lies farther from the origin than it is large. Of several meshes the counts are
 * sums, and the distance is the largest one. All are 0 if no position moves by more than 2^-24 of its mesh's size. 24 bytes. */
typedef struct {
    uint64_t positions; /* positions that move by more than that */
    uint64_t triangles; /* triangles that have an area in double and none in float, and cannot be hit then */
    double farthest;    /* the largest distance by which a position moves along an axis, in units of the mesh */
} bth_rounding;

/* Options. All zeros are the defaults of the program bthc. */
typedef struct {
    uint32_t structure;        /* BTH_STRUCTURE_... */
    uint32_t quality;          /* BTH_QUALITY_... */
    uint32_t flags;            /* BTH_COMPILE_... */
    uint32_t coordinate_bits;  /* of the coordinates that triangle leaves store: 0 for f32, or 16 or 21, which move vertices to
                                  the nearest points of a grid */
    double max_error;          /* greatest distance that a vertex may move; 0 for no such limit. With coordinate_bits 0 the fewest
                                  bits are taken that honour it */
    uint32_t threads;          /* 0 for one per processor; the result does not depend on it */
    uint32_t free_directions;  /* BTH_FREE_...; BTH_FREE_NONE for a deformable mesh */
    const char *cache;         /* folder of a cache of results, UTF-8; null for none */
    const char *tetgen;        /* path of the program bth-tetgen, UTF-8; null to search for it. If there is none, a warning says so */
    bth_progress progress;     /* null for none */
    bth_warning warning;       /* null for none */
    void *user;                /* passed to both */
    uint32_t positions;        /* BTH_POSITIONS_... */
    uint32_t reserved;         /* 0 */
    bth_rounding *rounding;    /* null, or stores what rounding has moved and dropped; zeros on failure */
    bth_rounding *avoided_rounding; /* the same for meshes whose positions are kept in double: what it would move and drop */
} bth_compile_options;

/* A mesh: three floats for each position, three indices of positions for each triangle. The row of a triangle is its id in hits.
 * Equal positions are merged and positions that no triangle uses are left out, unless the mesh is deformable. */
typedef struct {
    const float *positions;
    size_t position_count;
    const uint32_t *triangles;
    size_t triangle_count;
} bth_mesh;

/* A bth_mesh with positions in double; bth_compile_options.positions says if they are rounded. */
typedef struct {
    const double *positions;
    size_t position_count;
    const uint32_t *triangles;
    size_t triangle_count;
} bth_mesh64;

/* A mesh of a scene at a place in the world. */
typedef struct {
    double to_world[3][4]; /* rows, applied to columns (x, y, z, 1); finite; invertible, or zeros but for the last column for an
                              invisible instance */
    uint32_t mesh;         /* row of the mesh */
    uint32_t reserved;     /* 0 */
} bth_mesh_instance;

/* Bytes that bth_free_bytes frees. */
typedef struct {
    uint8_t *data;
    size_t length;
} bth_bytes;

/* Compiles a mesh; `options` may be null. On success stores the bytes of the file in *bytes and returns BTH_COMPILE_OK. On failure
 * stores null and 0, unless `bytes` is null, and returns a negative code; bth_compile_last_error then describes what is wrong,
 * where ("triangle 17"), and what can be done. Equal input and options give equal bytes, the content that bthc makes of a file
 * with the same vertices and faces. */
int32_t bth_compile_mesh(const bth_mesh *mesh, const bth_compile_options *options, bth_bytes *bytes);

/* As bth_compile_mesh, for a scene of meshes. Row i of `instances` is instance i of the scene. Meshes without an instance are left
 * out and equal ones are stored once. */
int32_t bth_compile_scene(const bth_mesh *meshes, size_t mesh_count, const bth_mesh_instance *instances, size_t instance_count,
                          const bth_compile_options *options, bth_bytes *bytes);

/* As bth_compile_mesh and bth_compile_scene, for positions in double. Where all numbers are floats, the bytes are the same. If
 * positions are rounded, a warning says what would show in a picture, and how many triangles lose their area. */
int32_t bth_compile_mesh_f64(const bth_mesh64 *mesh, const bth_compile_options *options, bth_bytes *bytes);
int32_t bth_compile_scene_f64(const bth_mesh64 *meshes, size_t mesh_count, const bth_mesh_instance *instances,
                              size_t instance_count, const bth_compile_options *options, bth_bytes *bytes);

/* As bth_compile_mesh, for a model file: OBJ, PLY, STL, OFF, or a glTF or GLB file, whose scene at rest becomes one object. `path` is
 * in UTF-8. The extension of the file decides about its format, or else its content. The bytes are those of `bthc compile --flatten`
 * with the same options. */
int32_t bth_compile_file(const char *path, const bth_compile_options *options, bth_bytes *bytes);

/* Frees bytes and stores null and 0 in their place; null, and bytes that have been freed, are allowed. */
void bth_free_bytes(bth_bytes *bytes);

/* Text of the last error of these functions on the calling thread, never null. It is valid until the next call on this thread that
 * can fail. */
const char *bth_compile_last_error(void);

/* Version of this library, such as "0.1.0". */
const char *bth_compile_version(void);

#ifdef __cplusplus
}
#endif
#endif
