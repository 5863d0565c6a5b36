"""Probes of a run: the steps at which they are asked, the messages that are sent, and the recording of the answers."""
