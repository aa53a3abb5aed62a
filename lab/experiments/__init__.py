"""Experiments: one module a table or figure, each run as ``python -m lab.experiments.NAME``."""
