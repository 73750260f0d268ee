"""Beacons, stations and vehicles as data."""

import dataclasses

import numpy as np
import pytest

from auvdock.core.beacons import BeaconCfg, BeaconLayout, ring_layout
from auvdock.core.contracts import Command, Detections
from auvdock.core.errors import ConfigError
from auvdock.core.station import ConicalStationCfg, FunnelCfg, load_conical_station
from auvdock.core.vehicle import load_vehicle


def test_the_papers_array_has_its_named_places_and_opposite_pairs():
    positions = BeaconLayout(ring_layout(6, 1.0)).array_positions_m
    right, up = positions[:, 1], positions[:, 2]
    assert np.argmax(right) == 1  # B1 right-most
    assert np.argmin(right) == 4  # B4 left-most
    assert up[[0, 5]] == pytest.approx(np.sqrt(0.75))  # B0, B5 at the top
    assert up[[2, 3]] == pytest.approx(-np.sqrt(0.75))  # B2, B3 at the bottom
    for one, other in ((0, 3), (1, 4), (2, 5)):
        assert np.allclose(positions[one] + positions[other], 0.0, atol=1e-12)


def test_beams_tilt_inwards():
    for beacon in ring_layout(6, 1.0, inward_tilt_deg=6.0):
        outwards = np.array(beacon.position_m)
        assert np.degrees(np.arcsin(-np.dot(beacon.axis, outwards))) == pytest.approx(6.0, abs=1e-9)


def test_three_array_lights_are_refused():
    with pytest.raises(ConfigError, match="at least 4"):
        BeaconLayout(ring_layout(3, 1.0))


def test_twice_the_same_name_is_refused():
    ring = ring_layout(4, 1.0)
    with pytest.raises(ConfigError, match="different name"):
        BeaconLayout((*ring, ring[0]))


@pytest.mark.parametrize(
    "change",
    [{"role": "disco"}, {"wavelength_nm": 900.0}, {"power_w": 0.0}, {"efficiency": 1.5}, {"axis": (0.0, 0.0, 0.0)}],
)
def test_impossible_lamps_are_refused(change):
    with pytest.raises(ConfigError, match=next(iter(change))):
        dataclasses.replace(ring_layout(4, 1.0)[0], **change)


def test_conical_preset_has_array_far_and_entrance_lights_where_the_station_can_hold_them():
    station = load_conical_station()
    layout = station.layout
    assert len(layout.indices("array")) == 6
    assert len(layout.indices("long_range")) == 1
    assert len(layout.indices("entrance")) >= 2
    funnel = station.funnel
    for index in layout.indices("entrance"):
        x, y, z = layout.positions_m[index]
        wall = funnel.tube_radius_m + (funnel.mouth_radius_m - funnel.tube_radius_m) * (x / funnel.length_m + 1.0)
        assert funnel.tube_radius_m < np.hypot(y, z) <= wall + 0.01


def test_a_tube_wider_than_its_mouth_is_refused():
    with pytest.raises(ConfigError, match="tube_radius_m"):
        FunnelCfg(tube_radius_m=1.5)


def test_own_beacons_replace_the_ring():
    station = ConicalStationCfg(array_count=0, beacons=ring_layout(5, 0.8))
    assert len(station.layout.beacons) == 5


def test_vehicle_fits_the_tube_and_has_sources():
    vehicle = load_vehicle("remus_hybrid")
    assert vehicle.radius_m < load_conical_station().funnel.tube_radius_m
    assert np.all(np.linalg.eigvalsh(vehicle.added_mass_body + vehicle.rigid_body_mass_body) > 0.0)
    for group in (vehicle.added_mass, vehicle.linear_damping, vehicle.quadratic_damping, vehicle.lift_damping):
        assert all(coefficient.source and coefficient.unit for coefficient in group)
    assert all(actuator.source for actuator in vehicle.actuators)


def test_empty_detections_select_and_count():
    empty = Detections.empty()
    assert len(empty) == 0
    assert len(empty.select(np.zeros(0, dtype=np.bool_))) == 0


def test_detections_of_unequal_length_are_refused():
    with pytest.raises(ValueError, match="centre_px"):
        Detections(np.zeros((2, 4)), np.zeros((1, 2)), np.zeros(2), np.zeros(2, dtype=np.int64))


def test_command_default_setpoints_are_not_shared():
    first, second = Command(np.zeros(7)), Command(np.zeros(7))
    first.setpoint["surge_m_s"] = 1.0
    assert second.setpoint == {}


def test_beacon_is_hashable_data():
    assert len({BeaconCfg("a", "array", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 450.0, 1.0, 0.5, 45.0)}) == 1
