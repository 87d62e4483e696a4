"""Writes emission.exr and emission.png, the pictures that emission.xml names, and emission.csv: what its surfaces emit towards
the origins of rays that meet them. Run with mitsuba 3.9.1 and numpy in this folder:

    python emission.py > emission.csv

Columns: origin and direction of the ray, radiance (red, green, blue).
"""
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
# Messages would go among the rows.
mi.set_log_level(mi.LogLevel.Error)
rng = np.random.default_rng(2)

SHAPES, SPACING, ROWS = 6, 3.0, 40

mi.Bitmap((rng.random((4, 6, 3)) * 10).astype(np.float32)).write("emission.exr")
mi.Bitmap((rng.random((3, 5, 3)) * 256).astype(np.uint8)).write("emission.png")
scene = mi.load_file("emission.xml")

print("# origin xyz, direction xyz, radiance rgb")
for shape in range(SHAPES):
    made = dark = 0
    while made < ROWS:
        middle = np.array([SPACING * shape, 0, 0])
        origin = middle + rng.normal(size=3) * 3
        direction = middle + rng.normal(size=3) * 0.5 - origin
        direction /= np.linalg.norm(direction)
        si = scene.ray_intersect(mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction)))
        if not si.is_valid() or abs(si.p.x - middle[0]) > SPACING / 2:
            continue
        value = si.emitter(scene).eval(si)
        # A few backs are enough.
        if max(value) == 0:
            dark += 1
            if dark > 4:
                continue
        print(*(f"{x:.9g}" for x in [*origin, *direction, *value]), sep=",")
        made += 1
