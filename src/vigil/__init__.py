"""VIGIL: measures world completion and terminal commitment of embodied agents apart."""

__version__ = "0.1.0"
