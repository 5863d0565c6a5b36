"""The closure-stress suite: its tasks, the certificates that prove their answers, and functions that propose tasks."""
