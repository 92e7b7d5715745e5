"""IFC, read back by ifcopenshell: entities, schema, geometry."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

from stairmap.errors import MissingPackageError, OutputError
from stairmap.export.geojson import EarthAnchor
from stairmap.export.ifc import dump_ifc
from stairmap.navigation.floors import FloorStack, find_floors
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


def world_mesh(product):
    """Return vertices (N, 3) and triangles (M, 3) of a product in the world."""
    import ifcopenshell.geom  # noqa: PLC0415

    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    geometry = ifcopenshell.geom.create_shape(settings, product).geometry
    return np.array(geometry.verts).reshape(-1, 3), np.array(geometry.faces).reshape(-1, 3)


def test_a_landing_is_its_whole_rectangle_facing_up(model):
    (slab,) = model.by_type("IfcSlab")
    vertices, triangles = world_mesh(slab)
    landing = STAIRWAYS[0].landings[0]
    half = np.array([0.6, 1.25, 0.0])
    assert vertices.min(axis=0) == pytest.approx(landing.center - half, abs=1e-5)
    assert vertices.max(axis=0) == pytest.approx(landing.center + half, abs=1e-5)
    first, second, third = vertices[triangles].swapaxes(0, 1)
    normals = np.cross(second - first, third - first) / 2
    assert normals.sum(axis=0) == pytest.approx([0.0, 0.0, 1.2 * 2.5], abs=1e-4)
    assert (normals[:, 2] > 0).all()
    assert slab.PredefinedType == "LANDING"


def test_a_flight_lies_as_its_surface_riser_by_riser(model):
    """Its faces cover as much ground and height as treads and risers do, and face up and down the stairs."""
    (flight,) = [item for item in model.by_type("IfcStairFlight") if item.Name.startswith("stairway 2")]
    vertices, triangles = world_mesh(flight)
    first, second, third = vertices[triangles].swapaxes(0, 1)
    total = (np.cross(second - first, third - first) / 2).sum(axis=0)
    risers, treads = 18 * 0.17 * 1.2, 17 * 0.28 * 1.2
    expected = [-risers * np.cos(0.7), -risers * np.sin(0.7), treads]
    assert total == pytest.approx(expected, abs=1e-3)


def test_a_flight_is_drawn_in_its_own_frame_at_its_base_and_heading(model):
    (flight,) = [item for item in model.by_type("IfcStairFlight") if item.Name.startswith("stairway 2")]
    placement = flight.ObjectPlacement.RelativePlacement
    # Its storey stands at 3.06 m.
    assert placement.Location.Coordinates == pytest.approx((2.0, 6.0, 0.0))
    assert placement.Axis.DirectionRatios == (0.0, 0.0, 1.0)
    assert placement.RefDirection.DirectionRatios == pytest.approx((np.cos(0.7), np.sin(0.7), 0.0))
    points = np.array(flight.Representation.Representations[0].Items[0].Coordinates.CoordList)
    assert points.min(axis=0) == pytest.approx([0.0, -0.6, 0.0], abs=1e-5)
    assert points.max(axis=0) == pytest.approx([17 * 0.28, 0.6, 18 * 0.17], abs=1e-5)
    assert not flight.Representation.Representations[0].Items[0].Closed


def test_everything_else_stands_at_the_origin_unturned(model):
    for kind in ("IfcSite", "IfcBuilding", "IfcStair", "IfcSlab"):
        for product in model.by_type(kind):
            placement = product.ObjectPlacement.RelativePlacement
            assert placement.Location.Coordinates == (0.0, 0.0, 0.0)
            assert placement.RefDirection.DirectionRatios == (1.0, 0.0, 0.0)
    (context,) = model.by_type("IfcGeometricRepresentationContext")
    assert context.CoordinateSpaceDimension == 3
    assert context.Precision == 1e-5
    assert context.WorldCoordinateSystem.Location.Coordinates == (0.0, 0.0, 0.0)
    assert context.WorldCoordinateSystem.RefDirection.DirectionRatios == (1.0, 0.0, 0.0)


def test_units_are_metres_and_radians(model):
    assert {unit.UnitType: (unit.Prefix, unit.Name) for unit in model.by_type("IfcSIUnit")} == {
        "LENGTHUNIT": (None, "METRE"), "PLANEANGLEUNIT": (None, "RADIAN")
    }  # fmt: skip


def test_parts_are_named_by_their_numbers_from_one(model):
    names = {item.Name for kind in ("IfcStairFlight", "IfcSlab") for item in model.by_type(kind)}
    assert names == {
        "stairway 1, flight 1", "stairway 1, flight 2", "stairway 1, landing 1", "stairway 2, flight 1"
    }  # fmt: skip
    assert len({item.GlobalId for item in model.by_type("IfcRoot")}) == len(model.by_type("IfcRoot"))


def test_all_that_was_measured_of_a_flight_stands_there(model):
    from ifcopenshell.util import element  # noqa: PLC0415

    (flight,) = [item for item in model.by_type("IfcStairFlight") if item.Name.startswith("stairway 2")]
    values = element.get_psets(flight)["Stairmap_Measured"]
    assert values["TreadLengthStd"] == pytest.approx(0.003)
    assert values["WidthStd"] == pytest.approx(0.02)
    assert values["RightEndSeen"] is True
    assert flight.PredefinedType == "STRAIGHT"


def test_a_flight_of_one_riser_has_no_tread(tmp_path):
    stairway = make_stairway(make_flight(num_risers=1, rise=0.4))
    dump_ifc([stairway], find_floors([stairway]), tmp_path / "a.ifc")
    (flight,) = ifcopenshell.open(str(tmp_path / "a.ifc")).by_type("IfcStairFlight")
    assert (flight.NumberOfRisers, flight.NumberOfTreads) == (1, 0)


def test_without_a_floor_there_is_a_building_without_storeys(tmp_path):
    dump_ifc([], FloorStack(floors=(), levels={}), tmp_path / "a.ifc")
    model = ifcopenshell.open(str(tmp_path / "a.ifc"))
    assert len(model.by_type("IfcBuilding")) == 1
    assert not model.by_type("IfcBuildingStorey")


def test_storeys_are_placed_at_their_heights(model):
    for storey in model.by_type("IfcBuildingStorey"):
        x, y, z = storey.ObjectPlacement.RelativePlacement.Location.Coordinates
        assert (x, y) == (0.0, 0.0)
        assert z == pytest.approx(storey.Elevation)
    heights = sorted(storey.Elevation for storey in model.by_type("IfcBuildingStorey"))
    assert heights == pytest.approx([0, 3.06, 6.12])


def test_a_stair_names_the_storeys_that_it_joins(model):
    from ifcopenshell.util import element  # noqa: PLC0415

    for stair, (lower, upper) in zip(model.by_type("IfcStair"), ((0, 1), (1, 2)), strict=True):
        assert stair.Description == f"from floor {lower} to floor {upper}"
        assert element.get_container(stair).Name == f"floor {lower}"
        (reference,) = [
            relation for relation in model.by_type("IfcRelReferencedInSpatialStructure")
            if stair in relation.RelatedElements
        ]  # fmt: skip
        assert reference.RelatingStructure.Name == f"floor {upper}"


def ids_of(path):
    return {item.GlobalId for item in ifcopenshell.open(str(path)).by_type("IfcRoot")}


def test_other_buildings_have_other_ids_and_the_same_one_has_the_same(path, tmp_path):
    """Two buildings in one viewer overwrote each other: all had the ids of 'stairway 1'."""
    other = (make_half_turn(height=3.2), SECOND)
    dump_ifc(other, find_floors(other), tmp_path / "other.ifc")
    dump_ifc(STAIRWAYS, find_floors(STAIRWAYS), tmp_path / "again.ifc")
    assert not ids_of(path) & ids_of(tmp_path / "other.ifc")
    assert ids_of(path) == ids_of(tmp_path / "again.ifc")


def test_an_anchor_is_written_as_a_map_conversion(tmp_path):
    import ifcopenshell.validate  # noqa: PLC0415

    anchor = EarthAnchor(latitude=48.2628, longitude=11.6681, bearing=90.0, height=520.0)
    dump_ifc(STAIRWAYS, find_floors(STAIRWAYS), tmp_path / "a.ifc", anchor=anchor)
    model = ifcopenshell.open(str(tmp_path / "a.ifc"))
    (conversion,) = model.by_type("IfcMapConversion")
    assert conversion.TargetCRS.Name == "EPSG:32632"
    # As PROJ has it.
    assert conversion.Eastings == pytest.approx(698007.2777, abs=0.001)
    assert conversion.Northings == pytest.approx(5348951.4485, abs=0.001)
    assert conversion.OrthogonalHeight == 520.0
    # East lies 2 degrees off the grid's east here.
    turn = np.degrees(np.arctan2(conversion.XAxisOrdinate, conversion.XAxisAbscissa))
    assert turn == pytest.approx(1.9916, abs=0.001)
    (site,) = model.by_type("IfcSite")
    assert site.RefLatitude == (48, 15, 46, 80000)
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, logger, express_rules=False)
    assert logger.statements == []
