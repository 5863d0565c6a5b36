"""Solving: scripts that play episodes with privileged access to the simulator, but the same skills as any agent."""
