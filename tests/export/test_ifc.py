"""IFC, read back by ifcopenshell: entities, schema, geometry."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

from stairmap.errors import MissingPackageError, OutputError
from stairmap.export.ifc import dump_ifc
from stairmap.navigation.floors import find_floors
from walkable_stairways import make_flight, make_half_turn, make_stairway, make_std

ifcopenshell = pytest.importorskip("ifcopenshell", reason="needs the extra ifc")

SECOND = make_stairway(
    make_flight(base=(2.0, 6.0, 3.06), heading=0.7, rise=0.17, num_risers=18, left_bounded=False),
    stairway_id=2,
)  # fmt: skip
STAIRWAYS = (make_half_turn(), SECOND)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("ifc") / "stairs.ifc"
    dump_ifc(STAIRWAYS, find_floors(STAIRWAYS), path)
    return path


@pytest.fixture(scope="module")
def model(path):
    return ifcopenshell.open(str(path))


def test_the_file_is_valid_by_the_schema(model):
    import ifcopenshell.validate  # noqa: PLC0415

    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, logger, express_rules=False)
    assert logger.statements == []


def test_flights_have_their_risers_treads_and_measures(model):
    flights = {flight.Name: flight for flight in model.by_type("IfcStairFlight")}
    assert len(flights) == 3
    flight = flights["stairway 2, flight 1"]
    assert (flight.NumberOfRisers, flight.NumberOfTreads) == (18, 17)
    assert flight.RiserHeight == pytest.approx(0.17)
    assert flight.TreadLength == pytest.approx(0.28)


def test_stairs_stand_in_the_storey_of_their_lower_end(model):
    from ifcopenshell.util import element  # noqa: PLC0415

    storeys = {stair.Name: element.get_container(stair) for stair in model.by_type("IfcStair")}
    assert storeys["stairway 1"].Elevation == pytest.approx(0.0)
    assert storeys["stairway 2"].Elevation == pytest.approx(3.06)
    parts = element.get_parts(model.by_type("IfcStair")[0])
    assert sorted(part.is_a() for part in parts) == ["IfcSlab", "IfcStairFlight", "IfcStairFlight"]


def test_what_was_measured_stands_in_a_property_set(model):
    from ifcopenshell.util import element  # noqa: PLC0415

    (flight,) = [item for item in model.by_type("IfcStairFlight") if item.Name.startswith("stairway 2")]
    values = element.get_psets(flight)["Stairmap_Measured"]
    assert values["Width"] == pytest.approx(1.2)
    assert values["RiserHeightStd"] == pytest.approx(0.002)
    assert values["LeftEndSeen"] is False


def test_the_geometry_lies_where_the_stairs_are(model):
    import ifcopenshell.geom  # noqa: PLC0415

    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    (flight,) = [item for item in model.by_type("IfcStairFlight") if item.Name.startswith("stairway 2")]
    shape = ifcopenshell.geom.create_shape(settings, flight)
    vertices = np.array(shape.geometry.verts).reshape(-1, 3)
    expected = SECOND.flights[0].surface()[0]
    assert vertices.min(axis=0) == pytest.approx(expected.min(axis=0), abs=1e-4)
    assert vertices.max(axis=0) == pytest.approx(expected.max(axis=0), abs=1e-4)


def test_the_same_stairways_give_the_same_file(path, tmp_path):
    dump_ifc(STAIRWAYS, find_floors(STAIRWAYS), tmp_path / "again.ifc")
    again = (tmp_path / "again.ifc").read_text()
    assert again == path.read_text()


def test_a_deviation_that_is_not_known_is_left_out(tmp_path):
    stairway = make_stairway(make_flight(std=make_std(rise=float("nan"))))
    dump_ifc([stairway], find_floors([stairway]), tmp_path / "a.ifc")
    assert "RiserHeightStd" not in (tmp_path / "a.ifc").read_text()


def test_a_path_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        dump_ifc(STAIRWAYS, find_floors(STAIRWAYS), tmp_path / "none" / "a.ifc")


def test_without_ifcopenshell_the_extra_is_named(tmp_path, monkeypatch):
    real_import = builtins.__import__

    def refuse(name, *arguments, **options):
        if name.startswith("ifcopenshell"):
            raise ImportError(name)
        return real_import(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(MissingPackageError, match=r"stairmap\[ifc\]"):
        dump_ifc(STAIRWAYS, find_floors(STAIRWAYS), tmp_path / "a.ifc")
