"""Accuracy against cost: cases with exact solutions, over the choices of the discretisation."""
