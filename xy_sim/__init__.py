"""The simulated XY milling table: a truth that the identification has never seen.

    machine file -> parts -> parameter vector -> kernel (fine inner steps) -> encoder

Nothing here imports the physics of xy_sysid; only its errors, settings, stream blocks and compiler are shared.
"""
