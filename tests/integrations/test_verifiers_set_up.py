"""What needs no verifiers: the versions it is tested with, how it is found, and what is said where it is missing."""

import importlib
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def pins(name: str) -> dict[str, str]:
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    found = dict(line.split("==") for line in lines)
    return {name.lower().replace("_", "-"): version for name, version in found.items()}


def test_the_two_files_of_pins_differ_in_openai_alone() -> None:
    common, own = pins("constraints.txt"), pins("constraints-verifiers.txt")
    both = common.keys() & own.keys()
    assert len(both) > 80
    assert {name for name in both if common[name] != own[name]} == {"openai"}
    assert "verifiers" in own.keys() - common.keys()


def test_both_modules_of_the_package_are_in_the_wheel() -> None:
    """verifiers looks an environment up by the name of a module at the top."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    folders = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert sorted(folders) == sorted(
        str(path.parent.relative_to(ROOT)) for path in (ROOT / "src").glob("*/__init__.py")
    )


def test_without_the_extra_the_message_says_what_to_give(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith(("verifiers.", "vigil.integrations.verifiers"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "verifiers", None)
    with pytest.raises(ModuleNotFoundError, match=r"a separate environment, .* pip install 'vigil-bench\[verifiers\]'"):
        importlib.import_module("vigil.integrations.verifiers")
