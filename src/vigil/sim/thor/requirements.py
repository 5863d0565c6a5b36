"""Requirements of AI2-THOR's own engine that this machine lacks. The check neither starts nor downloads the engine."""

import ctypes.util
import json
import os
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

BUILD = "f0825767cd50d69f666c7f282e54abfe58f1e917"
"""Commit hash that names the build of the engine which version 5.0.0 of the client starts."""
CLIENT = "5.0.0"
"""Supported version of the client."""
PLATFORMS = ("CloudRendering", "Linux64")
"""The client's names of the platforms on Linux."""
METADATA_FILE, MAKER = "metadata.json", "vigil"
"""Metadata file in a release's folder, and the value of its key `made_by` if the release is this project's engine."""
SOURCE = "http://s3-us-west-2.amazonaws.com/ai2-thor-public/builds"
"""Address from which the client downloads builds."""


@dataclass(frozen=True, slots=True)
class Findings:
    """The requirements of AI2-THOR's engine that this machine fulfils, and those that it lacks."""

    client: str
    """Version of the installed client, or "not installed"."""
    build: str
    """Folder of the engine's build, or a sentence saying that there is none."""
    platform: str
    """AI2-THOR's name for the platform whose build fits this machine."""
    missing: tuple[str, ...]
    """Sentences on what is missing and what to do about it; empty if the engine can run."""


def examine() -> Findings:
    """Return which requirements this machine fulfils and which it lacks."""
    missing = []
    client = _client()
    if client is None:
        missing.append('the client: pip install "vigil-bench[thor]"')
    elif client != CLIENT:
        missing.append(f"the client {CLIENT} (there is {client}): pip install ai2thor=={CLIENT}")
    if platform.system() != "Linux" or platform.machine() != "x86_64":
        missing.append(f"Linux on x86_64 (this is {platform.system()} on {platform.machine()})")
    has_vulkan, has_display = ctypes.util.find_library("vulkan") is not None, "DISPLAY" in os.environ
    if not has_vulkan and not has_display:
        missing.append("libvulkan1 with a GPU's driver (apt-get install libvulkan1), or an X display with GLX")
    kind = "CloudRendering" if has_vulkan else "Linux64"
    folder = release_folder(kind)
    build = str(folder) if folder.is_dir() else f"absent; the client would download {SOURCE}/{folder.name}.zip"
    if is_own_release(folder):
        build = f"{folder} (VIGIL's engine; `vigil thor uninstall` removes it)"
    return Findings(client or "not installed", build, kind, tuple(missing))


def release_folder(platform_name: str) -> Path:
    """Return the folder in which the client looks for the build of one of its platforms."""
    return Path.home() / ".ai2thor" / "releases" / f"thor-{platform_name}-{BUILD}"


def is_own_release(folder: Path) -> bool:
    """Return whether a release's folder holds this project's engine, as `vigil thor install` writes it."""
    try:
        return json.loads((folder / METADATA_FILE).read_text(encoding="utf-8")).get("made_by") == MAKER
    except (OSError, ValueError, AttributeError):
        return False


def _client() -> str | None:
    try:
        return version("ai2thor")
    except PackageNotFoundError:
        return None
