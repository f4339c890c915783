"""Measures of fields: NumPy arrays in, numbers out."""
