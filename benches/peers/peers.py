#!/usr/bin/env python3
"""Runs the same scene files through snell and its peers in turn, and prints how they compare.

  peers.py SCENE.xml... [--reference REF.exr]... [--spp 64] [--seeds 5] [-D NAME=VALUE]... [--json FILE]

For each scene and number of samples a row of a Markdown table: processor seconds of the whole process, relMSE, and the
ratios peer/snell of time (speed) and of time x relMSE (efficiency), medians over seeds with the smallest and the largest.
Where a renderer is run in several ways (samplers of the peer, accelerators of snell) the most efficient counts.

relMSE = mean((x - r)^2 / (r^2 + 0.01)), by `snell diff`, less the reference's own error as far as that is known. Rows
whose relMSE is not ten times the reference's own error are marked and not counted.

Exit codes: 0 done, 1 some row does not count, 2 nothing could be measured. See README.md beside this file."""
import argparse
import glob
import importlib.util
import json
import math
import os
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

# A reference must be so many times better than what it measures.
LEAST_RATIO = 10
# Means of two renderers' pictures that differ by more than this part say that they do not show the same.
SAME_MEAN = 0.05
# Seeds of references are this far from those of what they measure.
REFERENCE_SEED = 1_000_000


def fail(message):
    print(f"peers.py: {message}", file=sys.stderr)
    sys.exit(2)


def run(command, env=None):
    """Runs a command; its processor seconds, children included. What it prints shows only if it fails."""
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=env)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            output.seek(0)
            told = output.read().decode(errors="replace").strip().splitlines()[-5:]
            raise RuntimeError(f"{shlex.join(command)} ended with {process.returncode}: {' | '.join(told)}")
    return usage.ru_utime + usage.ru_stime


class Snell:
    """snell with one accelerator."""

    family = "snell"

    def __init__(self, options, accelerator):
        self.options, self.name, self.accelerator = options, f"snell {accelerator}", accelerator

    def scene(self, path):
        return path

    def render(self, scene, spp, seed, out):
        defines = [f"-D{d}" for d in self.options.define]
        command = [self.options.snell, "render", scene, "-o", out, "--spp", str(spp), "--seed", str(seed), "-q"]
        return run(command + ["--accel", self.accelerator] + defines + self.options.snell_args)


class Mitsuba:
    """Mitsuba 3 with one sampler."""

    def __init__(self, options, binary, sampler):
        self.options, self.binary, self.sampler = options, binary, sampler
        self.family, self.name = f"Mitsuba {options.variant}", f"Mitsuba {options.variant} {sampler}"
        self.env = dict(os.environ)
        libraries = sorted(glob.glob("/usr/lib/*/libLLVM*.so*") + glob.glob("/usr/lib/llvm*/lib/libLLVM*.so*"))
        if libraries:
            self.env.setdefault("DRJIT_LIBLLVM_PATH", libraries[-1])

    def scene(self, path):
        return path

    def render(self, scene, spp, seed, out):
        # No -t: with 1 or 2 threads, version 3.9.1 hangs while it writes.
        defines = [f"-D{d}" for d in self.options.define]
        numbers = [f"-Dspp={spp}", f"-Dseed={seed}", f"-Dsampler={self.sampler}"]
        return run([self.binary, "-m", self.options.variant] + numbers + defines + ["-o", out, scene], self.env)


class Other:
    """A peer with a scene format of its own: takes part where its file lies beside the scene's."""

    def __init__(self, name, binary, suffix, command):
        self.family = self.name = name
        self.binary, self.suffix, self.command = binary, suffix, command

    def scene(self, path):
        own = os.path.splitext(path)[0] + self.suffix
        return own if os.path.exists(own) else None

    def render(self, scene, spp, seed, out):
        return run([self.binary] + self.command(scene, str(spp), str(seed), out))


# Name, program, ending of the scene's file, arguments.
OTHERS = [
    ("pbrt", "pbrt", ".pbrt", lambda scene, spp, seed, out: ["--quiet", "--spp", spp, "--seed", seed, "--outfile", out, scene]),
    (
        "LuxCore",
        "luxcoreconsole",
        ".cfg",
        lambda scene, spp, seed, out: [
            "-D", "batch.haltspp", spp, "-D", "renderengine.seed", seed,
            "-D", "film.outputs.0.type", "RGB", "-D", "film.outputs.0.filename", out, scene,
        ],
    ),
    ("Cycles", "cycles", ".cycles.xml", lambda scene, spp, seed, out: ["--background", "--samples", spp, "--output", out, scene]),
]


def find_mitsuba(options):
    """The native program: the one that was named, or that of the Python module, or what the path has."""
    if options.mitsuba:
        return options.mitsuba
    spec = importlib.util.find_spec("mitsuba")
    native = spec and spec.origin and os.path.join(os.path.dirname(spec.origin), "mitsuba")
    return native if native and os.access(native, os.X_OK) else shutil.which("mitsuba")


