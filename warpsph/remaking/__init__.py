"""Cells made anew from the places of nodes: state stands at nodes, so nothing is transferred."""
