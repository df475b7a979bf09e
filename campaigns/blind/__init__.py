"""Blind campaigns: hidden effects on simulated machines, and how often the diagnosis is right.

The machines are ``xy_sim``'s (other physics code, other numerics than the hypotheses'). Development draws and reporting
draws come from different random streams; only the first were used for tuning.
"""
