"""Draws what the method is made of, for docs/method.md: cells, both kinds of node, corners, a frame, a support.

python tools/cell_picture.py    # writes docs/images/cell.svg
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.collections import PolyCollection

from warpsph import Box, Numerics
from warpsph.export.pictures.figures import BRIGHT, DARK, GREY, new_figure

PATH = Path(__file__).resolve().parent.parent / "docs" / "images" / "cell.svg"
SIZE = (5, 4)  # of the body [cells]
SUPPORT = Numerics(velocity_scheme="blanc-pastor").support  # [Δx]
SHOWN = 9  # the cell that is looked at
INWARDS = 0.3  # where a corner's number stands, from the corner towards the middle
STYLE = {"svg.fonttype": "none", "svg.hashsalt": "warpsph", "font.family": "sans-serif"}


def leaning(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cells as a motion has left them."""
    return x + 0.18 * y * (1.0 - 0.12 * x), y + 0.05 * x * (4.0 - x) / 4.0


def draw(axes) -> None:
    """The picture, into axes."""
    mesh = Box(SIZE, 1.0).mapped(leaning).mesh()
    corners = mesh.nodes[mesh.cells]
    middles = corners.mean(axis=1)
    middle, frame = middles[SHOWN], mesh.cell_jacobians()[SHOWN]
    axes.add_collection(
        PolyCollection(
            corners[:, mesh.kind.drawn],
            facecolors=["#fbe9d3" if k == SHOWN else "none" for k in range(len(corners))],
            edgecolors=GREY,
        )
    )
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    reach = middle[:, None] + SUPPORT * np.stack([np.cos(angle), np.sin(angle)])
    axes.plot(*mesh.nodes.T, "o", color=DARK, label="node: mass, position, v, σ, internal variables")
    hollow = {"markerfacecolor": "white", "zorder": 3}
    axes.plot(
        *middles.T,
        "s",
        color=BRIGHT,
        label="auxiliary node, in the middle of a cell",
        **hollow,
    )
    axes.plot(*reach, "--", color=BRIGHT, label="its support of W, in sums over neighbours")
    axes.quiver(
        *np.tile(middle[:, None], 2),
        *(0.42 * frame),
        color=DARK,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.006,
        zorder=4,
    )
    axes.plot([], [], color=DARK, marker=">", label="frame of a cell: ∂x/∂ξ in its middle")
    for name, axis in zip(("ξ₁", "ξ₂"), frame.T, strict=True):
        axes.annotate(name, middle + 0.5 * axis, ha="center", va="center")
    for k, corner in enumerate(corners[SHOWN]):
        axes.annotate(str(k), corner + INWARDS * (middle - corner), ha="center", va="center", color=GREY)
    axes.plot([], [], " ", marker="$0$", color=GREY, label="corners of a cell, in the order of its table")
    axes.set(aspect="equal")
    axes.axis("off")


def main() -> int:
    with matplotlib.rc_context(STYLE):
        figure = new_figure((7.0, 6.6))
        axes = figure.add_subplot()
        draw(axes)
        figure.legend(loc="outside lower center", frameon=False)
        figure.savefig(PATH, metadata={"Date": None})
    print(PATH)
    return 0


if __name__ == "__main__":
    sys.exit(main())
