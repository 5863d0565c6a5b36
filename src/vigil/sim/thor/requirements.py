"""What AI2-THOR's own engine requires and this machine lacks. Nothing is started or downloaded to find this out."""

import ctypes.util
import os
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

BUILD = "f0825767cd50d69f666c7f282e54abfe58f1e917"
"""Build of the engine that version 5.0.0 of the client starts."""
CLIENT = "5.0.0"
"""Supported version of the client."""
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
    name = f"thor-{kind}-{BUILD}"
    folder = Path.home() / ".ai2thor" / "releases" / name
    build = str(folder) if folder.is_dir() else f"absent; the client would download {SOURCE}/{name}.zip"
    return Findings(client or "not installed", build, kind, tuple(missing))


def _client() -> str | None:
    try:
        return version("ai2thor")
    except PackageNotFoundError:
        return None
