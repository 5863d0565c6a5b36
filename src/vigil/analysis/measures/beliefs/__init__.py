"""Beliefs of a run: measures of calibration, and the study of its probes."""
