"""Holds generated one-room houses against real ones: writes docs/house_statistics.md and its figures.

Example: python -m tools.house_statistics --real one_room_train.jsonl.gz --asset-database asset-database.json
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

from tools.house_measures import MEASURES, DistributionComparison, RoomStatistics, compare, measure
from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import GENERATOR_VERSION, generate
from vigil.protocol.house import House

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "houses"
LEAST_SHARE = 0.01
"""Kinds of things that fewer real houses have are not counted."""
SUPPORTS = (
    "CounterTop", "DiningTable", "SideTable", "Desk", "Dresser", "TVStand", "ShelvingUnit", "Sofa", "Bed", "ArmChair",
    "Fridge",
)  # fmt: skip
LEAST_HELD = 0.5
"""Furniture with fewer small things a room, in real and generated houses, is not in the table."""
ALL, REPEATS = "all", "share that repeats another of the room"
REAL_RGB, OWN_RGB = "#444444", "#d1672a"


def main() -> None:
    """Measure both kinds of houses, draw the figures and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--real", type=Path, required=True, help="Real one-room houses, one a line (.jsonl.gz).")
    parser.add_argument("--asset-database", type=Path, required=True, help="AI2-THOR's asset-database.json.")
    parser.add_argument("--seeds", type=int, default=400, help="How many generated houses.")
    options = parser.parse_args()
    thor = AssetDatabase.load(options.asset_database)
    with gzip.open(options.real, "rt") as lines:
        houses = [House(f"real_{number}", json.loads(line)) for number, line in enumerate(lines)]
    common = _common_categories(houses, thor)
    real = [room for house in houses for room in measure(house, thor, common)]
    spec, sizes = spec_for("1"), AssetDatabase.default()
    generated = [generate(seed, spec) for seed in range(options.seeds)]
    own = [room for house in generated for room in measure(house, sizes, common)]
    rooms = compare(real, own, ())
    supports = [*compare(real, own, SUPPORTS)[len(rooms) :], _on_all_countertops(real, own)]
    FOLDER.mkdir(parents=True, exist_ok=True)
    _draw(rooms, FOLDER / "statistics_rooms.png", columns=len(MEASURES))
    _draw(supports, FOLDER / "statistics_supports.png", columns=4)
    counts = {"real": len(houses), "own": options.seeds, "kinds": len(common)}
    places = _place_rows(_small_object_counts(houses, thor, common), _small_object_counts(generated, sizes, common))
    _write([*rooms, *supports], _tables(_states(real, own), places), counts)


def _common_categories(houses: list[House], thor: AssetDatabase) -> set[str]:
    """Return the kinds of things that more than a few of the real houses have."""
    counts: Counter[str] = Counter()
    for house in houses:
        counts.update({thor.look_up(node.asset_id, node.name_in_house).category for node, _ in house.objects()})
    return {category for category, count in counts.items() if count >= LEAST_SHARE * len(houses)}


def _on_all_countertops(real: list[RoomStatistics], own: list[RoomStatistics]) -> DistributionComparison:
    """Return how much is on all countertops of a kitchen together."""
    sides = [
        [
            sum(count for name, count in room.on_support if name == "CounterTop")
            for room in side
            if room.kind == "Kitchen"
        ]
        for side in (real, own)
    ]
    return DistributionComparison(
        "things on: all countertops of a kitchen", *(np.array(side, dtype=float) for side in sides)
    )


def _draw(compared: list[DistributionComparison], path: Path, columns: int) -> None:
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


def _draw_one(axis: Axes, comparison: DistributionComparison) -> None:
    """Draw both cumulative distributions, with the medians."""
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


def _states(real: list[RoomStatistics], own: list[RoomStatistics]) -> list[tuple[str, float, float]]:
    """Return the shares of what is on and dirty, of the things that say so in both."""
    found: list[tuple[str, float, float]] = []
    for name, category, read in (
        ("floor lamps that are on", "FloorLamp", lambda room: room.is_on),
        ("beds that are unmade", "Bed", lambda room: room.is_dirty),
    ):
        sides = [[state for room in side for kind, state in read(room) if kind == category] for side in (real, own)]
        found.append((name, float(np.mean(sides[0])), float(np.mean(sides[1]))))
    return found


