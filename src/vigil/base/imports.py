"""Imports of a user's modules, which register families, categories or drafts.

The modules are imported in this process and in every process that VIGIL starts. An environment variable has their
names; the started processes inherit the variable, and import the modules before anything else.
"""

import importlib
import os
import sys
from collections.abc import Iterable

from vigil.errors import SettingError

ENVIRONMENT_VARIABLE = "VIGIL_IMPORT"
"""Environment variable with the names of the modules, separated by commas."""


def import_modules(names: Iterable[str]) -> None:
    """Import modules, in this process and in every process that is started from now on. Raises SettingError.

    Modules are also searched for in the current folder, as `python -m` does.
    """
    if (here := os.getcwd()) not in sys.path and "" not in sys.path:
        sys.path.append(here)
    wanted = [*_modules_in_environment(), *names]
    for name in wanted:
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as error:
            raise SettingError(_not_found_message(name, error)) from None
    if wanted:
        os.environ[ENVIRONMENT_VARIABLE] = ",".join(dict.fromkeys(wanted))


def import_modules_from_environment() -> None:
    """Import the modules that the environment variable `VIGIL_IMPORT` names. Raises SettingError."""
    if _modules_in_environment():
        import_modules(())


def _modules_in_environment() -> list[str]:
    return [name.strip() for name in os.environ.get(ENVIRONMENT_VARIABLE, "").split(",") if name.strip()]


def _not_found_message(name: str, error: ModuleNotFoundError) -> str:
    if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
        hint = f" Give the module's name, without .py: {name.removesuffix('.py')}." if name.endswith(".py") else ""
        return (
            f"There is no module {name!r} to import: neither installed nor in {os.getcwd()!r}.{hint} It was named by "
            f"--import or {ENVIRONMENT_VARIABLE}."
        )
    return (
        f"Module {name!r}, which --import or {ENVIRONMENT_VARIABLE} names, needs {error.name!r}, which is not "
        "installed here."
    )
