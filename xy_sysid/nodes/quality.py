"""Properties of a node that a user can change through ROS.

Quality of service: ``qos_overrides./xy/position.subscription.reliability`` and the like, as in rclcpp.

Source: https://design.ros2.org/articles/qos_configurability.html. The topic STOP is exempt, so that no file can disable it.
"""

from __future__ import annotations

import copy
from typing import Any, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSPolicyKind, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from xy_sysid.errors import BadInput

ALLOWED = {
    "history": ("keep_last", "keep_all"),
    "depth": (),
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
}
DEEPEST = 1_000_000  # messages
KINDS = {name: QoSPolicyKind[name.upper()] for name in ALLOWED}
OF_RCLPY = ("/parameter_events", "/clock", "/rosout")  # made by rclpy itself, when no parameter may be declared


class Overridable(Node):
    """A node that applies qos_overrides to every publisher and subscription that it makes.

    It must be made with automatically_declare_parameters_from_overrides. Raises BadInput for an unknown policy or value.
    """

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: Any, **more: Any) -> Any:
        """As rclpy's."""
        return super().create_publisher(msg_type, topic, **_obeyed(self, (topic, qos_profile), "publisher", more))

    def create_subscription(self, msg_type: Any, topic: str, callback: Any, qos_profile: Any, **more: Any) -> Any:
        """As rclpy's."""
        return super().create_subscription(msg_type, topic, callback, **_obeyed(self, (topic, qos_profile), "subscription", more))

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """As rclpy's; the refusal of a read-only parameter says what to do."""
        result = super().set_parameters_atomically(parameter_list)
        fixed = [item.name for item in parameter_list if self.has_parameter(item.name) and self.describe_parameter(item.name).read_only]
        if result.successful or not fixed:
            return result
        now, act = self.get_parameter(fixed[0]).value, "It is read-only: start the node again with it."
        return SetParametersResult(successful=False, reason=str(BadInput(fixed[0], "not to be changed while the node runs", str(now), act)))


def overridden(node: Node, topic: str, side: str) -> dict[str, Any]:
    """The given policies of a topic: value by name; side: publisher or subscription. Raises BadInput for an unknown policy or value."""
    prefix = f"qos_overrides.{node.resolve_topic_name(topic)}.{side}"
    given = cast("dict[str, Parameter]", node.get_parameters_by_prefix(prefix))
    found = {name: parameter.value for name, parameter in given.items()}
    for name, value in found.items():
        if name not in ALLOWED:
            raise BadInput(f"{prefix}.{name}", repr(value), ", ".join(ALLOWED), "Choose one of these policies.")
        if name == "depth" and (not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= DEEPEST):
            raise BadInput(f"{prefix}.{name}", repr(value), f"a whole number from 1 to {DEEPEST}", "Change it.")
        if name != "depth" and value not in ALLOWED[name]:
            raise BadInput(f"{prefix}.{name}", repr(value), ", ".join(ALLOWED[name]), "Choose one of these.")
    return found


def _obeyed(node: Node, of: tuple[str, Any], side: str, more: dict[str, Any]) -> dict[str, Any]:
    """The profile, and the policies that rclpy takes from parameters: those that were given."""
    topic, quality = of
    if topic in OF_RCLPY or "qos_overriding_options" in more:
        return {"qos_profile": quality, **more}
    profile = QoSProfile(depth=quality) if isinstance(quality, int) else copy.copy(quality)  # rclpy writes into it
    options = QoSOverridingOptions([KINDS[name] for name in overridden(node, topic, side)])
    return {"qos_profile": profile, "qos_overriding_options": options, **more}
