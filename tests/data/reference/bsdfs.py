"""Writes bsdfs.csv: values and densities of Mitsuba's bsdfs for pairs of directions. Run with mitsuba 3.9.1 and numpy:

    python bsdfs.py > bsdfs.csv

Columns: plugin, distribution, alpha_u, alpha_v, int_ior (ext_ior is 1), direction to the viewer, direction to the light,
value times cosine (red, green, blue), density per solid angle.
"""
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
rng = np.random.default_rng(1)

ALPHAS = [(0.02, 0.02), (0.1, 0.1), (0.4, 0.4), (1.0, 1.0), (0.05, 0.4), (0.7, 0.15)]
ETAS = [1.5046, 1.1, 0.7, 2.4]
PAIRS = 8


def rgb(*v):
    return {"type": "rgb", "value": list(v)}


def configurations():
    yield "diffuse", "ggx", 1.0, 1.0, 0.0, {"type": "diffuse", "reflectance": rgb(0.8, 0.5, 0.2)}
    for distribution in ["ggx", "beckmann"]:
        for u, v in ALPHAS:
            facets = {"distribution": distribution, "alpha_u": u, "alpha_v": v}
            reflectance = {"specular_reflectance": rgb(0.9, 0.8, 0.7)}
            index = {
                "eta": {"type": "rgb", "value": [0.2, 0.9, 1.1]},
                "k": {"type": "rgb", "value": [3.9, 2.4, 2.1]},
            }
            yield "roughconductor", distribution, u, v, 0.0, {"type": "roughconductor", **facets, **index, **reflectance}
            for eta in ETAS:
                transmittance = {"specular_transmittance": rgb(0.6, 0.7, 0.8)}
                outside = {"int_ior": eta, "ext_ior": 1.0}
                yield "roughdielectric", distribution, u, v, eta, {
                    "type": "roughdielectric", **facets, **outside, **reflectance, **transmittance}


def direction():
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


print("# plugin, distribution, alpha_u, alpha_v, int_ior, wo xyz, wi xyz, value rgb, pdf")
for plugin, distribution, u, v, eta, description in configurations():
    bsdf = mi.load_dict(description)
    context = mi.BSDFContext()
    made = 0
    while made < PAIRS:
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(direction())
        # Half of the directions are sampled: random ones hardly ever meet a narrow lobe.
        if made % 2 == 0:
            sample, _ = bsdf.sample(context, si, rng.random(), mi.Point2f(rng.random(2)))
            light = sample.wo
        else:
            light = mi.Vector3f(direction())
        value, pdf = bsdf.eval_pdf(context, si, light)
        if not pdf > 1e-6:
            continue
        made += 1
        numbers = [*si.wi, *light, *value, pdf]
        print(f"{plugin},{distribution},{u},{v},{eta}," + ",".join(f"{float(x):.9g}" for x in numbers))
