"""A free surface that moves: found, and freed of its tractions."""
