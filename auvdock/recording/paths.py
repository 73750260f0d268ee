"""Names of the recording's entities and timelines, shared by what is logged and by the blueprint that shows it."""

from __future__ import annotations

__all__ = [
    "APPLICATION_ID",
    "AZIMUTH",
    "AZIMUTH_BELIEVED",
    "AZIMUTH_FIX",
    "AZIMUTH_TRUE",
    "BEAMS",
    "BEARINGS",
    "BELIEVED",
    "CAMERA",
    "COMMANDS",
    "CONTACT",
    "CURRENT",
    "CURRENT_ARROW",
    "DETECTIONS",
    "ESTIMATES",
    "FRAME",
    "FUNNEL",
    "HULL",
    "IMAGE",
    "LEVEL_STATE",
    "LIGHTS",
    "LIGHT_COUNTS",
    "MODE_LOG",
    "MODE_NUMBER",
    "MODE_STATE",
    "PATH",
    "PLACE",
    "PLACE_ANGLE",
    "PLATFORM",
    "POSE_ANGLE",
    "POSE_ERROR",
    "RANGE",
    "RANGE_SIGMA",
    "REPROJECTION",
    "ROTATING_BEAM",
    "SIM_TIME",
    "SPEED",
    "STATION",
    "SUMMARY",
    "TAG_OUTLINE",
    "TRACKS",
    "TUBE",
    "VEHICLE",
    "WORLD",
]

APPLICATION_ID = "auvdock"

SIM_TIME = "sim_time"
"""Timeline: simulated seconds since the episode began."""
FRAME = "frame"
"""Timeline: number of the control period, from 0."""

WORLD = "/world"
STATION = "/world/station"
FUNNEL = "/world/station/funnel"
TUBE = "/world/station/tube"
PLATFORM = "/world/station/platform"
LIGHTS = "/world/station/lights"
BEAMS = "/world/station/beams"
ROTATING_BEAM = "/world/station/rotating_beam"
"""Frame of the rotating beacon's beam by the vehicle's clock: x along the beam, but for its elevation."""
VEHICLE = "/world/vehicle"
HULL = "/world/vehicle/hull"
CAMERA = "/world/vehicle/camera"
IMAGE = "/world/vehicle/camera/image"
DETECTIONS = "/world/vehicle/camera/detections"
TRACKS = "/world/vehicle/camera/tracks"
BEARINGS = "/world/vehicle/camera/bearings"
TAG_OUTLINE = "/world/vehicle/camera/tag"
"""The tag's outline where level II's own pose puts it."""
PATH = "/world/camera_path"
"""True path of the camera, comparable with `ESTIMATES`."""
ESTIMATES = "/world/camera_estimates"
"""Camera positions from measured poses."""
BELIEVED = "/world/believed"
"""Where the pilot believes the camera to be, by the rotating beacon: two standard deviations."""
CURRENT_ARROW = "/world/current"

PLACE = "/plots/place_error_m"
"""Landing: ξ, η, ζ of the vehicle's seat, true and estimated."""
PLACE_ANGLE = "/plots/place_error_deg"
"""Landing: ψ, true and estimated."""
POSE_ERROR = "/plots/pose_error_m"
POSE_ANGLE = "/plots/pose_angle_deg"
REPROJECTION = "/plots/reprojection_px"
RANGE = "/plots/range_m"
SPEED = "/plots/speed_m_s"
LIGHT_COUNTS = "/plots/lights"
COMMANDS = "/plots/commands"
CURRENT = "/plots/current_m_s"
CONTACT = "/plots/contact_n"

AZIMUTH = "/plots/azimuth_deg"
AZIMUTH_TRUE = "/plots/azimuth_deg/true"
AZIMUTH_BELIEVED = "/plots/azimuth_deg/believed"
AZIMUTH_FIX = "/plots/azimuth_deg/fix"
RANGE_SIGMA = "/plots/range_sigma_m"

LEVEL_STATE = "/perception/level"
"""Landing: what the frame's pose rests on."""
MODE_NUMBER = "/mode/number"
MODE_STATE = "/mode/state"
MODE_LOG = "/mode/log"
SUMMARY = "/summary"
