#!/bin/bash
# Prints one table of how fast a GPU draws (benchmarks/gpu.py). Needs VIGIL's packages, OpenGL through EGL, no download.
set -eu
cd "$(dirname "$0")/.."
python=${PYTHON:-.venv/bin/python}
nvidia-smi --query-gpu=name,driver_version --format=csv,noheader || echo "nvidia-smi found no GPU"
MUJOCO_GL=egl PYTHONPATH="src:.:${PYTHONPATH:-}" timeout 480 "$python" -m benchmarks.gpu "$@"
