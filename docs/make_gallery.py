"""Make the pictures of docs/gallery.md: eight simulated cases, each with the command that a user would call.

    python docs/make_gallery.py FOLDER        # recordings and results go to FOLDER; six minutes of one core

What is in FOLDER already is not made again. Needs the extras ``explore``, ``report`` and ``sim``.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from stairmap.arrays import Points
from stairmap.export.loading import load_stairways
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.simulation.finished_maps import MAP_KINDS, FinishedMap
from stairmap.simulation.scenes import make_scene
from stairmap.stairway import Stairway
from stairmap.visualization.cloud_pictures import draw_stairway_in_cloud, draw_view
from stairmap.visualization.overlay import DROP_COLOR
from stairmap.visualization.plots import png_from_figure

IMAGES = Path(__file__).parent / "images"

NUM_COLORS = 192
"""Colours of a picture: it looks the same as with all of them, at a third of the size."""


def overlay_palette() -> Image.Image:
    """Return the colours of pictures of depth, those of few pixels included: red marks, greys of letters."""
    depth = cv2.applyColorMap(np.linspace(0, 255, 200).astype(np.uint8)[:, None], cv2.COLORMAP_VIRIDIS)
    shades = np.linspace(0, 1, 28)[:, None]
    colors = [depth[:, 0, ::-1], shades * np.full(3, 255), shades * np.array(DROP_COLOR[::-1])]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.concatenate(colors).astype(np.uint8).tobytes())
    return palette


def main(folder: Path) -> None:
    """Make all pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in CASES:
        name = make.__name__.removeprefix("make_")
        path = IMAGES / f"gallery-{name.replace('_', '-')}.png"
        content = make(folder / name)
        path.write_bytes(content)
        picture = Image.open(path).convert("RGB")
        palette = overlay_palette() if make in OVERLAYS else None
        small = picture.quantize(NUM_COLORS, palette=palette, dither=Image.Dither.NONE)
        small.save(path, optimize=True)
        sys.stdout.write(f"{path}: {path.stat().st_size / 1000:.0f} kB\n")


def stairmap(*arguments: str | Path, output: Path, option: str = "-o") -> Path:
    """Run a command that writes a folder or file, unless that is there; show the command."""
    if not output.exists():
        sys.stdout.write(f"$ stairmap {' '.join(map(str, arguments))} {option} {output}\n")
        sys.stdout.flush()
        command = [sys.executable, "-m", "stairmap", *map(str, arguments), option, str(output)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return output


def simulate(folder: Path, scene: str, *options: str) -> Path:
    """Simulate a drive."""
    return stairmap("simulate", scene, "--seed", "1", *options, output=folder / scene)


def draw_best_frame(folder: Path, recording: Path) -> bytes:
    """Return the overlay of the frame with most steps, or of the middle one where no frame has any."""
    results = stairmap("detect", recording, output=folder / "detect")
    lines = (results / "detections.jsonl").read_text().splitlines()
    counts = [sum(found["num_steps"] for found in json.loads(line)["observations"]) for line in lines]
    best = int(np.argmax(counts)) if max(counts) else len(counts) // 2
    overlays = sorted(results.rglob("*.png"))
    return overlays[best].read_bytes()


def make_going_up(folder: Path) -> bytes:
    """A flight with railings that a robot drives up to."""
    return draw_best_frame(folder, simulate(folder, "railings", "--sensor", "d435", "--frames", "20"))


def make_going_down(folder: Path) -> bytes:
    """A stairwell in the floor, seen from above."""
    recording = simulate(folder, "descending", "--sensor", "kinect_v2", "--robot", "spot", "--frames", "20")
    return narrowed(draw_best_frame(folder, recording), 800)


def make_open_risers(folder: Path) -> bytes:
    """Treads with nothing between them: what ``inspect`` shows of a frame."""
    options = ("--sensor", "kinect_v1", "--factor", "0.5", "--frames", "20")
    recording = simulate(folder, "open_risers", *options)
    results = stairmap("detect", recording, "--no-overlays", output=folder / "detect")
    lines = (results / "detections.jsonl").read_text().splitlines()
    found = [bool(json.loads(line)["observations"]) for line in lines]
    number = max(index for index, is_found in enumerate(found) if is_found)
    picture = stairmap("inspect", recording, "--frame", str(number), output=folder / "frame.png")
    return narrowed(picture.read_bytes(), 1300)


def make_bookshelf(folder: Path) -> bytes:
    """Edges one above the other that are no stairs."""
    return draw_best_frame(folder, simulate(folder, "bookshelf", "--sensor", "d435", "--frames", "12"))


def make_half_turn(folder: Path) -> bytes:
    """A stairwell measured by a laser scanner: plan and elevations, with the points behind."""
    stairway, points = scan(folder, "half_turn", "scanner_3mm")
    return png_from_figure(draw_stairway_in_cloud(stairway, points), dots_per_inch=85)


def make_slam_map(folder: Path) -> bytes:
    """A robot's own map: noisy, and each wall there twice."""
    stairway, points = scan(folder, "quarter_turn", "slam_15mm")
    return png_from_figure(draw_view(stairway, points), dots_per_inch=90)


def scan(folder: Path, scene: str, kind: str) -> tuple[Stairway, Points]:
    """Measure a finished map of a scene, and return the stairway found in it and the points."""
    cloud = folder / f"{scene}.ply"
    if not cloud.exists():
        folder.mkdir(parents=True, exist_ok=True)
        scanned = FinishedMap(make_scene(scene, 1), MAP_KINDS[kind], seed=1)
        measured = np.concatenate([part.points for part in scanned.parts()]).astype("<f4")
        header = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(measured)}\n"
            "property float x\nproperty float y\nproperty float z\nend_header\n"
        )
        cloud.write_bytes(header.encode() + measured.tobytes())
    run = stairmap("scan", cloud, "--no-report", output=folder / "scan")
    stairway = max(load_stairways(run).stairways, key=lambda item: len(item.flights))
    return stairway, np.concatenate(list(open_cloud(cloud).chunks()))