def _small_object_counts(houses: list[House], assets: AssetDatabase, common: set[str]) -> dict[str, dict[str, float]]:
    """Return, by kind of the one room, how many small things lie on and in what, and which share are repeats."""
    held: dict[str, Counter[str]] = {}
    rooms: Counter[str] = Counter()
    for house in houses:
        kind = house.document.rooms[0].room_type
        kinds = {node.id: assets.look_up(node.asset_id, node.name_in_house).category for node, _ in house.objects()}
        counted = held.setdefault(kind, Counter())
        loose = [
            (kinds[node.id], CATALOG[kinds[parent]].display_name if parent else "floor")
            for node, parent in house.objects()
            if kinds[node.id] in common and CATALOG[kinds[node.id]].is_pickupable
        ]
        rooms[kind] += 1
        counted.update(holder for _, holder in loose)
        counted[REPEATS] += len(loose) - len({category for category, _ in loose})
        counted[ALL] += len(loose)
    return {
        kind: {name: count / (counted[ALL] if name == REPEATS else rooms[kind]) for name, count in counted.items()}
        for kind, counted in held.items()
    }


def _place_rows(real: dict[str, dict[str, float]], own: dict[str, dict[str, float]]) -> list[tuple[str, float, float]]:
    """Return the rows of the table of small things: the places that matter in either, most of the real ones first."""
    rows: list[tuple[str, float, float]] = []
    for kind in sorted(real.keys() & own.keys()):
        names = {name for side in (real, own) for name, count in side[kind].items() if count >= LEAST_HELD} - {ALL}
        pairs = [(name, real[kind].get(name, 0.0), own[kind].get(name, 0.0)) for name in {*names, REPEATS}]
        pairs.sort(key=lambda row: (row[0] == REPEATS, -row[1], -row[2], row[0]))
        rows += [(f"{kind}: {name}", of_real, of_own) for name, of_real, of_own in pairs]
    return rows


def _tables(states: list[tuple[str, float, float]], places: list[tuple[str, float, float]]) -> list[str]:
    """Return the lines of the two smaller tables."""
    lines = ["| states | real | generated |", "|---|---|---|"]
    lines += [f"| {name} | {real:.0%} | {own:.0%} |" for name, real, own in states]
    lines += ["", "| small things on and in, mean of a room | real | generated |", "|---|---|---|"]
    for name, real, own in places:
        form = ".0%" if name.endswith(REPEATS) else ".1f"
        lines.append(f"| {name} | {real:{form}} | {own:{form}} |")
    return lines


def _write(compared: list[DistributionComparison], tables: list[str], counts: dict[str, int]) -> None:
    lines = [
        "# Generated houses and real ones, in numbers",
        "",
        f"This page compares {counts['own']} generated one-room houses (generator version {GENERATOR_VERSION}) with",
        f"{counts['real']} real ones, which are one-room houses of ProcTHOR. The figures show cumulative",
        "distributions, with dotted lines at the medians. `tools/house_statistics.py` writes this page.",
        "",
        f"Objects are counted if they are of one of the {counts['kinds']} kinds that at least {LEAST_SHARE:.0%} of the",
        "real houses have. The share of floor covered counts all furniture. The aim is that the medians differ by at",
        "most 25 %, and that the KS distance (largest difference of the cumulative distributions) is under 0.25.",
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
    lines += ["", *tables, "", REASONS]
    (DOCS / "house_statistics.md").write_text("\n".join(lines))


REASONS = """## Where they differ, and why

Generated houses are at least as full as real ones. Every kind of furniture carries about as many objects as in
real houses, and a room has more objects, of more types. So where a row misses the aim, the generated houses have more:

- **Objects, types and small things of rooms.** A generated room has furniture that real one-room houses seldom have:
  coffee tables, desks, two side tables at a bed, stoves, wall cabinets. Each piece carries as many objects as in real
  houses. Fewer objects of a generated room repeat another one (a second pencil, a second book), so that an
  instruction can name one object. For this reason the same number of objects has more types.
- **All countertops of a kitchen.** A real one-room kitchen has one large countertop. A generated kitchen has one or
  two; the second is mostly an island. Each holds about as much as a real countertop.

The page does not compare:

- **Other states.** The real one-room houses give only the states in the table. Generated houses also say what is open
  (boxes, books, laptops, curtains, drawers and doors of furniture), what else is on, and which dishes are dirty,
  because episodes need these states.
- **Other kinds of objects.** Generated houses also have objects that ProcTHOR's one-room houses lack: stoves, sinks,
  wall cabinets, shelves, mirrors, light switches, ceiling lamps, rugs, curtains.
- **Bathrooms.** There are no real one-room bathrooms.
"""


if __name__ == "__main__":
    main()
