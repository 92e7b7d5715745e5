"""One goal of an action on its way: sent, accepted, carried out, or cancelled."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Literal

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.node import Node

GONE_AFTER = 5.0
"""A server that cannot be found for so long while it works for us is gone, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """How a goal ended: why it did not succeed, and the server's message, if there is one."""

    state: Literal["succeeded", "cancelled", "failed"]
    reason: str = ""
    result: Any = None


class ActionOrder:
    """A goal that is polled by one thread while another spins the node.

    All that is asked of the server is asked by the spinning thread: an answer that comes before the client
    has noted its request would be lost.

    Parameters
    ----------
    node
        Whose executor spins.
    client, goal
        Who sends what.
    name
        Of the action, for reasons.
    """

    def __init__(self, node: Node, client: ActionClient, goal: Any, name: str) -> None:
        self._executor, self._client, self._goal, self._name = node.executor, client, goal, name
        self._must_cancel = False
        self._handle: Any = None
        self._result: Any = None
        self._seen = self._asked = time.monotonic()
        self._ending: Ending | None = None
        self._executor.create_task(self._send)

    def cancel(self) -> None:
        """Ask the server to stop; the end is polled as always."""
        if not self._must_cancel:
            self._must_cancel = True
            self._executor.create_task(self._cancel)

    def poll(self) -> Ending | None:
        """Return how it ended; ``None`` while it goes on."""
        if self._ending is None:
            self._ending = self._find_ending()
        return self._ending

    def _send(self) -> None:
        self._client.send_goal_async(self._goal).add_done_callback(self._answer)

    def _answer(self, sent: Any) -> None:
        handle = sent.result()
        if handle.accepted:
            self._result = handle.get_result_async()
            if self._must_cancel:
                handle.cancel_goal_async()
        self._handle = handle

    def _cancel(self) -> None:
        if self._handle is not None and self._handle.accepted:
            self._handle.cancel_goal_async()

    def _find_ending(self) -> Ending | None:
        if self._handle is None:
            return self._watch_server()
        if not self._handle.accepted:
            return Ending(state="failed", reason=f"{self._name} refuses the goal")
        if not self._result.done():
            return self._watch_server()
        answer = self._result.result()
        if answer.status == GoalStatus.STATUS_SUCCEEDED:
            return Ending(state="succeeded", result=answer.result)
        is_cancelled = answer.status == GoalStatus.STATUS_CANCELED
        return Ending(
            state="cancelled" if is_cancelled else "failed",
            reason=f"{self._name} was cancelled" if is_cancelled else self._describe(answer.result),
            result=answer.result,
        )

    def _describe(self, result: Any) -> str:
        """Say why the server gave up, as far as it tells: Humble's Nav2 does not."""
        told = getattr(result, "error_msg", "") or getattr(result, "reason", "")
        code = getattr(result, "error_code", 0)
        return f"{self._name} failed" + (f": {told}" if told else f" with error {code}" if code else "")

    def _watch_server(self) -> Ending | None:
        now = time.monotonic()
        if now - self._asked < 1.0:
            return None
        self._asked = now
        if self._client.server_is_ready():
            self._seen = now
        if now - self._seen < GONE_AFTER:
            return None
        return Ending(state="failed", reason=f"the server of {self._name} has gone")
