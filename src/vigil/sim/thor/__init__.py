"""AI2-THOR as a backend through its own client: what a machine lacks for it, a guarded connection, the simulator."""
