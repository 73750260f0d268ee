"""Light to pixels: beacons, water, camera; and the same radiometry without an image."""
