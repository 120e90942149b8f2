/* Uses the queries for several hits and with conditions through the C interface alone: opens a file, traces rays read from standard
 * input (lines of eight numbers), all of them for all hits, then those on triangles with even ids, and prints the answers. Exits
 * with another code than 0 where an error is not reported as documented. */
#include "bth.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(sizeof(bth_accept) == 8 + 2 * sizeof(void *), "accept");
_Static_assert(sizeof(bth_hit_list) == 16 + 2 * sizeof(void *), "list");

#define MOST 16

/* Accepts triangles with even ids and counts the calls. */
static int32_t is_even(void *user, const bth_ray *ray, const bth_hit *hit) {
    ++*(size_t *)user;
    return ray && hit->surface.triangle % 2 == 0 ? 8 : 0;
}

static int answer(const bth_scene *scene, const bth_ray *ray, size_t n, const bth_accept *accept) {
    bth_hit nearest[MOST];
    uint8_t any[MOST];
    uint64_t counts[MOST], offsets[MOST + 1];
    if (bth_nearest_accepted(scene, ray, accept, nearest, n) != BTH_OK) return 1;
    if (bth_any_accepted(scene, ray, accept, any, n) != BTH_OK) return 2;
    if (bth_count_hits(scene, ray, accept, counts, n) != BTH_OK) return 3;
    bth_hit_list list = {offsets, NULL, 0, 0};
    if (bth_all_hits(scene, ray, accept, BTH_ALL_HITS, &list, n) != BTH_OK || list.needed != offsets[n]) return 4;
    uint64_t needed = list.needed;
    list.hits = malloc((needed + 1) * sizeof(bth_hit));
    /* One more is not written, and all but one fit. */
    memset(&list.hits[needed], 7, sizeof(bth_hit));
    list.capacity = needed ? needed - 1 : 0;
    if (needed) memset(&list.hits[needed - 1], 7, sizeof(bth_hit));
    if (bth_all_hits(scene, ray, accept, BTH_ALL_HITS, &list, n) != BTH_OK || list.needed != needed) return 5;
    if (needed && memcmp(&list.hits[needed - 1], &list.hits[needed], sizeof(bth_hit))) return 6;
    list.capacity = needed;
    if (bth_all_hits(scene, ray, accept, BTH_ALL_HITS, &list, n) != BTH_OK) return 7;
    for (size_t i = 0; i < n; i++) {
        printf("%u %llu %.9g %u", any[i], (unsigned long long)counts[i], nearest[i].t, nearest[i].surface.triangle);
        for (uint64_t k = offsets[i]; k < offsets[i + 1]; k++)
            printf(" %.9g %.9g %.9g %u %u", list.hits[k].t, list.hits[k].u, list.hits[k].v,
                   list.hits[k].surface.instance, list.hits[k].surface.triangle);
        printf("\n");
    }
    bth_hit first[2 * MOST];
    bth_hit_list two = {offsets, first, 2 * MOST, 0};
    if (bth_all_hits(scene, ray, accept, 2, &two, n) != BTH_OK) return 8;
    for (size_t i = 0; i < n; i++)
        if (offsets[i + 1] - offsets[i] != (counts[i] < 2 ? counts[i] : 2)) return 9;
    free(list.hits);
    return 0;
}

int main(int argc, char **argv) {
    bth_scene *scene;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 100;
    bth_ray ray[MOST];
    size_t n = 0;
    while (n < MOST && scanf("%f %f %f %f %f %f %f %f", &ray[n].origin[0], &ray[n].origin[1], &ray[n].origin[2],
                             &ray[n].tmin, &ray[n].direction[0], &ray[n].direction[1], &ray[n].direction[2],
                             &ray[n].tmax) == 8)
        n++;
    size_t calls = 0;
    bth_accept everything = BTH_ACCEPT_EVERYTHING, even = {0xFFFFFFFFu, BTH_CULL_NONE, is_even, &calls};
    int failure = answer(scene, ray, n, NULL);
    if (!failure) failure = answer(scene, ray, n, &even);
    if (!failure && !calls) failure = 101;
    uint64_t counts[MOST];
    even.cull = 3;
    if (bth_count_hits(scene, ray, &even, counts, n) != BTH_ERROR_ARGUMENT || !strstr(bth_last_error(), "cull")) return 102;
    uint64_t none = 7;
    bth_hit_list empty = {&none, NULL, 0, 7};
    if (bth_count_hits(NULL, NULL, NULL, NULL, 0) != BTH_OK || bth_nearest_accepted(NULL, NULL, NULL, NULL, 0) != BTH_OK) return 111;
    if (bth_all_hits(scene, NULL, NULL, 1, NULL, 0) != BTH_OK || bth_all_hits(scene, NULL, NULL, 1, &empty, 0) != BTH_OK) return 112;
    if (none != 0 || empty.needed != 0) return 113;
    if (bth_count_hits(NULL, ray, NULL, counts, n) != BTH_ERROR_ARGUMENT) return 103;
    if (bth_count_hits(scene, NULL, NULL, counts, n) != BTH_ERROR_ARGUMENT) return 104;
    if (bth_count_hits(scene, ray, NULL, NULL, n) != BTH_ERROR_ARGUMENT) return 105;
    if (bth_count_hits(scene, NULL, NULL, NULL, 0) != BTH_OK) return 106;
    if (bth_all_hits(scene, ray, NULL, 1, NULL, n) != BTH_ERROR_ARGUMENT) return 107;
    if (bth_set_instance_mask(scene, bth_instance_count(scene), 1) != BTH_ERROR_ARGUMENT) return 108;
    if (bth_set_group_mask(scene, 0, 0xFFFFFFFEu, 1) != BTH_ERROR_ARGUMENT) return 109;
    if (bth_set_group_mask(scene, 77, 0, 1) != BTH_ERROR_ARGUMENT) return 110;
    /* With the second bit only, rays that have the first one only meet nothing. */
    if (bth_set_instance_mask(scene, 0, 2) != BTH_OK || bth_set_group_mask(scene, 0, 0, 6) != BTH_OK) return 111;
    for (everything.mask = 1; everything.mask < 4; everything.mask++) {
        if (bth_count_hits(scene, ray, &everything, counts, n) != BTH_OK) return 112;
        for (size_t i = 0; i < n; i++) printf("%llu ", (unsigned long long)counts[i]);
        printf("\n");
    }
    bth_close(scene);
    return failure;
}
