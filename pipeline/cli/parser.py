"""The parser of the command line."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli import commands, drafts, studies
from gudgeon.pipeline.cli.applications import feeling, wearing
from gudgeon.pipeline.cli.applications.sensing import add_sensing
from gudgeon.pipeline.cli.database.parser import DB, add_database
from gudgeon.pipeline.cli.help.completion import SHELLS, script
from gudgeon.pipeline.cli.help.examples import examples_of
from gudgeon.pipeline.cli.help.usage import Parser

EXAMPLES = """\
examples:
  gudgeon run data/skirt                      run all stages: mesh, modes, morph, solve, plot
  gudgeon run data/skirt --set component.skirt.change.profile.table=barrel-20um.csv
                                              change the design: nodes move, modes are kept
  gudgeon status data/skirt                   list which stages are fresh or stale, with the reason
  gudgeon plan data/rod-wall                  list the data that the solver reads and the terms that it omits
  gudgeon report data/skirt                   compare the error and the run time of every model of the scene
  gudgeon study data/rod-wall --vary body.rod.velocity.0=0.1:1:10
                                              run many designs: one table of quantities, and a picture
  gudgeon faces bracket.step                  list and draw the numbered faces of a CAD part
  gudgeon new bracket.step                    write a scene of a CAD part that is thrown at a plane
  gudgeon doctor                              check this machine and list the commands that correct it