def contenders(options):
    snells = [Snell(options, accelerator) for accelerator in options.accel]
    peers = []
    mitsuba = find_mitsuba(options)
    if mitsuba:
        peers += [Mitsuba(options, mitsuba, sampler) for sampler in options.samplers]
    for name, program, suffix, command in OTHERS:
        binary = shutil.which(program)
        if binary:
            peers.append(Other(name, binary, suffix, command))
    if not peers:
        fail("no peer is installed: README.md says how to install Mitsuba; or name its program by --mitsuba")
    return snells, peers


def check_parameters(path):
    """The peers take samples, seed and sampler as parameters of the file."""
    try:
        declared = {element.get("name") for element in xml.parse(path).getroot().iter("default")}
    except (OSError, xml.ParseError) as error:
        fail(f"{path}: {error}")
    missing = [name for name in ("spp", "seed", "sampler") if name not in declared]
    if missing:
        fail(f'{path}: expected <default name="{missing[0]}" .../>, used by its sampler, so that peers can be told; see README.md')


def compare(options, picture, reference):
    """relMSE, and how far the mean is off, in parts of the reference's."""
    told = subprocess.run([options.snell, "diff", picture, reference, "--json", "-"], capture_output=True, text=True)
    if told.returncode:
        raise RuntimeError(told.stderr.strip())
    figures = json.loads(told.stdout)
    return figures["relmse"], figures["mean"] / (figures["reference_mean"] or 1) - 1


def own_error(options, scene, reference, folder):
    """The error of a reference whose variance lies beside it, as snell's own bench tells it; None where none does."""
    if not os.path.exists(os.path.splitext(reference)[0] + "_var.exr"):
        return None
    out = os.path.join(folder, "bench")
    command = [options.snell, "bench", scene, "--reference", reference, "--spp", "1", "--seeds", "1", "--out", out, "-q"]
    told = subprocess.run(command + [f"-D{d}" for d in options.define], capture_output=True, text=True)
    if told.returncode > 1:
        raise RuntimeError(told.stderr.strip())
    with open(os.path.join(out, "bench.json")) as file:
        return json.load(file)["scenes"][0]["reference"]["own_error"]


def make_reference(options, snell, scene, folder):
    """Two pictures of many samples: the first is the reference, half of the difference its error."""
    first, second = (os.path.join(folder, f"reference-{i}.exr") for i in (0, 1))
    for i, out in enumerate((first, second)):
        snell.render(scene, options.reference_spp, REFERENCE_SEED + i, out)
    return first, compare(options, second, first)[0] / 2


def spread(values):
    return {"median": statistics.median(values), "low": min(values), "high": max(values)}


def measure(options, scene, reference, own, snells, peers, folder):
    """Rows of one scene: for each number of samples and each peer."""
    taking_part = snells + [peer for peer in peers if peer.scene(scene)]
    out = os.path.join(folder, "picture.exr")
    working = []
    for who in taking_part:
        # The first run of a peer may compile kernels.
        try:
            who.render(who.scene(scene), 1, 1, out)
            working.append(who)
        except RuntimeError as error:
            print(f"{scene}: {who.name} is left out: {error}", file=sys.stderr)
    rows = []
    for spp in options.spp:
        runs = {who.name: [] for who in working}
        for seed in range(options.seeds):
            for who in working:
                seconds = who.render(who.scene(scene), spp, 1 + seed, out)
                relmse, off = compare(options, out, reference)
                runs[who.name].append({"cpu_seconds": seconds, "relmse": relmse - (own or 0.0), "mean_off_by": off})
                print(f"{scene}: {spp} samples, seed {1 + seed}, {who.name}: {seconds:.2f} s, relMSE {relmse:.3e}", file=sys.stderr)
        rows += rows_of(scene, spp, runs, working, own)
    return rows


def best(whos, runs):
    """The most efficient."""
    cost = lambda who: statistics.median(run["cpu_seconds"] * run["relmse"] for run in runs[who.name])
    return min(whos, key=cost)


def rows_of(scene, spp, runs, working, own):
    families = {}
    for who in working:
        families.setdefault(who.family, []).append(who)
    if "snell" not in families:
        return []
    snell = best(families.pop("snell"), runs)
    rows = []
    for members in families.values():
        peer = best(members, runs)
        mine, theirs = runs[snell.name], runs[peer.name]
        pairs = list(zip(mine, theirs))
        least = min(statistics.median(run["relmse"] for run in both) for both in (mine, theirs))
        off = statistics.median(run["mean_off_by"] for run in theirs) - statistics.median(run["mean_off_by"] for run in mine)
        why = None
        if least <= 0 or (own is not None and least < LEAST_RATIO * own):
            why = f"the reference's own error, {own or 0:.1e}, is more than a tenth of {least:.1e}"
        elif abs(off) > SAME_MEAN:
            why = f"the means of the pictures differ by {100 * off:.1f} %: they do not show the same"
        efficiency = [p["cpu_seconds"] * p["relmse"] / (s["cpu_seconds"] * s["relmse"]) for s, p in pairs if s["relmse"] > 0]
        rows.append({
            "scene": scene, "samples": spp, "snell": snell.name, "peer": peer.name, "family": peer.family,
            "snell_cpu_seconds": spread([s["cpu_seconds"] for s in mine]), "peer_cpu_seconds": spread([p["cpu_seconds"] for p in theirs]),
            "snell_relmse": spread([s["relmse"] for s in mine]), "peer_relmse": spread([p["relmse"] for p in theirs]),
            "speed": spread([p["cpu_seconds"] / s["cpu_seconds"] for s, p in pairs]),
            "efficiency": spread(efficiency) if efficiency else None,
            "counts": why is None, "why_not": why, "reference_own_error": own, "runs": runs,
        })
    return rows


