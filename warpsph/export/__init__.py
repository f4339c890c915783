"""Keeps the frames of a run, and turns them into pictures, USD stages and ParaView files."""