A scene is a folder with scene.toml, or a TOML file; `gudgeon schema` describes its keys. Meshes, modes and results are
kept in a database (--db, GUDGEON_DB, or .gudgeon), each under a key of all inputs that it depends on: a stage is fresh
if the database has its result for the present inputs, and is then not computed again.
Exit code: 0 success; 1 the run failed; 2 the input is wrong.
"""

STAGE_HELP = {
    "mesh": "mesh the components",
    "modes": "compute normal modes, static correction modes and residual flexibility; stale meshes first",
    "morph": "move the nodes for a design change; stale meshes and modes first",
    "solve": "integrate the contact dynamics; stale meshes, modes and designs first",
    "plot": "draw the pictures; all stale stages first",
    "run": "run all stages: mesh, modes, morph, solve, plot",
}


SAME_MESH = "with --tolerance: accept a setting whose mesh has a larger error"
LINEAR_HELP = """\
Assembled modes of the scene at its start (run.start), with joints, driven bodies, springs and contacts that press
there: linear-modes.csv; with --force also the response over frequency: linear-response.csv and .png; with --static the
static answers to unit forces, such as strains of gauges per unit wrench: linear-static.csv. See docs/linear.md.
"""
REPORT_HELP = """\
Run the sweep that the scene defines under [report] (models, sweep, full_fe, reference, changes). Without [report], run
a default sweep over modes, reductions, methods and integrators. Write report.csv, report.json, report.png and
report.html with the run time of each run, its error, its modal truncation error and its time error, and the error
budget of the selected setting: basis, step, mesh, spline spacing and contact layer, each from further runs. A setting
whose mesh error exceeds the tolerance is not selected, unless --same-mesh is given. Finished runs are kept in the
database, so an interrupted report continues when it is started again. Timed runs are sequential and use one thread;
full-FE runs of a driven pair use one thread per body, and their CPU time is the sum over the threads.
--jobs runs the untimed runs in parallel.
"""
ROBUSTNESS_HELP = """\
Run the scene under extreme parameters (contact stiffness, masses, steps, restitution, Poisson's ratio, slivers, units,
and others) and check each result against a rule, such as the energy balance or the same result in other units. Write
robustness.json, robustness.csv and robustness.png. Exit code 0: no case is wrong and at least 85 % of the applicable
cases are right.
"""
FACES_HELP = """\
Print kind, area, centre and normal, radius or angle of every outer face of a STEP, IGES or BREP file or a script of
gmsh, whether the face is a true plane, cylinder, cone or sphere, and by how much it is not. Below, for each face a rule
that a scene can use under [component.NAME.geometry.surfaces]. The picture shows the part from two sides.
Of a deck (.inp, .bdf, .cdb) it prints the named sets instead, and its couplings as interfaces of a scene.
"""
NEW_HELP = """\
Write FOLDER/scene.toml with comments, and a copy of the file next to it. The scene runs as it is: a steel part whose
largest outer flat face, or lowest face, strikes a rigid plane at 1 m/s. Every number in it is for you to change. Of an
assembly, or a deck of several parts, all bodies are written: a component a solid or part, a body an instance.
"""
SCHEMA_HELP = """\
With KEY, print unit, default, range, meaning and an example of a table's keys or of one key. Without it, print the JSON
schema of scene files, for editors and validators: `gudgeon schema > scene.schema.json`, and `#:schema
scene.schema.json` as the first line of scene.toml.
"""


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = Parser(
        "gudgeon",
        description="Contact dynamics of flexible machine parts from a modal database.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version)
    names = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, text in STAGE_HELP.items():
        command = _command(names, name, text, commands.run_command)
        command.set_defaults(until="plot" if name == "run" else name)
        _run_options(command)
    text = "list which stages are fresh or stale, with the reason for each stale one"
    _command(names, "status", text, commands.status_command)
    text = "list the data that the solver reads and the terms that it omits, with the reason for each"
    _command(names, "plan", text, commands.plan_command)
    text = "run a sweep of the scene: error against run time, and the cheapest setting for a tolerance"
    report = _command(names, "report", text, commands.report_command, REPORT_HELP)
    add = report.add_argument
    add("--repeat", type=_positive, default=3, metavar="N", help="timed runs of each setting (default 3)")
    add("--tolerance", type=_tolerance, metavar="T", help="error that the cheapest setting must meet (default 1%%)")
    add("--same-mesh", action="store_true", help=SAME_MESH)
    report.set_defaults(threads=1)
    _add_many_runs(names)
    text = "run the robustness cases of the scene and check each result against its rule"
    add = _command(names, "robustness", text, commands.robustness_command, ROBUSTNESS_HELP).add_argument
    add("--only", type=_names, default=(), metavar="NAME,...", help="run only the named cases or groups")
    add("--cases", type=Path, metavar="FILE", help="TOML file with further cases, described in docs/robustness.md")
    text = "assembled modes of the scene at its start, and frequency responses between its ports"
    _linear_options(_command(names, "linear", text, commands.linear_command, LINEAR_HELP))
    add_sensing(names, _plain, _command)
    feeling.add_options(_command(names, "feel", feeling.FEEL_TEXT, feeling.feel_command, feeling.FEEL_HELP))
    _add_export(names)
    _add_cad(names)
    text = "list missing packages, libraries and variables on this machine, each with the command that corrects it"
    add = _plain(names, "doctor", text, commands.doctor_command).add_argument
    add("--db", metavar="PLACE", help=DB)
    add("--json", action="store_true", help="print one JSON document on stdout")
    text = "list the example scenes of the package, or copy one"
    subcommands = _plain(names, "example", text, commands.example_list_command).add_subparsers(metavar="list|copy")
    _plain(subcommands, "list", "list every scene with its description", commands.example_list_command)
    add = _plain(subcommands, "copy", "copy the folder of a scene", commands.example_copy_command).add_argument
    add("name", metavar="NAME", help="name of the scene, from `gudgeon example list`")
    add("folder", metavar="FOLDER", type=Path, nargs="?", help="new folder, must not exist (default ./NAME)")
    add_database(names, _plain)
    text = "print a script by which a shell completes commands and options"
    add = _plain(names, "completion", text, _completion_command).add_argument
    add("shell", choices=SHELLS, help="bash, zsh, fish or tcsh")
    text = "explain the keys of a scene file, or print its JSON schema"
    add = _plain(names, "schema", text, commands.schema_command, SCHEMA_HELP).add_argument
    text = "table or key without the names that you give: component.interface, component.geometry.box, run.step"
    add("key", metavar="KEY", nargs="?", help=text)
    parser.group_commands(names)
    return parser


def _run_options(command: argparse.ArgumentParser) -> None:
    """Add the options of the commands of stages."""
    command.add_argument(
        "--tolerance", type=_tolerance, metavar="T",
        help="run the cheapest setting whose error in `gudgeon report` is below T, such as 1%% or 0.01",
    )  # fmt: skip
    command.add_argument("--same-mesh", action="store_true", help=SAME_MESH)
    text = "print all quantities, also those of single impacts and below 1e-6 of the largest of their unit"
    command.add_argument("--all", action="store_true", help=text)


def _completion_command(options: argparse.Namespace) -> int:
    """Print the script of a shell."""
    print(script(options.shell, build_parser()))
    return 0


def _add_export(names: Any) -> None:
    """Add `gudgeon export`."""
    text = "write mode shapes or results as .vtu files for ParaView, or a reduced body for another program"
    add = _command(names, "export", text, commands.export_command).add_argument
    text = (
        "modes: mode shapes; results: displacements and contact pressures over time; with --format the name of a body"
    )
    add("what", metavar="{modes,results,BODY}", help=text)
    text = "reduced body: uff, universal file; op4, OUTPUT4 and DMIG; abaqus; exudyn, a script; npz, see docs/export.md"
    add("--format", choices=("uff", "op4", "abaqus", "exudyn", "npz"), help=text)
    add("--every", type=_positive, default=1, metavar="N", help="write every Nth frame (default 1: all)")


def _add_many_runs(names: Any) -> None:
    """Add `gudgeon study`, `gudgeon family` and `gudgeon wear`."""
    text = "run many designs of the scene: one table of their quantities, and a picture"
    study = _command(names, "study", text, studies.study_command, studies.STUDY_HELP)
    studies.add_options(study, _positive)
    text = "find the designs to store for a range of a component's profile, so that others need no new modes"
    family = _command(names, "family", text, studies.family_command, studies.FAMILY_HELP)
    studies.add_family_options(family, _tolerance)
    text = "wear the joints with clearance, or the contacts, of the scene over many cycles"
    wear = _command(names, "wear", text, wearing.wear_command, wearing.WEAR_HELP)
    wearing.add_options(wear, _tolerance)


def _linear_options(command: argparse.ArgumentParser) -> None:
    """Add the options of `gudgeon linear`."""
    add = command.add_argument
    text = "port of a unit force, or a motion that moves by a unit: contact.NAME, joint.NAME, force.NAME, motion.NAME"
    add("--force", metavar="PORT", help=f"{text}; [2] after it for the second of several rows")
    text = (
        "port, probe.NAME or gauge.BODY.NAME where the response is read; may be repeated (default: the port of --force)"
    )
    add("--at", action="append", default=[], metavar="PORT", help=text)
    add("--quantity", default="displacement", metavar="WHAT", help="displacement (default), velocity or acceleration")
    add("--frequencies", nargs=2, type=float, metavar=("LOW", "HIGH"), help="range of the response [Hz]")
    text = "number of frequencies, evenly spaced on a logarithmic scale (default 2001, and 31 more in each resonance)"
    add("--points", type=_positive, metavar="N", help=text)
    add(
        "--loss",
        type=float,
        default=0.0,
        metavar="ETA",
        help="structural loss factor of all elastic bodies (default 0)",
    )
    text = "static answers of gauges, probes and ports to a unit of every given force, or at --force: linear-static.csv"
    add("--static", action="store_true", help=text)
    text = "contact of which all points are closed; may be repeated (default: those that press at the start)"
    add("--closed", action="append", default=[], metavar="contact.NAME", help=text)


Action = Callable[[argparse.Namespace], int]


def _plain(names: Any, name: str, text: str, action: Action | None, description: str = "") -> argparse.ArgumentParser:
    """Add a command; its help text describes it as well unless a description is given."""
    command = names.add_parser(
        name, help=text, description=description or f"{text[0].upper()}{text[1:]}.",
        epilog=examples_of(name), formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    command.set_defaults(action=action)
    # Suppressed: a command below another one must not undo what was given before its name.
    text = "print log messages of the library on stderr: what is fresh, computed, read"
    command.add_argument("-v", "--verbose", action="store_true", default=argparse.SUPPRESS, help=text)
    return command


def _add_cad(names: Any) -> None:
    text = "list the faces of a CAD part and draw them with their numbers, or the sets of a deck"
    add = _cad(names, "faces", text, drafts.faces_command, FACES_HELP, alternatives="; or a deck").add_argument
    add("--picture", type=Path, metavar="PATH", help="PNG to write (default ./FILE-faces.png without its ending)")
    add("--json", action="store_true", help="print one JSON document on stdout")
    add("--part", metavar="NAME", help="part of a deck of several, as it was modelled")
    add("--instance", metavar="NAME", help="instance of a deck's assembly, as it is placed there")
    text = "write a scene in which a CAD part, an assembly or the bodies of a deck are thrown at a plane"
    add = _cad(names, "new", text, drafts.new_command, NEW_HELP, alternatives="; or a deck or mesh").add_argument
    add("--folder", metavar="PATH", type=Path, help="new folder, must not exist (default ./FILE without its ending)")


def _cad(
    names: Any, name: str, text: str, action: Action, description: str, *, alternatives: str = ""
) -> argparse.ArgumentParser:
    """Add a command on a CAD file, or on `alternatives`."""
    command = _plain(names, name, text, action, description)
    add = command.add_argument
    add("file", metavar="FILE", help="STEP, IGES or BREP file, or script of gmsh (.geo)" + alternatives)
    add("--unit", metavar="M", help="metres per unit of length, such as 0.001; needed where the file states none")
    text = "number or name of a solid to take; may be repeated (default all; several are glued)"
    add("--solid", action="append", default=[], metavar="S", help=text)
    return command


def _command(names: Any, name: str, text: str, action: Action, description: str = "") -> argparse.ArgumentParser:
    """Add a command on a scene."""
    command = _plain(names, name, text, action, description)
    command.set_defaults(command=name)
    add = command.add_argument
    add("scene", metavar="SCENE", help="folder with scene.toml, or a TOML file")
    text = "override a key of the scene, for instance run.duration=1e-3; may be repeated"
    add("--set", action="append", default=[], metavar="path.to.key=value", help=text)
    add("--db", metavar="PLACE", help=DB)
    text = "folder of the results (default out/FOLDER/FILE of the scene, such as out/piston/stroke)"
    add("--out", metavar="PATH", help=text)
    add("--json", action="store_true", help="print one JSON document on stdout and everything else on stderr")
    add("--jobs", type=_positive, metavar="N", help="number of cores to use (default all)")
    return command


def _tolerance(text: str) -> float:
    from gudgeon.pipeline.report.effort import parse_tolerance

    try:
        return parse_tolerance(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name for n in text.split(",") if (name := n.strip()))
    if not names:
        raise argparse.ArgumentTypeError(f"'{text}' given; expected a comma-separated list of names")
    return names


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} given; expected a whole number, 1 or more")
    return int(text)


class _Version(argparse.Action):
    """Prints the version of the installed distribution, looked up only on request since that takes time."""

    def __init__(self, option_strings: list[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and exit")

    def __call__(self, parser: argparse.ArgumentParser, *rest: Any) -> None:
        """Print and exit."""
        import gudgeon

        print(f"gudgeon {gudgeon.__version__}")
        parser.exit()
