/* Uses bth through its C interface alone: reads points from standard input and prints their closest points, their signed distances and the triangles near them. */
#include "bth.h"
#include <math.h>
#include <stdio.h>

_Static_assert(sizeof(bth_closest) == 36, "closest");

int main(int argc, char **argv) {
    bth_scene *scene = NULL;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 1;
    float points[16][3];
    size_t n = 0;
    while (n < 16 && scanf("%f %f %f", &points[n][0], &points[n][1], &points[n][2]) == 3) n++;
    bth_closest closest[16];
    float distance[16];
    if (bth_closest_points(scene, points[0], INFINITY, closest, n) != BTH_OK) return 2;
    if (bth_signed_distances(scene, points[0], distance, n) != BTH_OK) return 3;
    for (size_t i = 0; i < n; i++) {
        size_t near = 0, in_box = 0;
        bth_surface first = {BTH_NONE, BTH_NONE};
        if (bth_triangles_in_sphere(scene, points[i], closest[i].distance, &first, 1, &near) != BTH_OK) return 4;
        if (bth_triangles_in_box(scene, closest[i].point, closest[i].point, NULL, 0, &in_box) != BTH_OK) return 5;
        printf("%.9g %.9g %.9g %.9g %.9g %.9g %u %u %u %.9g %zu %u %zu\n", closest[i].distance, closest[i].point[0],
               closest[i].point[1], closest[i].point[2], closest[i].u, closest[i].v, closest[i].surface.instance,
               closest[i].surface.triangle, closest[i].feature, distance[i], near, first.triangle, in_box);
    }
    if (bth_closest_points(NULL, points[0], 1.0f, closest, 1) != BTH_ERROR_ARGUMENT) return 6;
    if (bth_closest_points(scene, points[0], -1.0f, closest, 1) != BTH_OK) return 7;
    if (closest[0].surface.triangle != BTH_NONE || closest[0].distance != INFINITY) return 8;
    bth_close(scene);
    return 0;
}
