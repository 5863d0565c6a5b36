"""Files beside the code that name versions, interpreters or commands agree with pyproject.toml and the Makefile."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from vigil import __version__

ROOT = Path(__file__).parents[2]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = SETTINGS["project"]
PYTHONS = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", line)]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
PINNED = re.compile(r"[\w-]+/[\w-]+@[0-9a-f]{40}")


def read(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def steps_of(workflow: Path) -> list[dict[str, Any]]:
    return [step for job in read(workflow)["jobs"].values() for step in job["steps"]]


def test_the_version_is_the_same_everywhere() -> None:
    assert read(ROOT / "CITATION.cff")["version"] == __version__
    newest = re.search(r"(?s)^## \[Unreleased\]\n(.*?)(?=^## \[|\Z)(?:## \[(.+?)\])?", CHANGES, re.MULTILINE)
    assert newest is not None
    assert newest[2] == __version__ or f"This will be {__version__}" in newest[1]


def test_the_interpreters_are_the_same_everywhere() -> None:
    assert PROJECT["requires-python"] == f">={PYTHONS[0]}"
    assert f"(3, {PYTHONS[0].split('.')[1]}) <= sys.version_info[:2] <= (3, {PYTHONS[-1].split('.')[1]})" in MAKEFILE
    assert f"RELEASE_PYTHONS ?= {' '.join(f'python{each}' for each in PYTHONS)}\n" in MAKEFILE
    jobs = read(ROOT / ".github" / "workflows" / "tests.yml")["jobs"]
    assert jobs["linux"]["strategy"]["matrix"]["python"] == PYTHONS
    assert jobs["release-check"]["strategy"]["matrix"]["python"] == PYTHONS


def test_make_mutants_tries_the_modules_that_have_tests_for_it() -> None:
    modules = re.search(r"^MODULE \?= (.+)$", MAKEFILE, re.MULTILINE)
    assert modules is not None
    assert sorted(modules[1].split()) == sorted(SETTINGS["tool"]["mutants"])
    for module, tests in SETTINGS["tool"]["mutants"].items():
        assert (ROOT / "src" / "vigil" / f"{module.replace('.', '/')}.py").is_file(), module
        assert all((ROOT / test).is_file() for test in tests), module


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_may_do_nothing_it_does_not_name(workflow: Path) -> None:
    """No permission but those that a job lists, actions of others by their hash, and no command that make lacks."""
    assert read(workflow)["permissions"] == {}
    for step in steps_of(workflow):
        assert "uses" not in step or PINNED.fullmatch(step["uses"]), step
        for target in re.findall(r"\bmake ([a-z-]+)", step.get("run", "")):
            assert target in TARGETS, target


def test_only_the_release_may_upload_and_by_trusted_publishing() -> None:
    allowed = {
        (path.stem, name): set(job["permissions"]) - {"contents"}
        for path in WORKFLOWS
        for name, job in read(path)["jobs"].items()
    }
    assert {place for place, more in allowed.items() if more} == {("release", "publish")}
    assert allowed["release", "publish"] == {"id-token"}
    assert all("secrets." not in path.read_text(encoding="utf-8") for path in WORKFLOWS)


def test_what_has_not_run_yet_cannot_fail_the_others() -> None:
    assert read(ROOT / ".github" / "workflows" / "tests.yml")["jobs"]["macos"]["continue-on-error"] is True


def test_the_hooks_need_no_network() -> None:
    repositories = read(ROOT / ".pre-commit-config.yaml")["repos"]
    assert [one["repo"] for one in repositories] == ["local"]
    assert {hook["language"] for hook in repositories[0]["hooks"]} <= {"system", "pygrep", "fail"}


def names_of(requirements: list[str]) -> set[str]:
    """The packages that are required, in the form in which names are compared."""
    return {re.sub(r"[-_.]+", "-", re.split(r"[^\w.-]", line)[0]).lower() for line in requirements}


def test_every_extra_is_pinned_and_stays_so() -> None:
    """`make lock` writes what is installed: it must install every extra but verifiers, which has pins of its own."""
    found = re.search(r"^LOCKED := (.+)$", MAKEFILE, re.MULTILINE)
    assert found is not None
    assert "'.[$(LOCKED)]'" in MAKEFILE.partition("\nlock: setup-dev\n")[2].partition("\n\n")[0]
    extras = {extra: names_of(lines) for extra, lines in PROJECT["optional-dependencies"].items()}
    installed = set().union(*(extras[extra] for extra in ("dev", *found[1].split(","))))
    assert {extra for extra, names in extras.items() if not names <= installed} == {"verifiers"}
    pins = names_of((ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines())
    assert names_of(PROJECT["dependencies"]) | installed <= pins


def packages_in(text: str) -> list[str]:
    found = re.search(r"--no-install-recommends \\\n +(.+?)( \\)?\n", text)
    assert found is not None
    return found[1].split()


def test_both_images_install_the_same() -> None:
    docker, apptainer = ((ROOT / name).read_text(encoding="utf-8") for name in ("Dockerfile", "vigil.def"))
    assert packages_in(docker) == packages_in(apptainer)
    assert {"chromium", "libatomic1"} <= set(packages_in(docker))  # Playwright's driver of Chromium needs libatomic
    for text in (docker, apptainer):
        assert re.search(r"(?i)^from:? debian:12-slim$", text, re.MULTILINE)
        assert "make setup-dev" in text
        assert "make test" in text or 'CMD ["make", "test"]' in text
