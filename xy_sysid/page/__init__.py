"""The page: live results of the identifier, or a recording, shown in a browser.

``access``, ``facts``, ``topics_state`` and ``orders`` are pure; ``worker``, ``link`` and ``server`` do the work; the
other files draw.
"""
