"""What is done to node sets: sweeps, waves, sources, conditions, motion. Kernels gather, they never scatter."""
