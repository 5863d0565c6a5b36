"""Worker processes. Each makes a state (any object) once. Then it answers requests: calls of functions with this
state."""
