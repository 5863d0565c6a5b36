"""Sandbox of a program: the tool bubblewrap starts the program so that it cannot see packs, runs or the home folder.

The program sees, read-only: the system's folders, its interpreter's folder, and the files and folders that its command
names. It also sees its own processes and its own working folder, which is the only folder that it can write to. The
network is open, because a program may ask a model. VIGIL's own packs stay hidden even if they are inside one of these
folders.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from vigil.errors import SettingError

SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/etc", "/opt", "/nix/store", "/run/systemd/resolve")
"""Folders of the system that a program sees."""
DEVICES = ("/dev/nvidia0", "/dev/nvidiactl", "/dev/nvidia-uvm", "/dev/dri", "/dev/kfd")
"""Devices of graphics cards that a program sees."""
PACKS = Path(__file__).parents[1] / "data"
"""Folder of the packs that come with VIGIL."""
TRIAL_SECONDS = 60


@lru_cache(maxsize=1)
def missing_for_sandbox() -> str:
    """Return why this machine cannot sandbox a program; empty if it can."""
    if sys.platform != "linux":
        return "bubblewrap runs on Linux only"
    bwrap = shutil.which("bwrap")
    if bwrap is None:
        return "bubblewrap is not installed (apt-get install bubblewrap)"
    try:
        trial = sandboxed([shutil.which("true") or "/bin/true"], Path("/tmp"), ())
        done = subprocess.run(trial, capture_output=True, timeout=TRIAL_SECONDS)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"bubblewrap does not run: {error}"
    said = done.stderr.decode("utf-8", "replace").strip()
    return f"bubblewrap does not run here: {said}" if done.returncode else ""


def check_sandbox() -> None:
    """Raise SettingError if this machine cannot sandbox a program."""
    missing = missing_for_sandbox()
    if missing:
        raise SettingError(
            f"--sandbox: {missing}. The system must allow user namespaces; `vigil doctor` says whether it does. "
            "Without --sandbox the program sees the files of this user."
        )


def sandboxed(arguments: Sequence[str], folder: Path, hidden: Sequence[Path]) -> list[str]:
    """Return the command that starts a program in the sandbox, with `folder` as its working folder.

    Folders in `hidden` are empty for the program. Raises FileNotFoundError if the program does not exist.
    """
    program = shutil.which(arguments[0], path=os.environ.get("PATH"))
    if program is None:
        raise FileNotFoundError(2, "No such file or directory")
    words = ["bwrap", "--unshare-user-try", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--die-with-parent"]
    words += ["--cap-drop", "ALL", "--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp"]
    for place in (*SYSTEM, *_of_interpreter(Path(program))):
        words += ["--ro-bind-try", place, place]
    for place in DEVICES:
        words += ["--dev-bind-try", place, place]
    seen = [*SYSTEM, *_of_interpreter(Path(program))]
    named = [word.partition("=")[2] if word.startswith("-") else word for word in arguments[1:]]
    for place in [program, *(word for word in named if word.startswith("/") and os.path.exists(word))]:
        if not any(Path(place).is_relative_to(each) for each in seen):
            words += ["--ro-bind", place, place]
            seen.append(place)
    for place in sorted({each.resolve() for each in (PACKS, *hidden)}):
        if place.is_dir() and any(place.is_relative_to(Path(each).resolve()) for each in seen):
            words += ["--tmpfs", str(place)]
    return [*words, "--bind", str(folder), str(folder), "--chdir", str(folder), "--", program, *arguments[1:]]


def _of_interpreter(program: Path) -> list[str]:
    """Return the parents of the `bin` folders that contain a program and, if the program is a link, its target.

    The list is empty if neither is in a `bin` folder.
    """
    places = {program.parent, program.resolve().parent}
    return [str(place.parent) for place in places if place.name == "bin" and place.parent != Path("/")]
