"""How the rerun viewer arranges a run at the start.

It is handed the package rerun and imports nothing of it itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stairmap.visualization.stairway_labels import Viewpoint


def make_blueprint(
    rerun: Any,
    viewpoint: Viewpoint,
    measures: Mapping[str, tuple[str, float]],
    *,
    is_map: bool,
    opens_log: bool,
) -> Any:
    """Return the arrangement of views: map and words to the left, depth image and plots to the right.

    Parameters
    ----------
    rerun
        The package.
    viewpoint
        Where to look from at the start.
    measures
        What is plotted, with its unit.
    is_map
        Whether the cloud of earlier frames stays.
    opens_log
        Whether the lines of the frames are shown first, instead of the table of measures.
    """
    rrb = rerun.blueprint
    everything = rrb.VisibleTimeRange(
        "stamp", start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
    )
    scene = rrb.Spatial3DView(
        origin="map",
        contents=["+ $origin/**", "- $origin/camera/image/**", "+ $origin/camera/image"],
        name="Map, m",
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=viewpoint.eye,
            look_target=viewpoint.target,
            eye_up=(0.0, 0.0, 1.0),
        ),
        overrides={"map/cloud": rrb.VisibleTimeRanges([everything])} if is_map else None,
    )
    image = rrb.Spatial2DView(origin="map/camera/image", name="Depth and stair edges of the frame")
    plots = [
        rrb.TimeSeriesView(
            origin=f"measures/{name}",
            name=f"{name}, {unit}: estimate ± std; dots: single frames",
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for name, (unit, _) in measures.items()
    ]
    words = rrb.Tabs(
        rrb.TextLogView(origin="log", name="What each frame said"),
        rrb.TextDocumentView(origin="summary", name="Measures"),
        active_tab=0 if opens_log else 1,
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(scene, words, row_shares=[3, 1]),
            rrb.Vertical(image, *plots, row_shares=[2, 1, 1, 1]),
            column_shares=[2, 1],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="stamp", play_state=rrb.components.PlayState.Following),
        auto_views=False,
    )
