/* Compiles a mesh and a scene in memory, opens them and traces rays. Writes the bytes of both to files, for a comparison with those
 * that Rust makes. Arguments: the two files; without them, the errors where no thread can be started. Exits with the line of the first check that fails. */
#include "bth.h"
#include "bth_compile.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

_Static_assert(sizeof(bth_mesh_instance) == 104, "instance");

#define CHECK(condition)                                                                                                 \
    do {                                                                                                                 \
        if (!(condition)) {                                                                                              \
            fprintf(stderr, "%d: %s | %s | %s\n", __LINE__, #condition, bth_compile_last_error(), bth_last_error());     \
            return __LINE__ & 127 ? __LINE__ & 127 : 1;                                                                  \
        }                                                                                                                \
    } while (0)

enum { SIDE = 40 };
static float positions[SIDE * SIDE * 3];
static uint32_t triangles[(SIDE - 1) * (SIDE - 1) * 2 * 3];

/* A square of hills over the plane z = 0. */
static bth_mesh hills(void) {
    size_t p = 0, t = 0;
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t x = 0; x < SIDE; x++) {
            positions[p++] = (float)x;
            positions[p++] = (float)y;
            positions[p++] = (float)(x * y % 7) / 8;
            if (x + 1 == SIDE || y + 1 == SIDE) continue;
            uint32_t at = y * SIDE + x, corners[6] = {at, at + 1, at + SIDE, at + 1, at + SIDE + 1, at + SIDE};
            memcpy(triangles + t, corners, sizeof corners);
            t += 6;
        }
    bth_mesh mesh = {positions, p / 3, triangles, t / 3};
    return mesh;
}

struct seen {
    int calls;
    int begun; /* calls with nothing done */
    int stages;
    int warnings;
    int cancel;
    char last[64];
};

static int32_t progress(void *user, const char *stage, uint64_t done, uint64_t total) {
    struct seen *seen = user;
    seen->calls++;
    seen->begun += done == 0;
    seen->stages += strcmp(seen->last, stage) != 0;
    snprintf(seen->last, sizeof seen->last, "%s", stage);
    return (total && done > total) || seen->cancel;
}

static void warning(void *user, const char *message) {
    struct seen *seen = user;
    seen->warnings += strstr(message, "/absent/bth-tetgen") != NULL;
}

