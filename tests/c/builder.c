/* Builds a scene of two files through the C interface alone, moves its instances, and prints after each commit what rays down from
 * (x, 9, z) meet, for lines `x z` of standard input. Exits with a number of its own for each answer that is not as documented. */
#include "bth.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(bth_update) == 64, "update");

static bth_ray ray[64];
static size_t rays;

static void at(float *m, float x, float y, float z, float scale) {
    float rows[12] = {scale, 0, 0, x, 0, scale, 0, y, 0, 0, scale, z};
    memcpy(m, rows, sizeof rows);
}

static int commit(bth_builder *builder) {
    bth_update update;
    int32_t code = bth_builder_commit(builder, &update);
    if (code != BTH_OK) {
        printf("error %d %s\n", code, bth_last_error());
    } else {
        printf("update %u %u %u %u %.17g\n", (unsigned)update.nodes, (unsigned)update.placed, (unsigned)update.visible,
               update.rebuilt, update.cost_ratio);
    }
    bth_hit hit[64];
    bth_nearest(bth_builder_scene(builder), ray, NULL, hit, rays);
    for (size_t i = 0; i < rays; i++) printf("hit %.9g %u %u\n", hit[i].t, hit[i].surface.instance, hit[i].surface.triangle);
    return code;
}

int main(int argc, char **argv) {
    bth_scene *model, *moving;
    if (argc < 3 || bth_open(argv[1], BTH_READ, &model) != BTH_OK || bth_open(argv[2], BTH_READ, &moving) != BTH_OK) return 1;
    float x, z, m[12];
    while (rays < 64 && scanf("%f %f", &x, &z) == 2) ray[rays++] = (bth_ray){{x, 9, z}, 0, {0, -1, 0}, INFINITY};
    bth_builder *builder = bth_builder_new();
    uint32_t quad, wheel, id[20], subscene;
    if (bth_builder_add(builder, model, &quad) != BTH_OK || bth_builder_add(builder, moving, &wheel) != BTH_OK) return 2;
    /* The files stay open for the builder. */
    bth_close(model);
    bth_close(moving);
    for (int i = 0; i < 20; i++) {
        at(m, 2.5f * i - 20, 0.1f * i, 0, 1);
        if (bth_builder_instance(builder, quad, m, &id[i]) != BTH_OK || id[i] != (uint32_t)i) return 3;
    }
    at(m, 0, 3, 0, 0.5f);
    if (bth_builder_subscene(builder, wheel, m, &subscene) != BTH_OK) return 4;
    if (commit(builder) != BTH_OK) return 5;

    /* Many at once, a time, a mask, one hidden and one removed. */
    float many[20][12];
    for (int i = 0; i < 20; i++) at(many[i], 2.5f * i - 20, 0.2f * i, 0.5f, 1);
    if (bth_builder_set_transforms(builder, id, many[0], 20) != BTH_OK) return 6;
    if (bth_builder_set_subscene_seconds(builder, subscene, 0.8) != BTH_OK) return 7;
    if (commit(builder) != BTH_OK) return 8;
    if (bth_builder_set_visible(builder, id[8], 0) != BTH_OK || bth_builder_remove(builder, id[9]) != BTH_OK) return 9;
    if (bth_builder_set_instance_mask(builder, id[7], 2) != BTH_OK) return 10;
    if (bth_builder_set_group_mask(builder, quad, 0, 0xFFFFFFFFu) != BTH_OK) return 11;
    if (commit(builder) != BTH_OK) return 12;
    bth_accept accept = {1, BTH_CULL_NONE, NULL, NULL};
    bth_hit hit[64];
    if (bth_nearest_accepted(bth_builder_scene(builder), ray, &accept, hit, rays) != BTH_OK) return 13;
    for (size_t i = 0; i < rays; i++) {
        if (hit[i].surface.instance == id[7]) return 14;
    }

    /* A commit that fails changes nothing, and succeeds after a correction. */
    at(m, 0, 0, 0, 0);
    if (bth_builder_set_transforms(builder, &id[3], m, 1) != BTH_OK) return 15;
    if (commit(builder) != BTH_ERROR_SCENE) return 16;
    at(m, -1, 1, 0.25f, -2);
    if (bth_builder_set_transforms(builder, &id[3], m, 1) != BTH_OK || commit(builder) != BTH_OK) return 17;

    /* The subscene: its instances, another place, hidden, removed. */
    uint32_t placed[2];
    size_t count;
    if (bth_builder_subscene_instances(builder, subscene, NULL, 0, &count) != BTH_OK || count != 2) return 18;
    if (bth_builder_subscene_instances(builder, subscene, placed, 2, &count) != BTH_OK || placed[0] != 20) return 19;
    if (bth_builder_set_transforms(builder, placed, m, 1) != BTH_ERROR_ARGUMENT) return 20;
    at(m, 4, 3, 0, 1);
    if (bth_builder_set_subscene_transform(builder, subscene, m) != BTH_OK || commit(builder) != BTH_OK) return 21;
    if (bth_builder_set_subscene_visible(builder, subscene, 0) != BTH_OK || commit(builder) != BTH_OK) return 22;
    if (bth_builder_remove_subscene(builder, subscene) != BTH_OK || commit(builder) != BTH_OK) return 23;
    bth_instance gone;
    double corner[3][3];
    if (bth_get_instance(bth_builder_scene(builder), 20, &gone) != BTH_OK || gone.object != BTH_NONE) return 24;
    if (bth_triangle_positions(bth_builder_scene(builder), (bth_surface){20, 0}, corner) != BTH_ERROR_ARGUMENT) return 25;

    /* A group of two quads, shown twice. */
    uint32_t group, row[3], rows[16];
    at(m, 0, 3, 0, 0);
    if (bth_builder_group(builder, &group) != BTH_OK) return 34;
    if (bth_builder_place(builder, BTH_OBJECT, quad, group, m, row) != BTH_OK) return 35;
    if (bth_builder_set_visible(builder, row[0], 0) != BTH_OK) return 35;
    at(m, 0, 3, 0, 1);
    if (bth_builder_place(builder, BTH_OBJECT, quad, group, m, row) != BTH_OK) return 35;
    for (int i = 1; i < 3; i++) {
        at(m, 40 + 9 * i, 1, 0.25f, -2);
        if (bth_builder_place(builder, BTH_GROUP, group, BTH_NONE, m, &row[i]) != BTH_OK) return 36;
    }
    if (bth_builder_commit(builder, NULL) != BTH_OK) return 37;
    uint32_t last = bth_instance_count(bth_builder_scene(builder)) - 1;
    if (bth_instance_path(bth_builder_scene(builder), last, rows) != 2 || rows[0] != row[2] || rows[1] != row[0]) return 38;
    if (bth_instance_path(bth_builder_scene(builder), last + 1, rows) || bth_instance_path(NULL, 0, rows)) return 39;
    if (bth_builder_place(builder, 2, group, BTH_NONE, m, row) != BTH_ERROR_ARGUMENT) return 40;
    if (bth_builder_place(builder, BTH_GROUP, group + 1, BTH_NONE, m, row) != BTH_ERROR_ARGUMENT) return 41;
    for (int i = 1; i < 3; i++) {
        if (bth_builder_remove(builder, row[i]) != BTH_OK) return 42;
    }
    if (bth_builder_commit(builder, NULL) != BTH_OK) return 43;

    /* What does not exist. */
    const int32_t wrong = BTH_ERROR_ARGUMENT;
    if (bth_builder_instance(builder, 99, m, id) != wrong || bth_builder_instance(builder, 0, NULL, id) != wrong) return 26;
    if (bth_builder_set_visible(builder, row[1], 1) != wrong || bth_builder_remove(builder, 99) != wrong) return 27;
    if (bth_builder_remove_subscene(builder, subscene) != wrong || bth_builder_subscene(builder, 99, m, id) != wrong) return 28;
    if (bth_builder_set_subscene_seconds(builder, 0, NAN) != wrong || bth_builder_commit(NULL, NULL) != wrong) return 29;
    if (bth_builder_set_subscene_transform(builder, 0, NULL) != wrong || bth_builder_add(builder, NULL, id) != wrong) return 30;
    if (bth_builder_set_transforms(builder, NULL, NULL, 1) != wrong || bth_builder_set_transforms(builder, NULL, NULL, 0)) return 31;
    if (bth_builder_set_transforms(NULL, NULL, NULL, 0) != wrong) return 31;
    if (bth_builder_add(builder, bth_builder_scene(builder), id) != wrong || bth_object_count(bth_builder_scene(builder)) != 2) return 33;
    if (bth_builder_scene(NULL) || bth_builder_commit(builder, NULL) != BTH_OK) return 32;
    bth_builder_free(builder);
    bth_builder_free(NULL);
    return 0;
}
