#!/usr/bin/env python3
"""Draws the plots of a convergence study for a paper: python3 docs/plots.py out/results.csv [FOLDER]

Writes SCENE-samples.pdf and SCENE-time.pdf, and the same as .pgf for LaTeX, into FOLDER ("." unless
given): root mean squared error over samples and over processor seconds of one trial, a line for each
estimator and sampler. Needs matplotlib, and LaTeX for .pgf; nothing else of linelit needs them.
"""

import csv
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("pdf")
import matplotlib.pyplot as plt

MARKS = "osD^v*PXhp"


def curves(path):
    """The points (samples, seconds, RMSE) by scene, and by estimator and sampler."""
    scenes = defaultdict(lambda: defaultdict(list))
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            mse = float(row["mse"])
            if mse > 0:
                name = f"{row['estimator']} ({row['sampler']})"
                point = (float(row["samples"]), float(row["cpu_seconds"]), mse**0.5)
                scenes[row["scene"]][name].append(point)
    return scenes


def draw(lines, column, label, stem):
    """One plot with logarithmic axes, as PDF and PGF."""
    figure, axes = plt.subplots(figsize=(3.4, 2.6))
    for index, (name, points) in enumerate(lines.items()):
        points.sort(key=lambda point: point[column])
        x = [point[column] for point in points]
        mark = MARKS[index % len(MARKS)]
        axes.loglog(x, [point[2] for point in points], marker=mark, ms=3, lw=0.8, label=name)
    axes.set(xlabel=label, ylabel="RMSE")
    axes.legend(fontsize=4, ncols=2)
    figure.tight_layout()
    figure.savefig(stem.with_suffix(".pdf"))
    try:
        figure.savefig(stem.with_suffix(".pgf"))
    except RuntimeError:
        print(f"{stem}.pgf: no LaTeX, which measures its text", file=sys.stderr)
    plt.close(figure)


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder = Path(sys.argv[2] if len(sys.argv) == 3 else ".")
    for scene, lines in curves(sys.argv[1]).items():
        draw(lines, 0, "samples", folder / f"{scene}-samples")
        draw(lines, 1, "processor seconds", folder / f"{scene}-time")


if __name__ == "__main__":
    main()