/* Seconds of some clock. */
static double now(void) {
    struct timespec time;
    timespec_get(&time, TIME_UTC);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static int write_file(const char *path, bth_bytes bytes) {
    FILE *file = fopen(path, "wb");
    return file && fwrite(bytes.data, 1, bytes.length, file) == bytes.length && fclose(file) == 0;
}

int main(int argc, char **argv) {
    bth_mesh mesh = hills();
    if (argc == 1) { /* No thread can be started, not at the second time either. */
        bth_compile_options options = {0};
        bth_bytes bytes = {0};
        for (int time = 0; time < 4; time++) {
            options.threads = time % 2 ? 2 : 0;
            CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_LIMIT && !bytes.data);
            CHECK(strstr(bth_compile_last_error(), time % 2 ? "BTH-L090: cannot start 2 threads" : "BTH-L090: cannot start a thread for"));
        }
        return 0;
    }
    CHECK(argc == 3 && strchr(bth_version(), '.') && strcmp(bth_version(), bth_compile_version()) == 0);
    struct seen seen = {0};
    bth_compile_options options = {0};
    options.structure = BTH_STRUCTURE_BVH;
    options.quality = BTH_QUALITY_FAST;
    options.threads = 2;
    options.progress = progress;
    options.user = &seen;
    bth_bytes bytes = {0};
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_OK && bytes.length > 10000);
    CHECK(seen.stages >= 2 && seen.calls >= seen.stages);
    CHECK(write_file(argv[1], bytes));

    bth_scene *scene = NULL;
    CHECK(bth_open_memory(bytes.data, bytes.length, BTH_READ, &scene) == BTH_OK);
    bth_ray ray = {{10.25f, 20.25f, 5}, 0, {0, 0, -1}, INFINITY};
    bth_hit hit;
    bth_nearest(scene, &ray, NULL, &hit, 1);
    CHECK(hit.surface.triangle == 2 * (20 * (SIDE - 1) + 10));
    CHECK(bth_nearest(scene, NULL, NULL, &hit, 1) == BTH_ERROR_ARGUMENT && strstr(bth_last_error(), "null"));
    CHECK(bth_any(scene, &ray, NULL, NULL, 1) == BTH_ERROR_ARGUMENT && bth_any(NULL, NULL, NULL, NULL, 0) == BTH_OK);
    CHECK(bth_nearest_accepted(scene, NULL, NULL, &hit, 1) == BTH_ERROR_ARGUMENT);
    bth_close(scene);

    CHECK(bth_open_memory(bytes.data, bytes.length - 64, BTH_READ, &scene) == BTH_ERROR_FORMAT && !scene);
    CHECK(bth_open_memory(bytes.data, bytes.length, BTH_MAP, &scene) == BTH_ERROR_ARGUMENT);
    CHECK(bth_open_memory(NULL, 0, BTH_READ, &scene) == BTH_ERROR_ARGUMENT);
    bth_free_bytes(&bytes);
    CHECK(!bytes.data && !bytes.length);
    bth_free_bytes(&bytes);
    bth_free_bytes(NULL);

    bth_mesh_instance instances[2] = {{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}, 0, 0},
                                      {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, -50}}, 0, 0}};
    CHECK(bth_compile_scene(&mesh, 1, instances, 2, &options, &bytes) == BTH_COMPILE_OK && write_file(argv[2], bytes));
    CHECK(bth_open_memory(bytes.data, bytes.length, BTH_READ, &scene) == BTH_OK && bth_instance_count(scene) == 2);
    ray.origin[2] = -20;
    bth_nearest(scene, &ray, NULL, &hit, 1);
    CHECK(hit.surface.instance == 1);
    bth_close(scene);
    bth_free_bytes(&bytes);

    /* A model file. */
    char model[4096];
    snprintf(model, sizeof model, "%s.off", argv[1]);
    FILE *text = fopen(model, "w");
    CHECK(text && fputs("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", text) >= 0 && fclose(text) == 0);
    CHECK(bth_compile_file(model, &options, &bytes) == BTH_COMPILE_OK);
    CHECK(bth_open_memory(bytes.data, bytes.length, BTH_READ, &scene) == BTH_OK);
    const bth_ray down = {{0.25f, 0.25f, 5}, 0, {0, 0, -1}, INFINITY};
    CHECK(bth_nearest(scene, &down, NULL, &hit, 1) == BTH_OK && hit.t == 5);
    bth_close(scene);
    bth_free_bytes(&bytes);
    CHECK(bth_compile_file("no such file.ply", NULL, &bytes) == BTH_COMPILE_ERROR_FILE && !bytes.data);
    CHECK(bth_compile_file(NULL, NULL, &bytes) == BTH_COMPILE_ERROR_ARGUMENT);

    /* Within a stage, progress is told a few times a second. */
    struct seen often = {0};
    double start = now();
    options.user = &often;
    options.quality = BTH_QUALITY_BEST;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_OK);
    bth_free_bytes(&bytes);
    CHECK(often.calls - often.begun <= 10 * (now() - start) + 1);
    options.user = &seen;
    options.quality = BTH_QUALITY_FAST;

    /* Free directions. */
    options.free_directions = 9;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && strstr(bth_compile_last_error(), "9"));
    bth_bytes plain;
    options.free_directions = BTH_FREE_NONE;
    CHECK(bth_compile_mesh(&mesh, &options, &plain) == BTH_COMPILE_OK);
    options.free_directions = BTH_FREE_ALL;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_OK && bytes.length > plain.length + 12 * mesh.triangle_count);
    bth_free_bytes(&bytes);
    bth_free_bytes(&plain);
    options.free_directions = BTH_FREE_NONE;

    /* Errors. */
    seen.cancel = 1;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_CANCELLED && !bytes.data);
    seen.cancel = 0;
    triangles[3 * 17 + 1] = 1600;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_INPUT && !bytes.data);
    CHECK(strstr(bth_compile_last_error(), "triangle 17: BTH-I005: index 1600 of 1600 positions"));
    triangles[3 * 17 + 1] = 0;
    positions[1] = NAN;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_INPUT);
    CHECK(strstr(bth_compile_last_error(), "triangle 0: BTH-I004"));
    instances[1].mesh = 1;
    CHECK(bth_compile_scene(&mesh, 1, instances, 2, &options, &bytes) == BTH_COMPILE_ERROR_INPUT);
    CHECK(strstr(bth_compile_last_error(), "instance 1"));
    options.quality = 9;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT);
    CHECK(strcmp(bth_compile_last_error(), "options: quality: expected 0, 1 or 2, found 9") == 0);
    options.quality = BTH_QUALITY_FAST;
    positions[1] = 0;
    options.cache = "";
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && strstr(bth_compile_last_error(), "cache"));
    options.cache = NULL;
    options.tetgen = "\xff";
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && strstr(bth_compile_last_error(), "tetgen"));

    options.tetgen = NULL;
    options.flags = BTH_COMPILE_DEFORMABLE | BTH_COMPILE_NO_GEOMETRY;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && strstr(bth_compile_last_error(), "BTH-L033"));
    options.flags = 0;

    /* A program that is named but absent is told, where it would be used. */
    options.tetgen = "/absent/bth-tetgen";
    options.warning = warning;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_OK && seen.warnings == 0);
    bth_free_bytes(&bytes);
    options.structure = BTH_STRUCTURE_BTH;
    CHECK(bth_compile_mesh(&mesh, &options, &bytes) == BTH_COMPILE_OK && seen.warnings == 1);
    bth_free_bytes(&bytes);
    CHECK(bth_compile_mesh(NULL, NULL, &bytes) == BTH_COMPILE_ERROR_ARGUMENT);
    CHECK(bth_compile_mesh(&mesh, NULL, NULL) == BTH_COMPILE_ERROR_ARGUMENT);
    bth_mesh none = {NULL, 0, NULL, 5};
    CHECK(bth_compile_mesh(&none, NULL, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && bth_compile_last_error()[0]);
    return 0;
}
