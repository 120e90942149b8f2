"""Renders one of three generated scenes with Blender's Cycles on the CPU, for record_rays.so.

Usage: python scenes.py hall|forest|room PICTURE.png [WIDTH HEIGHT SAMPLES]

Needs the wheel `bpy`. Every object has its own mesh and nothing moves, so Cycles puts all triangles
into one Embree scene without instances. All materials but one are opaque to shadow rays. None has
subsurface scattering or volumes.
"""

import math
import random
import sys

import bpy
import numpy as np


def material(name, kind, color, roughness=0.0):
    """A material of one shader node: ShaderNodeBsdfDiffuse and its kind."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*color, 1.0)
    if "Roughness" in shader.inputs:
        shader.inputs["Roughness"].default_value = roughness
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def diffuse(name, *color):
    return material(name, "ShaderNodeBsdfDiffuse", color)


def finished(look, smooth=False, modifiers=(), scale=None):
    """The object that was just added, with its material and modifiers."""
    thing = bpy.context.object
    if scale:
        thing.scale = scale
        bpy.ops.object.transform_apply(location=False, rotation=False)
    thing.data.materials.append(look)
    for kind, settings in modifiers:
        modifier = thing.modifiers.new(kind, kind)
        for key, value in settings.items():
            setattr(modifier, key, value)
    if smooth:
        bpy.ops.object.shade_smooth()
    return thing


def mesh_object(name, vertices, faces, looks, look_of_face):
    """An object of arrays: all faces have as many corners."""
    mesh = bpy.data.meshes.new(name)
    corners = faces.shape[1]
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.astype(np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, corners, dtype=np.int32))
    for look in looks:
        mesh.materials.append(look)
    mesh.polygons.foreach_set("material_index", look_of_face.astype(np.int32))
    mesh.update(calc_edges=True)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    return thing


def ground(look, size, cells, height, rng):
    """A displaced square: sums of sines."""
    axis = np.linspace(-size, size, cells + 1)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    z = np.zeros_like(x)
    for k in range(1, 8):
        a, b, phase = rng.normal() * k, rng.normal() * k, rng.uniform(0, 6.28)
        z += height / k * np.sin((a * x + b * y) * 2 / size + phase)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)[None, :]).ravel()
    faces = np.stack([corner, corner + cells + 1, corner + cells + 2, corner + 1], axis=1)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return mesh_object("ground", vertices, faces, [look], np.zeros(len(faces)))


def light(kind, location, energy, size=1.0, rotation=(0.0, 0.0, 0.0)):
    made = bpy.data.lights.new(kind, kind)
    made.energy = energy
    if kind == "AREA":
        made.size = size
    thing = bpy.data.objects.new(kind, made)
    thing.location, thing.rotation_euler = location, rotation
    bpy.context.collection.objects.link(thing)


def camera(location, target, lens=30.0):
    made = bpy.data.cameras.new("camera")
    made.lens = lens
    thing = bpy.data.objects.new("camera", made)
    thing.location = location
    x, y, z = (b - a for a, b in zip(location, target))
    thing.rotation_euler = (math.atan2(math.hypot(x, y), -z), 0.0, math.atan2(-x, y))
    bpy.context.collection.objects.link(thing)
    bpy.context.scene.camera = thing


def sky(strength):
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.6, 0.75, 1.0, 1.0)
    world.node_tree.nodes["Background"].inputs[1].default_value = strength
    bpy.context.scene.world = world


def hall():
    """Columns, bevelled blocks and subdivided heads on displaced ground, under an area light and a sky."""
    rng, pick = np.random.default_rng(1), random.Random(1)
    stone, red = diffuse("stone", 0.7, 0.67, 0.6), diffuse("red", 0.6, 0.2, 0.15)
    metal = material("metal", "ShaderNodeBsdfGlossy", (0.9, 0.8, 0.6), 0.2)
    ground(stone, 14.0, 250, 0.12, rng)
    bevel = ("BEVEL", {"width": 0.06, "segments": 4, "limit_method": "ANGLE"})
    for side in (-4.0, 4.0):
        for k in range(8):
            y = 3.0 * k - 10.5
            column = {"vertices": 96, "radius": 0.5, "depth": 5.0}
            bpy.ops.mesh.primitive_cylinder_add(location=(side, y, 2.5), **column)
            finished(stone, True, [bevel])
            for z in (0.25, 5.0):
                bpy.ops.mesh.primitive_cube_add(size=1.0, location=(side, y, z))
                finished(stone, False, [bevel], (1.4, 1.4, 0.5))
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 5.6))
    finished(stone, False, [bevel], (11.0, 25.0, 0.6))
    for wall in (-5.6, 5.6):
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=(wall, 0.0, 2.5))
        finished(red, False, [bevel], (0.4, 25.0, 5.5))
    for k in range(14):
        where = (pick.uniform(-2.6, 2.6), 1.5 * k - 9.0, 0.8)
        turn = (0.0, 0.0, pick.uniform(0.0, 6.28))
        bpy.ops.mesh.primitive_monkey_add(size=1.3, location=where, rotation=turn)
        finished((red, metal, stone)[k % 3], True, [("SUBSURF", {"levels": 2, "render_levels": 2})])
    light("AREA", (0.0, 0.0, 5.2), 600.0, 4.0)
    sky(0.5)
    camera((0.6, -11.5, 2.2), (0.0, 0.0, 1.8))


def forest():
    """Trunks and leaf cards, one mesh of 540,000 triangles, on displaced ground under sun and sky."""
    rng = np.random.default_rng(2)
    bark, leaf = diffuse("bark", 0.25, 0.17, 0.1), diffuse("leaf", 0.2, 0.45, 0.1)
    earth = diffuse("earth", 0.3, 0.25, 0.15)
    ground(earth, 20.0, 200, 0.3, rng)
    vertices, faces, looks, base = [], [], [], 0
    trees, around, along, leaves = 70, 12, 14, 3700
    for _ in range(trees):
        place, tall = rng.uniform(-18.0, 18.0, 2), rng.uniform(5.0, 9.0)
        heights, angles = np.linspace(-0.5, 1.0, along + 1), np.arange(around) * 2 * np.pi / around
        height, angle = np.meshgrid(heights, angles, indexing="ij")
        bend = rng.normal(0.0, 0.5, 2)
        radius = 0.25 * (1.05 - np.clip(height, 0.0, 1.0))
        ring = np.stack(
            [
                place[0] + radius * np.cos(angle) + bend[0] * height**2,
                place[1] + radius * np.sin(angle) + bend[1] * height**2,
                tall * height,
            ],
            axis=-1,
        ).reshape(-1, 3)
        row, column = np.arange(along)[:, None] * around, np.arange(around)[None, :]
        first, second = (row + column).ravel(), (row + (column + 1) % around).ravel()
        vertices.append(ring)
        faces.append(base + np.stack([first, second, second + around, first + around], axis=1))
        looks.append(np.zeros(len(first)))
        base += len(ring)
        # Cards around the crown, each a square turned at random.
        direction = rng.normal(size=(leaves, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        crown = np.array([place[0] + bend[0], place[1] + bend[1], 0.8 * tall])
        middle = crown + direction * (rng.uniform(0.2, 1.0, (leaves, 1)) ** 0.5) * [1.6, 1.6, 0.35 * tall]
        u = rng.normal(size=(leaves, 3))
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        v = np.cross(u, direction)
        v /= np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-6)
        u, v = u * 0.07, v * 0.05
        card = np.stack([middle - u - v, middle + u - v, middle + u + v, middle - u + v], axis=1)
        vertices.append(card.reshape(-1, 3))
        faces.append(base + np.arange(4 * leaves).reshape(-1, 4))
        looks.append(np.ones(leaves))
        base += 4 * leaves
    looks = np.concatenate(looks)
    mesh_object("trees", np.concatenate(vertices), np.concatenate(faces), [bark, leaf], looks)
    light("SUN", (0.0, 0.0, 20.0), 4.0, rotation=(0.6, 0.3, 0.0))
    sky(0.8)
    camera((0.0, -17.0, 1.8), (0.0, 0.0, 3.2), 24.0)


def room():
    """Heads and balls of glass, metal and paint in a closed room with an area light at the ceiling."""
    pick = random.Random(3)
    white, green = diffuse("white", 0.75, 0.75, 0.75), diffuse("green", 0.2, 0.5, 0.25)
    glass = material("glass", "ShaderNodeBsdfGlass", (0.95, 1.0, 0.98))
    metal = material("metal", "ShaderNodeBsdfGlossy", (0.9, 0.9, 0.9), 0.05)
    brass = material("brass", "ShaderNodeBsdfGlossy", (0.9, 0.7, 0.3), 0.3)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 2.0))
    finished(white, False, (), (8.0, 8.0, 4.0))
    subdivided = ("SUBSURF", {"levels": 2, "render_levels": 2})
    for k in range(24):
        look = (glass, metal, green, white, brass)[k % 5]
        x, y = 1.4 * (k % 5) - 2.8 + pick.uniform(-0.2, 0.2), 1.4 * (k // 5) - 2.4
        where = (x, y, pick.uniform(0.5, 1.6))
        if k % 4 == 3:
            ball = {"segments": 64, "ring_count": 32, "radius": 0.55}
            bpy.ops.mesh.primitive_uv_sphere_add(location=where, **ball)
            finished(look, True)
        else:
            turn = (pick.uniform(-0.4, 0.4), 0.0, pick.uniform(-1.5, 1.5))
            bpy.ops.mesh.primitive_monkey_add(size=1.2, location=where, rotation=turn)
            finished(look, True, [subdivided])
    light("AREA", (0.0, 0.0, 3.95), 250.0, 2.0)
    camera((0.0, -3.8, 2.2), (0.0, 0.5, 1.2), 22.0)


def pane():
    """A transparent pane far below everything. If no material lets shadow rays pass, Cycles asks Embree
    for their nearest hit. If one does, as in most scenes, it asks for any hit."""
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=(0.0, 0.0, -5.0))
    finished(material("pane", "ShaderNodeBsdfTransparent", (0.5, 0.5, 0.5)))


def render(path, width, height, samples):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.seed = "CPU", samples, 1
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    for bounces in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{bounces}_bounces", 5)
    cycles.caustics_reflective = cycles.caustics_refractive = True
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def main():
    name, path, *size = sys.argv[1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    {"hall": hall, "forest": forest, "room": room}[name]()
    pane()
    render(path, *(int(n) for n in size or (256, 144, 4)))


if __name__ == "__main__":
    main()
