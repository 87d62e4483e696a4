#!/usr/bin/env python3
"""Writes scene.xml beside itself: a hall of pillars with 200 lamps whose powers differ by up to 10,000.

The same bytes on every machine: the random numbers are Python's Mersenne Twister from a fixed seed, and what is written is
rounded to four digits.
"""

import os
import random

HERE = os.path.dirname(os.path.abspath(__file__))

# Half the hall's width and length, and its height, in metres.
WIDTH, LENGTH, HEIGHT = 4.0, 6.0, 3.2

# Lamps of each kind, the decades of their sizes in metres, and those of their radiances in W/(sr m^2).
KINDS = {"sphere": 80, "disk": 50, "rectangle": 50, "cube": 20}
SIZES = (-2.0, -0.9)
RADIANCES = (-0.3, 1.7)

# Where pillars stand, half as wide as HALF says; nothing else may be in there.
PILLARS = [(x, z) for z in (-3.6, -0.6, 2.4) for x in (-2.2, 2.2)]
HALF = 0.3

HEAD = """<scene version="3.0.0">
    <!-- A hall with 200 lamps. Written by generate.py: see README.md. Lengths in metres. -->
    <default name="spp" value="64"/>
    <default name="seed" value="0"/>
    <default name="sampler" value="independent"/>
    <default name="max_depth" value="6"/>
    <default name="res" value="512"/>

    <integrator type="path">
        <integer name="max_depth" value="$max_depth"/>
    </integrator>

    <sensor type="perspective">
        <string name="fov_axis" value="smaller"/>
        <float name="fov" value="62"/>
        <transform name="to_world">
            <lookat origin="0.4, 1.9, 5.7" target="0, 1.25, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="$sampler">
            <integer name="sample_count" value="$spp"/>
            <integer name="seed" value="$seed"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="$res"/>
            <integer name="height" value="$res"/>
            <string name="pixel_format" value="rgb"/>
            <string name="component_format" value="float32"/>
            <rfilter type="box"/>
        </film>
    </sensor>

    <bsdf type="diffuse" id="plaster">
        <rgb name="reflectance" value="0.6, 0.58, 0.55"/>
    </bsdf>
    <bsdf type="diffuse" id="floor">
        <rgb name="reflectance" value="0.35, 0.3, 0.26"/>
    </bsdf>
    <bsdf type="roughconductor" id="metal">
        <string name="distribution" value="ggx"/>
        <float name="alpha" value="0.25"/>
        <rgb name="eta" value="2.76, 2.54, 2.27"/>
        <rgb name="k" value="3.84, 3.43, 3.04"/>
    </bsdf>
    <bsdf type="diffuse" id="lamp">
        <rgb name="reflectance" value="0.2"/>
    </bsdf>
"""


def number(x):
    return f"{x:.4g}"


def triple(v):
    return ", ".join(number(x) for x in v)


def shape(kind, transform, bsdf, radiance=None):
    lines = [f'    <shape type="{kind}">', '        <transform name="to_world">']
    lines += [f"            {step}" for step in transform]
    lines += ["        </transform>", f'        <ref id="{bsdf}"/>']
    if radiance is not None:
        lines += [
            '        <emitter type="area">',
            f'            <rgb name="radiance" value="{triple(radiance)}"/>',
            "        </emitter>",
        ]
    return "\n".join(lines + ["    </shape>"]) + "\n"


def scale(x, y, z):
    return f'<scale x="{number(x)}" y="{number(y)}" z="{number(z)}"/>'


def rotate(axis, angle):
    return f'<rotate {axis}="1" angle="{number(angle)}"/>'


def translate(x, y, z):
    return f'<translate x="{number(x)}" y="{number(y)}" z="{number(z)}"/>'


def hall():
    """Six walls that face inwards, and the pillars."""
    walls = [
        (WIDTH, LENGTH, ("x", -90), (0, 0, 0), "floor"),
        (WIDTH, LENGTH, ("x", 90), (0, HEIGHT, 0), "plaster"),
        (WIDTH, HEIGHT / 2, ("y", 0), (0, HEIGHT / 2, -LENGTH), "plaster"),
        (WIDTH, HEIGHT / 2, ("y", 180), (0, HEIGHT / 2, LENGTH), "plaster"),
        (LENGTH, HEIGHT / 2, ("y", 90), (-WIDTH, HEIGHT / 2, 0), "plaster"),
        (LENGTH, HEIGHT / 2, ("y", -90), (WIDTH, HEIGHT / 2, 0), "plaster"),
    ]
    for x, y, turn, place, bsdf in walls:
        yield shape("rectangle", [scale(x, y, 1), rotate(*turn), translate(*place)], bsdf)
    for i, (x, z) in enumerate(PILLARS):
        bsdf = "metal" if i % 3 == 1 else "plaster"
        yield shape("cube", [scale(HALF, HEIGHT / 2, HALF), translate(x, HEIGHT / 2, z)], bsdf)


def free_place(rng, margin):
    while True:
        x, z = rng.uniform(-WIDTH + margin, WIDTH - margin), rng.uniform(-LENGTH + margin, LENGTH - 2.5)
        if all(max(abs(x - px), abs(z - pz)) > HALF + margin for px, pz in PILLARS):
            return x, z


def lamp(rng, kind):
    size = 10 ** rng.uniform(*SIZES)
    x, z = free_place(rng, 0.3)
    radiance = 10 ** rng.uniform(*RADIANCES)
    warmth = rng.random()
    colour = [0.6 + 0.7 * warmth, 0.9 + 0.1 * warmth, 1.4 - 1.0 * warmth]
    hanging = translate(x, rng.uniform(0.4, HEIGHT - 0.4), z)
    if kind == "sphere":
        steps = [scale(size, size, size), hanging]
    elif kind == "cube":
        turns = [rotate("x", rng.uniform(0, 90)), rotate("y", rng.uniform(0, 90))]
        steps = [scale(size, size, size), *turns, hanging]
    else:
        long = size * rng.uniform(1.0, 4.0) if kind == "rectangle" else size
        # Under the ceiling, or on the wall to the left or to the right.
        side = rng.choice((0, 0, -1, 1))
        if side == 0:
            steps = [scale(long, size, 1), rotate("x", 90), translate(x, HEIGHT - 0.02, z)]
        else:
            height = rng.uniform(0.4, HEIGHT - 0.4)
            steps = [scale(long, size, 1), rotate("y", -90 * side), translate(side * (WIDTH - 0.02), height, z)]
    return shape(kind, steps, "lamp", [c * radiance for c in colour])


def main():
    rng = random.Random(2018)
    with open(os.path.join(HERE, "scene.xml"), "w", encoding="utf-8", newline="\n") as out:
        out.write(HEAD)
        out.writelines(hall())
        for kind, count in KINDS.items():
            out.writelines(lamp(rng, kind) for _ in range(count))
        out.write("</scene>\n")


if __name__ == "__main__":
    main()
