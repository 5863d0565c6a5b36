"""Beliefs of a run: measures of calibration, and the study that computes them from the run's probes."""
