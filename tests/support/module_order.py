"""Order of tests for several processes: slow modules first, so that none is left at the end.

pytest-xdist gives each process an equal part of the list; a process that is done takes tests from the end of another's.
"""

from collections.abc import Sequence
from pathlib import Path

import pytest

LONG = {
    "packs/test_starter_runs.py": 130,
    "runner/test_ray.py": 110,
    "runner/test_programs.py": 90,
    "docs/test_pages_run.py": 90,
    "runner/test_model_run.py": 70,
    "runner/models/test_providers.py": 60,
    "authoring/drafting/test_drafts.py": 60,
    "authoring/drafting/test_proposals.py": 60,
    "runner/test_replies_whole_path.py": 55,
    "analysis/tables/test_published.py": 50,
    "authoring/closure/test_closure_packs.py": 50,
    "test_examples.py": 50,
    "runner/test_reasoning_forms.py": 40,
    "authoring/drafting/test_harder_kinds.py": 40,
    "release/test_distributions.py": 25,
    "analysis/test_report.py": 25,
    "runner/test_merge.py": 25,
    "packs/test_packaged_packs.py": 20,
    "sweeps/test_flaky_server.py": 20,
    "cli/test_houses.py": 20,
}
"""Module -> approximate duration (s) on one of two cores."""
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
