"""The simulated XY milling table, with known true parameters for tests of the identification.

    machine file -> parts -> parameter vector -> kernel (fine inner steps) -> encoder

Nothing here imports the physics of xy_sysid; only its errors, settings, stream blocks and compiler are shared.
"""
