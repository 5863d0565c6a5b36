"""The embedded simulator's engine on MuJoCo: kinematic, drawn by OpenGL, clicked and seen by rays.

`engine.MujocoEngine` is the entrance; `doctor.doctor` says whether frames can be drawn here; `stage` draws single
assets and floor plans. MuJoCo itself is imported by `binding` alone.
"""
