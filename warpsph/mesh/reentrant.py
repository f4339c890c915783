"""Where a body's boundary turns inwards: the corners of notches, the inner corners of steps."""

from __future__ import annotations

import math

import numpy as np

from .mesh import Mesh

LEAST_TURN = math.radians(50.0)  # less is a smooth hollow


def reentrant_nodes(mesh: Mesh) -> np.ndarray:
    """Which nodes lie on two boundary faces that look at each other, boolean, shape (n,).

    Around such a node is more than half a space of material: it carries stress as one inside does, though both of
    its faces are free.
    """
    corners = mesh.faces.shape[1]
    face = np.repeat(np.arange(len(mesh.faces)), corners)
    node = mesh.faces.ravel()
    order = np.argsort(node, kind="stable")
    face, node = face[order], node[order]
    start = np.searchsorted(node, node, "left")
    place, count = np.arange(len(node)) - start, np.bincount(node, minlength=len(mesh.nodes))[node]
    middles, normals = mesh.nodes[mesh.faces].mean(axis=1), mesh.face_normals()
    found = np.zeros(len(mesh.nodes), dtype=bool)
    for step in range(1, int(count.max(initial=1))):
        other = face[start + (place + step) % count]
        way = middles[other] - mesh.nodes[node]
        faces_it = np.sum(way * normals[face], axis=1) > 0.0
        sharp = np.sum(normals[other] * normals[face], axis=1) < math.cos(LEAST_TURN)
        found[node[faces_it & sharp]] = True
    return found
