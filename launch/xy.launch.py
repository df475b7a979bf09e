"""The nodes of xy_sysid for a full ROS 2: ros2 launch xy_sysid xy.launch.py simulate:=true activate:=true."""

from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler
from launch.conditions import IfCondition
from launch.events import matches_action
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import LifecycleNode, Node
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.substitutions import FindPackageShare
from lifecycle_msgs.msg import Transition

from launch import LaunchDescription

ARGUMENTS = {
    "namespace": ("xy", "namespace of all topics and nodes"),
    "params_file": (PathJoinSubstitution([FindPackageShare("xy_sysid"), "config", "default.yaml"]), "parameters of all nodes"),
    "simulate": ("false", "start the simulated machine"),
    "machine": ("paper.yaml", "its machine file"),
    "record": ("false", "record a bag"),
    "activate": ("false", "let the excitation drive the machine at once; without it, nothing moves until it is activated"),
}


def generate_launch_description() -> LaunchDescription:
    """The excitation is configured at once and activated only when that was asked for."""
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    common = {"package": "xy_sysid", "namespace": given["namespace"], "output": "screen"}
    excitation = LifecycleNode(executable="excitation", name="excitation", parameters=[given["params_file"]], **common)
    identifier = Node(executable="identifier", name="identifier", parameters=[given["params_file"]], **common)
    diagnoser = Node(executable="diagnoser", name="diagnoser", parameters=[given["params_file"]], **common)
    ballscrew = Node(
        executable="ballscrew",
        name="ballscrew",
        parameters=[given["params_file"], {"machine": given["machine"]}],
        condition=IfCondition(given["simulate"]),
        **common,
    )
    recorder = Node(executable="recorder", name="recorder", parameters=[given["params_file"]], condition=IfCondition(given["record"]), **common)

    def ask(transition: int) -> EmitEvent:
        return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(excitation), transition_id=transition))

    drive = RegisterEventHandler(
        OnStateTransition(
            target_lifecycle_node=excitation, goal_state="inactive", start_state="configuring", entities=[ask(Transition.TRANSITION_ACTIVATE)]
        ),
        condition=IfCondition(given["activate"]),
    )
    declared = [DeclareLaunchArgument(name, default_value=value, description=meaning) for name, (value, meaning) in ARGUMENTS.items()]
    return LaunchDescription([*declared, ballscrew, recorder, identifier, diagnoser, drive, excitation, ask(Transition.TRANSITION_CONFIGURE)])
