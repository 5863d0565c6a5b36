"""Worker processes. Each makes a state (any object) once, and then answers requests. A request calls a function with
the state."""
