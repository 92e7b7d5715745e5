"""Services to save, load and clear the map."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from stairmap_msgs.srv import LoadMap, SaveMap
from std_srvs.srv import Trigger

from stairmap.errors import StairmapError
from stairmap_ros.live_map import LiveMap
from stairmap_ros.map_keeper import MapKeeper


class MapServices:
    """``~/save_map``, ``~/load_map`` and ``~/clear_map``.

    Parameters
    ----------
    node
        Who serves.
    live_map, keeper
        The map and its file.
    """

    def __init__(self, node: Node, live_map: LiveMap, keeper: MapKeeper) -> None:
        self._node, self._live_map, self._keeper = node, live_map, keeper
        self._services = [
            node.create_service(SaveMap, "~/save_map", self._save),
            node.create_service(LoadMap, "~/load_map", self._load),
            node.create_service(Trigger, "~/clear_map", self._clear),
        ]

    def close(self) -> None:
        """End the services."""
        for service in self._services:
            self._node.destroy_service(service)

    def _save(self, request: SaveMap.Request, response: SaveMap.Response) -> SaveMap.Response:
        response.success, response.message = self._try(lambda: self._keeper.save(request.file))
        return response

    def _load(self, request: LoadMap.Request, response: LoadMap.Response) -> LoadMap.Response:
        response.success, response.message = self._try(lambda: self._keeper.load(request.file))
        return response

    def _clear(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._live_map.clear()
        response.success, response.message = self._try(lambda: "the map is empty")
        return response

    def _try(self, action: Callable[[], str]) -> tuple[bool, str]:
        try:
            done = action()
        except StairmapError as error:
            self._node.get_logger().error(str(error))
            return False, str(error)
        self._node.get_logger().info(done)
        return True, done
