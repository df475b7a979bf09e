"""The nodes of xy_sysid for a full ROS 2: ros2 launch xy_sysid xy.launch.py simulate:=true activate:=true."""

from launch.actions import DeclareLaunchArgument, EmitEvent
from launch.conditions import IfCondition, UnlessCondition
from launch.events import matches_action
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import LifecycleNode, Node
from launch_ros.events.lifecycle import ChangeState
from launch_ros.substitutions import FindPackageShare
from lifecycle_msgs.msg import Transition

from launch import LaunchDescription

ARGUMENTS = {
    "namespace": ("xy", "namespace of all topics and nodes"),
    "params_file": (PathJoinSubstitution([FindPackageShare("xy_sysid"), "config", "default.yaml"]), "parameters of all nodes"),
    "axes": ('["x", "y"]', "names of the axes; their parameters stand in the parameter file"),
    "simulate": ("false", "start the simulated machine"),
    "machine": ("paper.yaml", "its machine file"),
    "record": ("false", "record a bag"),
    "activate": ("false", "let the excitation drive as soon as a machine is there, however late; without it, nothing moves until it is activated"),
}


def generate_launch_description() -> LaunchDescription:
    """The excitation is configured at once; it begins by itself, as soon as a machine is there, only when that was asked for."""
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    common = {"package": "xy_sysid", "namespace": given["namespace"], "output": "screen"}
    with_axes = [given["params_file"], {"axes": given["axes"]}]  # read as YAML, that is as a list
    driven = [*with_axes, {"autostart": given["activate"]}]  # waits for the machine, however late it comes
    excitation = LifecycleNode(executable="excitation", name="excitation", parameters=driven, **common)
    identifier = Node(executable="identifier", name="identifier", parameters=with_axes, **common)
    diagnoser = Node(executable="diagnoser", name="diagnoser", parameters=with_axes, **common)
    ballscrew = Node(
        executable="ballscrew",
        name="ballscrew",
        parameters=[given["params_file"], {"machine": given["machine"]}],
        condition=IfCondition(given["simulate"]),
        **common,
    )
    recorder = Node(executable="recorder", name="recorder", parameters=[given["params_file"]], condition=IfCondition(given["record"]), **common)

    event = ChangeState(lifecycle_node_matcher=matches_action(excitation), transition_id=Transition.TRANSITION_CONFIGURE)
    configure = EmitEvent(event=event, condition=UnlessCondition(given["activate"]))
    declared = [DeclareLaunchArgument(name, default_value=value, description=meaning) for name, (value, meaning) in ARGUMENTS.items()]
    return LaunchDescription([*declared, ballscrew, recorder, identifier, diagnoser, excitation, configure])
