"""Order of tests for several processes: slow modules first, so that none is left at the end.

pytest-xdist gives each process an equal part of the list; a process that is done takes tests from the end of another's.
"""

from collections.abc import Sequence
from pathlib import Path

import pytest

LONG = {
    "docs/test_pages_run.py": 100,
    "authoring/closure/test_closure_packs.py": 60,
    "runner/test_ray.py": 50,
    "runner/test_model_run.py": 40,
    "packs/test_starter_runs.py": 35,
    "cli/test_private_packs.py": 30,
    "sim/conformance/test_conformance.py": 30,
    "test_examples.py": 25,
    "analysis/test_report.py": 20,
    "integrations/test_gymnasium_vector.py": 20,
    "release/test_distributions.py": 20,
    "authoring/chores/test_compose.py": 15,
    "authoring/chores/test_lists.py": 15,
    "authoring/demonstrations/test_demonstrations.py": 15,
    "authoring/demonstrations/test_lerobot.py": 15,
    "authoring/drafting/test_proposals.py": 15,
    "authoring/review/test_negative_controls.py": 15,
    "release/test_published_plays.py": 15,
    "runner/test_reasoning_forms.py": 15,
    "runner/test_replies_whole_path.py": 15,
    "sim/engines/mujoco/test_gl.py": 15,
    "thor/test_finding.py": 15,
    "tools/test_blind_round.py": 15,
}
"""Module -> approximate processor time (s); more for Ray, whose tests wait."""
TESTS = Path(__file__).parents[1]


def long_first(items: Sequence[pytest.Item], processes: int) -> list[pytest.Item]:
    """Return the tests in an order with some of the slow modules at the start of each process's part."""
    modules: dict[str, list[pytest.Item]] = {}
    for item in items:
        modules.setdefault(item.path.relative_to(TESTS).as_posix(), []).append(item)
    parts: list[list[pytest.Item]] = [[] for _ in range(processes)]
    seconds = [0] * processes
    for name in sorted(LONG.keys() & modules.keys(), key=lambda name: (-LONG[name], name)):
        part = seconds.index(min(seconds))
        parts[part] += modules.pop(name)
        seconds[part] += LONG[name]
    rest = [item for members in modules.values() for item in members]
    sizes = [len(items) * (part + 1) // processes - len(items) * part // processes for part in range(processes)]
    ordered: list[pytest.Item] = []
    for part, size in zip(parts, sizes, strict=True):
        wanted = max(size - len(part), 0)
        ordered += [*part, *rest[:wanted]]
        del rest[:wanted]
    return [*ordered, *rest]
