"""Light from a lamp by single photons: phase functions, walks, and the table of the halo that they make."""
