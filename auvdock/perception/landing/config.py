"""How a landing vehicle sees: the settings of the two levels, their fusion and its filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from auvdock.core.checked import Checked
from auvdock.core.limits import Count, NotNegative, Positive, at_least
from auvdock.perception.landing.tag_families import TagFamily
from auvdock.perception.tracker import TrackerCfg

__all__ = [
    "LEVELS",
    "AttitudeCfg",
    "FilterCfg",
    "Fusion",
    "LandingPerceptionCfg",
    "Levels",
    "LightLevelCfg",
    "TagLevelCfg",
]

Levels = Literal["both", "lights", "tag"]
"""Which levels are used."""
LEVELS: tuple[Levels, ...] = get_args(Levels)
Fusion = Literal["ekf", "weighted"]
"""The filter of remark 1, or the bare weighted mean P_out = K1 P_L + K2 P_A of each frame."""


@dataclass(frozen=True)
class AttitudeCfg(Checked):
    """What the vehicle may believe of its own attitude; standard deviations."""

    tilt_noise_deg: Positive = 0.1
    """Inclinometer, white, per axis (TCM-class modules)."""
    tilt_bias_deg: Positive = 0.2
    """Inclinometer's alignment, constant over a flight, per axis (same data sheets)."""
    heading_deg: Positive = 3.0
    """Compass, as the lights' and the tag's poses use it: ours, far more than its data sheet's 0.5°, since the
    platform's steel is near and the marks know the heading better."""


@dataclass(frozen=True)
class LightLevelCfg(Checked):
    """Level I: the lights."""

    centre_sigma_px: Positive = 0.05
    """Standard deviation of a small light's centre, per axis; ours. Rendered frames give 0.01 px to 0.02 px; no
    calibration in water is better than this."""
    centre_sigma_widths: NotNegative = 0.002
    """In addition this share of the box's width: the halo of a near light is not round (paper C, section 2.2)."""
    max_reprojection_px: Positive = 2.0
    """A mean reprojection error above this, in units of σ where that is above 1 px, means wrong identities."""
    max_lights_n: Annotated[int, at_least(3)] = 12
    """Only the surest detections take part in finding the identities."""
    max_height_error_m: NotNegative = 0.5
    """A pose whose height contradicts the pressure gauge and the station's depth by more is refused when identities are
    found. Ours: tide and chart leave some decimetres; 0 switches the check off."""
    confirm_n: Count = 3
    """Consecutive frames that must agree, the vehicle's motion taken out, before a first pose is believed."""
    min_odds: Positive = 1000.0
    """A pose that lights alone begin must be so many times more likely than strays in their places (`evidence`): strays
    alone reach that in no more than one of so many frames. Ours."""
    gate_px: Positive = 25.0
    """Farthest that a light may be from where the filter expects it."""


@dataclass(frozen=True)
class TagLevelCfg(Checked):
    """Level II: the tag."""

    family: TagFamily = "36h11"
    """36h11, 36h10, 25h9, 16h5 (AprilTag) or 4x4, 5x5, 6x6, 7x7 (ArUco)."""
    clahe: bool = False
    """Equalise contrast before the tag is looked for."""
    corner_sigma_px: NotNegative = 0.25
    """In addition to what the detector says of its corners; ours. Blur pulls all corners inwards by some hundredths of
    a pixel, in every frame alike: over two seconds of frames this white noise weighs what a constant 0.04 px does."""
    max_reprojection_px: Positive = 2.0
    """A mean reprojection error of the corners above this, in units of σ where that is above 1 px, is no tag."""
    whole_frame_every_n: Count = 10
    """While the tag is not found where it is expected, every so manieth frame is searched as a whole."""


@dataclass(frozen=True)
class FilterCfg(Checked):
    """Dead reckoning between frames, and what is believed of a measurement; standard deviations."""

    velocity_noise_m_s: Positive = 0.003
    """DVL bottom lock, white (Workhorse Navigator 1200 kHz)."""
    velocity_scale_error: NotNegative = 0.002
    """DVL's scale, constant over a flight (same data sheet)."""
    gyro_noise_rad_s: Positive = 0.0005
    """Gyroscopes, white (ADIS1648x)."""
    gyro_bias_rad_s: NotNegative = 0.0002
    """Gyroscopes' bias after zeroing (same class)."""
    gate: Positive = 27.9
    """A level whose squared Mahalanobis distance from the prediction is beyond this is left out: 1e-4 of χ² with six
    degrees of freedom."""
    reset_after_n: Count = 10
    """Consecutive frames, agreeing with one another, after which a level that is left out, and that no other level
    contradicts, is believed."""


@dataclass(frozen=True)
class LandingPerceptionCfg(Checked):
    """How a landing vehicle sees."""

    detector: str = "cores"
    """Of lights: "cores" (for near lights), "threshold", "blob" or your own as "package.module:Name"."""
    tag_detector: str = "apriltag"
    """Of the tag: "apriltag", or "contour" (paper C's way: Canny, contours, quadrilateral)."""
    levels: Levels = "both"
    """"both", "lights" or "tag"."""
    fusion: Fusion = "ekf"
    """"ekf" or "weighted"."""
    station_yaw_deg: float = 0.0
    """Heading of the station's centre line in the world, as surveyed."""
    max_missed_lights_n: Count = 60
    """T_L: consecutive frames without the lights after which level I counts as dead. Ours, 3 s at 20 Hz."""
    max_missed_tag_n: Count = 60
    """T_A: likewise for the tag and level II. The pose is lost once both are dead (remark 2, against the paper's
    loop test, which goes on only while both are alive)."""
    tracker: TrackerCfg = TrackerCfg()
    """Tracks of lights, for the bearing to their group."""
    attitude: AttitudeCfg = AttitudeCfg()
    lights: LightLevelCfg = LightLevelCfg()
    tag: TagLevelCfg = TagLevelCfg()
    filter: FilterCfg = FilterCfg()
