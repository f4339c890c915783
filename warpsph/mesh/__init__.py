"""Geometry, NumPy only: nodes, cells and faces, and the kinds of cell."""
