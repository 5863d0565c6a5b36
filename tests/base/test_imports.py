"""Modules of users: imported here, named for the processes that VIGIL starts, and refused with a reason."""

import sys
from pathlib import Path

import pytest

from vigil.base.imports import ENVIRONMENT_VARIABLE, import_modules, import_modules_from_environment
from vigil.errors import SettingError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with no modules in the environment."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [place for place in sys.path if place])
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "")
    return tmp_path


def test_modules_of_the_current_folder_are_imported_and_named_for_other_processes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("vigil_user_one", "vigil_user_two"):
        (folder / f"{name}.py").write_text("")
        monkeypatch.delitem(sys.modules, name, raising=False)
    import_modules_from_environment()
    assert "vigil_user_one" not in sys.modules
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, " vigil_user_one ,")
    import_modules(["vigil_user_two", "vigil_user_one"])
    assert {"vigil_user_one", "vigil_user_two"} <= sys.modules.keys()
    monkeypatch.delitem(sys.modules, "vigil_user_two")
    import_modules_from_environment()
    assert "vigil_user_two" in sys.modules


def test_a_module_that_is_missing_is_named_with_what_to_do(folder: Path) -> None:
    with pytest.raises(SettingError, match=r"no module 'absent\.py'.*Give the module's name, without \.py: absent\."):
        import_modules(["absent.py"])
    (folder / "vigil_user_three.py").write_text("import absent_library")
    with pytest.raises(SettingError, match=r"'vigil_user_three', .* needs 'absent_library'"):
        import_modules(["vigil_user_three"])
