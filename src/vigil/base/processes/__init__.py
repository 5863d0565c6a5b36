"""Worker processes: each makes a state once, then answers requests, which are functions of that state."""
