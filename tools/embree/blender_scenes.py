"""Makes one of ten scenes in Blender's `bpy`, renders it with Cycles, and saves the picture. Run by tools/embree/blender."""

import json
import math
import random
import sys
import time

import bpy
import numpy


def material(color=(0.8, 0.8, 0.8), **inputs):
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    for name, value in {"Base Color": (*color, 1), **inputs}.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    return made


def add(data, of=None, at=(0, 0, 0), scale=(1, 1, 1), turn=(0, 0, 0)):
    thing = bpy.data.objects.new("object", data)
    thing.location, thing.scale, thing.rotation_euler = at, scale, turn
    if of:
        data.materials.clear()
        data.materials.append(of)
    bpy.context.collection.objects.link(thing)
    return thing


def primitive(kind, **options):
    """Data of one of Blender's primitive meshes."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**options)
    thing = bpy.context.object
    data = thing.data
    bpy.data.objects.remove(thing)
    return data


def modified(thing, *modifiers):
    for kind, options in modifiers:
        modifier = thing.modifiers.new(kind, kind)
        for name, value in options.items():
            setattr(modifier, name, value)
    return thing


def lamp(kind, at, energy, **options):
    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in options.items():
        setattr(data, name, value)
    thing = add(data, at=at)
    thing.rotation_euler = (-thing.location).to_track_quat("-Z", "Y").to_euler()
    return thing


def ground():
    return add(primitive("plane", size=40), material((0.5, 0.5, 0.45)), at=(0, 0, -1))


def colors(seed):
    source = random.Random(seed)
    while True:
        yield tuple(source.uniform(0.1, 0.9) for _ in range(3))


def around(count, radius, seed):
    """Places, sizes and rotations on the ground."""
    source = random.Random(seed)
    for _ in range(count):
        yield ((source.uniform(-radius, radius), source.uniform(-radius, radius), source.uniform(-0.8, 0.6)),
               source.uniform(0.1, 0.35), tuple(source.uniform(0, 6.28) for _ in range(3)))


def modifiers():
    ground()
    for index, (color, (at, size, turn)) in enumerate(zip(colors(1), around(10, 3, 1))):
        kinds = [[("SUBSURF", {"render_levels": 3})], [("BEVEL", {"segments": 4, "width": 0.1}), ("ARRAY", {"count": 3})],
                 [("WIREFRAME", {"thickness": 0.1})],
                 # Without the cut, both halves would lie in the same place, and which one rays hit would be noise.
                 [("SUBSURF", {"render_levels": 2}), ("SOLIDIFY", {"thickness": 0.2}), ("MIRROR", {"use_bisect_axis": (True, False, False)})]]
        modified(add(primitive("monkey"), material(color), at, (size * 2,) * 3, turn), *kinds[index % 4])


def instances():
    ground()
    meshes = [primitive("monkey"), primitive("torus"), primitive("cube")]
    for mesh, color in zip(meshes, colors(2)):
        mesh.materials.append(material(color))
    for index, (at, size, turn) in enumerate(around(2000, 8, 2)):
        # Stretched, and every fourth one mirrored.
        add(meshes[index % 3], at=at, scale=(size * (-1 if index % 4 == 0 else 1), size * 0.6, size * 1.3), turn=turn)


def glass():
    ground()
    clear = material((1, 1, 1), Transmission_Weight=1.0, Roughness=0.0, IOR=1.5)
    for at, size, turn in around(12, 2.5, 3):
        modified(add(primitive("monkey"), clear, at, (size * 2.5,) * 3, turn), ("SUBSURF", {"render_levels": 2}))
    add(primitive("uv_sphere", segments=64, ring_count=32), clear, (0, -2, 0))


def hair():
    ground()
    modified(add(primitive("monkey"), material((0.6, 0.4, 0.3))), ("SUBSURF", {"render_levels": 2}))
    source = numpy.random.default_rng(4)
    strands = bpy.data.hair_curves.new("hair")
    strands.add_curves([6] * 4000)
    roots = source.normal(size=(4000, 3))
    roots /= numpy.linalg.norm(roots, axis=1)[:, None]
    points = roots[:, None] * (0.9 + 0.12 * numpy.arange(6))[None, :, None] + source.normal(size=(4000, 6, 3)) * 0.03
    strands.position_data.foreach_set("vector", points.astype("f4").reshape(-1))
    strands.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", numpy.full(24000, 0.004, "f4"))
    add(strands, material((0.3, 0.15, 0.05)), at=(1.6, 0, 0))


def points():
    ground()
    source = numpy.random.default_rng(5)
    mesh = bpy.data.meshes.new("places")
    mesh.vertices.add(3000)
    mesh.vertices.foreach_set("co", (source.normal(size=(3000, 3)) * (1.5, 1.5, 0.4)).astype("f4").reshape(-1))
    # A mesh of points only becomes a cloud of spheres by a node.
    nodes = bpy.data.node_groups.new("points", "GeometryNodeTree")
    for direction in "INPUT", "OUTPUT":
        nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    enter, leave = nodes.nodes.new("NodeGroupInput"), nodes.nodes.new("NodeGroupOutput")
    cloud, colored = nodes.nodes.new("GeometryNodeMeshToPoints"), nodes.nodes.new("GeometryNodeSetMaterial")
    cloud.inputs["Radius"].default_value, colored.inputs["Material"].default_value = 0.04, material((0.2, 0.5, 0.8))
    for a, b in (enter, cloud), (cloud, colored), (colored, leave):
        nodes.links.new(a.outputs[0], b.inputs[0])
    modified(add(mesh), ("NODES", {"node_group": nodes}))
    add(primitive("monkey"), material((0.8, 0.3, 0.2)), at=(0, 0, 0.3))


def alpha():
    ground()
    leaf = material((0.2, 0.6, 0.1))
    nodes, links = leaf.node_tree.nodes, leaf.node_tree.links
    checker = nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 8
    links.new(checker.outputs["Fac"], nodes["Principled BSDF"].inputs["Alpha"])
    links.new(nodes.new("ShaderNodeTexCoord").outputs["UV"], checker.inputs["Vector"])
    card = primitive("plane")
    card.materials.append(leaf)
    for at, size, turn in around(300, 3, 6):
        add(card, at=at, scale=(size * 2,) * 3, turn=turn)


def shadows():
    ground()
    linked = bpy.data.collections.new("blockers")
    for index, (color, (at, size, turn)) in enumerate(zip(colors(7), around(16, 3, 7))):
        thing = add(primitive("monkey"), material(color), at, (size * 2,) * 3, turn)
        if index % 2:
            linked.objects.link(thing)
    # Only the blockers throw shadows of this light, and it lights only them.
    lit = lamp("AREA", (-4, -3, 5), 900, size=1)
    lit.light_linking.blocker_collection = linked
    lit.light_linking.receiver_collection = linked


def large():
    size = 1226
    mesh = bpy.data.meshes.new("hills")
    x, y = (a.reshape(-1) for a in numpy.meshgrid(numpy.linspace(-6, 6, size), numpy.linspace(-6, 6, size)))
    z = 0.3 * numpy.sin(3 * x) * numpy.cos(4 * y) + 0.02 * numpy.sin(40 * x + 31 * y) - 0.6
    a = (numpy.arange(size - 1)[:, None] * size + numpy.arange(size - 1)).reshape(-1)
    corners = numpy.stack([a, a + 1, a + size, a + 1, a + size + 1, a + size], -1).reshape(-1)
    mesh.vertices.add(size * size)
    mesh.vertices.foreach_set("co", numpy.stack([x, y, z], -1).astype("f4").reshape(-1))
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners.astype("i4"))
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, len(corners), 3, dtype="i4"))
    mesh.update(calc_edges=True)
    add(mesh, material((0.5, 0.6, 0.4)))


def interior():
    room = primitive("cube", size=6)
    room.flip_normals()
    add(room, material((0.8, 0.75, 0.7)), at=(0, 0, 1.9), scale=(2, 2, 1))
    for color, (at, size, turn) in zip(colors(9), around(25, 3, 9)):
        modified(add(primitive("cube"), material(color, Metallic=0.5, Roughness=0.2), at, (size,) * 3, turn),
                 ("BEVEL", {"segments": 3, "width": 0.05}))
    lamp("AREA", (0, 0, 4.5), 300, size=2)


def subsurface():
    ground()
    bevel = material((0.3, 0.4, 0.8))
    nodes, links = bevel.node_tree.nodes, bevel.node_tree.links
    links.new(nodes.new("ShaderNodeBevel").outputs[0], nodes["Principled BSDF"].inputs["Normal"])
    occlusion = nodes.new("ShaderNodeAmbientOcclusion")
    occlusion.inputs["Color"].default_value = (0.3, 0.4, 0.7, 1)
    links.new(occlusion.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    skin = material((0.9, 0.6, 0.5), Subsurface_Weight=1.0, Subsurface_Scale=0.3)
    for index, (at, size, turn) in enumerate(around(10, 2.5, 10)):
        thing = add(primitive("monkey" if index % 2 else "cube"), bevel if index % 3 == 0 else skin, at, (size * 2,) * 3, turn)
        modified(thing, ("SUBSURF", {"render_levels": 2})) if index % 2 else None


SCENES = {function.__name__: function for function in
          (modifiers, instances, glass, hair, points, alpha, shadows, large, interior, subsurface)}


def main(name, seed, samples, width, threads, out):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.4, 0.5, 0.6, 1)
    SCENES[name]()
    if name != "interior":
        lamp("SUN", (3, -4, 6), 3, angle=0.1)
    scene.camera = add(bpy.data.cameras.new("camera"), at=(0, -5.5, 2.2), turn=(math.radians(70), 0, 0))
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.seed, scene.cycles.use_adaptive_sampling = int(samples), int(seed), False
    scene.cycles.use_denoising = False
    scene.render.threads_mode, scene.render.threads = "FIXED", int(threads)
    scene.render.resolution_x, scene.render.resolution_y = int(width), int(width) * 9 // 16
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = f"{out}.exr"
    wall, cpu = time.monotonic(), time.process_time()
    bpy.ops.render.render(write_still=True)
    times = {"wall": time.monotonic() - wall, "cpu": time.process_time() - cpu}
    picture = bpy.data.images.load(f"{out}.exr")
    pixels = numpy.empty(len(picture.pixels), "f4")
    picture.pixels.foreach_get(pixels)
    numpy.save(f"{out}.npy", pixels.reshape(picture.size[1], picture.size[0], 4)[::-1, :, :3])
    print("\n" + json.dumps(times))


main(*sys.argv[1:])
