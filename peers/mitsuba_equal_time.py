"""Processor time to a normalised mean squared error of 1e-4: Mitsuba 3 and linelit, in turns.

Two ways of Mitsuba's are measured. `direct` is its integrator of that name, which samples the
light and jitters camera rays in the pixel. `centre` traces one ray through the middle of each
pixel and then samples the light only: exactly the problem that linelit solves. Each is compared
with a reference of its own kind, the mean of many of its pictures with other seeds.

One thread. Mitsuba's scene is built and its kernels are compiled before the clock starts; the time
of linelit is that of its whole process, with reading, building and writing.
"""

import argparse
import math
import os
import resource
import subprocess
import time
from pathlib import Path

import drjit
import mitsuba
import numpy as np

mitsuba.set_variant("llvm_ad_rgb")

import scenes  # noqa: E402

TARGET = 1e-4
REFERENCE_PICTURES, REFERENCE_SAMPLES = 64, 256
# The samples a pixel that are tried, around the target.
MITSUBA = {"direct": (16, 64, 256), "centre": (16, 64, 256)}
LINELIT = {
    "line-analytic": (4, 16, 32),
    "hybrid": (4, 8, 16, 32),
    "point-area[visibility=shaft]": (16, 64, 256),
}


class Direct:
    """Mitsuba's direct integrator with one multijittered light sample for each camera ray."""

    def __init__(self, description):
        self.description = description
        self.integrator = mitsuba.load_dict({
            "type": "direct",
            "emitter_samples": 1,
            "bsdf_samples": 0,
            "hide_emitters": True,
        })

    def render(self, samples, seed):
        """The picture, and the seconds that it took."""
        sampler = {"type": "multijitter", "sample_count": samples}
        sensor = {**self.description["sensor"], "sampler": sampler}
        scene = mitsuba.load_dict({**self.description, "sensor": sensor})
        start = time.process_time()
        picture = mitsuba.render(scene, integrator=self.integrator, spp=samples, seed=seed)
        picture = np.array(picture, dtype=float)
        return picture, time.process_time() - start


