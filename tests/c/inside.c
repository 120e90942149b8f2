/* Counts crossings and asks for points through the C interface alone: reads points (three numbers a line) from standard input and
 * prints for each its winding number, whether it lies inside, and the crossings of a ray from it along z. */
#include "bth.h"
#include <math.h>
#include <stdio.h>

_Static_assert(sizeof(bth_crossing_count) == 8, "crossings");

int main(int argc, char **argv) {
    bth_scene *scene;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 1;
    float points[16][3];
    size_t n = 0;
    while (n < 16 && scanf("%f %f %f", &points[n][0], &points[n][1], &points[n][2]) == 3) n++;
    int32_t winding[16];
    uint8_t inside[16];
    bth_ray ray[16];
    bth_crossing_count crossings[16];
    for (size_t i = 0; i < n; i++)
        ray[i] = (bth_ray){{points[i][0], points[i][1], points[i][2]}, 0, {0, 0, 1}, INFINITY};
    if (bth_winding(scene, points[0], winding, n) != BTH_OK) return 2;
    if (bth_contains(scene, points[0], inside, n) != BTH_OK) return 3;
    if (bth_crossings(scene, ray, crossings, n) != BTH_OK) return 4;
    for (size_t i = 0; i < n; i++)
        printf("%d %d %u %d\n", winding[i], inside[i], crossings[i].count, crossings[i].winding);
    if (bth_winding(NULL, points[0], winding, n) != BTH_ERROR_ARGUMENT) return 5;
    if (bth_winding(scene, NULL, winding, n) != BTH_ERROR_ARGUMENT) return 6;
    if (bth_contains(scene, points[0], NULL, n) != BTH_ERROR_ARGUMENT) return 7;
    if (bth_crossings(scene, ray, NULL, n) != BTH_ERROR_ARGUMENT || bth_last_error()[0] == 0) return 8;
    if (bth_crossings(scene, NULL, NULL, 0) != BTH_OK) return 9;
    bth_close(scene);
    return 0;
}
