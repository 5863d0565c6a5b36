"""Profiles: the table of what each profile shows an agent and asks of it, and the mark of a click in a frame."""
