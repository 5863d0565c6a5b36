"""Who may import whom: the layers of the package, and that nothing hidden can reach an agent.

A rule names what a part of the package may import from the package itself, indirect imports included where a rule is
about secrecy. Parts are the modules and packages directly under `vigil`.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import vigil

ROOT = Path(vigil.__file__).parent

BASE = [
    *("errors", "imports", "setting", "files", "strict_json", "jsonl", "versions", "pack_names", "pose"),
    *("house_forms", "house", "world", "observation", "json_text", "glossary", "private", "markup"),
    *("reasoning", "endings", "actions", "costs", "replies", "kept_reply", "prompt_file", "profile"),
]
"""Lowest layer: each may import those before it."""
PURE = [
    "goals",
    "record",
    "goal_check",
    "episode",
    "strata",
    "even_draw",
    "pack_files",
    "levels",
    "pack",
    "freezing",
    "shards",
    "row_check",
    "record_file",
    "kept_reasoning",
    "scoring",
    "closure",
    "rates",
    "summary",
    "saved_run",
]
"""Facts and verdicts: each may import those before it and the base. No simulator, no clock, no network."""
PHYSICS = {"errors", "files", "strict_json", "pose", "house_forms", "house", "world", "actions"}
"""What a simulator or a generator of houses may know: where to stand and what to do, never what is wanted."""

ALLOWED: dict[str, set[str]] = {
    **{name: set(BASE[:index]) for index, name in enumerate(BASE)},
    "prompt": set(BASE),
    **{name: {*BASE, *PURE[:index]} for index, name in enumerate(PURE)},
    "row_check": {*BASE, "record", "goals", "episode", "pack", "shards", "prompt"},
    "record_file": {*BASE, "record", "row_check"},
    "assets": PHYSICS,
    "scene": PHYSICS - {"actions"} | {"assets"},
    "sim": PHYSICS | {"assets", "scene", "observation"},
    "processes": {"errors", "imports"},
    "housegen": PHYSICS | {"assets", "scene", "processes"},
    "thor": PHYSICS | {"assets", "scene", "sim", "observation"},
    "agents": {"errors", "observation", "actions", "reasoning", "replies", "profile", "prompt"},
    "env": {*BASE, *PURE, "prompt", "sim"},
    "analysis": {*BASE, *PURE, "prompt", "processes"},
    "authoring": {*BASE, *PURE, "prompt", "assets", "scene", "sim", "housegen", "env", "agents", "processes"},
    "runner": {*BASE, *PURE, "prompt", "assets", "sim", "env", "agents"},
    "exports": {*BASE, *PURE, "prompt", "analysis", "runner"},
}
TOPMOST = {"cli", "web", "integrations", "api"}
"""May import anything; nobody imports them, but `vigil` itself its public names."""
HIDDEN = {
    "world",
    "goals",
    "goal_check",
    "episode",
    "scoring",
    "closure",
    "rates",
    "summary",
    "saved_run",
    "record",
    "row_check",
    "record_file",
    "kept_reasoning",
    "even_draw",
    "pack_files",
    "pack",
    "freezing",
    "shards",
    "env",
    "scene",
    "sim",
    "thor",
    "authoring",
    "runner",
}
"""What holds or tells hidden state. Agents must not reach it, not even through what they import."""
FRAME_FACTS = {"FRAME_WIDTH", "FRAME_HEIGHT", "Quality"}
"""All that simulators may know of what an agent sees."""
SIMULATOR_SEAM = {"vigil.sim.protocol"}
"""All of the simulators that `env` may import: nothing privileged."""
A_SIMULATOR, AN_ENGINE = {"load", "reset", "step", "world"}, {"load", "update", "cast", "draw"}
"""Methods by which a class that is a simulator, or an engine of one, is known."""
ONLY_IN = {
    "inspect_ai": "runner",
    "mujoco": "sim.engines.mujoco",
    "ai2thor": "sim.thor",
    "msgpack": "thor.wire.fifo",
    "prior": "authoring.drafting.procthor",
    "gymnasium": "integrations.gymnasium",
    "verifiers": "integrations.verifiers",
    "ray": "runner",
}
"""Libraries that stay in one place."""
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
    "vigil.runner.models.inspect_model",
    "vigil.runner.inspect_task",
    "vigil.runner.ray_cluster",
    "vigil.analysis.measures.closure",
    "vigil.sim.engines.mujoco.engine",
    "vigil.sim.engines.fake",
    "vigil.sim.thor.start",
}
"""Heavy or optional libraries that may be imported inside a function, and the modules made of such a library.

