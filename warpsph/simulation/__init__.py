"""Runs a scene and lets observers look at it."""
