"""The plan of the run that a server records."""

from dataclasses import fields, replace

from vigil.errors import SettingError
from vigil.integrations.serve.settings import ServeSettings
from vigil.runner.plan import RUNS_FOLDER, RunPlan, plan_run
from vigil.runner.settings import RunSettings
from vigil.runner.shared_settings import PackName


def plan_serving(pack: PackName, settings: ServeSettings) -> RunPlan:
    """Return the plan of the run that a server records. Raises InputError."""
    shared = {one.name for one in fields(settings)} & {one.name for one in fields(RunSettings)}
    plan = plan_run(RunSettings(pack=pack, agent="noop", **{name: getattr(settings, name) for name in shared}))
    if plan.spec.profile.row.declares_criteria:
        raise SettingError(
            f"Profile {settings.profile!r} asks a question before the first frame, which `vigil serve` cannot do. "
            "Choose another profile."
        )
    spec = plan.spec.model_copy(
        update={
            "agent": f"remote:{settings.name}",
            "agent_kind": "remote",
            "frame_interval_seconds": settings.frame_interval_seconds,
        }
    )
    folder = settings.log_dir or RUNS_FOLDER / f"{spec.pack}-{spec.agent.replace(':', '-')}"
    worker = replace(plan.worker, agent="")
    return replace(plan, spec=spec, worker=worker, execution=replace(plan.execution, folder=folder))
