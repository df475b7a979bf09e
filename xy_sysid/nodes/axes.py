"""The parameter ``axes`` of a node."""

from __future__ import annotations

from rclpy.node import Node

from xy_sysid.errors import BadInput
from xy_sysid.live.plain_messages import topic_of
from xy_sysid.nodes.common import declare_fixed, overrides

AXES = "axes"


def declare_axes(node: Node) -> tuple[str, ...]:
    """The parameter ``axes``, x and y by default; raises BadInput if it is not a list of names with different topics."""
    axes = overrides(node).get(AXES, ["x", "y"])
    if not isinstance(axes, list) or not axes or not all(isinstance(axis, str) and axis for axis in axes):
        raise BadInput(f"node {node.get_name()}: parameter {AXES}", axes, 'a list of names like ["x", "y"]', "Change it and try again.")
    topics = {topic_of("frf", axis) for axis in axes}
    if any("," in axis or "=" in axis or axis.strip() != axis for axis in axes) or len(topics) < len(axes):
        what = "names without , and = that differ in more than signs other than letters, digits and _"
        raise BadInput(
            f"node {node.get_name()}: parameter {AXES}", axes, what, 'Give joints short names, for example axes ["x"] and joints ["x=NAME"].'
        )
    declare_fixed(node, AXES, axes, "names of the axes")
    return tuple(axes)
