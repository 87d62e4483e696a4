"""Writes lights.exr, the picture that lights.xml names, and lights.csv: what its lights bring to points, and for those that
are at infinity in directions. Run with mitsuba 3.9.1 and numpy in this folder:

    python lights.py > lights.csv

Columns: number of the light, point (or, of light 0, direction towards the light), light that arrives there if nothing is in
the way (red, green, blue): of light 0 radiance, of the others irradiance of a surface that faces them.
"""
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
# Messages would go among the rows.
mi.set_log_level(mi.LogLevel.Error)
rng = np.random.default_rng(1)

WIDTH, HEIGHT, ROWS = 7, 5, 60

pixels = (rng.random((HEIGHT, WIDTH, 3)) * 10).astype(np.float32)
mi.Bitmap(pixels).write("lights.exr")
scene = mi.load_file("lights.xml")
lights = {light.id(): light for light in scene.emitters()}

print("# light, point or direction xyz, value rgb")
for number in range(len(lights)):
    light = lights[f"light{number}"]
    made = 0
    while made < ROWS:
        v = rng.normal(size=3)
        si = mi.SurfaceInteraction3f()
        if number == 0:
            v /= np.linalg.norm(v)
            si.wi = mi.Vector3f(-v)
            value = light.eval(si)
        else:
            si.p = mi.Point3f(v)
            value = light.sample_direction(si, mi.Point2f(0.5))[1]
        # A few of the points that are not lit are enough.
        if max(value) == 0 and rng.random() < 0.8:
            continue
        print(number, *(f"{x:.9g}" for x in [*v, *value]), sep=",")
        made += 1
