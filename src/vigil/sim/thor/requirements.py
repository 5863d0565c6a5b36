"""What AI2-THOR's own engine needs on this machine, and what is missing, without starting or downloading anything."""

import ctypes.util
import os
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

BUILD = "f0825767cd50d69f666c7f282e54abfe58f1e917"
"""The build that the client 5.0.0 takes."""
CLIENT = "5.0.0"
SOURCE = "http://s3-us-west-2.amazonaws.com/ai2-thor-public/builds"


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found."""

    client: str
    build: str
    platform: str
    """Of the build that fits this machine, as the client calls it."""
    missing: tuple[str, ...]
    """What must be there before AI2-THOR's own engine can run, with what to do; empty when nothing is missing."""


def examine() -> Findings:
    """Return what is there, and what is missing."""
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
