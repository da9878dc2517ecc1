"""The parser of `gudgeon db` and `gudgeon serve`."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gudgeon.pipeline.cli import records
from gudgeon.pipeline.cli.database import commands as database

DB = "database: a folder, or the URL of a `gudgeon serve` (default: the variable GUDGEON_DB, or .gudgeon)"
VERIFY_HELP = """\
Read every record of a database in full: its checksum, its key, and whether it has what a record of its kind must have.
List those that cannot be used, with the reason. Exit code: 0 all can be used, or were set aside; 1 some cannot.
"""
GC_HELP = """\
List what can be removed: files of writers that were killed, damaged records that were set aside, and unreferenced
records. These were made by another version of the code or of the libraries, so that no run of this version finds them,
and no record of this version, no finished study and no tag leads to them. In the folder of results: unfinished pictures
that are older than a day. Nothing is removed without --delete.
"""
SERVE_HELP = """\
Serve databases over HTTP (docs/service.md). Without tokens everybody on this machine may read and nobody may put. A
token is given by the variable GUDGEON_TOKEN, then it may do everything, or by --tokens; with one, nobody may read
without. An address that others can reach needs tokens. Ctrl-C ends it.
"""
LS_HELP = """\
List records, newest first: key, kind, date, size, number of records that refer to it, scenes and components that use
it, tags. --where compares a value of the inputs, as `gudgeon db show` names them: material.E>=2e11,
modes.normal_count=40.
"""
DIFF_HELP = """\
Print the inputs in which two records differ. Of two modal bases also each mode with the most similar one of the other
by the modal assurance criterion (MAC); nodes of different meshes are compared with the nearest ones.
"""
TAG_HELP = """\
Give a record a name, by which all commands find it and which `gudgeon db gc` respects; the key stays. A tag that
another record has moves to this one.
"""
RECORD = "tag of the record, or four or more of the first digits of its key"
Plain = Callable[..., argparse.ArgumentParser]


def add_database(names: Any, plain: Plain) -> None:
    """Add `gudgeon db` and `gudgeon serve`; `plain` adds a command without options."""
    text = "list, compare, name, examine or tidy the records of a database"
    subcommands = plain(names, "db", text, None).add_subparsers(
        metavar="ls|show|diff|tag|export|verify|gc", required=True
    )
    _add_records(subcommands, plain)
    text = "read every record of a database and list those that cannot be used"
    add = _database(plain(subcommands, "verify", text, database.verify_command, VERIFY_HELP))
    add("--repair", action="store_true", help="rename those records, so that the next run makes them again")
    text = "list what can be removed from a database"
    add = _database(plain(subcommands, "gc", text, database.gc_command, GC_HELP))
    add("--delete", action="store_true", help="remove what is listed")
    text = "list finished studies without a tag, too, and of their runs those that this release does not find"
    add("--studies", action="store_true", help=text)
    add("--out", type=Path, default=Path("out"), metavar="PATH", help="folder of all results (default out)")
    _add_serve(names, plain)


def _add_records(subcommands: Any, plain: Plain) -> None:
    add = _database(plain(subcommands, "ls", "list records", records.ls_command, LS_HELP))
    add("--kind", default="", metavar="KIND", help="mesh, modes, morph, trajectory, …")
    add("--scene", default="", metavar="TEXT", help="part of the name of a scene that uses it")
    add("--component", default="", metavar="TEXT", help="part of the name of a component")
    add("--tag", default="", metavar="NAME", help="tag")
    add("--key", default="", metavar="DIGITS", help="first digits of the key")
    add("--text", default="", metavar="TEXT", help="text within the inputs")
    add("--since", type=records.moment, metavar="DATE", help="written since a date, or 7d, 12h, 2w ago")
    add("--until", type=records.moment, metavar="DATE", help="written before a date, or 7d, 12h, 2w ago")
    text = "PATH=VALUE of the inputs, with = != < <= > or >=; may be repeated"
    add("--where", action="append", default=[], metavar="CONDITION", help=text)
    add("--limit", type=_count, metavar="N", help="the newest N only")
    add = _database(
        plain(subcommands, "show", "print what a record is, was made from, and holds", records.show_command)
    )
    add("record", metavar="RECORD", help=RECORD)
    add = _database(plain(subcommands, "diff", "compare two records", records.diff_command, DIFF_HELP))
    add("record", metavar="RECORD", help=RECORD)
    add("other", metavar="OTHER", help="the other one")
    add("--picture", type=Path, metavar="PATH", help="write the MAC matrix as a PNG")
    add = _database(plain(subcommands, "tag", "give a record a name", records.tag_command, TAG_HELP))
    add("name", metavar="NAME", help="letters, digits, full stops, hyphens and underscores, at most 64")
    add("record", metavar="RECORD", nargs="?", help=RECORD)
    add("--delete", action="store_true", help="take the name away")
    add = _database(plain(subcommands, "export", "write the file of a record", records.export_command))
    add("record", metavar="RECORD", help=RECORD)
    add("path", metavar="PATH", type=Path, nargs="?", help="file to write (default ./KIND-KEY.h5)")


def _add_serve(names: Any, plain: Plain) -> None:
    """Add `gudgeon serve`."""
    text = "serve databases over HTTP to --db http://HOST:PORT, and a page that shows them"
    add = plain(names, "serve", text, database.serve_command, SERVE_HELP).add_argument
    add("--db", action="append", default=[], metavar="[NAME=]PATH",
        help="folder to serve, at /NAME; may be repeated (default: .gudgeon, without a name)")  # fmt: skip
    add("--host", default="127.0.0.1", metavar="HOST", help="address to listen at (default 127.0.0.1: this machine)")
    add("--port", type=_port, default=8765, metavar="N", help="port to listen at (default 8765; 0: any free one)")
    add("--tokens", type=Path, metavar="FILE", help="TOML file with [[token]]: name, sha256, databases, rights")
    text = "further name or address under which the server is called, such as that of a proxy; may be repeated"
    add("--name", action="append", default=[], metavar="HOST", help=text)
    add("--largest", type=_gigabytes, default=4.0, metavar="GB", help="largest record that is taken (default 4 GB)")
    add("--audit", type=Path, metavar="FILE", help="file to which each change is added as a line (default: stderr)")


def _database(command: argparse.ArgumentParser) -> Callable[..., Any]:
    """Add the options of every command on a database; return the method that adds more."""
    command.add_argument("--db", metavar="PLACE", help=DB)
    command.add_argument("--json", action="store_true", help="print one JSON document on stdout")
    return command.add_argument


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} given; expected a whole number, 1 or more")
    return int(text)


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text} given; expected a number from 0 to 65535")
    return int(text)


def _gigabytes(text: str) -> float:
    try:
        size = float(text)
    except ValueError:
        size = -1.0
    if not 0 < size < 1e6:
        raise argparse.ArgumentTypeError(f"{text} given; expected a size in GB, above 0")
    return size
