"""Puts small faults into a module, one at a time, and lists those that the module's tests do not notice.

    python -m tools.mutants scoring.outcomes

The faults (mutants) are those of mutmut's operators. Its own runner leaves out what stands outside of functions, and
properties and validators, which is half of these modules; so the module is mutated as a whole here, in a forked process
that runs the tests named in `[tool.mutants]` of pyproject.toml. Nothing on disk is changed. Sentences (strings with a
space in them), annotations, imports and decorators are left as they are.

Results are kept in runs/mutants/MODULE.jsonl: the same command tries again what survived and goes on where it was
stopped; what was once killed stays killed while the module is unchanged. Exit code 1 when more than 5 % survive.
"""

# pyright: reportMissingImports=false
# The extra `mutants` is not part of the development environment.

import argparse
import contextlib
import gc
import hashlib
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import io
import json
import os
import resource
import signal
import sys
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import hypothesis
import libcst as cst
import pytest
from libcst.metadata import MetadataWrapper, PositionProvider
from mutmut.mutation.mutators import mutation_operators

ROOT = Path(__file__).resolve().parents[1]
PROJECT_FOLDERS = (f"{ROOT}/src/", f"{ROOT}/tests/")
"""Folder of the project's modules; an environment with libraries may be in the same folder."""
MIN_KILLED_SHARE = 0.95
EXAMPLES = 4
"""Examples of each property test: a mutant that only a rare example shows counts as not noticed."""
TIME_FACTOR, TIME_EXTRA_S = 4, 3
"""Limit on a mutant's processor time: a multiple of the sound module's time, and seconds in addition."""
CONTEXT_CHARS = 30
"""Number of characters shown on either side of a difference."""
MEMORY_BYTES = 4 << 30
OPTIONS = ["-x", "--noconftest", "-p", "no:xdist", "-p", "no:cacheprovider", "--no-header", "--tb=line"]
"""The suite's conftest loads half of the package, for fixtures that these tests do not ask for."""
OPAQUE = (cst.Annotation, cst.Decorator, cst.Import, cst.ImportFrom)
SENTENCES = (cst.FormattedString, cst.ConcatenatedString)


@dataclass(frozen=True)
class Mutant:
    """One fault: a node of the module's syntax tree and what stands in its place."""

    line: int
    old: cst.CSTNode
    new: cst.CSTNode

    def __str__(self) -> str:
        before, after = (" ".join(cst.Module([]).code_for_node(node).split()) for node in (self.old, self.new))
        start = max(0, _common(before, after) - CONTEXT_CHARS)
        end = max(0, _common(before[start:][::-1], after[start:][::-1]) - CONTEXT_CHARS)
        return f"line {self.line}: {before[start : len(before) - end]} -> {after[start : len(after) - end]}"


class Finder(cst.CSTVisitor):
    """Collects the mutants of a module."""

    METADATA_DEPENDENCIES = (PositionProvider,)

    def __init__(self) -> None:
        super().__init__()
        self.found: list[Mutant] = []

    def on_visit(self, node: cst.CSTNode) -> bool:
        """Ask every operator for its mutants of `node`."""
        if isinstance(node, (*OPAQUE, *SENTENCES)) or _is_sentence(node):
            return False
        position: Any = self.get_metadata(PositionProvider, node)
        for kind, operator in mutation_operators:
            if isinstance(node, kind):
                self.found += [Mutant(position.start.line, node, new) for new in _plain(operator(node))]
        return True


class MutantLoader(importlib.machinery.SourceFileLoader):
    """Gives a module other code than its file holds."""

    def __init__(self, name: str, path: str, source: str) -> None:
        super().__init__(name, path)
        self.source = source

    def get_code(self, fullname: str):
        """Compile the mutant, past any cache."""
        return compile(self.source, self.path, "exec")


class MutantFinder(importlib.abc.MetaPathFinder):
    """Finds the mutant in place of the module."""

    def __init__(self, name: str, path: Path, source: str) -> None:
        self.name, self.path, self.source = name, path, source

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None):
        """Return the mutant's spec for its own name alone."""
        if fullname != self.name:
            return None
        return importlib.util.spec_from_loader(fullname, MutantLoader(fullname, str(self.path), self.source))


def _common(one: str, other: str) -> int:
    """Return how many characters both begin with."""
    pairs = zip(one, other, strict=False)
    return next((index for index, (a, b) in enumerate(pairs) if a != b), min(len(one), len(other)))


