"""Flawed agents: solvers with one ability or one kind of honesty removed."""
