"""What every room shares: the contracts between rooms, frames of reference, cameras, beacons and strict config."""
