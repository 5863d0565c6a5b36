"""Agents by the names that `--agent` accepts: the name of a scripted agent, or `exec:COMMAND`."""

from vigil.agents.agent import Agent
from vigil.agents.exec_agent import EXEC_PREFIX, ExecAgent, ProgramSettings
from vigil.agents.scripted import SCRIPTS, scripted_agent
from vigil.errors import SettingError
from vigil.protocol.profile import Profile


def is_exec(name: str) -> bool:
    """Return whether `name` is `exec:COMMAND`."""
    return name.startswith(EXEC_PREFIX)


def is_known(name: str) -> bool:
    """Return whether `make_agent` accepts the name."""
    return is_exec(name) or name in SCRIPTS


def make_agent(name: str, profile: Profile, seed: int = 0, program: ProgramSettings | None = None) -> Agent:
    """Return the agent of that name. Raises SettingError on an unknown name.

    `seed` applies to scripted agents, and `program` to programs of `exec:COMMAND`.
    """
    if is_exec(name):
        return ExecAgent(name.removeprefix(EXEC_PREFIX), profile, program or ProgramSettings())
    if name in SCRIPTS:
        return scripted_agent(name, seed)
    known = ", ".join(SCRIPTS)
    raise SettingError(f"Agent {name!r} does not exist. Choose one of: {known}, or exec:COMMAND.")
