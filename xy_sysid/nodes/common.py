"""Shared by the nodes: topics, their quality of service, and parameters made from the settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any, Generic, TypeVar, cast

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from xy_sysid.errors import BadInput
from xy_sysid.nodes.quality import Overridable
from xy_sysid.nodes.run import run_node
from xy_sysid.nodes.wall import Wall
from xy_sysid.settings import AXES, NAMESPACE, Knob, Settings, build, changed, knobs, of_other_axes, unknown_name

__all__ = [
    "DATA_QOS",
    "LATCHED_QOS",
    "NAMESPACE",
    "STOP_HEARD",
    "STOP_TOPIC",
    "Parameters",
    "WalledNode",
    "declare",
    "run_node",
]

AnySettings = TypeVar("AnySettings", bound=Settings)

# Ten seconds of 20-row blocks at 2 kHz: queues overflow without an error, so they are longer than any stall.
DATA_QOS = QoSProfile(depth=1000, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)
LATCHED_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)

STOP_TOPIC = "stop"  # std_msgs/Bool; true: zero volts now, and no activate until false
# Two subscriptions: one for messages latched before the node started, one for publishers without latching or reliability. All publishers share the
# queue: at a depth of 1 the false of one would replace the true of another.
STOP_HEARD = (
    QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT),
)

OF_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides.")  # parameters that rclpy declares itself


class WalledNode(Overridable):
    """A node whose callbacks are protected against errors, and which can end at once."""

    exit_code: int | None = None

    def __init__(self, name: str) -> None:
        self.wall = Wall(lambda words: self.get_logger().error(words))
        super().__init__(name, namespace=NAMESPACE, automatically_declare_parameters_from_overrides=True)

    def create_subscription(self, msg_type: Any, topic: str, callback: Callable[..., Any], *rest: Any, **more: Any) -> Any:
        """As in rclpy; an error of the callback is logged."""
        return super().create_subscription(msg_type, topic, self.wall.around(callback), *rest, **more)

    def create_service(self, srv_type: Any, srv_name: str, callback: Callable[..., Any], **more: Any) -> Any:
        """As in rclpy; an error of the callback is logged."""
        return super().create_service(srv_type, srv_name, self.wall.around(callback), **more)

    def create_timer(self, timer_period_sec: float, callback: Callable[..., Any], *rest: Any, **more: Any) -> Any:
        """As in rclpy; an error of the callback is logged."""
        return super().create_timer(timer_period_sec, self.wall.around(callback), *rest, **more)

    def ask_to_stop(self, reason: str) -> None:
        """Nothing to do."""

    def has_stopped(self) -> bool:
        """True at once."""
        return True

    def last_words(self) -> None:
        """Nothing to publish."""


class Parameters(Generic[AnySettings]):
    """The settings with the node's current parameter values; ``accept`` may refuse a change by raising BadInput."""

    def __init__(self, settings: AnySettings, accept: Callable[[AnySettings], None] | None) -> None:
        self.settings = settings
        self._accept = accept

    def on_change(self, parameters: list[Parameter]) -> SetParametersResult:
        """rclpy calls this before it sets parameters."""
        known = {item.name for item in knobs(self.settings)}
        values = {parameter.name: parameter.value for parameter in parameters if parameter.name in known}
        try:
            settings = changed(self.settings, values)
            if self._accept is not None:
                self._accept(settings)
        except BadInput as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.settings = settings
        return SetParametersResult(successful=True)


def overrides(node: Node) -> dict[str, Any]:
    """Parameters from the command line or a file, for a node made with automatically_declare_parameters_from_overrides."""
    given = cast("dict[str, Parameter]", node.get_parameters_by_prefix(""))
    return {name: parameter.value for name, parameter in given.items() if not name.startswith(OF_ROS)}


def declare(
    node: Node,
    defaults: AnySettings,
    accept: Callable[[AnySettings], None] | None = None,
    also: Collection[str] = (),
    fixed: Collection[str] | None = (),
) -> Parameters[AnySettings]:
    """Declare every setting with its type, meaning, unit and limits, with the given values; the result follows changes.

    The node must be made with automatically_declare_parameters_from_overrides. also: names that the node declares itself;
    fixed: names that never change while it runs, None for all; rclpy refuses their changes before it calls ``accept``.
    Raises BadInput for an unknown name (with the nearest spelling) or a value that is not allowed.
    """
    given = {name: value for name, value in overrides(node).items() if name not in also}
    axes = overrides(node).get("axes", list(AXES))
    for name in of_other_axes(type(defaults), given, axes):
        node.undeclare_parameter(name)
        del given[name]
    known = {item.name: item.value for item in knobs(defaults)}
    for name in given:
        if name not in known:
            raise unknown_name(name, [*known, *also], f"node {node.get_name()}: parameter")
    settings = build(type(defaults), {**known, **given}, f"node {node.get_name()}")
    for item in knobs(settings):
        if item.name in given:
            node.undeclare_parameter(item.name)
        node.declare_parameter(item.name, item.value, describe(item, fixed is None or item.name in fixed), ignore_override=True)
    parameters = Parameters(settings, accept)
    node.add_on_set_parameters_callback(parameters.on_change)
    return parameters


def declare_fixed(node: Node, name: str, value: Any, meaning: str) -> None:
    """Declare a parameter that is set when the node starts and never changes."""
    if node.has_parameter(name):
        node.undeclare_parameter(name)
    node.declare_parameter(name, value, ParameterDescriptor(read_only=True, description=meaning), ignore_override=True)


def describe(item: Knob, fixed: bool = False) -> ParameterDescriptor:
    """Meaning, unit and limits as a ParameterDescriptor."""
    unit = f" [{item.unit}]" if item.unit else ""
    descriptor = ParameterDescriptor(
        read_only=fixed,
        dynamic_typing=isinstance(item.value, list),  # the type of an empty list is unknown
        description=item.meaning + unit,
        additional_constraints=f"one of {', '.join(item.choices)}" if item.choices else "",
    )
    if item.low is not None and item.high is not None:
        if isinstance(item.value, float):
            low = math.nextafter(item.low, math.inf) if item.above else item.low  # a range of ROS includes its ends
            high = math.nextafter(item.high, -math.inf) if item.below else item.high
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
        else:
            descriptor.integer_range = [IntegerRange(from_value=int(item.low) + item.above, to_value=int(item.high) - item.below)]
        open_ends = [f"above {item.low:g}"] * item.above + [f"below {item.high:g}"] * item.below
        descriptor.additional_constraints = " and ".join(open_ends)
    return descriptor
