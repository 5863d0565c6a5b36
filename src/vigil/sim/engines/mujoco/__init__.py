"""The embedded simulator's engine on MuJoCo: kinematic scenes, frames drawn by `vigil.rendering`, and rays.

`engine.MujocoEngine` is the entry point. Only `compiled.binding` imports MuJoCo.
"""
