"""A program in a sandbox: what it sees and what it does not; and a clear refusal where there is none."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from vigil.agents import sandbox
from vigil.agents.exec_agent import ExecAgent, ProgramSettings
from vigil.agents.sandbox import check_sandbox, missing_for_sandbox
from vigil.errors import SettingError
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.runner.plan import plan_run
from vigil.runner.settings import RunSettings

LOOKER = """
import json, os, pathlib, sys
seen = {}
for name, path in json.loads(pathlib.Path(sys.argv[1]).read_text()).items():
    try:
        seen[name] = sorted(os.listdir(path)) if os.path.isdir(path) else open(path).read()[:20]
    except OSError as error:
        seen[name] = type(error).__name__
pathlib.Path("note").write_text("its own folder")
try:
    pathlib.Path(sys.argv[1]).write_text("changed")
    seen["write"] = "written"
except OSError as error:
    seen["write"] = type(error).__name__
seen["processes"] = sum(name.isdigit() for name in os.listdir("/proc"))
for line in sys.stdin:
    if json.loads(line)["type"] == "observation":
        print(json.dumps({"text": json.dumps(seen)}), flush=True)
"""


@pytest.mark.skipif(bool(missing_for_sandbox()), reason=f"no sandbox here: {missing_for_sandbox()}")
def test_a_program_sees_what_its_command_names_and_nothing_else(tmp_path: Path) -> None:
    mine, pack, run, home = (tmp_path / name for name in ("mine", "mine/pack", "run", "home"))
    for folder in (mine, pack, run, home):
        folder.mkdir()
        (folder / "secret.json").write_text("the answer")
    script, places = mine / "looker.py", mine / "places.json"
    script.write_text(LOOKER)
    seen_by_name = {"mine": mine, "pack": pack, "run": run, "home": home, "user": Path.home(), "packs": sandbox.PACKS}
    places.write_text(json.dumps({name: str(path) for name, path in seen_by_name.items()}))
    settings = ProgramSettings(frame_interval_seconds=0.0, hidden=(pack, run))
    agent = ExecAgent(f"{sys.executable} {script} {places} --also={mine}", Profile(), settings)
    try:
        agent.start("Find the mug.")
        reply = agent.act(Observation(lambda: np.zeros((480, 640, 3), np.uint8)))
    finally:
        agent.close()
    assert not reply.agent_ended, reply.agent_ended
    seen = json.loads(reply.text)
    assert "looker.py" in seen["mine"]
    assert seen["pack"] == []
    assert {seen["run"], seen["home"]} == {"FileNotFoundError"}
    interpreter = Path(sys.executable).resolve().parts[len(Path.home().parts) :][:1]
    assert seen["user"] in ("FileNotFoundError", [], [*interpreter])  # an interpreter in the home folder is seen
    assert seen["packs"] in ("FileNotFoundError", [])
    assert seen["write"] in ("OSError", "PermissionError")
    assert seen["processes"] <= 3


def test_the_header_says_that_a_program_ran_in_a_sandbox(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("vigil.runner.plan.check_sandbox", lambda: None)
    plan = plan_run(RunSettings(agent="exec:/bin/cat", sandbox=True, log_dir=tmp_path / "run"))
    assert json.loads(plan.spec.model_dump_json())["sandbox"] is True
    assert plan.worker.hidden is not None
    assert {plan.pack.folder, tmp_path / "run"} <= set(plan.worker.hidden)
    bare = plan_run(RunSettings(agent="exec:/bin/cat"))
    assert (bare.worker.hidden, "sandbox" in json.loads(bare.spec.model_dump_json())) == (None, False)


def test_where_there_is_no_sandbox_it_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    missing_for_sandbox.cache_clear()
    try:
        with pytest.raises(SettingError, match="--sandbox: bubblewrap is not installed"):
            check_sandbox()
        (tmp_path / "bwrap").write_text("#!/bin/sh\necho no namespaces >&2; exit 1\n")
        (tmp_path / "bwrap").chmod(0o700)
        (tmp_path / "true").symlink_to("/bin/true")
        missing_for_sandbox.cache_clear()
        with pytest.raises(SettingError, match="bubblewrap does not run here: no namespaces"):
            plan_run(RunSettings(agent="exec:/bin/cat", sandbox=True))
    finally:
        missing_for_sandbox.cache_clear()
    with pytest.raises(SettingError, match="--sandbox is for a program"):
        plan_run(RunSettings(agent="noop", sandbox=True))
