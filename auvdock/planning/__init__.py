"""Where a layout of beacons can be seen, on the light model that the renderer uses."""
