"""What reaches the camera in one frame, and the steps by which nuisances change it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from auvdock.core.arrays import Array, BoolArray
from auvdock.numeric.records import Records
from auvdock.optics.arrival import Arrival

__all__ = ["Beam", "Flakes", "Moment", "Step", "View"]


class Beam(NamedTuple):
    """The rotating beacon's beam beside its lamp, in pieces along its image.

    Attributes:
        angle_rad: angle between the beam's axis and the line from lamp to camera.
        ray_camera: (3,) unit direction to the lamp.
        along_camera: (3,) unit direction, normal to that, in which the beam's image runs.
        edge_rad: (k + 1,) borders of the pieces, apparent angle from the lamp.
        rays_camera: (k, 3) unit directions to the pieces.
        range_m: (k,) distances of the pieces.
        scattering_depth: (k,) b times the path over which the light spreads.
        light_w_m2: (k,) irradiance from each.
        width_rad: (k,) standard deviation of the beam across, as seen from the camera.
    """

    angle_rad: float
    ray_camera: Array
    along_camera: Array
    edge_rad: Array
    rays_camera: Array
    range_m: Array
    scattering_depth: Array
    light_w_m2: Array
    width_rad: Array


class Flakes(NamedTuple):
    """The brightest flakes of marine snow in view.

    Attributes:
        pixels: (k, 2) positions.
        irradiance_w_m2: (k,) light of each at the lens.
        sigma_px: (k,) size on the sensor.
    """

    pixels: Array
    irradiance_w_m2: Array
    sigma_px: Array


class Moment(NamedTuple):
    """When a frame is taken, and for how long.

    Attributes:
        time_s: time of mid exposure by the vehicle's clock.
        station_time_s: the same by the station's clock, which turns the rotating beacon.
        exposure_s: time over which the rotating beacon's light is averaged.
    """

    time_s: float
    station_time_s: float
    exposure_s: float


class View(NamedTuple):
    """What the lamps send into the camera in one frame.

    Attributes:
        T_world_camera: (4, 4).
        T_station_camera: (4, 4).
        arrivals: (n,) light of every lamp, nuisances included.
        beam: what is seen of the rotating beacon beside its lamp, None without one.
        flakes: marine snow, None without.
    """

    T_world_camera: Array
    T_station_camera: Array
    arrivals: Records[Arrival]
    beam: Beam | None = None
    flakes: Flakes | None = None

    @property
    def depth_m(self) -> float:
        """The camera's depth."""
        return -float(self.T_world_camera[2, 3])

    @property
    def pixels(self) -> Array:
        """(n, 2) positions on the sensor; they mean something where `inside` or near it."""
        return self.arrivals["pixel"]

    @property
    def inside(self) -> BoolArray:
        """(n,) lamps whose centre falls on the sensor."""
        return self.arrivals["inside"]

    @property
    def in_sight(self) -> BoolArray:
        """(n,) lamps that shine from before the camera, on the sensor or beside it."""
        arrivals = self.arrivals
        return (arrivals["halo_w_m2"] + arrivals["core_w_m2"] > 0.0) & (arrivals["ray_camera"][:, 2] > 0.0)


Step = Callable[[View, Moment], View]
"""What a nuisance does to a view; the rows of `arrivals` it changes in place."""
