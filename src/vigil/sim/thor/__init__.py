"""AI2-THOR as a backend that uses AI2-THOR's own client: requirements, a guarded connection and the simulator."""
