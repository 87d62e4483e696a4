#!/usr/bin/env python3
"""Renders the reference pictures of this folder with Mitsuba 3, from the scenes in scenes/.

    make.py [--chunks N] [--spp N] [--res N] [SCENE]...

For each SCENE (a folder of scenes/) it writes SCENE.exr, the mean of N chunks that differ only in their seed, and
SCENE_var.exr, the variance of that mean, estimated from the scatter of the chunks. The scatter, not the variance
of the samples within a chunk, because it needs nothing from the renderer but pictures and holds for any sampler.
"""

import argparse
import os
import time

import mitsuba as mi
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "..", "..", "scenes")

# Those whose pictures are here.
NAMES = [
    "caustic",
    "cornell-box",
    "cornell-box-materials",
    "enclosure",
    "furnace",
    "glass",
    "layers",
    "many-lights",
    "million",
    "plates",
    "rough-glass-caustic",
    "shelf",
]

# Far from the seeds that tests and renders by hand use, so that no picture shares its random numbers with the reference.
FIRST_SEED = 1_000_000


def mean_and_variance_of_mean(scene, chunks, spp):
    """Welford's running mean and sum of squares over the chunks, in double precision."""
    mean, squares = 0.0, 0.0
    for chunk in range(chunks):
        picture = np.array(mi.render(scene, spp=spp, seed=FIRST_SEED + chunk), dtype=np.float64)
        step = picture - mean
        mean = mean + step / (chunk + 1)
        squares = squares + step * (picture - mean)
    return mean, squares / (chunks - 1) / chunks


def write(name, pixels):
    mi.Bitmap(pixels.astype(np.float32)).write(os.path.join(HERE, name + ".exr"))


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--chunks", type=int, default=256, help="pictures to average, at least 2 (default %(default)s)")
    arguments.add_argument("--spp", type=int, default=256, help="samples per pixel of each (default %(default)s)")
    arguments.add_argument("--res", type=int, default=64, help="width and height (default %(default)s)")
    arguments.add_argument("scenes", nargs="*", metavar="SCENE", default=NAMES)
    options = arguments.parse_args()
    if options.chunks < 2:
        arguments.error("a variance needs at least 2 chunks")

    mi.set_variant("llvm_ad_rgb")
    for name in options.scenes:
        start = time.time()
        path = os.path.join(SCENES, name, "scene.xml")
        scene = mi.load_file(path, res=options.res, sampler="independent", spp=options.spp)
        mean, variance = mean_and_variance_of_mean(scene, options.chunks, options.spp)
        write(name, mean)
        write(name + "_var", variance)
        relative_error = np.mean(variance / (mean**2 + 0.01))
        print(
            f"{name}: {options.res}x{options.res}, {options.chunks} x {options.spp} samples per pixel, "
            f"mean {mean.mean(axis=(0, 1))}, relMSE of the reference {relative_error:.1e}, {time.time() - start:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
