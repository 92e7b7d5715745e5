"""The node, which a lifecycle manager may configure, activate, deactivate and clean up, or which does it
itself."""

from __future__ import annotations

from collections.abc import Sequence

from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from stairmap.errors import ConfigError, StairmapError
from stairmap_ros.node_parts import NodeParts
from stairmap_ros.parameters import check_known, declare_parameters, known_parameters


class StairmapNode(LifecycleNode):
    """Depth images, camera_info and TF in; stairways and what follows from them out.

    unconfigured: it has its parameters. inactive: it has its map, topics and services. active: it looks at
    images.

    Raises
    ------
    StairmapError
        If a parameter is unknown or not allowed.
    """

    def __init__(self) -> None:
        super().__init__(
            "stairmap", allow_undeclared_parameters=True, automatically_declare_parameters_from_overrides=True
        )
        self._own, self._config = declare_parameters(self)
        self.add_on_set_parameters_callback(_refuse_unknown)
        self._parts: NodeParts | None = None
        self._failure: StairmapError | None = None

    def autostart(self) -> None:
        """Configure and activate, unless a lifecycle manager is to do it.

        Raises
        ------
        StairmapError
            If the map file cannot be used or a message package is missing.
        """
        if not self._own.autostart:
            self.get_logger().info("unconfigured: a lifecycle manager must configure and activate it")
            return
        self.trigger_configure()
        if self._failure is not None:
            raise self._failure
        self.trigger_activate()

    def close(self) -> None:
        """Stop everything and write the map."""
        if self._parts is not None:
            self._parts.close()
            self._parts = None

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the map, topics and services."""
        self._failure = None
        try:
            self._parts = NodeParts(self, self._own, self._config)
        except StairmapError as error:
            self._failure = error
            if not self._own.autostart:
                self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to look at images."""
        assert self._parts is not None, "only a configured node is activated"
        self._parts.activate()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop looking at images and write the map."""
        assert self._parts is not None, "only a configured node is deactivated"
        self._parts.deactivate()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Write the map and forget it."""
        self.close()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Write the map and end."""
        self.close()
        return super().on_shutdown(state)


def _refuse_unknown(parameters: Sequence[Parameter]) -> SetParametersResult:
    try:
        check_known([parameter.name for parameter in parameters], known_parameters())
    except ConfigError as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)
