"""Measurements against other software and against the goals: ``python -m bench [name ...]``."""
