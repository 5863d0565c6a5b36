"""Sweep: the functions of AI2-THOR's own suite (`ai2thor/tests/test_unity.py`), typed over for a house of ours.

    python -m sweeps.thor_suite [--backend mujoco|fake] [--only NAME ...]

It needs the client (pip install "vigil-bench[thor]") and fetches nothing. Each function is tried over named pipes and
over HTTP, and the table says of each: pass, fail, or why it does not apply. Exit status 1 means that one failed.
"""

import argparse
import os
import sys
import tempfile
import traceback
import warnings
from typing import Any

from sweeps.support import thor_agent_cases, thor_object_cases
from sweeps.support.thor_trial import SCENE, Case, DoesNotApplyError, Trial
from vigil.thor.launch import thor_engine

UNITYS_TEST_ACTIONS = "it calls test actions that exist only in Unity's build, and checks how C# methods are found"
NO_ARM = "the engine has no arm, and says so"
NOT_APPLICABLE = {
    **dict.fromkeys(
        (
            *(
                "action_dispatch",
                "action_dispatch_find_ambiguous_stochastic",
                "action_dispatch_server_action_ambiguous",
            ),
            *("action_dispatch_server_action_ambiguous2", "action_dispatch_find_conflicts_stochastic"),
            *("action_dispatch_find_conflicts_physics", "action_dispatch_empty", "action_disptatch_one_param"),
            *("action_disptatch_two_param", "action_disptatch_two_param_with_default"),
            *("action_disptatch_two_param_with_default_empty", "action_disptatch_serveraction_default"),
            *("action_disptatch_serveraction_with_object_id", "action_disptatch_all_default"),
            "action_disptatch_some_default",
        ),
        UNITYS_TEST_ACTIONS,
    ),
    **dict.fromkeys(
        ("arm_jsonschema_metadata", "manipulathor_move", "manipulathor_rotate", "unsupported_manipulathor"), NO_ARM
    ),
}
"""Name of a function that is not tried -> the reason."""
NAMES = {
    "open_": "open",
    "two_d_semantic_hulls": "2d_semantic_hulls",
    "directional_push": "directionalPush",
    "randomize_materials_clear_on_reset": "randomize_materials_clearOnReset",
}
CASES: dict[str, Case] = {
    NAMES.get(case.__name__, case.__name__): case for case in (*thor_agent_cases.CASES, *thor_object_cases.CASES)
}


def main() -> int:
    """Try the functions and print the table. Return 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--backend", choices=("mujoco", "fake"), default="mujoco")
    parser.add_argument("--only", nargs="+", choices=sorted(CASES), metavar="NAME", help="try these functions alone")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    names = options.only or list(CASES)
    with tempfile.TemporaryDirectory() as home:
        os.environ["HOME"] = home  # the client writes logs there
        found = {wire: tried(wire, options.backend, names) for wire in ("pipes", "HTTP")}
    print("| function | pipes | HTTP |\n|---|---|---|")
    for name in names:
        print(f"| `{name}` | {found['pipes'][name]} | {found['HTTP'][name]} |")
    for name, reason in {} if options.only else NOT_APPLICABLE.items():
        print(f"| `{name}` | not tried: {reason} | |")
    passed = [name for name in names if all(not each[name].startswith("FAIL") for each in found.values())]
    print(f"{len(names)} functions tried, {len(passed)} pass over both")
    return int(len(passed) < len(names))


def tried(wire: str, backend: str, names: list[str]) -> dict[str, str]:
    """Return the result of each named function over one protocol."""
    from ai2thor.controller import Controller  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent
    from ai2thor.fifo_server import FifoServer  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent
    from ai2thor.wsgi_server import WsgiServer  # noqa: PLC0415  # pyright: ignore[reportMissingImports] - may be absent

    def start() -> Trial:
        server: Any = {"pipes": FifoServer, "HTTP": WsgiServer}[wire]
        made = Controller(local_executable_path=thor_engine(backend=backend), scene=SCENE, server_class=server)
        return Trial(made, dict(made.initialization_parameters))

    trial, found = start(), {}
    for name in names:
        found[name] = result(trial, CASES[name])
        print(f"{wire}: {name}: {found[name]}", file=sys.stderr, flush=True)
    trial.controller.stop()
    return found


def result(trial: Trial, case: Case) -> str:
    """Return what one function says: "pass", "FAIL: ..." or "does not apply: ..."."""
    try:
        trial.reset()
        case(trial)
    except DoesNotApplyError as reason:
        return f"does not apply: {reason}"
    except Exception as error:  # noqa: BLE001 - a table of results names every failure
        line = traceback.extract_tb(error.__traceback__)[-1]
        return f"FAIL: {type(error).__name__}: {' '.join(str(error).split())[:160] or line.line}"
    return "pass"


if __name__ == "__main__":
    sys.exit(main())
