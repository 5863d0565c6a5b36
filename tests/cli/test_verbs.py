"""Verbs are listed without loading what they call."""

import inspect
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import is_dataclass, replace
from importlib import import_module

import pytest
from typer.testing import CliRunner

from vigil.base.settings import DeclaredSetting, declared_setting, declared_settings
from vigil.cli import app
from vigil.cli.verbs import VERBS, Group, Verb, load

HEAVY = ("numpy", "mujoco", "matplotlib", "pandas", "inspect_ai", "fastapi")
GROUPS = {name: each.verbs for name, each in VERBS.items() if isinstance(each, Group)}
SHOWN = ("houses", "pack", "study", "leaderboard")
ALL = {
    **{name: verb for name, verb in VERBS.items() if isinstance(verb, Verb)},
    **{f"{group} {name}": verb for group in SHOWN for name, verb in GROUPS[group].items()},
}


@pytest.mark.parametrize("name", ALL)
def test_the_help_of_a_verb_begins_with_its_line_in_the_list_and_gives_an_example(name: str) -> None:
    first, *rest = load(ALL[name]).help.split("\n")
    assert first == ALL[name].help
    assert ALL[name].is_hidden or f"vigil {name} " in "\n".join(rest) + " "


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["rnu"], [], ["pack", "--help"], ["pack"], ["pack", "verfy"], ["houses", "--help"]],
    ids=lambda arguments: "_".join(arguments) or "nothing",
)
def test_the_list_comes_before_anything_heavy_is_loaded(arguments: list[str]) -> None:
    program = "import sys, vigil.cli\ntry: vigil.cli.main()\nfinally: print('loaded:', *sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=False)
    loaded = done.stderr.rpartition("loaded:")[2].split()
    assert "vigil.cli" in loaded
    assert not set(HEAVY) & set(loaded)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [(["rnu"], "run"), (["pakc"], "pack"), (["pack", "verfy"], "verify"), (["houses", "chekc"], "check")],
)
def test_a_mistyped_verb_is_answered_with_the_nearest(wrong: list[str], right: str) -> None:
    done = CliRunner().invoke(app, wrong)
    assert done.exit_code == 2
    assert f"Did you mean '{right}'?" in done.output


def test_a_mistyped_option_is_answered_with_the_nearest() -> None:
    done = CliRunner().invoke(app, ["run", "--agnet", "solver"])
    assert done.exit_code == 2
    assert "--agent" in done.output


def test_the_number_of_workers_is_one_option_everywhere() -> None:
    facts = ("opts", "default", "help", "metavar", "show_default", "envvar", "required")
    options = {
        name: {fact: getattr(option, fact) for fact in facts}
        for name, verb in ALL.items()
        for option in load(verb).params
        if "worker" in (option.name or "")
    }
    assert {"run", "verify", "pack verify", "pack make", "houses sweep"} <= set(options)
    first = options["run"]
    assert (first["opts"], first["default"]) == (["--workers"], None)
    assert [name for name, option in options.items() if option != first] == []


def test_the_other_name_of_verify_is_not_listed() -> None:
    listed = CliRunner().invoke(app, ["pack", "--help"]).output
    assert "verify" in listed
    assert "validate " not in listed
    assert GROUPS["pack"]["validate"].place == GROUPS["pack"]["verify"].place


def settings_of(verb: Verb) -> Iterator[DeclaredSetting]:
    module, _, function = verb.place.partition(":")
    made = getattr(import_module(f"vigil.cli.{module}"), function)
    for name, one in inspect.signature(made, eval_str=True).parameters.items():
        if isinstance(one.annotation, type) and is_dataclass(one.annotation):
            yield from declared_settings(one.annotation)
        elif (found := declared_setting(name, one.annotation, one.default)) is not None:
            yield found


def test_a_setting_of_several_verbs_has_one_default() -> None:
    defaults = defaultdict(set)
    for verb in ALL.values():
        for one in settings_of(verb):
            defaults[replace(one.setting, read=None), one.kind].add(repr(one.default))
    assert len(defaults) > len(ALL)
    assert {setting.help: found for (setting, _), found in defaults.items() if len(found) > 1} == {}
