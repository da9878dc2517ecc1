"""Classes of the tables of scene files, for completion and for scenes that Python builds; `help(Run)` lists its keys.

from gudgeon.models import Bar, Body, Component, Contact, Interface, Material, Plane, Run, Scene
"""

from gudgeon.pipeline.geometry.cad.part import CadPart
from gudgeon.pipeline.geometry.matrices.part import Matrices
from gudgeon.pipeline.geometry.mesh_file import CylinderShape, MeshFile, PlaneShape
from gudgeon.pipeline.geometry.plane_file import PlaneFile
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.bladed_sector import BladedSector
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.cylinder import Cylinder
from gudgeon.pipeline.geometry.shapes.frame import Frame, Member
from gudgeon.pipeline.geometry.shapes.liner import Liner
from gudgeon.pipeline.geometry.shapes.piston import Piston
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.plate import Plate
from gudgeon.pipeline.geometry.shapes.rigid import Rigid
from gudgeon.pipeline.geometry.shapes.ring import Ring
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.geometry.shapes.sphere import Sphere
from gudgeon.pipeline.scenes.bodies import SceneFile as Scene
from gudgeon.pipeline.scenes.component import Change, Component, MeshSettings, PointMass, Profile
from gudgeon.pipeline.scenes.gauge import Channel, Gauge, Sensor
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material, Orthotropic
from gudgeon.pipeline.scenes.modes import ModesSettings
from gudgeon.pipeline.scenes.report import FullFE, Plot, Report
from gudgeon.pipeline.scenes.supports import Support
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.fields.electrostatic import Adhesion, Electrostatic, ElectrostaticPressure, ParallelPlates
from gudgeon.solver.forces.gas import GasPressure
from gudgeon.solver.forces.given import GivenForce, GivenPressure, GivenTorque, GivenWrench
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.joints.bearing import JournalBearing
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.coupled import Driven, Gear
from gudgeon.solver.joints.markers import (
    Axial,
    Cylindrical,
    Distance,
    Fixed,
    Marker,
    Planar,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.joints.wear import JournalWear
from gudgeon.solver.laws.archard import Archard, ContactWear
from gudgeon.solver.obstacles.bore import Bore
from gudgeon.solver.obstacles.plane import Edge, Plane
from gudgeon.solver.scene.body import Body
from gudgeon.solver.scene.contact import Contact, Friction, MasterSurface, OtherBody
from gudgeon.solver.scene.damping import Damping
from gudgeon.solver.scene.motion import Rotation, Translation
from gudgeon.solver.scene.orientation import Orientation
from gudgeon.solver.scene.probe import DistanceProbe, ForceProbe, PointProbe
from gudgeon.solver.scene.run import Limits, Run

__all__ = [
    "Adhesion",
    "Archard",
    "Axial",
    "Bar",
    "Beam",
    "BladedSector",
    "Body",
    "Bore",
    "Box",
    "Bushing",
    "CadPart",
    "Change",
    "Channel",
    "Clearance",
    "Component",
    "Contact",
    "ContactWear",
    "Cylinder",
    "CylinderShape",
    "Cylindrical",
    "Damping",
    "Distance",
    "DistanceProbe",
    "Driven",
    "Edge",
    "Electrostatic",
    "ElectrostaticPressure",
    "ExternalForce",
    "Fixed",
    "ForceProbe",
    "Frame",
    "Friction",
    "FullFE",
    "GasPressure",
    "Gauge",
    "Gear",
    "GivenForce",
    "GivenPressure",
    "GivenTorque",
    "GivenWrench",
    "Interface",
    "JournalBearing",
    "JournalWear",
    "Limits",
    "Liner",
    "Marker",
    "MasterSurface",
    "Material",
    "Matrices",
    "Member",
    "MeshFile",
    "MeshSettings",
    "ModesSettings",
    "MovingForce",
    "Orientation",
    "Orthotropic",
    "OtherBody",
    "ParallelPlates",
    "Piston",
    "Planar",
    "Plane",
    "PlaneFile",
    "PlaneShape",
    "Plate",
    "Plot",
    "PointMass",
    "PointProbe",
    "Profile",
    "Rectangle",
    "Report",
    "Revolute",
    "Rigid",
    "Ring",
    "Rotation",
    "Run",
    "Scene",
    "Screw",
    "Sensor",
    "Skirt",
    "SliderCrank",
    "Sphere",
    "Spherical",
    "Spring",
    "Support",
    "Translation",
    "Translational",
    "Universal",
]
