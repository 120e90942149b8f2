/* What hits lead to, through the C interface: opens a file, traces rays from standard input (lines of six numbers) and prints bounds,
 * names, and the surface at each hit. */
#include "bth.h"
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(bth_surface_point) == 96, "surface point");

static void print3(const char *what, const double v[3]) { printf(" %s %.17g %.17g %.17g", what, v[0], v[1], v[2]); }

int main(int argc, char **argv) {
    bth_scene *scene;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 1;
    if (!strchr(bth_version(), '.')) return 2;
    float bounds[2][3];
    if (bth_bounds(scene, bounds) != BTH_OK || bth_bounds(NULL, bounds) != BTH_ERROR_ARGUMENT) return 3;
    if (bth_bounds(scene, NULL) != BTH_ERROR_ARGUMENT) return 4;
    printf("bounds %.9g %.9g %.9g %.9g %.9g %.9g\n", bounds[0][0], bounds[0][1], bounds[0][2], bounds[1][0], bounds[1][1],
           bounds[1][2]);
    for (uint32_t object = 0; object < bth_object_count(scene); object++) {
        char name[64], short_name[3];
        bth_object_name(scene, object, name, sizeof name);
        printf("object %s groups %u materials %u\n", name, bth_group_count(scene, object), bth_material_count(scene, object));
        size_t length = bth_object_name(scene, object, short_name, sizeof short_name);
        if (strlen(short_name) != (length < 2 ? length : 2) || bth_object_name(scene, object, NULL, 0) != length) return 5;
    }
    bth_hit miss = {0, 0, 0, {BTH_NONE, BTH_NONE}};
    bth_surface_point point;
    double corners[3][3];
    bth_surface beyond = {0, 1000000};
    if (bth_surface_at(scene, &miss, &point) != BTH_ERROR_ARGUMENT) return 6;
    if (bth_surface_at(scene, NULL, &point) != BTH_ERROR_ARGUMENT) return 7;
    if (bth_triangle_positions(scene, beyond, corners) != BTH_ERROR_ARGUMENT || !strstr(bth_last_error(), "1000000")) return 8;
    if (bth_group_count(scene, BTH_NONE) || bth_material_name(scene, BTH_NONE, 0, NULL, 0)) return 9;
    bth_ray ray = {{0, 0, 0}, 0, {0, 0, 0}, 1e30f};
    while (scanf("%f %f %f %f %f %f", &ray.origin[0], &ray.origin[1], &ray.origin[2], &ray.direction[0], &ray.direction[1],
                 &ray.direction[2]) == 6) {
        bth_hit hit;
        bth_nearest(scene, &ray, NULL, &hit, 1);
        int32_t code = bth_surface_at(scene, &hit, &point);
        if (code != BTH_OK) {
            printf("error %d %s\n", code, bth_last_error());
            continue;
        }
        if (bth_triangle_positions(scene, hit.surface, corners) != BTH_OK) return 10;
        char group[64], material[64];
        bth_group_name(scene, point.object, point.group, group, sizeof group);
        bth_material_name(scene, point.object, point.material, material, sizeof material);
        print3("at", point.position);
        print3("plane", point.geometric_normal);
        print3("normal", point.normal);
        print3("corner", corners[0]);
        printf(" uv %.9g %.9g object %u group %s material %s flags %u\n", point.uv[0], point.uv[1], point.object, group, material,
               point.flags);
    }
    bth_close(scene);
    return 0;
}
