from __future__ import annotations

import pytest

from small_recordings import write_recording


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """Four recordings, the third without stairs, and a folder that is a broken one."""
    folder = tmp_path_factory.mktemp("batch") / "recordings"
    for number in range(4):
        write_recording(folder / f"r{number}", num_frames=5, has_stairs=number != 2)
    (folder / "broken").mkdir()
    (folder / "broken" / "depth.txt").write_text("0.0 depth/none.png\n")
    return folder
