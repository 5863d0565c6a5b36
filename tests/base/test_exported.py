"""Registries whose entries are modules: each exports one object, and what it lacks is said at import."""

from collections.abc import Callable
from pathlib import Path

import pytest

from vigil.base.exported import exported_by_modules, loaded

ENTRY = "from types import SimpleNamespace\nENTRY = SimpleNamespace(position={position}, words={words!r})\n"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    def make(name: str, **modules: str) -> str:
        monkeypatch.syspath_prepend(tmp_path)
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("")
        for module, text in modules.items():
            (tmp_path / name / f"{module}.py").write_text(text)
        return name

    return make


def test_objects_come_in_the_order_of_their_positions(package: Callable[..., str]) -> None:
    entries = {name: ENTRY.format(position=number, words=name) for number, name in ((2, "a"), (1, "b"))}
    found = exported_by_modules(package("ordered_entries", **entries), "ENTRY", ("words",))
    assert [entry.words for entry in found] == ["b", "a"]


def test_an_entry_that_is_left_out_is_named(package: Callable[..., str]) -> None:
    name = package("lacking_entries", a=ENTRY.format(position=1, words=""))
    with pytest.raises(TypeError, match=r"ENTRY of lacking_entries\.a lacks words"):
        exported_by_modules(name, "ENTRY", ("words",))


def test_a_module_that_exports_nothing_is_named(package: Callable[..., str]) -> None:
    with pytest.raises(AttributeError, match="ENTRY"):
        exported_by_modules(package("no_entries", a=""), "ENTRY", ())


def test_a_function_is_found_by_its_name_or_given() -> None:
    assert loaded("vigil.base.exported:loaded") is loaded
    assert loaded(loaded) is loaded
