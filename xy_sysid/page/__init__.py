"""The page: what the identifier hears, or what a recording holds, drawn and told in a browser.

``access``, ``facts``, ``topics_state``, ``orders`` and ``library`` are pure; ``worker``, ``link`` and ``server`` do the work; the
other files draw.
"""
