"""Keeps the frames of a run, and turns them into pictures, USD stages and ParaView files.

The solver knows none of it: what is here observes a simulation, or reads a run's folder.
"""
