/* Traces bounces by starts through the C interface alone: opens a file, traces rays read from
 * standard input (lines of eight numbers), and goes on from their hits twice, in batches of several
 * sizes. Prints the answers, and what bth_check_start says about starts that are not points of a
 * surface. Exits with a separate code for each answer that is not as documented. */
#include "bth.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(bth_start) == 16, "start");

#define MOST 3000

static bth_start start[MOST];
static float direction[MOST][3], tmax[MOST];
static bth_hit hit[MOST];
static uint8_t any[MOST];

static bth_start start_of(const bth_hit *hit) {
    return (bth_start){hit->surface.instance, hit->surface.triangle, hit->u, hit->v};
}

/* Traces `n` rays from `start`, prints their hits, and makes those the next starts. */
static int bounce(const bth_scene *scene, size_t n, const float *ends) {
    memset(hit, 7, sizeof hit);
    if (bth_nearest_starts(scene, start, direction[0], ends, hit, n) != BTH_OK) return 1;
    if (bth_any_starts(scene, start, direction[0], ends, any, n) != BTH_OK) return 2;
    for (size_t i = 0; i < n; i++) {
        printf("%.9g %.9g %.9g %u %u %u\n", hit[i].t, hit[i].u, hit[i].v, hit[i].surface.instance,
               hit[i].surface.triangle, any[i]);
        start[i] = start_of(&hit[i]);
    }
    bth_hit beyond;
    memset(&beyond, 7, sizeof beyond);
    return n < MOST && memcmp(&hit[n], &beyond, sizeof beyond) ? 3 : 0;
}

/* Checks a start that is not a point of a surface: a miss, which bth_check_start explains. */
static int refused(const bth_scene *scene, bth_start bad) {
    bth_hit found = {0};
    uint8_t blocked = 7;
    if (bth_nearest_starts(scene, &bad, direction[0], NULL, &found, 1) != BTH_OK) return 1;
    if (found.t != INFINITY || found.surface.triangle != BTH_NONE) return 2;
    if (bth_any_starts(scene, &bad, direction[0], NULL, &blocked, 1) != BTH_OK || blocked) return 3;
    if (bth_check_start(scene, &bad) != BTH_ERROR_ARGUMENT) return 4;
    printf("%s\n", bth_last_error());
    return 0;
}

static int null_arguments(const bth_scene *scene) {
    const float *to = direction[0];
    memset(hit, 7, sizeof hit);
    any[0] = 7;
    const int32_t code[] = {
        bth_nearest_starts(NULL, start, to, tmax, hit, 1), bth_nearest_starts(scene, NULL, to, tmax, hit, 1),
        bth_nearest_starts(scene, start, NULL, tmax, hit, 1), bth_nearest_starts(scene, start, to, tmax, NULL, 1),
        bth_any_starts(NULL, start, to, tmax, any, 1), bth_any_starts(scene, NULL, to, tmax, any, 1),
        bth_any_starts(scene, start, NULL, tmax, any, 1), bth_any_starts(scene, start, to, tmax, NULL, 1),
        bth_check_start(NULL, start), bth_check_start(scene, NULL),
    };
    for (size_t i = 0; i < sizeof code / sizeof *code; i++)
        if (code[i] != BTH_ERROR_ARGUMENT) return 1;
    if (any[0] != 7 || !bth_last_error()[0]) return 2;
    if (bth_nearest_starts(NULL, NULL, NULL, NULL, NULL, 0) != BTH_OK) return 3;
    return bth_any_starts(NULL, NULL, NULL, NULL, NULL, 0) == BTH_OK ? 0 : 4;
}

/* Checks that a start on an instance that is hidden is refused. */
static int hidden(const bth_scene *scene, bth_start good) {
    const float place[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    uint32_t object, id;
    bth_builder *builder = bth_builder_new();
    if (bth_builder_add(builder, scene, &object) != BTH_OK) return 1;
    if (bth_builder_instance(builder, object, place, &id) != BTH_OK) return 2;
    if (bth_builder_commit(builder, NULL) != BTH_OK) return 3;
    if (bth_check_start(bth_builder_scene(builder), &good) != BTH_OK) return 4;
    if (bth_builder_set_visible(builder, id, 0) != BTH_OK) return 5;
    if (bth_builder_commit(builder, NULL) != BTH_OK) return 6;
    int failure = refused(bth_builder_scene(builder), good);
    bth_builder_free(builder);
    return failure ? 10 + failure : 0;
}

int main(int argc, char **argv) {
    bth_scene *scene;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 100;
    bth_ray ray[16];
    bth_hit first[16];
    size_t n = 0;
    while (n < 16 && scanf("%f %f %f %f %f %f %f %f", &ray[n].origin[0], &ray[n].origin[1], &ray[n].origin[2],
                           &ray[n].tmin, &ray[n].direction[0], &ray[n].direction[1], &ray[n].direction[2],
                           &ray[n].tmax) == 8)
        n++;
    bth_nearest(scene, ray, NULL, first, n);
    for (int i = 0; i < MOST; i++) {
        direction[i][0] = (float)(i * 7 % 13 - 6);
        direction[i][1] = (float)(i * 5 % 11 - 5);
        direction[i][2] = (float)(i * 3 % 17 - 8);
        tmax[i] = i % 3 ? INFINITY : 0.01f;
    }
    const size_t counts[] = {0, 1, 5, MOST};
    for (size_t k = 0; k < 4; k++) {
        for (size_t i = 0; i < counts[k]; i++) start[i] = start_of(&first[i % n]);
        int failure = bounce(scene, counts[k], NULL);
        if (!failure) failure = bounce(scene, counts[k], tmax);
        if (failure) return failure;
    }
    int failure = null_arguments(scene);
    if (failure) return 10 + failure;
    bth_start good = start_of(&first[0]);
    if (bth_check_start(scene, &good) != BTH_OK) return 20;
    const bth_start bad[] = {
        {9, 0, 0, 0}, {0, 1000000, 0, 0}, {0, 0, -0.5f, 0.5f}, {0, 0, 0.75f, 0.5f}, {0, 0, NAN, 0}, {BTH_NONE, BTH_NONE, 0, 0},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        failure = refused(scene, bad[i]);
        if (failure) return 20 + failure;
    }
    failure = hidden(scene, good);
    if (failure) return 30 + failure;
    bth_close(scene);
    return 0;
}
