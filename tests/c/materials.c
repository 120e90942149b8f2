/* How surfaces look, through the C interface: prints the materials and textures of a file, and the vertex color at a hit along -z. */
#include "bth.h"
#include <stdio.h>
#include <string.h>

_Static_assert(sizeof(bth_material_look) == 76, "material");
_Static_assert(sizeof(bth_texture_image) == 48 + 2 * sizeof(size_t), "texture");

int main(int argc, char **argv) {
    bth_scene *scene;
    if (argc < 2 || bth_open(argv[1], BTH_READ, &scene) != BTH_OK) return 1;
    bth_material_look look;
    for (uint32_t material = 0; material < bth_material_count(scene, 0); material++) {
        int32_t code = bth_material(scene, 0, material, &look);
        if (code != BTH_OK) {
            printf("error %d %s\n", code, bth_last_error());
            continue;
        }
        if (look.metallic != 0 || look.normal_texture != BTH_NONE)
            printf("gloss %.3g %.3g scale %.3g strength %.3g textures %d %d %d\n", look.metallic, look.roughness, look.normal_scale,
                   look.occlusion_strength, (int)look.metallic_roughness_texture, (int)look.normal_texture, (int)look.occlusion_texture);
        printf("material %.3g %.3g %.3g %.3g emissive %.3g %.3g %.3g alpha %u %.3g flags %u textures %d %d\n", look.base_color[0],
               look.base_color[1], look.base_color[2], look.base_color[3], look.emissive[0], look.emissive[1], look.emissive[2],
               look.alpha_mode, look.alpha_cutoff, look.flags, (int)look.base_color_texture, (int)look.emissive_texture);
    }
    bth_texture_image image;
    for (uint32_t texture = 0; texture < bth_texture_count(scene, 0); texture++) {
        if (bth_texture(scene, 0, texture, &image) != BTH_OK) return 2;
        printf("texture of image %u: %zu bytes, %d, wrap %u %u nearest %u set %u transform %g %g %g %g %g %g\n", image.image, image.length,
               memcmp(image.bytes, "\x89PNG", 4), image.wrap[0], image.wrap[1], image.nearest, image.uv_set, image.transform[0][0],
               image.transform[0][1], image.transform[0][2], image.transform[1][0], image.transform[1][1], image.transform[1][2]);
    }
    bth_ray ray = {{0.25f, 0.25f, 3}, 0, {0, 0, -1}, 1e30f};
    bth_hit hit, miss = {0, 0, 0, {BTH_NONE, BTH_NONE}};
    float color[4];
    bth_nearest(scene, &ray, NULL, &hit, 1);
    int32_t code = bth_vertex_color(scene, &hit, color);
    if (code == BTH_OK) printf("color %.3g %.3g %.3g %.3g\n", color[0], color[1], color[2], color[3]);
    else printf("error %d %s\n", code, bth_last_error());
    float uv[2];
    for (uint32_t set = 0; set < 2; set++)
        if (bth_texture_coordinates(scene, &hit, set, uv) == BTH_OK) printf("set %u: %.3g %.3g\n", set, uv[0], uv[1]);
    if (bth_texture_coordinates(scene, &miss, 0, uv) != BTH_ERROR_ARGUMENT || bth_texture_coordinates(scene, &hit, 2, uv) != BTH_ERROR_ARGUMENT ||
        bth_texture_coordinates(scene, NULL, 0, uv) != BTH_ERROR_ARGUMENT)
        return 9;
    if (bth_vertex_color(scene, &miss, color) != BTH_ERROR_ARGUMENT || bth_vertex_color(scene, NULL, color) != BTH_ERROR_ARGUMENT) return 3;
    bth_hit beyond = hit;
    beyond.surface.triangle = 1000000;
    if (bth_vertex_color(scene, &beyond, color) != BTH_ERROR_ARGUMENT || !strstr(bth_last_error(), "1000000")) return 11;
    if (bth_texture_coordinates(scene, &beyond, 0, uv) != BTH_ERROR_ARGUMENT) return 12;
    beyond.surface.instance = 0;
    beyond.surface.triangle = BTH_NONE;
    if (bth_vertex_color(scene, &beyond, color) != BTH_ERROR_ARGUMENT) return 13;
    if (bth_material(scene, 0, 1000, &look) != BTH_ERROR_ARGUMENT || !strstr(bth_last_error(), "1000")) return 4;
    if (bth_material(scene, BTH_NONE, 0, &look) != BTH_ERROR_ARGUMENT || bth_material(NULL, 0, 0, &look) != BTH_ERROR_ARGUMENT) return 5;
    if (bth_material(scene, 0, 0, NULL) != BTH_ERROR_ARGUMENT || bth_texture(scene, 0, 0, NULL) != BTH_ERROR_ARGUMENT) return 6;
    if (bth_texture(scene, 0, 1000, &image) != BTH_ERROR_ARGUMENT || bth_texture(scene, BTH_NONE, 0, &image) != BTH_ERROR_ARGUMENT) return 7;
    if (bth_texture_count(NULL, 0) || bth_texture_count(scene, BTH_NONE)) return 8;
    bth_close(scene);
    return 0;
}
