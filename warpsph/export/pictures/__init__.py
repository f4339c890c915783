"""Pictures by matplotlib: `history` curves, a `field` on the body, a `sheet` of the run, the free `surface`."""
