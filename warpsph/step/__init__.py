"""The time step."""
