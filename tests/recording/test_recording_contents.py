"""Episodes recorded, then read back with Rerun's own reader."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from recording_reader import Recording
from synthetic_episode import MODES, POSE_OFFSET_STATION_M, YAW_ERROR_DEG, make_result, make_setup, ticks

from auvdock.core.contracts import RED, Bearing
from auvdock.core.station import ConicalStationCfg
from auvdock.episode.trace import EpisodeSetup
from auvdock.metrics.tick import Tick
from auvdock.recording import paths
from auvdock.recording.rerun_recorder import RerunRecorder

pytestmark = pytest.mark.filterwarnings("error::rerun.error_utils.RerunWarning")
COUNT = 100


def record(path: Path, setup: EpisodeSetup, episode: list[Tick], **options: int) -> Recording:
    recorder = RerunRecorder(path, **options)
    recorder.on_start(setup)
    for tick in episode:
        recorder.on_tick(tick)
    recorder.on_end(make_result())
    recorder.close()
    return Recording(path)


@pytest.fixture(scope="module")
def setup() -> EpisodeSetup:
    return make_setup(160, 90)


@pytest.fixture(scope="module")
def episode(setup: EpisodeSetup) -> list[Tick]:
    return list(ticks(setup, COUNT))


@pytest.fixture(scope="module")
def recording(setup: EpisodeSetup, episode: list[Tick], tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp("recording") / "run.rrd", setup, episode)


def test_every_period_is_there_on_both_timelines(recording: Recording) -> None:
    column = recording.column(paths.VEHICLE, "Transform3D:translation")
    assert column.frames == list(range(COUNT))
    np.testing.assert_allclose(column.times_s, np.arange(COUNT) / 30.0, atol=1e-8)


def test_vehicle_pose_is_the_true_one(recording: Recording, episode: list[Tick]) -> None:
    translation = recording.column(paths.VEHICLE, "Transform3D:translation").values
    mat3x3 = recording.column(paths.VEHICLE, "Transform3D:mat3x3").values
    T = np.array([tick.truth.T_world_body for tick in episode])
    np.testing.assert_allclose(np.array(translation)[:, 0], T[:, :3, 3], atol=1e-5)
    stored = np.array(mat3x3).reshape(-1, 3, 3).transpose(0, 2, 1)  # Rerun stores matrices column by column
    np.testing.assert_allclose(stored, T[:, :3, :3], atol=1e-6)


def test_path_is_one_unbroken_line_through_the_true_camera_positions(
    recording: Recording, setup: EpisodeSetup, episode: list[Tick]
) -> None:
    segments = np.array(recording.column(paths.PATH, "LineStrips3D:strips").values)[:, 0]
    camera = np.array([(tick.truth.T_world_body @ setup.camera.T_body_camera)[:3, 3] for tick in episode])
    np.testing.assert_allclose(segments[:, 1], camera, atol=1e-5)
    np.testing.assert_allclose(segments[1:, 0], segments[:-1, 1], atol=1e-6)


def test_pose_error_is_what_the_estimates_are_off_by(recording: Recording, episode: list[Tick]) -> None:
    errors = recording.column(paths.POSE_ERROR, "Scalars:scalars").values
    angles = recording.column(paths.POSE_ANGLE, "Scalars:scalars").values
    along, lateral, vertical = POSE_OFFSET_STATION_M
    for tick, error, angle in zip(episode, errors, angles, strict=True):
        assert tick.percept is not None
        assert tick.percept.pose is not None
        if tick.percept.pose.measured:
            assert error == pytest.approx([lateral, vertical, along], abs=1e-9)
            assert angle == pytest.approx([YAW_ERROR_DEG], abs=1e-6)
        else:
            assert error == []
            assert angle == []


def test_estimates_are_off_the_true_path_by_the_same(
    recording: Recording, setup: EpisodeSetup, episode: list[Tick]
) -> None:
    column = recording.column(paths.ESTIMATES, "Points3D:positions")
    assert column.frames == [frame for frame in range(COUNT) if frame % 4 != 3]  # the others were predicted
    camera = np.array([(episode[f].truth.T_world_body @ setup.camera.T_body_camera)[:3, 3] for f in column.frames])
    np.testing.assert_allclose(
        np.array(column.values)[:, 0] - camera, np.tile(POSE_OFFSET_STATION_M, (75, 1)), atol=1e-5
    )


def test_detections_are_boxes_around_the_pixels_that_were_detected(recording: Recording, episode: list[Tick]) -> None:
    centres = recording.column(paths.DETECTIONS, "Boxes2D:centers").values
    halves = recording.column(paths.DETECTIONS, "Boxes2D:half_sizes").values
    colours = recording.column(paths.DETECTIONS, "Boxes2D:colors").values
    for tick, centre, half, colour in zip(episode, centres, halves, colours, strict=True):
        assert tick.percept is not None
        detections = tick.percept.detections
        # Half a pixel: Rerun counts from the first pixel's corner, the package from its centre.
        np.testing.assert_allclose(np.reshape(centre, (-1, 2)), detections.centre_px + 0.5, atol=1e-4)
        np.testing.assert_allclose(half, np.full((len(detections), 2), 5.0), atol=1e-4)
        assert len(set(colour)) == len(set(detections.class_id.tolist()))
        by_class = {int(kind): shade for kind, shade in zip(detections.class_id, colour, strict=True)}
        assert [by_class[int(kind)] for kind in detections.class_id] == colour


def test_tracks_carry_beacon_names_or_track_numbers(recording: Recording, episode: list[Tick]) -> None:
    labels = recording.column(paths.TRACKS, "Points2D:labels").values
    for tick, label in zip(episode, labels, strict=True):
        assert tick.percept is not None
        expected = [f"B{t.beacon_id}" if t.beacon_id is not None else f"#{t.track_id}" for t in tick.percept.tracks]
        assert label == expected
    assert {"B0", "B3", "#107"} <= {name for label in labels for name in label}


def test_bearings_are_named(setup: EpisodeSetup, episode: list[Tick], tmp_path: Path) -> None:
    bearing = Bearing(np.array([0.0, 0.0, 1.0]), np.array([80.0, 45.0]), 0.9)
    first, second, third = episode[0], episode[1], episode[2]
    assert first.percept is not None
    both = dataclasses.replace(first.percept, long_range=bearing, entrance=bearing)
    one = dataclasses.replace(first.percept, entrance=bearing)
    recording = record(
        tmp_path / "run.rrd",
        setup,
        [dataclasses.replace(first, percept=both), dataclasses.replace(second, percept=one), third],
    )
    assert recording.column(paths.BEARINGS, "Points2D:labels").values == [["far", "entrance"], ["entrance"], []]


def test_modes_as_number_state_and_log(recording: Recording, episode: list[Tick]) -> None:
    changed = [0] + [i for i in range(1, COUNT) if episode[i].command.mode != episode[i - 1].command.mode]
    states = recording.column(paths.MODE_STATE, "StateChange:state")
    log = recording.column(paths.MODE_LOG, "TextLog:text")
    assert states.frames == log.frames == changed
    assert [state for (state,) in states.values] == list(MODES)
    assert all(mode in text for mode, (text,) in zip(MODES, log.values, strict=True))
    numbers = recording.column(paths.MODE_NUMBER, "Scalars:scalars").values
    assert [number for (number,) in numbers] == [MODES.index(tick.command.mode) for tick in episode]


def test_plots_hold_the_episode(recording: Recording, setup: EpisodeSetup, episode: list[Tick]) -> None:
    def series(path: str) -> np.ndarray:
        return np.array(recording.column(path, "Scalars:scalars").values)

    truths = [tick.truth for tick in episode]
    np.testing.assert_allclose(series(paths.COMMANDS), [tick.command.values for tick in episode])
    np.testing.assert_allclose(series(paths.CURRENT), [truth.current_world_m_s for truth in truths])
    np.testing.assert_allclose(series(paths.CONTACT)[:, 0], [truth.contact_force_n for truth in truths])
    np.testing.assert_allclose(series(paths.RANGE)[:, 0], [math.hypot(*truth.nose_station_m) for truth in truths])
    speeds = series(paths.SPEED)
    np.testing.assert_allclose(speeds[:, 0], 1.0)  # made so
    np.testing.assert_allclose(speeds[:, 1], [math.hypot(1.0, truth.current_world_m_s[1]) for truth in truths])
    np.testing.assert_allclose(series(paths.REPROJECTION.replace("reprojection_px", "lights"))[:, 2], 6.0)
    assert recording.static(paths.COMMANDS, "SeriesLines:names") == list(setup.vehicle.actuator_names)


def test_scene_has_the_station_as_it_is(recording: Recording, setup: EpisodeSetup) -> None:
    assert isinstance(setup.station, ConicalStationCfg)
    layout = setup.station.layout
    np.testing.assert_allclose(recording.static(paths.LIGHTS, "Points3D:positions"), layout.positions_m, atol=1e-6)
    for beacon in layout.beacons:
        assert f"{paths.BEAMS}/{beacon.name}" in recording.entities
    funnel = np.array(recording.static(paths.FUNNEL, "Mesh3D:vertex_positions"))
    radii = np.hypot(funnel[:, 1], funnel[:, 2])
    assert radii.max() == pytest.approx(setup.station.funnel.mouth_radius_m, abs=1e-6)
    assert radii.min() == pytest.approx(setup.station.funnel.tube_radius_m, abs=1e-6)
    tube = np.array(recording.static(paths.TUBE, "Mesh3D:vertex_positions"))
    assert tube[:, 0].min() == pytest.approx(-setup.station.funnel.length_m - setup.station.funnel.tube_length_m)
    (station,) = recording.static(paths.STATION, "Transform3D:translation")
    assert station == pytest.approx([0.0, 0.0, -setup.station.depth_m])
    (length,) = recording.static(paths.HULL, "Capsules3D:lengths")
    (radius,) = recording.static(paths.HULL, "Capsules3D:radii")
    assert length + 2 * radius == pytest.approx(setup.vehicle.nose_x_m - setup.vehicle.tail_x_m, abs=1e-6)


def test_pinhole_projects_the_optical_axis_to_the_image_centre(recording: Recording, setup: EpisodeSetup) -> None:
    (matrix,) = recording.static(paths.CAMERA, "Pinhole:image_from_camera")
    centre = np.array(matrix).reshape(3, 3).T @ np.array([0.0, 0.0, 1.0])
    assert centre == pytest.approx([setup.camera.width_px / 2, setup.camera.height_px / 2, 1.0])


def test_result_is_a_table(recording: Recording) -> None:
    (text,) = recording.static(paths.SUMMARY, "TextDocument:text")
    assert "| outcome | **docked** |" in text
    assert "| distortion rate | 4.13 % |" in text
    assert "| invalid frames | 10 |" in text
    assert "| vertical error at entry | - |" in text
    assert "| heading error at entry | 3.0° |" in text


def test_the_blueprint_shows_only_what_was_recorded(recording: Recording) -> None:
    assert len(recording.blueprints) == 1
    assert recording.blueprints[0].application_id == recording.recordings[0].application_id
    origins = recording.blueprint_values("ViewBlueprint:space_origin")
    classes = recording.blueprint_values("ViewBlueprint:class_identifier")
    shown = dict.fromkeys(classes)
    assert {"3D", "2D", "TimeSeries", "TextLog", "TextDocument", "StateTimeline"} <= set(shown)
    for origin in origins:
        below = {entity for entity in recording.entities if (entity + "/").startswith(origin.rstrip("/") + "/")}
        assert below, origin
    plots = {entity for entity in recording.temporal_entities if entity.startswith("/plots/")}
    assert plots <= set(origins)


def test_without_an_image_the_marks_lie_on_black(recording: Recording, setup: EpisodeSetup) -> None:
    column = recording.column(paths.IMAGE, "EncodedImage:blob")
    assert column.frames == [0]
    image = cv2.imdecode(np.array(column.values[0][0], dtype=np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert image.shape == (setup.camera.height_px, setup.camera.width_px, 3)
    assert image.max() == 0


@pytest.mark.parametrize("image_every", [1, 3])
def test_images_keep_their_colours(setup: EpisodeSetup, episode: list[Tick], tmp_path: Path, image_every: int) -> None:
    image = np.zeros((90, 160, 3), dtype=np.uint8)
    image[:, :80] = (200, 20, 10)
    image[:, 80:] = (10, 30, 180)
    shown = [dataclasses.replace(tick, image=image) for tick in episode[:10]]
    column = record(tmp_path / "run.rrd", setup, shown, image_every=image_every).column(
        paths.IMAGE, "EncodedImage:blob"
    )
    assert column.frames == list(range(0, 10, image_every))
    for (blob,) in column.values:
        decoded = cv2.imdecode(np.array(blob, dtype=np.uint8), cv2.IMREAD_COLOR)
        assert decoded is not None
        rgb = cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB)
        np.testing.assert_allclose(rgb[40, 20], image[40, 20], atol=6)  # JPEG's loss on even areas
        np.testing.assert_allclose(rgb[40, 140], image[40, 140], atol=6)


def test_without_lights_every_frame_clears_the_marks(setup: EpisodeSetup, tmp_path: Path) -> None:
    recording = record(tmp_path / "run.rrd", setup, list(ticks(setup, 20, lights=False)))
    assert recording.column(paths.DETECTIONS, "Boxes2D:centers").values == [[]] * 20
    assert recording.column(paths.TRACKS, "Points2D:positions").values == [[]] * 20
    assert recording.column(paths.POSE_ERROR, "Scalars:scalars").values == [[]] * 20
    assert recording.column(paths.LIGHT_COUNTS, "Scalars:scalars").values == [[0.0, 0.0, 0.0]] * 20
    assert paths.ESTIMATES not in recording.temporal_entities


def test_periods_without_a_frame_leave_the_marks_standing(
    setup: EpisodeSetup, episode: list[Tick], tmp_path: Path
) -> None:
    sparse = [tick if index % 3 == 0 else dataclasses.replace(tick, percept=None) for index, tick in enumerate(episode)]
    recording = record(tmp_path / "run.rrd", setup, sparse)
    assert recording.column(paths.DETECTIONS, "Boxes2D:centers").frames == list(range(0, COUNT, 3))
    assert recording.column(paths.VEHICLE, "Transform3D:translation").frames == list(range(COUNT))
    blind = record(tmp_path / "blind.rrd", setup, [dataclasses.replace(tick, percept=None) for tick in episode])
    assert paths.DETECTIONS not in blind.temporal_entities


def test_lost_tracks_look_different(setup: EpisodeSetup, episode: list[Tick], tmp_path: Path) -> None:
    percept = episode[-40].percept
    assert percept is not None
    assert any(track.class_id == RED for track in percept.tracks)
    lost = dataclasses.replace(percept, tracks=tuple(track._replace(missed=3) for track in percept.tracks))
    recording = record(
        tmp_path / "run.rrd",
        setup,
        [dataclasses.replace(episode[0], percept=percept), dataclasses.replace(episode[1], percept=lost)],
    )
    seen, gone = recording.column(paths.TRACKS, "Points2D:colors").values
    assert len(set(seen)) == 2  # identified and not
    assert len(set(gone)) == 1
    assert not set(gone) & set(seen)


def test_a_minute_without_images_is_small(setup: EpisodeSetup, episode: list[Tick], tmp_path: Path) -> None:
    full = make_setup()
    path = tmp_path / "run.rrd"
    record(path, full, list(ticks(full, 600)))
    assert path.stat().st_size < 5e6 / 3  # 5 MB a minute, 600 periods are a third of one