def _is_sentence(node: cst.CSTNode) -> bool:
    return isinstance(node, cst.SimpleString) and " " in node.value


def _plain(nodes: Iterable[cst.CSTNode]) -> Iterator[cst.CSTNode]:
    """Leave out strings in other letter cases: `XX...XX` tells as much."""
    for index, node in enumerate(nodes):
        if index == 0 or not isinstance(node, cst.SimpleString):
            yield node


def run_mutant(name: str, path: Path, source: str, tests: Sequence[str], seconds: int) -> tuple[str, float]:
    """Run the tests on other code; return `killed`, `timeout` or `survived`, and the processor time that it took."""
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
        silence = os.open(os.environ.get("MUTANTS_OUTPUT", os.devnull), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        sys.meta_path.insert(0, MutantFinder(name, path, source))
        code = 1
        try:
            code = int(pytest.main([*OPTIONS, *tests]))
        finally:
            os._exit(code)
    _, status, usage = os.wait4(child, 0)
    took = usage.ru_utime + usage.ru_stime
    if os.WIFSIGNALED(status):
        return ("timeout" if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else "killed"), took
    return ("survived" if os.WEXITSTATUS(status) == 0 else "killed"), took


def read_log(log: Path, source: str) -> dict[int, str]:
    """Return what became of each mutant of this very source."""
    digest = hashlib.sha256(source.encode()).hexdigest()
    lines = log.read_text().splitlines() if log.exists() else []
    if not lines or json.loads(lines[0]) != digest:
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(json.dumps(digest) + "\n")
        return {}
    return {row["mutant"]: row["state"] for row in map(json.loads, lines[1:])}


def load_unchanged(name: str, tests: Sequence[str]) -> Path:
    """Load whatever a mutant cannot change: what its module imports, and all libraries; return the module's file."""
    path = importlib.import_module(name).__file__
    kept = set(sys.modules) - {name}
    with contextlib.redirect_stdout(io.StringIO()):
        pytest.main([*OPTIONS, "--collect-only", *tests])
    for loaded in set(sys.modules) - kept:
        file = getattr(sys.modules[loaded], "__file__", None) or ""
        if file.startswith(PROJECT_FOLDERS) or loaded == "tests" or loaded.startswith("tests."):
            del sys.modules[loaded]
    gc.freeze()
    return Path(path or "")


def main(module: str, every: int) -> int:
    """Try every n-th mutant of one module."""
    tests = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mutants"][module]
    os.chdir(ROOT)
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    sys.path.insert(0, str(ROOT / "src"))
    name = f"vigil.{module}"
    phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile(
        "mutants", max_examples=EXAMPLES, phases=phases, database=None, deadline=None, derandomize=True
    )
    hypothesis.settings.load_profile("mutants")
    path = load_unchanged(name, tests)
    source = path.read_text(encoding="utf-8")
    state, took = run_mutant(name, path, source, tests, 600)
    if state != "survived":
        sys.exit(f"The tests of {module} fail on the sound module: {' '.join(tests)}")
    limit = int(took * TIME_FACTOR) + TIME_EXTRA_S
    tree = MetadataWrapper(cst.parse_module(source))
    tree.visit(finder := Finder())
    log = ROOT / "runs" / "mutants" / f"{module}.jsonl"
    states = read_log(log, source)
    print(f"{module}: {len(finder.found)} mutants, the tests take {took:.1f} s, {len(states)} tried before", flush=True)
    for number, mutant in enumerate(finder.found):
        if number % every == 0 and states.get(number, "survived") == "survived":
            changed: Any = tree.module.deep_replace(mutant.old, mutant.new)
            states[number], _ = run_mutant(name, path, changed.code, tests, limit)
            with log.open("a") as file:
                file.write(json.dumps({"mutant": number, "state": states[number], "what": str(mutant)}) + "\n")
            if states[number] == "survived":
                print(f"  survived: {mutant}", flush=True)
    survived = sum(state == "survived" for state in states.values())
    print(f"{module}: {len(states) - survived} killed of {len(states)} that were tried")
    return int(survived > (1 - MIN_KILLED_SHARE) * len(states))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Tells which small faults in a module its tests do not notice.")
    parser.add_argument("module", help="a name in [tool.mutants] of pyproject.toml")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only every N-th mutant: a quick sample")
    given = parser.parse_args()
    sys.exit(main(given.module, given.every))
