"""Warp, and nothing of the method: precision, compiling, launching, arrays, small matrices."""
