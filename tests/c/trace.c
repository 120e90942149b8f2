/* Uses bth through its C interface alone: opens a file, traces rays read from standard input (lines of
 * eight numbers) and prints the answers. Exits with 1 when bth_open fails. */
#include "bth.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(sizeof(bth_ray) == 32, "ray");
_Static_assert(sizeof(bth_surface) == 8, "surface");
_Static_assert(sizeof(bth_hit) == 20, "hit");

int main(int argc, char **argv) {
    bth_scene *scene = (bth_scene *)1;
    const char *path = argc > 1 ? argv[1] : "";
    unsigned flags = argc > 2 && !strcmp(argv[2], "map") ? BTH_MAP : BTH_READ;
    int32_t code = bth_open(path, flags, &scene);
    if (code != BTH_OK) {
        printf("error %d %s %s\n", code, scene ? "dangling" : "null", bth_last_error());
        return 1;
    }
    if (bth_open(NULL, 0, &scene) != BTH_ERROR_ARGUMENT || !bth_last_error()[0]) return 2;
    bth_open(path, flags, &scene);
    printf("resident %llu\n", (unsigned long long)bth_resident_bytes(scene));
    bth_ray ray[16];
    size_t n = 0;
    while (n < 16 && scanf("%f %f %f %f %f %f %f %f", &ray[n].origin[0], &ray[n].origin[1], &ray[n].origin[2],
                           &ray[n].tmin, &ray[n].direction[0], &ray[n].direction[1], &ray[n].direction[2],
                           &ray[n].tmax) == 8)
        n++;
    bth_hit hit[16];
    uint8_t any[16];
    bth_nearest(scene, ray, NULL, hit, n);
    bth_any(scene, ray, NULL, any, n);
    for (size_t i = 0; i < n; i++)
        printf("%.9g %.9g %.9g %u %u %u\n", hit[i].t, hit[i].u, hit[i].v, hit[i].surface.instance,
               hit[i].surface.triangle, any[i]);
    bth_nearest(scene, NULL, NULL, hit, 0);
    bth_close(scene);
    bth_close(NULL);
    return 0;
}
