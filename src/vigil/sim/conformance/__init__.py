"""Conformance: the checks that every simulator backend must pass, in the reference house."""
