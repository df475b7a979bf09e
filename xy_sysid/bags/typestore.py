"""Message definitions and their hashes, which a bag carries along so that others can read it without ROS."""

from __future__ import annotations

import functools


@functools.cache
def definition(kind: str) -> tuple[str, str]:
    """(text of the definition, hash) of a message type of ROS 2 Jazzy; empty for a type that is not one."""
    from rosbags.typesys import Stores, get_typestore
    from rosbags.typesys.base import TypesysError

    store = get_typestore(Stores.ROS2_JAZZY)
    try:
        return store.generate_msgdef(kind, ros_version=2)[0], store.hash_rihs01(kind)
    except (TypesysError, KeyError):
        return "", ""
