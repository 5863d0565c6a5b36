"""Measures how well things stand out from what they lie on: the contrast across their edges in portraits.

    python -m benchmarks.contrast [--variants 4] [--seed 0] [--worst 25]

A portrait shows one thing where such things stand (`vigil.sim.pictures.object_renders`). For each pixel at the
thing's edge
the mean colour just inside is compared with that just outside, in CIELAB (76), in which 2 to 3 is a difference that
one just sees; a portrait's figure is the median over its edge, a category's the median over its portraits.
"""

import argparse

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.sim.engines.mujoco.engine import MujocoEngine
from vigil.sim.pictures.object_renders import view_of
from vigil.sim.pictures.staged_scenes import SUBJECT, SceneSubject, staged_scene

WINDOW = 5
"""Pixels along each side of the square over which colours are averaged."""
FAINT = 10.0
"""Under this a category is marked."""


def main() -> None:
    """Read the command line and print the table, the faintest first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--worst", type=int, default=25, help="How many rows are printed.")
    options = parser.parse_args()
    found = {
        name: [contrast(SceneSubject(name, variant), options.seed) for variant in range(options.variants)]
        for name in sorted(CATALOG)
    }
    ordered = sorted(found.items(), key=lambda pair: float(np.median(pair[1])))
    for name, values in ordered[: options.worst]:
        mark = "faint" if np.median(values) < FAINT else ""
        print(f"{name:24} {np.median(values):6.1f}  {' '.join(f'{value:5.1f}' for value in sorted(values))}  {mark}")
    medians = [float(np.median(values)) for values in found.values()]
    faint = sum(each < FAINT for each in medians)
    print(f"{len(found)} categories: median {np.median(medians):.1f}, {faint} under {FAINT:.0f}")


def contrast(subject: SceneSubject, seed: int) -> float:
    """Return the median difference of colour across the edge of a subject's portrait."""
    rng = np.random.default_rng([seed, subject.variant])
    scene = staged_scene(subject, rng)
    agent = view_of(scene.things[SUBJECT], float(rng.uniform(-25.0, 25.0))).agent
    engine = MujocoEngine()
    engine.load(scene)
    try:
        frame, geoms = engine.draw(agent, None), engine.camera.segment(agent)
        index = list(scene.things).index(SUBJECT)
        return across_edge(lab(frame), engine.model.geom_things[geoms] == index)
    finally:
        engine.close()


def across_edge(colours: np.ndarray, mask: np.ndarray) -> float:
    """Return the median difference (h, w, 3) of colour across the edge of a mask (h, w); nan without an edge."""
    inside, outside = mean_where(colours, mask), mean_where(colours, ~mask)
    padded = np.pad(mask, 1, mode="edge")
    is_edge = mask & ~(padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:])
    differences = np.linalg.norm(inside - outside, axis=2)[is_edge]
    return float(np.nanmedian(differences)) if len(differences) else float("nan")


def mean_where(colours: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the mean colour of the pixels of a mask in the window around each pixel; nan where there is none."""
    totals, counts = boxes(colours * mask[..., None]), boxes(mask[..., None].astype(float))
    with np.errstate(invalid="ignore", divide="ignore"):
        return totals / counts


def boxes(values: np.ndarray) -> np.ndarray:
    """Return the sum over the window around each pixel (h, w, k)."""
    half = WINDOW // 2
    padded = np.pad(values, ((half + 1, half), (half + 1, half), (0, 0)))
    sums = padded.cumsum(axis=0).cumsum(axis=1)
    return sums[WINDOW:, WINDOW:] - sums[:-WINDOW, WINDOW:] - sums[WINDOW:, :-WINDOW] + sums[:-WINDOW, :-WINDOW]


def lab(frame: np.ndarray) -> np.ndarray:
    """Return the CIELAB colours (h, w, 3) of sRGB bytes, under the white of D65."""
    share = frame / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    xyz = linear @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
    ratio = xyz / (0.9505, 1.0, 1.089)
    root = np.where(ratio > 0.008856, np.cbrt(ratio), 7.787 * ratio + 16 / 116)
    x, y, z = root[..., 0], root[..., 1], root[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


if __name__ == "__main__":
    main()
