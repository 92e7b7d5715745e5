"""A histogram as an SVG picture."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array

WIDTH, HEIGHT, BORDER = 320, 180, 24
"""Size of the picture and room for its words, px."""

NUM_BINS = 30


def histogram_svg(values: Float64Array, *, name: str, unit: str) -> str:
    """Return a histogram with its axis, median and extent written on it.

    Parameters
    ----------
    values
        (N,) finite values, N ≥ 1.
    name, unit
        What is drawn; plain words.
    """
    low, high = float(values.min()), float(values.max())
    if high - low < 1e-9:
        low, high = low - 0.5, high + 0.5
    counts, edges = np.histogram(values, bins=NUM_BINS, range=(low, high))
    scale = (HEIGHT - 2 * BORDER) / max(int(counts.max()), 1)
    step = (WIDTH - 2 * BORDER) / NUM_BINS
    floor = HEIGHT - BORDER
    bars = "".join(
        f'<rect x="{BORDER + index * step:.1f}" y="{floor - count * scale:.1f}" width="{step - 1:.1f}" '
        f'height="{count * scale:.1f}"><title>{edges[index]:.1f} to {edges[index + 1]:.1f} {unit}: {count}'
        "</title></rect>"
        for index, count in enumerate(counts.tolist())
    )
    median = float(np.median(values))
    return (
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="distribution of {name}">'
        f'<text x="{BORDER}" y="15">{name}, {unit} · median {median:.1f} · {len(values):,} flights</text>'
        f'{bars}<line x1="{BORDER}" y1="{floor}" x2="{WIDTH - BORDER}" y2="{floor}"/>'
        f'<text x="{BORDER}" y="{HEIGHT - 6}">{low:.1f}</text>'
        f'<text x="{WIDTH - BORDER}" y="{HEIGHT - 6}" text-anchor="end">{high:.1f}</text>'
        f'<text x="{BORDER - 4}" y="{BORDER + 12}" text-anchor="end">{int(counts.max())}</text></svg>'
    )
