"""Stairways as IFC 4 building elements: ``IfcStair`` with its ``IfcStairFlight`` and landings.

Needs ifcopenshell (extra ``ifc``), which no other module imports.
"""

from __future__ import annotations

import json
import math
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import IntArray, Points
from stairmap.errors import MissingPackageError
from stairmap.export.geojson import EarthAnchor
from stairmap.export.map_projection import utm_from_degrees
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.footprints import Rectangle
from stairmap.output_files import write_whole_text
from stairmap.stairway import Flight, Landing, Stairway, rounded
from stairmap.transforms import invert_transform, transform_points

_NAMESPACE = uuid.UUID("6f1d6f0c-5f0e-4d43-9d0e-9d3b6381a001")
"""Global ids are made from names in a space that follows from the stairways in this one."""


def dump_ifc(
    stairways: Sequence[Stairway], floors: FloorStack, path: Path, *, anchor: EarthAnchor | None = None
) -> None:
    """Write stairways to an IFC 4 file (STEP).

    A storey for each floor, placed at its height; an ``IfcStair`` in the storey of its lower end, which names
    both and is referenced by the upper one, made of ``IfcStairFlight`` with NumberOfRisers, NumberOfTreads,
    RiserHeight, TreadLength and the clean surface as triangles, and of ``IfcSlab`` for landings. Standard
    deviations stand in the property set ``Stairmap_Measured``. Lengths are m.

    Global ids follow from what is written: the same stairways have the same ones in every export, other
    buildings have others.

    Parameters
    ----------
    stairways, floors
        What there is.
    path
        The file.
    anchor
        Where the map lies on the earth: written as ``IfcMapConversion`` to the UTM zone of the place.

    Raises
    ------
    MissingPackageError
        If ifcopenshell is not installed.
    OutputError
        If the file cannot be written.
    """
    try:
        import ifcopenshell  # noqa: PLC0415
        import ifcopenshell.guid  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("ifcopenshell", "ifc", "writing IFC") from error
    namespace = uuid.uuid5(_NAMESPACE, json.dumps([stairway.to_dict() for stairway in stairways]))
    writer = _IfcWriter(ifcopenshell.file(schema="IFC4"), ifcopenshell.guid, namespace)
    writer.write(stairways, floors, anchor)
    # The time in the header would make two equal runs differ.
    writer.file.header.file_name.time_stamp = "1970-01-01T00:00:00"
    write_whole_text(path, writer.file.to_string())


