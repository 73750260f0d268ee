"""Truth: vehicle, hydrodynamics, ocean, station and their MuJoCo scene."""