class Centre:
    """Light samples at what is seen through the middle of each pixel.

    They are the R2 sequence, shifted by two random numbers for each pixel.
    """

    def __init__(self, description):
        self.scene = mitsuba.load_dict(description)

    def render(self, samples, seed):
        """The picture, and the seconds that it took."""
        start = time.process_time()
        size = scenes.RESOLUTION
        pixel = drjit.arange(mitsuba.UInt32, size * size)
        x, y = mitsuba.Float(pixel % size) + 0.5, mitsuba.Float(pixel // size) + 0.5
        on_film, middle = mitsuba.Point2f(x / size, y / size), mitsuba.Point2f(0.5)
        ray, _ = self.scene.sensors()[0].sample_ray(0, 0.5, on_film, middle)
        ray.wavelengths = []
        hit = self.scene.ray_intersect(ray, True)
        random = np.random.default_rng(seed)
        shift = mitsuba.Point2f(random.random(size * size), random.random(size * size))
        total = sum_of_samples(
            self.scene, hit, shift, hit.is_valid(), mitsuba.UInt32(0), mitsuba.UInt32(samples)
        )
        picture = np.array(total, dtype=float).T.reshape(size, size, 3) / samples
        return picture, time.process_time() - start


@drjit.syntax
def sum_of_samples(scene, hit, shift, active, i, count):
    total = mitsuba.Color3f(0.0)
    context = mitsuba.BSDFContext()
    while i < count:
        k = mitsuba.Float64(i)
        x, y = k * 0.7548776662466927, k * 0.5698402909980532
        point = shift + mitsuba.Point2f(mitsuba.Float(x - drjit.floor(x)),
                                        mitsuba.Float(y - drjit.floor(y)))
        point -= drjit.floor(point)
        light, weight = scene.sample_emitter_direction(hit, point, True, active)
        towards, seen = hit.to_local(light.d), active & (light.pdf > 0)
        total += hit.bsdf().eval(context, hit, towards, seen) * weight
        i += 1
    return total


class Linelit:
    """A whole run of the program `linelit render`."""

    def __init__(self, program, scene, estimator):
        self.picture = scene.with_suffix(".pfm")
        self.command = [
            program, "render", scene, "--estimator", estimator, "--sampler", "auto",
            "--threads", "1", "--hide-lights", "--output", self.picture,
        ]

    def render(self, samples, seed):
        """The picture, and the seconds that it took."""
        start = processor_time_of_children()
        command = [*self.command, "--samples", samples, "--seed", seed]
        subprocess.run(map(str, command), check=True, capture_output=True)
        return read_pfm(self.picture), processor_time_of_children() - start


def processor_time_of_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def read_pfm(path):
    """A picture with its first row at the top; PFM has it at the bottom."""
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        pixels = np.frombuffer(file.read(), order + "f4").astype(float)
    return pixels.reshape(height, width, 3)[::-1]


def reference(way, folder, label):
    """The mean of many pictures and its own normalised error, from the file if it is there."""
    path = folder / f"{label}-{REFERENCE_PICTURES}x{REFERENCE_SAMPLES}.npz"
    if not path.exists():
        seeds = range(1000, 1000 + REFERENCE_PICTURES)
        pictures = np.stack([way.render(REFERENCE_SAMPLES, seed)[0] for seed in seeds])
        mean = pictures.mean(0)
        error = pictures.var(0, ddof=1).mean() / len(pictures) / mean.mean() ** 2
        np.savez(path, mean=mean, error=error)
    stored = np.load(path)
    return stored["mean"], float(stored["error"])


def normalised_error(picture, expected):
    return ((picture - expected) ** 2).mean() / expected.mean() ** 2


def seconds_to_target(points):
    """The time at the target error, by a power law through the two points nearest to it.

    Points are (error, seconds), by rising samples. If the fewest samples are enough, it is their
    time: an upper bound. NaN if more samples do not lower the error.
    """
    if points[0][0] <= TARGET:
        return points[0][1]
    nearest = sorted(points, key=lambda point: abs(math.log(point[0] / TARGET)))[:2]
    (error0, seconds0), (error1, seconds1) = nearest
    run = math.log(error1 / error0)
    if abs(run) < 0.05:
        return math.nan
    slope = math.log(seconds1 / seconds0) / run
    return seconds0 * (TARGET / error0) ** slope


def measure(name, options):
    """Prints all points of a scene, and returns the seconds to the target of each way."""
    scene = scenes.SCENES[name]()
    text = scenes.write(scene, options.work)
    description = scenes.for_mitsuba(scene, options.work)
    ways = {"direct": Direct(description), "centre": Centre(description)}
    references = {}
    for label, way in ways.items():
        references[label], error = reference(way, text.parent, label)
        print(f"{name}: the reference of `{label}` has an error of {error:.1e}", flush=True)
    ways |= {label: Linelit(options.linelit, text, label) for label in LINELIT}
    drjit.set_thread_count(1)
    for label, counts in MITSUBA.items():
        for samples in counts:
            ways[label].render(samples, 0)  # Compiles the kernels.
    tries = [(label, n) for label, counts in (MITSUBA | LINELIT).items() for n in counts]
    results = {one: [] for one in tries}
    for seed in range(1, options.rounds + 1):
        for label, samples in tries:
            picture, seconds = ways[label].render(samples, seed)
            expected = references.get(label, references["centre"])
            results[label, samples].append((normalised_error(picture, expected), seconds))
    curves = {label: [] for label in ways}
    for (label, samples), rounds in results.items():
        errors, seconds = zip(*rounds)
        curves[label].append((np.mean(errors), np.median(seconds)))
        print(f"{label:30} {samples:4} samples: error {curves[label][-1][0]:.2e}, "
              f"{curves[label][-1][1]:.3f} s", flush=True)
    return [seconds_to_target(points) for points in curves.values()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("linelit", help="the program linelit")
    parser.add_argument("work", type=Path, help="a folder for scenes and references")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scenes", nargs="+", choices=scenes.SCENES, default=scenes.SCENES)
    options = parser.parse_args()
    rows = {name: measure(name, options) for name in options.scenes}
    print(f"\nLoad {os.getloadavg()[0]:.1f}; processor seconds to an error of {TARGET:g}:\n")
    labels = [f"Mitsuba `{label}`" for label in MITSUBA] + [f"`{label}`" for label in LINELIT]
    print(f"| scene | {' | '.join(labels)} |\n|{'---|' * (len(labels) + 1)}")
    for name, row in rows.items():
        print(f"| {name} | {' | '.join(f'{seconds:.2f}' for seconds in row)} |")


if __name__ == "__main__":
    main()
