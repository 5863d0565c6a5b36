"""Holds generated one-room houses against real ones: writes docs/house_statistics.md and its figures.

Example: python scripts/house_statistics.py --real one_room_train.jsonl.gz --asset-database asset-database.json
Only distributions are drawn; no house of others is kept.
"""

import argparse
import gzip
import json
from collections import Counter
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from vigil.assets.sizes import AssetDatabase
from vigil.house import House
from vigil.housegen import GENERATOR_VERSION, generate, spec_for
from vigil.housegen.statistics import MEASURES, Comparison, RoomMeasures, compare, measure

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "houses"
LEAST_SHARE = 0.01
"""Kinds of things that fewer real houses have are not counted."""
SUPPORTS = (
    "CounterTop", "DiningTable", "SideTable", "Desk", "Dresser", "TVStand", "ShelvingUnit", "Sofa", "Bed", "ArmChair",
    "Fridge",
)  # fmt: skip
REAL_RGB, OWN_RGB = "#444444", "#d1672a"


def main() -> None:
    """Measures both, draws the figures and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--real", type=Path, required=True, help="Real one-room houses, one a line (.jsonl.gz).")
    parser.add_argument("--asset-database", type=Path, required=True, help="AI2-THOR's asset-database.json.")
    parser.add_argument("--seeds", type=int, default=500, help="How many generated houses.")
    options = parser.parse_args()
    thor = AssetDatabase.load(options.asset_database)
    with gzip.open(options.real, "rt") as lines:
        houses = [House(f"real_{number}", json.loads(line)) for number, line in enumerate(lines)]
    common = _common(houses, thor)
    real = [room for house in houses for room in measure(house, thor, common)]
    spec, sizes = spec_for("1"), AssetDatabase.default()
    own = [room for seed in range(options.seeds) for room in measure(generate(seed, spec), sizes, common)]
    rooms = compare(real, own, ())
    supports = [*compare(real, own, SUPPORTS)[len(rooms) :], _on_all_countertops(real, own)]
    FOLDER.mkdir(parents=True, exist_ok=True)
    _draw(rooms, FOLDER / "statistics_rooms.png", columns=len(MEASURES))
    _draw(supports, FOLDER / "statistics_supports.png", columns=4)
    _write([*rooms, *supports], _states(real, own), {"real": len(houses), "own": options.seeds, "kinds": len(common)})


def _common(houses: list[House], thor: AssetDatabase) -> set[str]:
    """Returns the kinds of things that more than a few of the real houses have."""
    counts: Counter[str] = Counter()
    for house in houses:
        counts.update({thor.look_up(node.asset_id, node.id).category for node, _ in house.objects()})
    return {category for category, count in counts.items() if count >= LEAST_SHARE * len(houses)}


def _on_all_countertops(real: list[RoomMeasures], own: list[RoomMeasures]) -> Comparison:
    """Returns how much is on all countertops of a kitchen together."""
    sides = [
        [
            sum(count for name, count in room.on_support if name == "CounterTop")
            for room in side
            if room.kind == "Kitchen"
        ]
        for side in (real, own)
    ]
    return Comparison("things on: all countertops of a kitchen", *(np.array(side, dtype=float) for side in sides))


def _draw(compared: list[Comparison], path: Path, columns: int) -> None:
    rows = -(-len(compared) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(2.9 * columns, 2.3 * rows), squeeze=False)
    for axis, comparison in zip(axes.ravel(), compared, strict=False):
        _draw_one(axis, comparison)
    for axis in axes.ravel()[len(compared) :]:
        axis.axis("off")
    axes.ravel()[0].legend(frameon=False, fontsize=8, loc="lower right")
    figure.supylabel("share of rooms or things with at most so many", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _draw_one(axis: Axes, comparison: Comparison) -> None:
    """Draws both cumulative distributions, with the medians."""
    for values, colour, name in ((comparison.real, REAL_RGB, "real"), (comparison.own, OWN_RGB, "generated")):
        ordered = np.sort(values)
        shares = np.arange(1, len(ordered) + 1) / len(ordered)
        axis.step(
            np.concatenate(([ordered[0]], ordered)), np.concatenate(([0.0], shares)),
            where="post", color=colour, label=name, linewidth=1.4,
        )  # fmt: skip
        axis.axvline(float(np.median(values)), color=colour, linewidth=0.8, linestyle=":")
    axis.set_title(f"{comparison.name}\nKS {comparison.ks:.2f}", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.set_ylim(0, 1.02)


def _states(real: list[RoomMeasures], own: list[RoomMeasures]) -> list[tuple[str, float, float]]:
    """Returns the shares of what is on and dirty, of the things that say so in both."""
    found: list[tuple[str, float, float]] = []
    for name, category, read in (
        ("floor lamps that are on", "FloorLamp", lambda room: room.is_on),
        ("beds that are unmade", "Bed", lambda room: room.is_dirty),
    ):
        sides = [[state for room in side for kind, state in read(room) if kind == category] for side in (real, own)]
        found.append((name, float(np.mean(sides[0])), float(np.mean(sides[1]))))
    return found


def _write(compared: list[Comparison], states: list[tuple[str, float, float]], counts: dict[str, int]) -> None:
    lines = [
        "# Generated houses and real ones, in numbers",
        "",
        f"{counts['own']} generated one-room houses (generator version {GENERATOR_VERSION}) against {counts['real']}",
        "one-room houses of ProcTHOR: cumulative distributions, dotted lines at the medians. Counted are the",
        f"{counts['kinds']} kinds of things that at least {LEAST_SHARE:.0%} of the real houses have; the share of",
        "floor covered counts all furniture. The aim: medians within 25 % and a KS distance under 0.25.",
        "Written by `scripts/house_statistics.py`.",
        "",
        "![Rooms: area, objects, types, floor covered, small things](houses/statistics_rooms.png)",
        "",
        "![Small things on and in each kind of furniture](houses/statistics_supports.png)",
        "",
        "| what | real median | generated median | ratio | KS | within the aim |",
        "|---|---|---|---|---|---|",
    ]
    for each in compared:
        real, own = float(np.median(each.real)), float(np.median(each.own))
        close = "yes" if each.is_close else "no"
        lines.append(f"| {each.name} | {real:.3g} | {own:.3g} | {each.median_ratio:.2f} | {each.ks:.2f} | {close} |")
    lines += ["", "| states | real | generated |", "|---|---|---|"]
    lines += [f"| {name} | {real:.0%} | {own:.0%} |" for name, real, own in states]
    lines += ["", REASONS]
    (DOCS / "house_statistics.md").write_text("\n".join(lines))


REASONS = """## Where they differ, and why

- **Countertops.** A real one-room kitchen has one large countertop; a generated one has a run of two to four, with the
  stove between them; the row "on all countertops" compares what lies on them together.
- **Living rooms: types of objects.** A generated house has most small things once, so that an instruction names one
  thing: the same number of things is of more types.
- **Desks, dressers, TV stands.** Real houses repeat small things on them (three pencils, two mugs), generated ones
  do not, for the same reason. A room holds as many small things as a real one, spread over more furniture.
- **Beds.** Counts of 1 to 3: a difference of one thing is already more than 25 % of the median;
  the distributions are near each other.
- **Other states.** The real one-room houses state nothing else. Generated ones also say what stands open (boxes,
  laptops, curtains, lids) and what else is on, because episodes ask for it.
- **Other kinds.** Generated houses also have what ProcTHOR's one-room houses lack: stoves, sinks, wall cabinets, light
  switches, ceiling lamps, rugs, curtains. Bathrooms are not compared: there are no real one-room ones.
"""


if __name__ == "__main__":
    main()
