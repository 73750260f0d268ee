import numpy as np
import pytest

from auvdock.cli.fit_landing import run, sample_landing_poses
from auvdock.core.calibrated_camera import CalibratedCameraCfg
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import load_vehicle
from auvdock.envs.landing_world import belly_camera


def test_poses_put_the_camera_over_the_platform():
    camera = belly_camera(CalibratedCameraCfg(), load_vehicle("bluerov2_heavy"))
    poses = sample_landing_poses(300, camera, 10.0, np.random.default_rng(0))
    cameras = np.array([pose @ camera.T_body_camera for pose in poses])
    heights = cameras[:, 2, 3] + 10.0
    assert 0.3 <= heights.min() < 0.35
    assert 6.5 < heights.max() <= 7.0
    # Looking down, and most of them with the station's centre in view.
    assert np.all(cameras[:, 2, 2] < -0.9)
    centres = np.array([(np.array([0.0, 0.0, -10.0]) - T[:3, 3]) @ T[:3, :3] for T in cameras])
    assert np.mean(camera.in_view(centres)) > 0.8
    assert sample_landing_poses(0, camera, 10.0, np.random.default_rng(0)) == []


def test_unknown_detectors_are_refused_before_a_frame_is_drawn(tmp_path):
    files = ["--out-lights", str(tmp_path / "a.toml"), "--out-tags", str(tmp_path / "b.toml")]
    with pytest.raises(ConfigError):
        run(["nobody", "apriltag", *files], "auvdock fit-landing")
    with pytest.raises(ConfigError):
        run(["cores", "nobody", *files], "auvdock fit-landing")
