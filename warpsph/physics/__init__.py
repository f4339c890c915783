"""Pure device functions: stresses, unknowns, waves, smoothing functions."""
