"""Pictures and pages of the documentation, made from the simulated machine: ``python -m campaigns.pictures``."""
