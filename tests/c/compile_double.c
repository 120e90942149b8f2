/* Compiles positions in double through the C interface alone, writes the file, and traces it. Argument: the file. Exits with the line
 * of the first check that fails. */
#include "bth.h"
#include "bth_compile.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(bth_rounding) == 24, "rounding");

#define CHECK(condition)                                                                                                 \
    do {                                                                                                                 \
        if (!(condition)) {                                                                                              \
            fprintf(stderr, "%d: %s | %s | %s\n", __LINE__, #condition, bth_compile_last_error(), bth_last_error());     \
            return __LINE__ & 127 ? __LINE__ & 127 : 1;                                                                  \
        }                                                                                                                \
    } while (0)

/* Counts the warnings that say what rounding moves and drops. */
static void warning(void *user, const char *message) {
    *(int *)user += strstr(message, "moves 2 of 6 positions") && strstr(message, "1 of 3 triangles lose their area");
}

int main(int argc, char **argv) {
    CHECK(argc == 2);
    /* Where float has steps of half a metre: two triangles of a square, and one that float flattens to a line. */
    const double x = 5.5e6, y = 4.2e5;
    const double positions[] = {x, y, 0, x + 2, y, 0, x, y + 2, 0, x + 2, y + 2, 0, x + 0.125, y + 1, 1, x + 0.0625, y + 2, 2};
    const uint32_t triangles[] = {0, 1, 2, 1, 3, 2, 0, 4, 5};
    const bth_mesh64 mesh = {positions, 6, triangles, 3};
    int warnings = 0;
    bth_rounding moved = {9, 9, 9}, avoided = {9, 9, 9};
    bth_compile_options options = {0};
    options.warning = warning;
    options.user = &warnings;
    options.rounding = &moved;
    options.avoided_rounding = &avoided;
    bth_bytes bytes;

    options.positions = BTH_POSITIONS_F32;
    CHECK(bth_compile_mesh_f64(&mesh, &options, &bytes) == BTH_COMPILE_OK && warnings == 1);
    CHECK(moved.positions == 2 && moved.triangles == 1 && moved.farthest == 0.125);
    CHECK(avoided.positions == 0 && avoided.triangles == 0 && avoided.farthest == 0);
    bth_scene *scene = NULL;
    CHECK(bth_open_memory(bytes.data, bytes.length, BTH_READ, &scene) == BTH_OK);
    bth_close(scene);
    bth_free_bytes(&bytes);

    /* The same for a scene, whose counts are those of its mesh. */
    const bth_mesh_instance instance = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}, 0, 0};
    CHECK(bth_compile_scene_f64(&mesh, 1, &instance, 1, &options, &bytes) == BTH_COMPILE_OK && warnings == 2);
    CHECK(moved.positions == 2 && moved.triangles == 1 && moved.farthest == 0.125);
    bth_free_bytes(&bytes);

    /* By default float would move two positions. */
    options.positions = 0;
    CHECK(bth_compile_mesh_f64(&mesh, &options, &bytes) == BTH_COMPILE_OK && warnings == 2);
    CHECK(avoided.positions == 2 && avoided.triangles == 1 && avoided.farthest == 0.125 && moved.positions == 0);
    FILE *file = fopen(argv[1], "wb");
    CHECK(file && fwrite(bytes.data, 1, bytes.length, file) == bytes.length && fclose(file) == 0);
    CHECK(bth_open_memory(bytes.data, bytes.length, BTH_READ, &scene) == BTH_OK);
    /* The triangle that float would drop, 2^-30 above it. */
    const bth_ray64 ray = {{x + 0.0625, y + 1, 1 + 0x1p-30}, 0, {0, 0, -1}, INFINITY};
    bth_hit64 hit;
    CHECK(bth_nearest_f64(scene, &ray, NULL, &hit, 1) == BTH_OK && hit.surface.triangle == 2);
    CHECK(fabs(hit.t - 0x1p-30) <= 0x1p-40 * 0x1p-30);

    /* Two squares at a place that is no float, by an instance and by a subscene: edges are where the sums are. */
    bth_builder *builder = bth_builder_new();
    const float origin[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    uint32_t object, placed, whole;
    CHECK(bth_builder_add(builder, scene, &object) == BTH_OK);
    CHECK(bth_builder_instance(builder, object, origin, &placed) == BTH_OK);
    CHECK(bth_builder_subscene(builder, object, origin, &whole) == BTH_OK);
    const double by = 0x1p-20, up[12] = {1, 0, 0, by, 0, 1, 0, 0, 0, 0, 1, 0}, down[12] = {1, 0, 0, -by, 0, 1, 0, 0, 0, 0, 1, -8};
    CHECK(bth_builder_set_transforms_f64(builder, &placed, up, 1) == BTH_OK);
    CHECK(bth_builder_set_subscene_transform_f64(builder, whole, down) == BTH_OK);
    CHECK(bth_builder_commit(builder, NULL) == BTH_OK);
    bth_ray64 edge = {{x + by, y + 0.5, 9}, 0, {0, 0, -1}, INFINITY};
    CHECK(bth_nearest_f64(bth_builder_scene(builder), &edge, NULL, &hit, 1) == BTH_OK && hit.surface.instance == placed && hit.t == 9);
    edge.origin[0] = x - by;
    CHECK(bth_nearest_f64(bth_builder_scene(builder), &edge, NULL, &hit, 1) == BTH_OK && hit.surface.instance != placed && hit.t == 17);
    edge.origin[0] = x - 2 * by;
    CHECK(bth_nearest_f64(bth_builder_scene(builder), &edge, NULL, &hit, 1) == BTH_OK && isinf(hit.t));
    CHECK(bth_builder_set_transforms_f64(builder, NULL, up, 1) == BTH_ERROR_ARGUMENT);
    CHECK(bth_builder_set_subscene_transform_f64(builder, whole, NULL) == BTH_ERROR_ARGUMENT);
    bth_builder_free(builder);
    bth_close(scene);
    bth_free_bytes(&bytes);

    /* Floats keep their bytes. */
    const float near[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const double same[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const bth_mesh of_floats = {near, 3, triangles, 1};
    const bth_mesh64 of_doubles = {same, 3, triangles, 1};
    bth_bytes expected;
    for (options.positions = BTH_POSITIONS_AUTO; options.positions <= BTH_POSITIONS_F64; options.positions++) {
        CHECK(bth_compile_mesh(&of_floats, &options, &expected) == BTH_COMPILE_OK);
        CHECK(bth_compile_mesh_f64(&of_doubles, &options, &bytes) == BTH_COMPILE_OK);
        CHECK(moved.positions == 0 && avoided.positions == 0);
        CHECK(bth_open_memory(bytes.data, bytes.length, BTH_READ, &scene) == BTH_OK && bytes.length == expected.length);
        bth_close(scene);
        bth_free_bytes(&bytes);
        bth_free_bytes(&expected);
    }

    /* Errors. */
    options.positions = 3;
    moved.positions = 9;
    CHECK(bth_compile_mesh_f64(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && moved.positions == 0);
    CHECK(strcmp(bth_compile_last_error(), "options: positions: expected 0, 1 or 2, found 3") == 0);
    options.positions = BTH_POSITIONS_F64;
    options.flags = BTH_COMPILE_DEFORMABLE;
    CHECK(bth_compile_mesh_f64(&mesh, &options, &bytes) == BTH_COMPILE_ERROR_ARGUMENT && strstr(bth_compile_last_error(), "BTH-L033"));
    options.flags = 0;
    const double infinite[] = {0, 0, 0, 1e300, 0, 0, 0, 1, 0};
    const bth_mesh64 beyond = {infinite, 3, triangles, 1};
    CHECK(bth_compile_mesh_f64(&beyond, &options, &bytes) == BTH_COMPILE_ERROR_INPUT && strstr(bth_compile_last_error(), "triangle 0: BTH-I004"));
    CHECK(bth_compile_mesh_f64(NULL, NULL, &bytes) == BTH_COMPILE_ERROR_ARGUMENT);
    return 0;
}
