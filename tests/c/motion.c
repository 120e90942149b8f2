/* Moves a scene through the C interface alone: for each frame of the file it prints where the instances are and what a ray
 * down from (x, 9, z) meets, for lines `x z` of standard input. Exits with 1 when the file cannot be opened. */
#include "bth.h"
#include <math.h>
#include <stdio.h>

_Static_assert(sizeof(bth_instance) == 112, "instance");

static void shown(bth_scene *scene, const bth_ray *ray, size_t n) {
    bth_hit hit[16];
    bth_instance place;
    printf("time %.17g\n", bth_seconds(scene));
    for (uint32_t i = 0; i < bth_instance_count(scene); i++) {
        if (bth_get_instance(scene, i, &place) != BTH_OK) return;
        printf("instance %u %u %u", place.object, place.node, place.visible);
        for (int k = 0; k < 12; k++) printf(" %.17g", place.to_world[k / 4][k % 4]);
        printf("\n");
    }
    bth_nearest(scene, ray, NULL, hit, n);
    for (size_t i = 0; i < n; i++) printf("hit %.9g %u %u\n", hit[i].t, hit[i].surface.instance, hit[i].surface.triangle);
}

int main(int argc, char **argv) {
    bth_scene *scene;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 1;
    bth_ray ray[16];
    size_t n = 0;
    float x, z;
    while (n < 16 && scanf("%f %f", &x, &z) == 2) ray[n++] = (bth_ray){{x, 9, z}, 0, {0, -1, 0}, INFINITY};
    int32_t first, last;
    double rate;
    bth_frames(scene, &first, &last, &rate);
    bth_frames(scene, NULL, NULL, NULL);
    printf("frames %d %d %.17g\n", first, last, rate);
    for (int32_t frame = first; frame <= last; frame++) {
        int32_t code = bth_set_frame(scene, frame);
        if (code != BTH_OK) printf("error %d %s\n", code, bth_last_error());
        shown(scene, ray, n);
    }
    if (bth_set_seconds(scene, 0.3) != BTH_OK) return 2;
    shown(scene, ray, n);
    bth_instance place;
    if (bth_set_seconds(scene, NAN) != BTH_ERROR_ARGUMENT || bth_set_frame(NULL, 0) != BTH_ERROR_ARGUMENT) return 3;
    if (bth_get_instance(scene, bth_instance_count(scene), &place) != BTH_ERROR_ARGUMENT) return 4;
    if (bth_seconds(scene) != 0.3 || bth_seconds(NULL) != 0 || bth_instance_count(NULL) != 0) return 5;
    bth_close(scene);
    return 0;
}
