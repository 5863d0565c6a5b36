"""Fingerprints of shapes and of the grammar, which `tests/base/test_versions.py` compares with the package.

After an intended change, write them again: `python -m tests.support.fingerprints`. Check the diff, and
raise `SHAPES_VERSION` or `GRAMMAR_VERSION` (see `vigil.base.versions`): the files contain the version. A new category
is not a change of shapes: write the files again to pin it, under the same version.
"""

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Asset, Joint, Part, Solid, Surface
from vigil.assets.making import MAKERS, make
from vigil.base.versions import GRAMMAR_VERSION, SHAPES_VERSION
from vigil.protocol.actions import Coordinates, Reply, ReplyPolicy
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply

GOLDEN = Path(__file__).parents[1] / "golden"
SHAPES, REPLIES = GOLDEN / "shapes.json", GOLDEN / "replies.json"
VARIANTS = (0, 1, 2, 3)
TOLERANCE = 1e-3
"""Tolerance of a sum of coordinates (m); the arithmetic of other machines differs by far less."""
Numbers = dict[str, list[float]]


def shapes() -> dict[str, Numbers]:
    """Return the fingerprint of every category: numbers for each kind of part of its shape."""
    return {name: _category(name) for name in sorted({*MAKERS, *CATALOG})}


def _category(name: str) -> Numbers:
    size = CATALOG[name].typical_size if name in CATALOG else CATALOG["Box"].typical_size
    middle = round(size.y / 2, 3)
    assets = [make(name, size, variant) for variant in VARIANTS]
    assets += [make(name, size, 0, (middle,)), make(name, size._replace(x=size.x * 1.7, z=size.z * 1.3), 1)]
    return {
        "parts": _summed(_part(part) for asset in assets for part in asset.parts),
        "solids": _summed(_solid(solid) for asset in assets for solid in asset.solids),
        "surfaces": _summed(_surface(surface) for asset in assets for surface in asset.surfaces),
        "joints": _summed(_joint(joint) for asset in assets for joint in asset.joints),
        "boxes": _summed(_boxes(asset) for asset in assets),
    }


def _summed(rows: Iterable[list[float]]) -> list[float]:
    """Return the number of rows and their sums; each row is weighted by its index, so that swapped rows are noticed."""
    found = [np.array([1.0, *row]) * (1.0, *[1.0 + 0.01 * place] * len(row)) for place, row in enumerate(rows)]
    return [round(float(value), 4) for value in np.sum(found, axis=0)] if found else []


def _part(part: Part) -> list[float]:
    vertices = part.mesh.vertices.astype(float)
    corners = [*vertices.min(axis=0), *vertices.max(axis=0)] if len(vertices) else [0.0] * 6
    kind = ("always", "on", "off").index(part.shown)
    flags = [part.joint is not None, part.bears_open, part.bears_toggle, part.is_glass, kind]
    return [len(vertices), len(part.mesh.faces), *vertices.sum(axis=0), *corners, *map(float, flags)]


def _solid(solid: Solid) -> list[float]:
    x, z = zip(*solid.polygon, strict=True)
    return [len(x), sum(x), sum(z), max(x) - min(x), max(z) - min(z), solid.bottom, solid.top, solid.joint is not None]


def _surface(surface: Surface) -> list[float]:
    flags = [surface.is_inside, surface.joint is not None]
    return [*surface.center, surface.size_x, surface.size_z, surface.clearance, *map(float, flags)]


def _joint(joint: Joint) -> list[float]:
    return [joint.kind == "hinge", *joint.axis, *joint.origin, joint.travel]


def _boxes(asset: Asset) -> list[float]:
    low, high = asset.body or (asset.size, asset.size)
    return [*asset.size, *low, *high]


def shape_differences(pinned: dict[str, Numbers], found: dict[str, Numbers]) -> list[str]:
    """Return the parts of pinned shapes that differ or are missing, e.g. `Fridge: surfaces`; new categories are not."""
    return [
        f"{name}: {kind}"
        for name in sorted(pinned)
        for kind in sorted({*pinned[name], *found.get(name, {})})
        if not _alike(pinned[name].get(kind), found.get(name, {}).get(kind))
    ]


def _alike(before: list[float] | None, now: list[float] | None) -> bool:
    if before is None or now is None or len(before) != len(now):
        return False
    return all(math.isclose(a, b, rel_tol=1e-6, abs_tol=TOLERANCE) for a, b in zip(before, now, strict=True))


WALK = '{"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 2}}'
LOOK = '{"skill_name": "look", "arguments": {"direction": "down", "magnitude": 30.5}}'
PICK = '{"skill_name": "interact_pixel", "arguments": {"intent": "pick", "x": 639, "y": 0}}'
DROP = '{"skill_name": "interact_pixel", "arguments": {"intent": "drop", "x": 5}}'
DONE = '{"skill_name": "report", "arguments": {"status": "success", "summary": "done"}}'


