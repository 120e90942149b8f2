/* Uses the queries in double through the C interface alone: opens a file, traces rays read from standard input (lines of eight
 * numbers), asks for the points at their origins, and prints a line of answers for each. Exits with the line of the first check
 * that fails. */
#include "bth.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(bth_ray64) == 64 && sizeof(bth_hit64) == 32 && sizeof(bth_closest64) == 64, "structs in double");

#define CHECK(condition)                                                                                                 \
    do {                                                                                                                 \
        if (!(condition)) {                                                                                              \
            fprintf(stderr, "%d: %s | %s\n", __LINE__, #condition, bth_last_error());                                    \
            return __LINE__ & 127 ? __LINE__ & 127 : 1;                                                                  \
        }                                                                                                                \
    } while (0)

enum { MOST = 64, ROOM = 4096 };

static int32_t is_even(void *user, const bth_ray *ray, const bth_hit *hit) {
    ++*(size_t *)user;
    return ray && hit->surface.triangle % 2 == 0;
}

static void print_hit(const bth_hit64 *hit) {
    printf("%.17g %.17g %.17g %u %u ", hit->t, hit->u, hit->v, hit->surface.instance, hit->surface.triangle);
}

int main(int argc, char **argv) {
    bth_scene *scene;
    CHECK(argc == 2 && bth_open(argv[1], BTH_READ, &scene) == BTH_OK);
    bth_ray64 ray[MOST];
    size_t n = 0;
    for (; n < MOST; n++) {
        double x[8];
        int read = 0;
        while (read < 8 && scanf("%lf", &x[read]) == 1) read++;
        if (read < 8) break;
        ray[n] = (bth_ray64){{x[0], x[1], x[2]}, x[3], {x[4], x[5], x[6]}, x[7]};
    }
    CHECK(n > 0);

    bth_hit64 nearest[MOST], even[MOST];
    uint8_t any[MOST];
    uint64_t counts[MOST], offsets[MOST + 1];
    bth_crossing_count crossings[MOST];
    static bth_hit64 hits[ROOM];
    size_t calls = 0;
    bth_accept accept = {0xFFFFFFFFu, BTH_CULL_NONE, is_even, &calls};
    bth_hit64_list list = {offsets, hits, ROOM, 0};
    CHECK(bth_nearest_f64(scene, ray, NULL, nearest, n) == BTH_OK);
    CHECK(bth_nearest_f64(scene, ray, &accept, even, n) == BTH_OK && calls > 0);
    CHECK(bth_any_f64(scene, ray, NULL, any, n) == BTH_OK);
    CHECK(bth_count_hits_f64(scene, ray, NULL, counts, n) == BTH_OK);
    CHECK(bth_crossings_f64(scene, ray, crossings, n) == BTH_OK);
    CHECK(bth_all_hits_f64(scene, ray, NULL, BTH_ALL_HITS, &list, n) == BTH_OK && list.needed <= ROOM);

    double points[MOST][3], distance[MOST];
    bth_closest64 closest[MOST];
    int32_t winding[MOST];
    uint8_t inside[MOST];
    for (size_t i = 0; i < n; i++) memcpy(points[i], ray[i].origin, sizeof points[i]);
    CHECK(bth_closest_points_f64(scene, points[0], INFINITY, closest, n) == BTH_OK);
    CHECK(bth_signed_distances_f64(scene, points[0], distance, n) == BTH_OK);
    CHECK(bth_winding_f64(scene, points[0], winding, n) == BTH_OK);
    CHECK(bth_contains_f64(scene, points[0], inside, n) == BTH_OK);

    for (size_t i = 0; i < n; i++) {
        print_hit(&nearest[i]);
        print_hit(&even[i]);
        printf("%u %llu %u %d ", any[i], (unsigned long long)counts[i], crossings[i].count, crossings[i].winding);
        const bth_closest64 *c = &closest[i];
        size_t near = 0, in_box = 0;
        bth_surface first = {BTH_NONE, BTH_NONE};
        CHECK(bth_triangles_in_sphere_f64(scene, points[i], 2 * c->distance, &first, 1, &near) == BTH_OK);
        const double corner[3] = {c->point[0] + 1, c->point[1] + 1, c->point[2] + 1};
        CHECK(bth_triangles_in_box_f64(scene, c->point, corner, NULL, 0, &in_box) == BTH_OK && c->reserved == 0);
        printf("%.17g %.17g %.17g %.17g %.17g %.17g %u %u %u ", c->distance, c->point[0], c->point[1], c->point[2], c->u, c->v,
               c->surface.instance, c->surface.triangle, c->feature);
        printf("%.17g %d %u %zu %u %zu ", distance[i], winding[i], inside[i], near, first.triangle, in_box);
        for (uint64_t k = offsets[i]; k < offsets[i + 1]; k++) print_hit(&hits[k]);
        printf("\n");
    }

    /* A hit that is found in float, and what is not a hit. */
    bth_hit64 numbers;
    bth_hit hit = {1, 0.5f, 0.25f, {0, 0xFFFFFFF0u}}, miss = {INFINITY, 0, 0, {BTH_NONE, BTH_NONE}};
    CHECK(bth_hit_f64(scene, ray, &hit, &numbers) == BTH_ERROR_ARGUMENT && strstr(bth_last_error(), "bth_hit_f64: there is no triangle"));
    hit.surface.instance = bth_instance_count(scene);
    CHECK(bth_hit_f64(scene, ray, &hit, &numbers) == BTH_ERROR_ARGUMENT && strstr(bth_last_error(), "no instance"));
    CHECK(bth_hit_f64(scene, ray, &miss, &numbers) == BTH_OK && numbers.t == INFINITY && numbers.surface.triangle == BTH_NONE);
    CHECK(bth_hit_f64(scene, NULL, &miss, &numbers) == BTH_ERROR_ARGUMENT);
    CHECK(bth_hit_f64(scene, ray, &miss, NULL) == BTH_ERROR_ARGUMENT);
    for (size_t i = 0; i < n; i++) {
        const bth_hit64 *found = &nearest[i];
        const bth_hit in_float = {(float)found->t, (float)found->u, (float)found->v, found->surface};
        CHECK(bth_hit_f64(scene, &ray[i], &in_float, &numbers) == BTH_OK && memcmp(&numbers, found, sizeof numbers) == 0);
    }

    /* Errors. */
    accept.cull = 3;
    CHECK(bth_nearest_f64(scene, ray, &accept, nearest, n) == BTH_ERROR_ARGUMENT && strstr(bth_last_error(), "bth_nearest_f64"));
    CHECK(bth_nearest_f64(NULL, ray, NULL, nearest, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_any_f64(scene, NULL, NULL, any, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_count_hits_f64(scene, ray, NULL, NULL, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_all_hits_f64(scene, ray, NULL, 1, NULL, n) == BTH_ERROR_ARGUMENT && strstr(bth_last_error(), "bth_all_hits_f64"));
    CHECK(bth_crossings_f64(scene, ray, NULL, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_closest_points_f64(scene, NULL, 1, closest, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_signed_distances_f64(scene, points[0], NULL, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_winding_f64(NULL, points[0], winding, n) == BTH_ERROR_ARGUMENT);
    CHECK(bth_contains_f64(scene, points[0], NULL, n) == BTH_ERROR_ARGUMENT);
    size_t found = 0;
    CHECK(bth_triangles_in_box_f64(scene, NULL, points[0], NULL, 0, &found) == BTH_ERROR_ARGUMENT);
    CHECK(bth_triangles_in_sphere_f64(scene, points[0], 1, NULL, 5, &found) == BTH_ERROR_ARGUMENT);
    CHECK(bth_nearest_f64(NULL, NULL, NULL, NULL, 0) == BTH_OK && bth_closest_points_f64(NULL, NULL, 1, NULL, 0) == BTH_OK);
    CHECK(bth_closest_points_f64(scene, points[0], -1, closest, 1) == BTH_OK && closest[0].surface.triangle == BTH_NONE);
    CHECK(closest[0].distance == INFINITY);
    /* Numbers that are not finite are misses. */
    ray[0].origin[0] = NAN;
    points[0][0] = INFINITY;
    CHECK(bth_nearest_f64(scene, ray, NULL, nearest, 1) == BTH_OK && nearest[0].t == INFINITY);
    CHECK(bth_signed_distances_f64(scene, points[0], distance, 1) == BTH_OK && isnan(distance[0]));
    CHECK(bth_contains_f64(scene, points[0], inside, 1) == BTH_OK && inside[0] == 0);
    bth_close(scene);
    return 0;
}
