"""What a data set is drawn from: strict TOML; `assets/datasets/default.toml` holds all, a file of one's own changes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated

from auvdock.assets import asset
from auvdock.core.camera import SidePx
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, NotNegative, Positive, Share, above, at_least, between
from auvdock.core.strict import load_toml, merge, names_file, read_toml
from auvdock.dataset.rules import LabelRules
from auvdock.optics.water import load_water

__all__ = [
    "CameraDraw",
    "DatasetCfg",
    "ExposureDraw",
    "LightDraw",
    "NuisanceDraw",
    "PoseDraw",
    "RangeDraw",
    "SceneDraw",
    "WaterDraw",
    "load_dataset_cfg",
]

Span = tuple[NotNegative, NotNegative]
"""Least and greatest value of what is drawn between them."""


def _ordered(owner: Checked, *names: str) -> None:
    """Refuse spans (low, high) that are not in order, and such that begin at 0 where a logarithm is drawn."""
    for name in names:
        low, high = getattr(owner, name)
        if low > high:
            raise ConfigError(name, [low, high], "the smaller value first")


def _absorption_per_m(water: str, field: str) -> float:
    """Of a water by name or file, at 450 nm."""
    try:
        return load_water(water).absorption_per_m[0]
    except ConfigError as error:
        raise ConfigError(field, water, error.remedy) from error


@dataclass(frozen=True)
class SceneDraw(Checked):
    """Shares of the kinds of scene; they need not add up to 1."""

    array: NotNegative
    """A ring of lights on a funnel, with a far lamp and red entrance lamps or without."""
    rotating_front: NotNegative
    """The same below a rotating beacon whose beam faces the camera."""
    rotating_side: NotNegative
    """The same with the beam turned away, so that it glows from the side."""
    landing: NotNegative
    """Five lights and an AprilTag on a platform, seen from above by a camera with lamps."""
    unlit: NotNegative
    """Either station with no light at all, lit by the vehicle's lamps: nothing to be found but the tag."""
    conditions: Count
    """Waters, lamps and nuisances that a scene is seen in; station and camera stay."""
    frames: Count
    """Frames in each of these."""
    depth_m: tuple[Annotated[float, between(4.0, 200.0)], Annotated[float, between(4.0, 200.0)]]
    """Of the station's origin, even in its logarithm."""

    def __post_init__(self) -> None:
        """Refuse scenes of no kind."""
        _ordered(self, "depth_m")
        if not self.array + self.rotating_front + self.rotating_side + self.landing + self.unlit > 0.0:
            raise ConfigError("array", self.array, "a share above 0 to at least one kind of scene")


@dataclass(frozen=True)
class LightDraw(Checked):
    """Lamps of a ring and of a platform."""

    counts: tuple[Annotated[int, between(1, 64)], ...]
    """Numbers of lights that shine on a ring; fewer than four are a ring of four with dead ones."""
    ring_radius_m: Span
    """Of the mouth whose rim carries the ring."""
    power_w: tuple[Positive, Positive]
    """Electrical power of each light, even in its logarithm."""
    beam_angle_deg: tuple[Annotated[float, between(5.0, 180.0)], Annotated[float, between(5.0, 180.0)]]
    """Full beam angle at half of the peak."""
    far_share: Share
    """Of scenes on a funnel with the far lamp above the mouth."""
    red_share: Share
    """Of scenes on a funnel with the red entrance lamps."""
    dead_share: Share
    """Of lights that do not shine, each by itself."""

    def __post_init__(self) -> None:
        """Refuse a choice of nothing."""
        _ordered(self, "ring_radius_m", "power_w", "beam_angle_deg")
        if not self.counts:
            raise ConfigError("counts", self.counts, "at least one number of lights")
        if not 0.3 <= self.ring_radius_m[0] <= self.ring_radius_m[1] <= 3.0:
            raise ConfigError("ring_radius_m", self.ring_radius_m, "radii of 0.3 m to 3 m")


@dataclass(frozen=True)
class WaterDraw(Checked):
    """Waters: a preset's colour and scattering, made as turbid as is drawn."""

    names: tuple[str, ...]
    """Presets or files; of these one whose absorption at 450 nm leaves room for scattering."""
    attenuation_per_m: tuple[Positive, Positive]
    """Beam attenuation c at 450 nm, even in its logarithm."""

    def __post_init__(self) -> None:
        """Refuse waters that do not exist, and a clearest water that none of them can be."""
        _ordered(self, "attenuation_per_m")
        if not self.names:
            raise ConfigError("names", self.names, "at least one water")
        clearest = min(_absorption_per_m(name, f"names[{k}]") for k, name in enumerate(self.names))
        if self.attenuation_per_m[0] < clearest / 0.8:
            remedy = f"{clearest / 0.8:.3g} 1/m or more: absorption takes up to four fifths of it in the clearest water"
            raise ConfigError("attenuation_per_m", self.attenuation_per_m, f"a first number of {remedy}")


