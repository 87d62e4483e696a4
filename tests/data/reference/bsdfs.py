"""Writes bsdfs.csv: values and densities of Mitsuba's bsdfs for pairs of directions. Run with mitsuba 3.9.1 and numpy:

    python bsdfs.py > bsdfs.csv

Columns: plugin and its other parameters as NAME=NUMBER, distribution, alpha_u, alpha_v, int_ior (ext_ior is 1), direction to
the viewer, direction to the light, value times cosine (red, green, blue), density per solid angle.
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


# Each lobe of the principled bsdfs alone, then all parameters at once.
PRINCIPLED = [
    {"roughness": 0.5},
    {"roughness": 0.2, "eta": 1.8},
    {"roughness": 0.7, "specular": 0.3},
    {"roughness": 0.3, "metallic": 1.0},
    {"roughness": 0.3, "metallic": 0.4, "eta": 0.7},
    {"roughness": 0.4, "anisotropic": 0.9, "metallic": 1.0},
    {"roughness": 0.5, "spec_tint": 0.8},
    {"roughness": 0.5, "spec_tint": 0.8, "eta": 0.6},
    {"roughness": 0.5, "sheen": 1.0},
    {"roughness": 0.5, "sheen": 0.7, "sheen_tint": 0.6},
    {"roughness": 0.8, "flatness": 1.0},
    {"roughness": 0.6, "clearcoat": 1.0},
    {"roughness": 0.6, "clearcoat": 0.8, "clearcoat_gloss": 0.7},
    {"roughness": 0.6, "clearcoat": 0.8, "eta": 0.8},
    {"roughness": 0.2, "spec_trans": 1.0},
    {"roughness": 0.6, "spec_trans": 1.0, "eta": 1.33},
    {"roughness": 0.5, "spec_trans": 1.0, "eta": 0.75},
    {"roughness": 0.5, "spec_trans": 0.6, "metallic": 0.3, "anisotropic": 0.5},
    {"roughness": 0.7, "specular": 0.0, "metallic": 0.5},
    {"roughness": 0.35, "anisotropic": 0.6, "metallic": 0.2, "spec_trans": 0.3, "eta": 1.6, "spec_tint": 0.4, "sheen": 0.5,
     "sheen_tint": 0.7, "flatness": 0.3, "clearcoat": 0.6, "clearcoat_gloss": 0.2},
]
PRINCIPLED_THIN = [
    {"roughness": 0.5},
    {"roughness": 0.5, "diff_trans": 0.8},
    {"roughness": 0.5, "diff_trans": 2.0},
    {"roughness": 0.3, "spec_trans": 1.0},
    {"roughness": 0.7, "spec_trans": 1.0, "eta": 1.9},
    {"roughness": 0.5, "spec_trans": 0.7, "eta": 0.8},
    {"roughness": 0.5, "spec_trans": 0.6, "spec_tint": 0.7, "anisotropic": 0.8},
    {"roughness": 0.6, "sheen": 0.8, "sheen_tint": 0.5, "flatness": 0.6},
    {"roughness": 0.4, "anisotropic": 0.6, "spec_trans": 0.4, "eta": 1.6, "spec_tint": 0.4, "sheen": 0.5, "sheen_tint": 0.7,
     "flatness": 0.3, "diff_trans": 1.2},
]


def named(plugin, parameters):
    return " ".join([plugin, *(f"{name}={value}" for name, value in parameters.items())])


def layered_configurations():
    for nonlinear in [0, 1]:
        colours = {"diffuse_reflectance": rgb(0.7, 0.4, 0.1), "specular_reflectance": rgb(0.9, 0.8, 0.7)}
        plastic = {"nonlinear": bool(nonlinear), "ext_ior": 1.0, **colours}
        for eta in ETAS:
            yield f"plastic nonlinear={nonlinear}", "ggx", 0.0, 0.0, eta, {"type": "plastic", "int_ior": eta, **plastic}
        for distribution in ["ggx", "beckmann"]:
            for alpha in [0.02, 0.1, 0.4, 1.0]:
                for eta in ETAS:
                    facets = {"distribution": distribution, "alpha": alpha}
                    yield f"roughplastic nonlinear={nonlinear}", distribution, alpha, alpha, eta, {
                        "type": "roughplastic", "int_ior": eta, **facets, **plastic}
    for plugin, configurations in [("principled", PRINCIPLED), ("principledthin", PRINCIPLED_THIN)]:
        for parameters in configurations:
            colour = {"base_color": rgb(0.8, 0.5, 0.2)}
            yield named(plugin, parameters), "ggx", 0.0, 0.0, 0.0, {"type": plugin, **colour, **parameters}


def direction():
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


print("# plugin and parameters, distribution, alpha_u, alpha_v, int_ior, wo xyz, wi xyz, value rgb, pdf")
for plugin, distribution, u, v, eta, description in [*configurations(), *layered_configurations()]:
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
