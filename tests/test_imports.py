"""Imports: the contracts in `pyproject.toml` hold (layers, secrecy, no cycles), and what they cannot say.

The contracts of import-linter say who may import whom within the package. Here are rules about libraries, about names
in the code, and about where an import may stand.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

import vigil

ROOT = Path(vigil.__file__).parent
PROJECT = Path(__file__).parents[1]

PURE = ("base", "protocol", "packs", "records", "scoring")
"""Facts and verdicts: no simulator, no clock, no network."""
FRAME_FACTS = {"FRAME_WIDTH", "FRAME_HEIGHT", "Quality"}
"""All that simulators may know of what an agent sees."""
A_SIMULATOR, AN_ENGINE = {"load", "reset", "step", "world"}, {"load", "update", "cast", "draw"}
"""Methods by which a class that is a simulator, or an engine of one, is known."""
ONLY_IN = {
    "inspect_ai": "runner",
    "mujoco": "sim.engines.mujoco",
    "embreex": "sim.engines.mujoco",
    "moderngl": "rendering.context",
    "ai2thor": "sim.thor thor.install",
    "msgpack": "thor.wire.fifo",
    "prior": "authoring.drafting.procthor",
    "gymnasium": "integrations.gymnasium",
    "verifiers": "integrations.verifiers",
    "ray": "runner",
}
"""Library -> the modules and packages that may import it."""
LAZY = {
    "mujoco",
    "ai2thor",
    "msgpack",
    "prior",
    "ray",
    "OpenGL",
    "inspect_ai",
    "av",
    "scipy",
    "matplotlib",
    "pandas",
    "vigil.agents.registry",
    "vigil.runner.models.inspect_model",
    "vigil.analysis.measures.chores",
    "vigil.runner.inspect_task",
    "vigil.runner.ray_cluster",
    "vigil.analysis.measures.closure",
    "vigil.assets.making",
    "vigil.authoring.solving.solvers",
    "vigil.housegen.base.spec",
    "vigil.housegen.generate",
    "vigil.integrations.gymnasium",
    "vigil.sim.core.embedded",
    "vigil.sim.engines.mujoco.engine",
    "vigil.sim.engines.fake",
    "vigil.sim.thor.start",
}
"""Heavy or optional libraries that may be imported inside a function, and the modules made of such a library.

SciPy's are heavy (0.3 s), and the start of a simulator needs none of them: what does loads them at its first use.
"""
MOST_MODULES = 20
"""In one folder, without its `__init__.py`."""
NONDETERMINISTIC = {"random", "time", "secrets", "socket", "urllib", "requests", "httpx"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}


def part_of(module: str) -> str:
    """Return the module or package directly under `vigil`; an empty string for `vigil` itself."""
    return module.split(".")[1] if "." in module else ""


@cache
def tree_of(module: str) -> ast.Module:
    return ast.parse(MODULES[module].read_text(encoding="utf-8"))


def imported(node: ast.AST) -> Iterator[str]:
    """Yield the full names in an import statement; a `from` import also gives the module, unless all are modules."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    if isinstance(node, ast.ImportFrom):
        assert node.level == 0, f"relative import in line {node.lineno}"
        names = [f"{node.module}.{alias.name}" for alias in node.names]
        yield from names
        if not all(name in MODULES for name in names):
            yield node.module or ""


@cache
def imports_of(module: str) -> tuple[str, ...]:
    """Return all names that a module imports, at the top or inside functions."""
    return tuple(name for node in ast.walk(tree_of(module)) for name in imported(node))


@cache
def own_imports_of(module: str) -> frozenset[str]:
    """Return the modules of the package that a module imports by name."""
    return frozenset(name for name in imports_of(module) if name in MODULES and name != module and name != "vigil")


def libraries_of(module: str) -> set[str]:
    return {name.split(".")[0] for name in imports_of(module)}


def test_the_contracts_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(PROJECT)
    assert lint_imports(no_cache=True) == 0


