"""AI2-THOR through its own client: what this machine lacks for it, and a connection that never hangs."""