@dataclass(frozen=True)
class RangeDraw(Checked):
    """Distance between camera and station, drawn as c · range at 450 nm, the number of attenuation lengths."""

    least_m: Annotated[float, at_least(0.5)]
    """Nearest."""
    most_m: Positive
    """Farthest from a funnel."""
    most_height_m: Positive
    """Farthest from a platform."""
    edges: tuple[NotNegative, ...]
    """Borders of the bands of c · range; within one it is even."""
    train: tuple[NotNegative, ...]
    """Shares of the bands in training and validation."""
    test: tuple[NotNegative, ...]
    """Shares in the test split: most at 5 to 14, for nearer by every detector finds all."""
    platform: tuple[NotNegative, ...]
    """Shares above a platform, in every split: its tag is lost beyond some 4."""

    def __post_init__(self) -> None:
        """Refuse bands out of order or without shares."""
        if len(self.edges) < 2 or any(low >= high for low, high in pairwise(self.edges)):
            raise ConfigError("edges", self.edges, "two or more rising numbers")
        for name in ("train", "test", "platform"):
            shares = getattr(self, name)
            if len(shares) != len(self.edges) - 1 or not sum(shares) > 0.0:
                raise ConfigError(name, shares, f"{len(self.edges) - 1} shares, one for each band, not all of them 0")
        if not self.least_m < min(self.most_m, self.most_height_m):
            raise ConfigError("least_m", self.least_m, "less than most_m and most_height_m")


@dataclass(frozen=True)
class PoseDraw(Checked):
    """Where the camera is and looks; standard deviations of Gaussians unless said otherwise."""

    azimuth_deg: NotNegative
    """From the approach axis; a rotating beacon is seen from all of ±80°, evenly."""
    elevation_deg: NotNegative
    """From the approach axis."""
    roll_deg: NotNegative
    """Of the camera."""
    aim_share: Share
    """Share of the field of view, evenly, in which the station's middle lies."""
    away_share: Share
    """Of frames that look elsewhere."""


@dataclass(frozen=True)
class CameraDraw(Checked):
    """Cameras; drawn evenly between two values. A platform is seen by the calibrated belly camera."""

    width_px: SidePx
    """Image width."""
    height_px: SidePx
    """Image height."""
    horizontal_fov_deg: tuple[Annotated[float, between(20.0, 110.0)], Annotated[float, between(20.0, 110.0)]]
    """Full horizontal field of view in water."""
    distortion: Annotated[float, between(0.0, 0.1)]
    """Greatest share by which the vertical field of view is more or less than a pinhole's."""
    lens_sigma_px: tuple[Positive, Positive]
    """Standard deviation of the point spread function."""
    f_number: tuple[Annotated[float, above(0.5)], Annotated[float, above(0.5)]]
    """Focal length over aperture."""
    full_well_e: tuple[Annotated[float, at_least(100.0)], Annotated[float, at_least(100.0)]]
    """Electrons at saturation."""
    read_noise_e: Span
    """Standard deviation in electrons."""
    lamp_radius_m: Span
    """Radius of a lamp's face."""
    linear_share: Share
    """Of conditions whose camera encodes linearly; the others' codes go with the root of light."""

    def __post_init__(self) -> None:
        """Refuse spans out of order, and pictures whose two fields of view cannot tell a distortion."""
        if self.height_px > 0.8 * self.width_px:
            raise ConfigError("height_px", self.height_px, "at most four fifths of width_px")
        _ordered(
            self,
            "horizontal_fov_deg",
            "lens_sigma_px",
            "f_number",
            "full_well_e",
            "read_noise_e",
            "lamp_radius_m",
        )


@dataclass(frozen=True)
class ExposureDraw(Checked):
    """Exposure: what auto-exposure settles at, times a factor for each frame; both even in their logarithm."""

    saturated_share: tuple[Annotated[float, between(1e-6, 0.4)], Annotated[float, between(1e-6, 0.4)]]
    """Share of saturated samples that auto-exposure wants."""
    factor: tuple[Positive, Positive]
    """Too dark and too bright."""

    def __post_init__(self) -> None:
        """Refuse spans out of order."""
        _ordered(self, "saturated_share", "factor")


@dataclass(frozen=True)
class NuisanceDraw(Checked):
    """Shares of the levels, for each kind of nuisance by itself, and of what else makes a frame hard."""

    none: NotNegative
    mild: NotNegative
    moderate: NotNegative
    severe: NotNegative
    lamp_share: Share
    """Of conditions before a funnel in which the vehicle's own lamps shine; above a platform they do in most."""
    jellyfish_share: Share
    """Of frames with jellyfish."""
    surfaces: bool
    """Draw station and floor; needs OpenGL."""

    def __post_init__(self) -> None:
        """Refuse levels of which none can be drawn."""
        if not self.none + self.mild + self.moderate + self.severe > 0.0:
            raise ConfigError("none", self.none, "a share above 0 to at least one level")


@dataclass(frozen=True)
class DatasetCfg(Checked):
    """All that a data set is drawn from, and the rules of its labels."""

    scenes: SceneDraw
    lights: LightDraw
    water: WaterDraw
    range: RangeDraw
    pose: PoseDraw
    camera: CameraDraw
    exposure: ExposureDraw
    nuisance: NuisanceDraw
    labels: LabelRules = LabelRules()


def load_dataset_cfg(name: str = "default") -> DatasetCfg:
    """A preset by name ("default"), or a TOML file ("mine.toml") of what differs from that preset.

    Raises:
        ConfigError: no such preset, or a file that does not fit.
    """
    if names_file(name):
        return merge(load_dataset_cfg(), read_toml(Path(name)))
    return load_toml(DatasetCfg, asset("datasets", name))