def _argued(text: str, old: str, *new: str) -> list[str]:
    return [text.replace(old, each) for each in new]


def _nested(depth: int) -> str:
    return WALK[:-1] + ', "thought": ' + "[" * depth + "]" * depth + "}"


TEXTS = [
    WALK, LOOK, PICK, DROP, DONE, f"\n\t {WALK} \r\n", WALK.replace("navigate", "NAVIGATE "),
    *_argued(WALK, "2", "2.0", "2.5", "0", "-1", "NaN", "Infinity", "1e999", "9" * 400, '"2"', "true", "null", "1e6"),
    *_argued(WALK, "forward", "Forward\\n", "backward", "turn_left", "turn_right", "ahead"),
    *_argued(PICK, '"pick"', '"grab"', '"put_in"', '"toggle_on"', '"CLICK "', '"release"', '"eat"', "7"),
    *_argued(PICK, "639", "0", "639.0", "639.5", "640", "-1", "true", '"5"', "null"),
    *_argued(PICK, ', "y": 0', "", ', "y": 479', ', "y": 480', ', "y": 0, "z": 1'),
    *_argued(DONE, "success", " Closed ", "on", "great", "", "FAIL", "unsafe", "invalid", "off", "open"),
    *_argued(DONE, ', "summary": "done"', "", ', "summary": ""', ', "summary": 3', ', "summary": null'),
    *_argued(WALK, "}}", "}", '}, "thought": "t", "cognitive_state": {"a": [1]}, "extra": 1}', "}} Done.", "}}}"),
    WALK[:-1] + ', "thought": "\\ud800"}', WALK[:-1] + ', "arguments": {}}',
    WALK[:-1] + ', "thought": {"a": 1, "a": 2}}',
    "", "   ", "null", "7", f"[{WALK}]", "I will walk.", f"Sure: {WALK}", f"{WALK}\n{WALK}", f"```json\n{WALK}\n```",
    f"```\n{WALK}\n```\n```\n{LOOK}\n```", WALK.replace('"', "'"), '{"skill_name": "look"}', '{"arguments": {}}',
    '{"skill_name": "look", "arguments": []}', '{"skill_name": ["look"], "arguments": {}}', "\ufeff" + WALK,
    f"<think>{{I wonder}}</think>\n{WALK}", f"  <think></think>{WALK}", f"<think>and so on {WALK}",
    f"{WALK}<think>b</think>", f"Hm. </think>{WALK}", f"<think>a</think><think>b</think>{WALK}",
    f"◁think▷a◁/think▷{WALK}", f"Hm. <think>a</think>{WALK}",
    f"<think>{WALK}</think>", f"<think>{WALK}</think>{LOOK}", WALK[:20] + "<think>a</think>" + WALK[20:],
    WALK.replace("2}", '2, "note": "</think>"}'), f"<THINK>a</THINK>{WALK}", f'<think id="1">a</think>{WALK}',
    f"\ud800</think>{WALK}", f"\ud800{WALK}",
    *map(_nested, (10, 61, 62, 63, 64, 200)),
]  # fmt: skip
VARIANTS_OF_READING: tuple[dict[str, Any], ...] = (
    {}, {"policy": "lenient"}, {"coordinates": "normalized_1000"}, {"finish_reason": "length"},
)  # fmt: skip


def replies() -> list[dict[str, Any]]:
    """Return the table of reply texts and their parses."""
    return [{"text": text, **how, "is": read(text, how)} for text in TEXTS for how in VARIANTS_OF_READING]


def read(text: str, how: dict[str, Any]) -> dict[str, Any]:
    """Return the parse of a text: the action, or the kind of fault without its wording."""
    reply = Reply(text=text, finish_reason=how.get("finish_reason"))
    coordinates = cast(Coordinates, how.get("coordinates", "pixel"))
    parsed = read_reply(
        reply, Profile(coordinates=coordinates, reply_policy=cast(ReplyPolicy, how.get("policy", "strict")))
    ).parsed
    return parsed.model_dump(mode="json", exclude={"thought", "cognitive_state", "detail"})


def main() -> None:
    """Write both files."""
    lines = [f'  "{name}": {json.dumps(numbers)}' for name, numbers in shapes().items()]
    SHAPES.write_text(f'{{"shapes_version": {SHAPES_VERSION}, "shapes": {{\n' + ",\n".join(lines) + "\n}}\n")
    table = [f"  {json.dumps(row)}" for row in replies()]
    REPLIES.write_text(f'{{"grammar_version": {GRAMMAR_VERSION}, "replies": [\n' + ",\n".join(table) + "\n]}\n")


if __name__ == "__main__":
    main()
