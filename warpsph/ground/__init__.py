"""The ground floor: precision, smoothing functions, kinematics, materials. Pure functions only."""
