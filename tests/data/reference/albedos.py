"""Writes albedos.csv: which part of the light white bsdfs of Mitsuba reflect and transmit. Run with mitsuba 3.9.1 and numpy:

    python albedos.py > albedos.csv

Columns: plugin and its other parameters as NAME=NUMBER, distribution, alpha_u, alpha_v, int_ior (ext_ior is 1), cosine of the direction to the viewer (negative from
inside), mean weight of the samples on the viewer's side, on the other side (there with 1/eta^2 of the radiance).
"""
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
SIDE = 1024

ALPHAS = [(0.1, 0.1), (0.5, 0.5), (1.0, 1.0), (0.1, 0.6)]
COSINES = [1.0, 0.5, 0.1]


def configurations():
    yield "diffuse", "ggx", 1.0, 1.0, 0.0, {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
    yield "dielectric", "ggx", 0.0, 0.0, 1.5, {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}
    for distribution in ["ggx", "beckmann"]:
        for u, v in ALPHAS:
            facets = {"distribution": distribution, "alpha_u": u, "alpha_v": v}
            yield "roughconductor", distribution, u, v, 0.0, {"type": "roughconductor", "material": "none", **facets}
            yield "roughdielectric", distribution, u, v, 1.5, {
                "type": "roughdielectric", "int_ior": 1.5, "ext_ior": 1.0, **facets}


# White ones: what each parameter adds.
PRINCIPLED = [
    {"roughness": 0.3},
    {"roughness": 1.0},
    {"roughness": 1.0, "flatness": 1.0},
    {"roughness": 0.5, "sheen": 1.0},
    {"roughness": 0.3, "metallic": 1.0},
    {"roughness": 1.0, "metallic": 1.0},
    {"roughness": 0.3, "clearcoat": 1.0},
    {"roughness": 0.3, "clearcoat": 1.0, "clearcoat_gloss": 1.0},
    {"roughness": 0.3, "spec_trans": 1.0},
    {"roughness": 1.0, "spec_trans": 1.0},
]
PRINCIPLED_THIN = [
    {"roughness": 0.3},
    {"roughness": 0.3, "diff_trans": 1.0},
    {"roughness": 0.3, "spec_trans": 1.0},
    {"roughness": 1.0, "spec_trans": 1.0},
    {"roughness": 0.5, "sheen": 1.0},
]


def named(plugin, parameters):
    return " ".join([plugin, *(f"{name}={value}" for name, value in parameters.items())])


def layered_configurations():
    white = {"type": "rgb", "value": 1.0}
    index = {"int_ior": 1.5, "ext_ior": 1.0}
    yield "null", "ggx", 0.0, 0.0, 1.0, {"type": "null"}
    yield "thindielectric", "ggx", 0.0, 0.0, 1.5, {"type": "thindielectric", **index}
    for nonlinear in [0, 1]:
        plastic = {"nonlinear": bool(nonlinear), "diffuse_reflectance": white, **index}
        yield f"plastic nonlinear={nonlinear}", "ggx", 0.0, 0.0, 1.5, {"type": "plastic", **plastic}
        for distribution in ["ggx", "beckmann"]:
            for alpha in [0.1, 0.5, 1.0]:
                facets = {"distribution": distribution, "alpha": alpha}
                yield f"roughplastic nonlinear={nonlinear}", distribution, alpha, alpha, 1.5, {
                    "type": "roughplastic", **facets, **plastic}
    for parameters in PRINCIPLED:
        eta = 1.5 if "spec_trans" in parameters else 0.0
        index = {"eta": eta} if eta > 0 else {}
        yield named("principled", parameters), "ggx", 0.0, 0.0, eta, {
            "type": "principled", "base_color": white, **index, **parameters}
    for parameters in PRINCIPLED_THIN:
        yield named("principledthin", parameters), "ggx", 0.0, 0.0, 1.5, {
            "type": "principledthin", "base_color": white, **parameters}


i = dr.arange(mi.UInt32, SIDE * SIDE)
u = (mi.Point2f(i % SIDE, i // SIDE) + 0.5) / SIDE
# The numbers that choose the lobe are spread by the golden ratio.
spread = dr.arange(mi.Float64, SIDE * SIDE) * 0.6180339887498949
lobe = mi.Float(spread - dr.floor(spread))

print("# plugin and parameters, distribution, alpha_u, alpha_v, int_ior, cosine, same side, other side")
for plugin, distribution, alpha_u, alpha_v, eta, description in [*configurations(), *layered_configurations()]:
    bsdf = mi.load_dict(description)
    for cosine in COSINES + ([-c for c in COSINES] if eta > 0 and "plastic" not in plugin else []):
        sine = (1 - cosine * cosine) ** 0.5
        si = dr.zeros(mi.SurfaceInteraction3f, SIDE * SIDE)
        si.wi = mi.Vector3f(0.6 * sine, 0.8 * sine, cosine)
        sample, weight = bsdf.sample(mi.BSDFContext(), si, lobe, u)
        same = sample.wo.z * cosine > 0
        parts = [dr.mean(mi.Float64(dr.select(side, weight.x, 0)))[0] for side in [same, ~same]]
        print(f"{plugin},{distribution},{alpha_u},{alpha_v},{eta},{cosine}," + ",".join(f"{p:.6f}" for p in parts))
