"""Cells made anew from the places of nodes (METHOD section 9): state stands at nodes, so nothing is transferred."""