SciPy's are heavy (0.3 s), and the start of a simulator needs none of them: what does loads them at its first use.
"""
MOST_MODULES = 16
"""In one folder, without its `__init__.py`."""
NONDETERMINISTIC = {"random", "time", "secrets", "socket", "urllib", "requests", "httpx"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}


def part_of(module: str) -> str:
    """Returns the module or package directly under `vigil`; an empty string for `vigil` itself."""
    return module.split(".")[1] if "." in module else ""


@cache
def tree_of(module: str) -> ast.Module:
    return ast.parse(MODULES[module].read_text(encoding="utf-8"))


def imported(node: ast.AST) -> Iterator[str]:
    """Yields the full names in an import statement; of a `from` import also the module, unless all are modules."""
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
    """Returns all names that a module imports, wherever in it."""
    return tuple(name for node in ast.walk(tree_of(module)) for name in imported(node))


@cache
def own_imports_of(module: str) -> frozenset[str]:
    """Returns the modules of the package that a module imports by name."""
    return frozenset(name for name in imports_of(module) if name in MODULES and name != module and name != "vigil")


def libraries_of(module: str) -> set[str]:
    return {name.split(".")[0] for name in imports_of(module)}


@pytest.mark.parametrize("module", MODULES)
def test_each_part_imports_only_what_its_layer_allows(module: str):
    part = part_of(module)
    if part in TOPMOST or not part:
        return
    assert part in ALLOWED, f"{module}: a new part of the package; say in ALLOWED what it may import"
    for name in own_imports_of(module):
        other = part_of(name)
        assert other == part or other in ALLOWED[part], f"{module} imports {name}; {part} may import {ALLOWED[part]}"


def test_nobody_imports_the_topmost_parts():
    for module in MODULES:
        for name in own_imports_of(module):
            is_public_face = (module, name) == ("vigil", "vigil.api")
            assert is_public_face or part_of(name) not in TOPMOST or part_of(module) in TOPMOST, (
                f"{module} imports {name}"
            )


def test_env_knows_simulators_by_their_protocol_alone():
    found = {name for name in own_imports_of("vigil.env") if part_of(name) == "sim"}
    assert found <= SIMULATOR_SEAM, found


def concrete_classes() -> set[str]:
    """Returns the full names of all classes in `vigil.sim` that are a simulator or an engine, but for protocols."""
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
            names = {name.rpartition(".")[2] for name in imports_of(module) if name.startswith("vigil.observation.")}
            assert names <= FRAME_FACTS, f"{module} imports {names}"


def test_whoever_plays_an_episode_knows_nothing_of_its_twin():
    """Answers of the closure-stress suite are read by what makes and judges packs, not by what shows or plays them."""
    for module in MODULES:
        if part_of(module) in {"env", "runner", "agents", "web", "integrations", "prompt", "exports"}:
            assert "vigil.closure" not in own_imports_of(module), f"{module} imports the answers of the suite"


def test_no_agent_can_reach_hidden_state_even_indirectly():
    agents = [module for module in MODULES if part_of(module) == "agents"]
    assert agents
    seen: set[str] = set()
    stack = list(agents)
    while stack:
        module = stack.pop()
        assert part_of(module) not in HIDDEN, f"agents reach {module}"
        if module not in seen:
            seen.add(module)
            stack.extend(sorted(own_imports_of(module)))


def test_there_are_no_import_cycles():
    done: set[str] = set()

    def visit(module: str, path: list[str]) -> None:
        assert module not in path, " -> ".join([*path[path.index(module) :], module])
        if module in done:
            return
        for name in sorted(own_imports_of(module)):
            visit(name, [*path, module])
        done.add(module)

    for module in MODULES:
        visit(module, [])


@cache
def packages() -> dict[str, set[str]]:
    """Returns each package below `vigil` that holds modules, with the packages that they import."""
    found: dict[str, set[str]] = {}
    for module in MODULES:
        if part_of(module):
            found.setdefault(package_of(module), set()).update(
                package_of(name) for name in own_imports_of(module) if not is_facade(name)
            )
    return {name: others - {name} for name, others in found.items()}


def is_facade(module: str) -> bool:
    """Says whether a module is the `__init__.py` of a package: it offers what its sub-packages hold."""
    return MODULES[module].name == "__init__.py"


def package_of(module: str) -> str:
    """Returns the package that a module stands in; a module directly under `vigil` stands for itself."""
    inner = module if module.count(".") == 1 else module.rpartition(".")[0]
    return f"{module}.__init__" if is_facade(module) else inner


def test_there_are_no_cycles_between_packages():
    """Packages can be ordered so that each imports only those before it."""
    left = packages()
    while left:
        free = {name for name, others in left.items() if not others & set(left)}
        assert free, f"among these packages imports go round: {sorted(left)}"
        left = {name: others for name, others in left.items() if name not in free}


def test_no_folder_holds_more_modules_than_one_can_take_in():
    sizes = Counter(path.parent for path in MODULES.values() if path.name != "__init__.py")
    crowded = {str(folder): size for folder, size in sizes.items() if size > MOST_MODULES and folder != ROOT}
    assert not crowded, crowded


@pytest.mark.parametrize("module", MODULES)
def test_imports_stand_at_the_top(module: str):
    for function in ast.walk(tree_of(module)):
        if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        for node in ast.walk(function):
            for name in imported(node):
                is_lazy = bool({name, name.rpartition(".")[0], name.split(".")[0]} & LAZY)
                assert is_lazy, f"{module} line {function.lineno} imports {name} inside a function"


@pytest.mark.parametrize("library", ONLY_IN)
def test_some_libraries_stay_in_one_place(library: str):
    home = f"vigil.{ONLY_IN[library]}"
    for module in MODULES:
        if library in libraries_of(module):
            is_home = module == home or module.startswith(f"{home}.")
            assert is_home or part_of(module) in TOPMOST, f"{module} imports {library}, which belongs in {home}"


def test_pages_start_no_process_of_their_own():
    """Simulators in processes are `vigil.runner.workers` alone; the page of who plays cannot ask for drawings."""
    for module in MODULES:
        if part_of(module) == "web":
            found = {"subprocess", "multiprocessing", "concurrent"} & libraries_of(module)
            assert not found, f"{module} imports {found}"
    for module in ("vigil.web.play", "vigil.web.play_session"):
        assert "vigil.web.drawing" not in own_imports_of(module), module


@pytest.mark.parametrize("part", [*BASE, "prompt", *PURE])
def test_the_pure_parts_use_no_clock_network_or_global_randomness(part: str):
    assert not libraries_of(f"vigil.{part}") & NONDETERMINISTIC
    text = MODULES[f"vigil.{part}"].read_text(encoding="utf-8")
    assert ".now(" not in text
    assert ".utcnow(" not in text


def test_no_global_random_state_anywhere():
    """`numpy.random` is for `Generator` and `default_rng`; the module `random` for instances of `Random`."""
    fine = {"default_rng", "Generator", "PCG64", "SeedSequence", "Random", "BitGenerator"}
    for module in MODULES:
        for node in ast.walk(tree_of(module)):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("np.random", "numpy.random", "random"):
                assert node.attr in fine, f"{module} line {node.lineno}: {ast.unparse(node)}"


def test_the_rules_would_notice():
    """The checker itself sees a forbidden import of each form."""
    for line in ("import vigil.world", "from vigil import world", "from vigil.world import Effect"):
        names = {name for node in ast.walk(ast.parse(line)) for name in imported(node)}
        assert names & set(MODULES) == {"vigil.world"}
