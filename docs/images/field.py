#!/usr/bin/env python3
"""Writes the scene of field.png: 1,500 instances of four models of bth-scenes on a plain.

    for model in "gyroid 1200000" "torus-knot 300000" "hairball 120000" "blob 600000"; do
        set -- $model; bth-scenes make $1 --faces $2 -o $1.ply
    done
    python3 docs/images/field.py > field.manifest
    bth-play field.manifest -o field.png --mode path --size 1280x560 --spp 24
    pngquant --quality 60-100 --speed 1 --output field.png --force field.png
"""
import math
import random

# Radius of a model's bounding sphere over the radius that is wanted, and the height of its centre over that radius.
FIT = {"gyroid": (1.0, 0.985), "blob": (1.05, 0.97), "hairball": (1.0, 0.96), "torus-knot": (2.6, 1.0)}
SIZES = [0.35, 0.5, 0.5, 0.7, 0.9, 1.2, 1.5]
MODELS = ["gyroid", "blob", "hairball", "torus-knot", "gyroid", "torus-knot"]

rng = random.Random(7)
placed = []


def node(name, model, x, z, radius, axis=(0, 1, 0), degrees=0):
    placed.append((x, z, radius * 1.02))
    fit, height = FIT[model]
    scale = round(radius / fit, 4)
    print(f'[[nodes]]\nname = "{name}"\nobject = "{model}"')
    print(f"translation = [{x:.3f}, {radius * height:.3f}, {z:.3f}]\nscale = [{scale}, {scale}, {scale}]")
    print(f"rotation = {{ axis = {list(axis)}, degrees = {degrees} }}\n")


def is_free(x, z, radius):
    return all(math.hypot(x - a, z - b) > radius + c for a, b, c in placed)


def background(count):
    """Models at random places behind the ones in front, denser near the camera."""
    while count > 0:
        z = 2 - 120 * rng.random() ** 1.6
        x = rng.uniform(-1, 1) * (9 + abs(z - 12) * 0.62)
        radius = rng.choice(SIZES)
        in_front = -5.2 < x < 5.6 and z > -2.6
        if (z > -3 and radius > 0.8) or in_front or not is_free(x, z, radius):
            continue
        model = rng.choice(MODELS)
        axis = [round(rng.uniform(-1, 1), 3), round(rng.uniform(0.3, 1), 3), round(rng.uniform(-1, 1), 3)]
        upright = model == "torus-knot"
        node(f"field {count}", model, x, z, radius, [0, 1, 0] if upright else axis, round(rng.uniform(0, 360), 1))
        count -= 1


print('version = 1\ncamera = "main"\n')
for model in FIT:
    print(f'[[objects]]\nname = "{model}"\nmodel = "{model}.ply"\n')
print('[[objects]]\nname = "plain"\nmodel = "plain.ply"\n')
print('[[nodes]]\nname = "plain"\nobject = "plain"\nscale = [400, 400, 400]\n')
with open("plain.ply", "w") as plain:
    plain.write("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n")
    plain.write("element face 2\nproperty list uchar int vertex_indices\nend_header\n")
    plain.write("-1 0 -1\n-1 0 1\n1 0 1\n1 0 -1\n3 0 1 2\n3 0 2 3\n")

node("gyroid in front", "gyroid", -0.6, 0, 2.0, (0, 1, 0), 25)
node("knot in front", "torus-knot", 3.3, 0.6, 1.35, (1, 0.3, 0), 62)
node("hairball in front", "hairball", -3.6, 2.0, 1.15)
node("blob in front", "blob", 1.9, 3.0, 0.8, (0, 1, 0), 40)
node("small hairball", "hairball", 4.6, 3.4, 0.62)
node("small gyroid", "gyroid", -1.6, 4.0, 0.55, (1, 1, 0), 70)
background(1500)

print('[[nodes]]\nname = "eye"\nlook = { from = [0.9, 3.3, 12], to = [0.15, 1.35, 0] }\n')
print('[[cameras]]\nname = "main"\nnode = "eye"\nfov = 31\n')
print('[[nodes]]\nname = "sun"\nlook = { from = [-7, 5, 5], to = [0, 0, 0] }\n')
print('[[lights]]\nname = "sun"\nnode = "sun"\nkind = "directional"\ncolor = [1.0, 0.82, 0.62]\nintensity = 3')