def short(path):
    """What a scene is called: its file, or its folder where the file is just a scene."""
    stem = os.path.splitext(os.path.basename(path))[0]
    return os.path.basename(os.path.dirname(os.path.abspath(path))) if stem == "scene" else stem


def ratio(s):
    return f"**{s['median']:.2f}** ({s['low']:.2f}–{s['high']:.2f})" if s else "–"


def print_table(rows):
    print("| scene | samples | peer | CPU s, snell | peer | relMSE, snell | peer | speed | efficiency |")
    print("|---|--:|---|--:|--:|--:|--:|--:|--:|")
    for r in rows:
        mark = "" if r["counts"] else " (not counted)"
        print(
            f"| {short(r['scene'])}{mark} | {r['samples']} | {r['peer']} | {r['snell_cpu_seconds']['median']:.2f} | "
            f"{r['peer_cpu_seconds']['median']:.2f} | {r['snell_relmse']['median']:.2e} | {r['peer_relmse']['median']:.2e} | "
            f"{ratio(r['speed'])} | {ratio(r['efficiency'])} |"
        )
    for family in dict.fromkeys(r["family"] for r in rows):
        counted = [r for r in rows if r["family"] == family and r["counts"] and r["efficiency"]]
        if counted:
            mean = lambda key: math.exp(statistics.fmean(math.log(r[key]["median"]) for r in counted))
            print(f"| geometric mean | | {family} | | | | | **{mean('speed'):.2f}** | **{mean('efficiency'):.2f}** |")
    for r in rows:
        if not r["counts"]:
            print(f"\nNot counted: {short(r['scene'])}, {r['samples']} samples, {r['peer']}: {r['why_not']}.")
    unknown = dict.fromkeys(short(r["scene"]) for r in rows if r["reference_own_error"] is None)
    if unknown:
        print(f"\nHow good the reference is, is not known (no NAME_var.exr beside it): {', '.join(unknown)}.")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words = lambda text: text.split(",")
    numbers = lambda text: [int(word) for word in text.split(",")]
    parser.add_argument("scenes", nargs="+", metavar="SCENE")
    parser.add_argument("--reference", action="append", default=[], help="one for each scene, in their order")
    parser.add_argument("--reference-spp", type=int, default=4096, help="samples of references that are not given (default 4096)")
    parser.add_argument("--spp", type=numbers, default=[64], help="samples per pixel, separated by commas (default 64)")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("-D", dest="define", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--snell", default=shutil.which("snell") or "target/release/snell")
    parser.add_argument("--accel", type=words, default=["auto"], help="accelerators of snell, the best of which counts")
    parser.add_argument("--snell-args", type=shlex.split, default=[], help="more options of `snell render`")
    parser.add_argument("--mitsuba", default=os.environ.get("MITSUBA"), help="its native program (default: found)")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="of Mitsuba")
    parser.add_argument("--samplers", type=words, default=["independent", "multijitter"], help="of Mitsuba, the best of which counts")
    parser.add_argument("--json", help="write all figures, of every run, there")
    options = parser.parse_args()
    if options.reference and len(options.reference) != len(options.scenes):
        parser.error(f"--reference: expected one for each scene, {len(options.scenes)}; there are {len(options.reference)}")
    if options.seeds < 1:
        parser.error("--seeds: expected at least 1")
    for path in options.scenes + options.reference:
        if not os.path.isfile(path):
            parser.error(f"{path}: there is no such file")
    return options


def main():
    options = arguments()
    for scene in options.scenes:
        check_parameters(scene)
    snells, peers = contenders(options)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for i, scene in enumerate(options.scenes):
            try:
                if options.reference:
                    reference = options.reference[i]
                    own = own_error(options, scene, reference, folder)
                else:
                    reference, own = make_reference(options, snells[0], scene, folder)
                rows += measure(options, scene, reference, own, snells, peers, folder)
            except (OSError, RuntimeError) as error:
                print(f"{scene} is left out: {error}", file=sys.stderr)
    if not rows:
        fail("nothing could be measured")
    if options.json:
        with open(options.json, "w") as file:
            json.dump({"cores": os.cpu_count(), "seeds": options.seeds, "rows": rows}, file, indent=1)
    print_table(rows)
    return 0 if all(r["counts"] for r in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
