"""The embedded simulator's engine on MuJoCo: kinematic, drawn by OpenGL, clicked and seen by rays.

`engine.MujocoEngine` is the entry point. MuJoCo itself is imported by `binding` alone.
"""
