"""Worker processes. Each makes a state once, and then answers requests; a request calls a function with this state."""