def make_verdicts(folder: Path) -> bytes:
    """What four robots can climb."""
    options = ("--sensor", "d435", "--factor", "0.5", "--frames", "60")
    recording = simulate(folder, "two_stairways", *options)
    run = stairmap("run", recording, "--no-report", output=folder / "run")
    robots = [word for name in ("spot", "go2", "b2", "wheeled") for word in ("--robot", name)]
    picture = stairmap("check", run, *robots, output=folder / "verdicts.png", option="--picture")
    return narrowed(picture.read_bytes(), 1200)


def make_two_floors(folder: Path) -> bytes:
    """A house that a robot explored by itself, and a way from one floor to the other."""
    mission = stairmap("explore", "two_floors", "--robot", "spot", "--seed", "1", output=folder / "mission")
    maps = [
        word
        for file in sorted((mission / "maps").glob("level_*.yaml"))
        for word in ("--map", f"{file.stem.removeprefix('level_')}={file}")
    ]
    positions = load_tum_trajectory(mission / "trajectory.tum").map_from_camera[:, :3, 3]
    upstairs = positions[positions[:, 2] > positions[:, 2].mean() + 1.0]
    goal = upstairs[np.argmax(upstairs[:, 1] - upstairs[:, 0])]
    way = ("--from", _place(positions[0], 0), "--to", _place(goal, 1))
    plan = stairmap("plan", mission, *maps, "--robot", "spot", *way, output=folder / "plan")
    return narrowed((plan / "plan.png").read_bytes(), 1300)


def _place(position: Points, level: int) -> str:
    return f"{position[0]:.1f},{position[1]:.1f},{level}"


def narrowed(png: bytes, width: int) -> bytes:
    """Return a picture no wider than so many pixels."""
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    if picture.shape[1] > width:
        size = (width, round(picture.shape[0] * width / picture.shape[1]))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".png", picture)[1].tobytes())


CASES: tuple[Callable[[Path], bytes], ...] = (
    make_going_up,
    make_going_down,
    make_open_risers,
    make_bookshelf,
    make_half_turn,
    make_slam_map,
    make_verdicts,
    make_two_floors,
)

OVERLAYS = (make_going_up, make_going_down, make_bookshelf)
"""Pictures of depth images."""

if __name__ == "__main__":
    main(Path(sys.argv[1]))
