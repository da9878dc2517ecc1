"""`gudgeon db ls|show|diff|tag|export|verify|gc`, over a folder and over a server of it."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.query import Query
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.cli.records import moment
from gudgeon.pipeline.gudgeon import run
from tests.modaldb.samples import mesh
from tests.pipeline.service.serving import served
from tests.pipeline.small import write_scene

Capture = pytest.CaptureFixture[str]
PLACES: dict[str, Callable[[Path], AbstractContextManager[str]]] = {
    "folder": lambda root: nullcontext(str(root)),
    "HTTP": served,
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run, and another size of mesh up to its modes."""
    folder = tmp_path_factory.mktemp("db-commands")
    scene, places = write_scene(folder / "skirt"), {"db": folder / "db", "out": folder / "out"}
    run(scene, until="solve", **places)
    run(scene, until="modes", set={"component.skirt.mesh.size": 0.016}, **places)
    return folder


@pytest.fixture(params=PLACES)
def place(request: pytest.FixtureRequest, made: Path) -> Iterator[str]:
    with PLACES[request.param](made / "db") as location:
        yield location


@pytest.fixture
def ask(place: str, capsys: Capture) -> Callable[..., tuple[int, str, str]]:
    """Run `gudgeon db`; return its exit code, output and messages."""

    def asked(name: str, *arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        try:
            code = main(["db", name, *arguments, "--db", place])
        except SystemExit as end:
            code = int(str(end.code))
        output = capsys.readouterr()
        assert "Traceback" not in output.err
        return code, output.out, output.err

    return asked


Ask = Callable[..., tuple[int, str, str]]


def rows(ask: Ask, *arguments: str) -> list[dict]:
    code, text, _ = ask("ls", *arguments, "--json")
    assert code == 0
    return json.loads(text)


def test_ls(ask: Ask, place: str) -> None:
    code, text, _ = ask("ls", "--kind", "modes")
    assert code == 0
    head, *lines, last = text.splitlines()
    assert head.split() == ["key", "kind", "date", "size", "used", "scene", "component", "tags"]
    assert len(lines) == 2
    assert all(" modes " in line and line.split()[-2:] == ["skirt", "skirt"] for line in lines)
    assert last.startswith(f"{place}: 2 records of ")
    assert [row["kind"] for row in rows(ask)] == ["modes", "mesh", "trajectory", "morph", "modes", "mesh"]
    assert [row["inputs"]["size"] for row in rows(ask, "--where", "size>0.015")] == [0.016]
    assert len(rows(ask, "--where", "material.rho>2000", "--limit", "1")) == 1
    assert len(rows(ask, "--scene", "skirt", "--since", "1d")) == 6
    assert rows(ask, "--until", "2001-01-01") == []
    assert rows(ask, "--component", "liner") == []


def test_show(ask: Ask) -> None:
    row = rows(ask, "--kind", "modes", "--limit", "1")[0]
    code, text, _ = ask("show", row["key"][:8])
    assert code == 0
    assert f"modes {row['key']}" in text
    assert f"made from   {row['refers'][0]}" in text
    assert "used by     skirt, skirt" in text
    assert "  material.rho = " in text
    assert "angular_frequencies" in text
    assert "mode    frequency [Hz]   estimated error" in text
    found = json.loads(ask("show", row["key"], "--json")[1])
    store = {"inputs": row["inputs"], "key": row["key"]}
    assert store.items() <= found.items()
    assert found["modes"][0]["frequency"] > 0


def test_diff_of_two_bases(ask: Ask, tmp_path: Path) -> None:
    first, second = (row["key"] for row in rows(ask, "--kind", "modes"))
    code, text, _ = ask("diff", first, second, "--picture", str(tmp_path / "mac.png"))
    assert code == 0
    assert f"mesh: {json.dumps(rows(ask, '--key', first)[0]['inputs']['mesh'])[:20]}" in text
    assert "mode    frequency [Hz]" in text
    assert (tmp_path / "mac.png").read_bytes().startswith(b"\x89PNG")
    found = json.loads(ask("diff", first, second, "--json")[1])
    assert found["modes"]["modes"][0]["other"] is not None
    # The lowest modes of the skirt are a pair, which each mesh turns as it likes: together they span the same.
    assert sum(found["modes"]["mac"][0][:2]) > 0.95
    assert ask("diff", first, first)[1] == "the inputs are the same\n"


def test_diff_of_other_records(ask: Ask, tmp_path: Path) -> None:
    first, second = (row["key"] for row in rows(ask, "--kind", "mesh"))
    code, text, _ = ask("diff", second, first)
    assert (code, text) == (0, "size: 0.012 → 0.016\n") if "size: 0.012" in text else (0, text)
    assert text.startswith("size: ")
    code, _, message = ask("diff", first, second, "--picture", str(tmp_path / "mac.png"))
    assert (code, message) == (
        2,
        "gudgeon: --picture: the MAC matrix is of two modes records; these are mesh and mesh\n",
    )


def test_tags(ask: Ask) -> None:
    key = rows(ask, "--kind", "modes", "--limit", "1")[0]["key"]
    assert ask("tag", "released", key[:10])[:2] == (0, f"released: {key}\n")
    assert [row["key"] for row in rows(ask, "--tag", "released")] == [key]
    assert json.loads(ask("show", "released", "--json")[1])["tags"] == ["released"]
    assert ask("tag", "released", "--delete")[0] == 0
    assert rows(ask, "--tag", "released") == []
    code, _, message = ask("tag", "released", "--delete")
    assert (code, "no tag 'released'" in message) == (1, True)
    for arguments in (("released",), ("released", key, "--delete")):
        assert ask("tag", *arguments)[::2] == (2, "gudgeon: db tag: give NAME RECORD, or NAME --delete\n")
    code, _, message = ask("tag", "dead", key)
    assert (code, "not only hexadecimal digits" in message) == (2, True)


def test_export(ask: Ask, made: Path, tmp_path: Path) -> None:
    key = rows(ask, "--kind", "trajectory")[0]["key"]
    code, text, _ = ask("export", key[:9], str(tmp_path / "run.h5"))
    assert (code, text) == (0, f"{tmp_path / 'run.h5'}\n")
    assert (tmp_path / "run.h5").read_bytes() == (made / "out" / "trajectory.h5").read_bytes()


def test_an_export_is_read_as_the_page_says(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """The Python lines of docs/format.md, which know h5py only."""
    store = modaldb.open(made / "db")
    store.export(store.find(Query(kind="modes"))[0].key, tmp_path / "skirt.h5")
    text = (Path(__file__).parents[2] / "docs/format.md").read_text()
    code = text.partition("## Reading a record elsewhere")[2].partition("```python\n")[2].partition("```")[0]
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("gudgeon-modes {'E': 72000000000.0")
    assert lines[1].startswith("angular frequencies of the elastic coordinates rad/s [")
    assert lines[-1].startswith("thrust (")
    assert lines[-1].endswith(" kg^-0.5")


def test_verify_and_gc(ask: Ask, place: str, made: Path) -> None:
    code, text, _ = ask("verify")
    assert (code, text) == (0, f"{place}: 6 records, 0 cannot be used\n")
    old = {"stage": "mesh", "code": "another", "size": 1.0}
    store, key = modaldb.open(made / "db"), content_key(old)
    store.put(key, "mesh", mesh(), old)
    code, text, _ = ask("gc", "--out", str(made / "out"))
    assert (code, f"{key}: " in text, "1 files of" in text) == (0, True, True)
    assert ask("gc", "--out", str(made / "out"), "--delete")[0] == 0
    assert not modaldb.open(made / "db").has(key)
    assert len(rows(ask)) == 6


def test_verify_of_a_file_that_cannot_be_read(tmp_path: Path, capsys: Capture) -> None:
    """It is listed beside the others, and not set aside: it may be sound."""
    inputs = {"n": 1}
    modaldb.open(tmp_path).put(content_key(inputs), "mesh", mesh(), inputs)
    loop = tmp_path / "00" / f"00{'1' * 62}.h5"
    loop.parent.mkdir(exist_ok=True)
    loop.symlink_to(loop)
    for option in ([], ["--repair"]):
        assert main(["db", "verify", "--db", str(tmp_path), *option]) == 1
        printed = capsys.readouterr().out
        assert "cannot be read (Too many levels of symbolic links)" in printed
        assert "2 records, 1 cannot be used" in printed
    assert loop.is_symlink()


@pytest.mark.parametrize("name", ["show", "export"])
def test_records_that_are_not_there(name: str, ask: Ask, place: str) -> None:
    for record, cause in (
        ("0000000", "no record 0000000"), ("released", "no tag 'released', and no key"), ("ab", "no tag 'ab'"),
        ("", "no tag ''"), ("../x", "no tag '../x'"),
    ):  # fmt: skip
        code, text, message = ask(name, record)
        assert (code, text) == (2, "")
        assert message.startswith(f"gudgeon: {place}: {cause}")


def test_digits_that_begin_several_keys(tmp_path: Path, capsys: Capture) -> None:
    store, seen = modaldb.open(tmp_path), dict[str, int]()
    for number in range(2000):  # Until two keys share four digits.
        key = content_key({"n": number})
        if key[:4] in seen:
            break
        seen[key[:4]] = number
    for one in (seen[key[:4]], number):
        store.put(content_key({"n": one}), "mesh", mesh(), {"n": one})
    assert main(["db", "show", key[:4], "--db", str(tmp_path)]) == 2
    assert f"{key[:4]} begins several keys: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "cause"),
    [(["--where", "size"], "'size' given; expected PATH=VALUE"), (["--since", "soon"], "expected a date such as"),
     (["--limit", "0"], "expected a whole number")],
)  # fmt: skip
def test_lists_that_cannot_be_made(arguments: list[str], cause: str, ask: Ask) -> None:
    code, text, message = ask("ls", *arguments)
    assert (code, text, cause in message) == (2, "", True)


def test_moments() -> None:
    assert moment("1970-01-02T00:00+00:00") == 86400.0
    assert moment("2d") - moment("1w") == pytest.approx(5 * 86400, abs=5)
