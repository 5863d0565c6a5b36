"""Solving: scripts that play episodes with privileged access to the simulator, but with the same skills as any
agent.
"""