def test_a_broken_contract_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the layers upside down, and with agents forbidden what they import."""
    monkeypatch.chdir(PROJECT)
    contracts = tmp_path / "contracts.toml"
    head = '[tool.importlinter]\nroot_packages = ["vigil"]\n[[tool.importlinter.contracts]]\nname = "wrong"\n'
    for broken in (
        'type = "layers"\ncontainers = ["vigil"]\nlayers = ["base", "protocol"]',
        'type = "forbidden"\nsource_modules = ["vigil.agents"]\nforbidden_modules = ["vigil.protocol.actions"]',
    ):
        contracts.write_text(head + broken, encoding="utf-8")
        assert lint_imports(config_filename=str(contracts), no_cache=True) == 1


def concrete_classes() -> set[str]:
    """Return the full names of all classes in `vigil.sim` that are simulators or engines, except protocols."""
    return {
        f"{module}.{node.name}"
        for module in MODULES
        if part_of(module) == "sim"
        for node in ast.walk(tree_of(module))
        if isinstance(node, ast.ClassDef) and "Protocol" not in {ast.unparse(base) for base in node.bases}
        if any(
            kind <= {each.name for each in node.body if isinstance(each, ast.FunctionDef)}
            for kind in (A_SIMULATOR, AN_ENGINE)
        )
    }


def test_simulators_are_known_by_their_protocols_outside_of_sim():
    """Only the registry makes them, so that another backend serves solvers, workers, pages and commands as well."""
    found = concrete_classes()
    assert {name.rpartition(".")[2] for name in found} >= {"EmbeddedSimulator", "FakeEngine", "MujocoEngine"}
    homes = {name.rpartition(".")[0] for name in found}
    for module in MODULES:
        if part_of(module) != "sim":
            assert not set(imports_of(module)) & (found | homes), f"{module} imports a simulator's class"
            texts = {node.value for node in ast.walk(tree_of(module)) if isinstance(node, ast.Constant)}
            assert not {name.rpartition(".")[2] for name in found} & texts, f"{module} names a simulator's class"


def test_simulators_know_nothing_of_an_observation_but_the_size_of_its_frame():
    for module in MODULES:
        if part_of(module) in {"sim", "thor"}:
            names = {
                name.rpartition(".")[2] for name in imports_of(module) if name.startswith("vigil.protocol.observation.")
            }
            assert names <= FRAME_FACTS, f"{module} imports {names}"


def test_no_folder_holds_more_modules_than_one_can_take_in():
    sizes = Counter(path.parent for path in MODULES.values() if path.name != "__init__.py")
    crowded = {str(folder): size for folder, size in sizes.items() if size > MOST_MODULES and folder != ROOT}
    assert not crowded, crowded


def test_a_public_class_name_means_one_thing():
    """Across all modules, so that a name in a message or a docstring can be looked up."""
    places: dict[str, list[str]] = {}
    for module in MODULES:
        for node in tree_of(module).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(module)
    assert len(places) > 400
    assert not {name: modules for name, modules in places.items() if len(modules) > 1}


@pytest.mark.parametrize(
    "module", [name for name in MODULES if not name.startswith(("vigil.authoring.families.", "vigil.cli."))]
)
def test_imports_stand_at_the_top(module: str):
    """Families are imported with the protocol, so what drafts them may be imported inside their functions.

    A verb imports inside its function what it works with, so that its help loads little (`tests/cli/test_start.py`).
    """
    for function in ast.walk(tree_of(module)):
        if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        for node in ast.walk(function):
            for name in imported(node):
                is_lazy = bool({name, name.rpartition(".")[0], name.split(".")[0]} & LAZY)
                assert is_lazy, f"{module} line {function.lineno} imports {name} inside a function"


@pytest.mark.parametrize("library", ONLY_IN)
def test_some_libraries_stay_in_one_place(library: str):
    homes = [f"vigil.{home}" for home in ONLY_IN[library].split()]
    for module in MODULES:
        if library in libraries_of(module):
            is_home = any(module == home or module.startswith(f"{home}.") for home in homes)
            is_front = part_of(module) in {"api", "cli", "integrations", "web"}
            assert is_home or is_front, f"{module} imports {library}, which belongs in {homes}"


def test_pages_start_no_process_of_their_own():
    """Simulators in processes are `vigil.runner.workers` alone; the page of who plays cannot ask for drawings."""
    for module in MODULES:
        if part_of(module) == "web":
            found = {"subprocess", "multiprocessing", "concurrent"} & libraries_of(module)
            assert not found, f"{module} imports {found}"


IS_NOT_PURE = "vigil.base.processes"
"""Worker processes: they need sockets, and limits of time."""


@pytest.mark.parametrize(
    "module", [module for module in MODULES if part_of(module) in PURE and not module.startswith(IS_NOT_PURE)]
)
def test_the_pure_parts_use_no_clock_network_or_global_randomness(module: str):
    assert not libraries_of(module) & NONDETERMINISTIC
    text = MODULES[module].read_text(encoding="utf-8")
    assert ".now(" not in text
    assert ".utcnow(" not in text


def test_no_global_random_state_anywhere():
    """`numpy.random` is for `Generator` and `default_rng`; the module `random` for instances of `Random`."""
    fine = {"default_rng", "Generator", "PCG64", "SeedSequence", "Random", "BitGenerator"}
    for module in MODULES:
        for node in ast.walk(tree_of(module)):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("np.random", "numpy.random", "random"):
                assert node.attr in fine, f"{module} line {node.lineno}: {ast.unparse(node)}"