class _IfcWriter:
    def __init__(self, file: Any, guid: Any, namespace: uuid.UUID) -> None:
        self.file, self._guid, self._namespace = file, guid, namespace
        self._make = file.create_entity
        origin = self._placement3d((0.0, 0.0, 0.0))
        self._context = self._make(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5,
            WorldCoordinateSystem=origin,
        )

    def write(
        self, stairways: Sequence[Stairway], floors: FloorStack, anchor: EarthAnchor | None = None
    ) -> None:
        units = self._make(
            "IfcUnitAssignment",
            Units=[
                self._make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE"),
                self._make("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
            ],
        )
        project = self._root(
            "IfcProject", "project", RepresentationContexts=[self._context], UnitsInContext=units
        )
        site = self._root("IfcSite", "site", ObjectPlacement=self._local(None))
        if anchor is not None:
            self._anchor(site, anchor)
        building = self._root("IfcBuilding", "building", ObjectPlacement=self._local(site.ObjectPlacement))
        self._aggregate(project, [site])
        self._aggregate(site, [building])
        storeys = {}
        for floor in floors.floors:
            storeys[floor.level] = self._root(
                "IfcBuildingStorey",
                f"floor {floor.level}",
                Elevation=rounded(floor.height),
                ObjectPlacement=self._local(building.ObjectPlacement, (0.0, 0.0, floor.height)),
            )
        if storeys:
            self._aggregate(building, list(storeys.values()))
        for stairway in stairways:
            lower, upper = (floors.floor(level) for level in floors.levels[stairway.id])
            storey = storeys[lower.level]
            stair = self._stair(stairway, storey.ObjectPlacement, lower.height)
            stair.Description = f"from floor {lower.level} to floor {upper.level}"
            self._root(
                "IfcRelReferencedInSpatialStructure",
                f"stairway {stairway.id} at its upper storey",
                RelatedElements=[stair],
                RelatingStructure=storeys[upper.level],
            )
            self._root(
                "IfcRelContainedInSpatialStructure",
                f"stairway {stairway.id} in its storey",
                RelatedElements=[stair],
                RelatingStructure=storey,
            )

    def _anchor(self, site: Any, anchor: EarthAnchor) -> None:
        """Say where the map lies on the earth: roughly in the site, exactly on a projected grid."""
        site.RefLatitude = _degrees_minutes_seconds(anchor.latitude)
        site.RefLongitude = _degrees_minutes_seconds(anchor.longitude)
        if anchor.height is not None:
            site.RefElevation = rounded(anchor.height)
        place = utm_from_degrees(anchor.latitude, anchor.longitude)
        # The x axis' bearing from the grid's north, as an angle from its east.
        angle = math.radians(90.0 - anchor.bearing) + place.convergence
        self._make(
            "IfcMapConversion",
            SourceCRS=self._context,
            TargetCRS=self._make(
                "IfcProjectedCRS",
                Name=f"EPSG:{place.epsg}",
                GeodeticDatum="WGS84",
                MapProjection="UTM",
                MapZone=f"{place.epsg % 100}{'N' if anchor.latitude >= 0 else 'S'}",
            ),
            Eastings=rounded(place.easting),
            Northings=rounded(place.northing),
            OrthogonalHeight=rounded(anchor.height or 0.0),
            XAxisAbscissa=math.cos(angle),
            XAxisOrdinate=math.sin(angle),
            Scale=1.0,
        )

    def _stair(self, stairway: Stairway, storey_placement: Any, height: float) -> Any:
        name = f"stairway {stairway.id}"
        stair = self._root("IfcStair", name, ObjectPlacement=self._local(storey_placement))
        parts = [
            self._flight(flight, f"{name}, flight {number}", stair.ObjectPlacement, height)
            for number, flight in enumerate(stairway.flights, start=1)
        ]
        parts += [
            self._landing(landing, f"{name}, landing {number}", stair.ObjectPlacement, height)
            for number, landing in enumerate(stairway.landings, start=1)
        ]
        self._aggregate(stair, parts)
        return stair

    def _flight(self, flight: Flight, name: str, parent: Any, height: float) -> Any:
        vertices, triangles = flight.surface()
        local = transform_points(invert_transform(flight.map_from_flight), vertices)
        product = self._root(
            "IfcStairFlight",
            name,
            ObjectPlacement=self._local(parent, flight.base - np.array([0.0, 0.0, height]), flight.heading),
            Representation=self._mesh(local, triangles),
            NumberOfRisers=flight.num_risers,
            NumberOfTreads=max(flight.num_risers - 1, 0),
            RiserHeight=rounded(flight.rise),
            TreadLength=rounded(flight.run),
            PredefinedType="STRAIGHT",
        )
        values = {
            "Width": flight.width,
            "RiserHeightStd": flight.std.rise,
            "TreadLengthStd": flight.std.run,
            "WidthStd": flight.std.width,
        }
        flags = {"LeftEndSeen": flight.left_bounded, "RightEndSeen": flight.right_bounded}
        properties = [
            self._property(key, "IfcReal", rounded(value))
            for key, value in values.items()
            if math.isfinite(value)
        ]
        properties += [self._property(key, "IfcBoolean", value) for key, value in flags.items()]
        properties_set = self._root(
            "IfcPropertySet", "Stairmap_Measured", key=f"{name}, measured", HasProperties=properties
        )
        self._root(
            "IfcRelDefinesByProperties",
            f"{name}, its properties",
            RelatedObjects=[product],
            RelatingPropertyDefinition=properties_set,
        )
        return product

    def _landing(self, landing: Landing, name: str, parent: Any, height: float) -> Any:
        x, y, z = landing.center
        corners = Rectangle(
            center=(x, y), heading=landing.heading, length=landing.size[0], width=landing.size[1]
        ).corners()
        vertices = np.column_stack([corners, np.full(len(corners), z - height)])
        triangles = np.array([[0, 1, 2], [0, 2, 3]])
        return self._root(
            "IfcSlab",
            name,
            ObjectPlacement=self._local(parent),
            Representation=self._mesh(vertices, triangles),
            PredefinedType="LANDING",
        )

    def _property(self, name: str, kind: str, value: Any) -> Any:
        return self._make("IfcPropertySingleValue", Name=name, NominalValue=self._make(kind, value))

    def _mesh(self, vertices: Points, triangles: IntArray) -> Any:
        points = self._make("IfcCartesianPointList3D", CoordList=rounded(vertices))
        faces = self._make(
            "IfcTriangulatedFaceSet", Coordinates=points, Closed=False, CoordIndex=(triangles + 1).tolist()
        )
        shape = self._make(
            "IfcShapeRepresentation",
            ContextOfItems=self._context,
            RepresentationIdentifier="Body",
            RepresentationType="Tessellation",
            Items=[faces],
        )
        return self._make("IfcProductDefinitionShape", Representations=[shape])

    def _local(self, parent: Any, position: Any = (0.0, 0.0, 0.0), heading: float = 0.0) -> Any:
        return self._make(
            "IfcLocalPlacement",
            PlacementRelTo=parent,
            RelativePlacement=self._placement3d(position, heading),
        )

    def _placement3d(self, position: Any, heading: float = 0.0) -> Any:
        direction = (math.cos(heading), math.sin(heading), 0.0)
        return self._make(
            "IfcAxis2Placement3D",
            Location=self._make("IfcCartesianPoint", rounded(position)),
            Axis=self._make("IfcDirection", (0.0, 0.0, 1.0)),
            RefDirection=self._make("IfcDirection", direction),
        )

    def _aggregate(self, whole: Any, parts: list[Any]) -> None:
        self._root("IfcRelAggregates", f"parts of {whole.Name}", RelatingObject=whole, RelatedObjects=parts)

    def _root(self, kind: str, name: str, *, key: str | None = None, **attributes: Any) -> Any:
        identity = uuid.uuid5(self._namespace, f"{kind} {key or name}")
        return self._make(kind, GlobalId=self._guid.compress(identity.hex), Name=name, **attributes)


def _degrees_minutes_seconds(degrees: float) -> tuple[int, int, int, int]:
    """An angle as IFC has it: degrees, minutes, seconds and millionths of a second, all of one sign."""
    total = round(abs(degrees) * 3_600_000_000)
    sign = 1 if degrees >= 0 else -1
    seconds, millionths = divmod(total, 1_000_000)
    minutes, second = divmod(seconds, 60)
    degree, minute = divmod(minutes, 60)
    return sign * degree, sign * minute, sign * second, sign * millionths
