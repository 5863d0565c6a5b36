"""Profiles: the table of what each shows and asks, and how a frame is marked."""
