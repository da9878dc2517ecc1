"""What varies in a study, and which designs come of it."""

import itertools
from pathlib import Path

import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.scenes.reading import merged, parse_override
from gudgeon.pipeline.studies.designs import Sampling, read_designs, sampled
from gudgeon.pipeline.studies.fitting import fitted
from gudgeon.pipeline.studies.parameters import MOST, parse_parameters
from tests.pipeline.small import rod_scene

VELOCITY, COUNT = "body.rod.velocity.0", "component.rod.modes.normal_count"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "rod.toml"
    path.write_text(rod_scene(0.02, 10, 200, 10))
    return path


def values(text: str, *, drawn: bool = False) -> tuple[object, ...]:
    (found,) = parse_parameters([text], drawn=drawn)
    return found.listed()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a.b=1,2,5", (1, 2, 5)),
        ("a.b = 2e-3 , 3e-3", (2e-3, 3e-3)),
        ("a.b=-0.5:-5:10", (-0.5, -1.0, -1.5, -2.0, -2.5, -3.0, -3.5, -4.0, -4.5, -5.0)),
        ("a.b=1e6:1e9:4:log", (1e6, 1e7, 1e8, 1e9)),
        ("a.b=0.1:0.3:3", (0.1, 0.2, 0.3)),
        ("a.b=one.csv, two.csv", ("one.csv", "two.csv")),
        ("a.b='one,two','three'", ("one,two", "three")),
        ("a.b=[1, 0, 0], [0, 1, 0]", ([1, 0, 0], [0, 1, 0])),
        ("a.b=true,false", (True, False)),
        ("a.b=x[1,2],y", ("x[1,2]", "y")),
        ("a.b=1979-05-27,x", ("1979-05-27", "x")),
    ],
)
def test_values(text: str, expected: tuple[object, ...]) -> None:
    assert values(text) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a.b", "expected path.to.key=VALUE,VALUE"),
        ("a.b=", "expected path.to.key=VALUE,VALUE"),
        ("a..b=1", "expected path.to.key=VALUE,VALUE"),
        ("=1", "expected path.to.key=VALUE,VALUE"),
        ("a.b=1:2", "a range without number of values"),
        ("a.b=1:2:1", "1 values given; allowed: 2 to"),
        (f"a.b=1:2:{MOST + 1}", "values given; allowed: 2 to"),
        ("a.b=1:1:3", "both ends are 1"),
        ("a.b=-1:1:3:log", "-1 given; allowed with log: ends above 0"),
        ("a.b=1e400:2:3", "finite"),
        ("a.b=nan,1", "nan given"),
        ("a.b=1,inf", "inf given"),
        ("a.b=1,,2", "an empty value given"),
    ],
)
def test_wrong_values_are_refused(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        values(text)
    assert message in str(caught.value)
    assert str(caught.value).startswith("--vary ")


@pytest.mark.parametrize("paths", [("a.b", "a.b"), ("a.b", "a.b.c"), ("a.b.0", "a.b")])
def test_a_key_is_given_once(paths: tuple[str, str]) -> None:
    with pytest.raises(InputError, match="each key once"):
        parse_parameters([f"{path}=1,2" for path in paths], drawn=False)


def test_all_combinations() -> None:
    found = sampled(parse_parameters(["a.b=1,2", "a.c=x,y,z"], drawn=False), Sampling())
    assert found == [*itertools.product((1, 2), "xyz")]


def test_too_many_combinations_are_refused_before_they_are_made() -> None:
    texts = [f"a.{name}=0:1:1000" for name in "bcdefgh"]
    with pytest.raises(InputError, match="designs; allowed: up to 100000; --latin N"):
        sampled(parse_parameters(texts, drawn=False), Sampling())


def test_latin_hypercube_takes_each_part_once() -> None:
    parameters = parse_parameters(["a.b=-1:1", "a.c=1:1000:log", "a.d=x,y"], drawn=True)
    designs = sampled(parameters, Sampling("latin", 40, 3))
    assert sorted(int((one[0] + 1) / 2 * 40) for one in designs) == [*range(40)]
    assert sum(one[1] < 10 for one in designs) in (13, 14)
    assert sum(one[2] == "x" for one in designs) == 20
    assert designs == sampled(parameters, Sampling("latin", 40, 3))
    assert designs != sampled(parameters, Sampling("latin", 40, 4))


def test_random_designs_are_within_their_ranges() -> None:
    designs = sampled(parse_parameters(["a.b=5:2", "a.c=1e-6:1:log"], drawn=True), Sampling("random", 200, 1))
    assert all(2 <= one <= 5 for one, _ in designs)
    assert 0.3 < sum(other < 1e-3 for _, other in designs) / 200 < 0.7
    with pytest.raises(InputError, match="--seed -1: allowed: 0 or more"):
        sampled(parse_parameters(["a.b=5:2"], drawn=True), Sampling("latin", 3, -1))
    with pytest.raises(InputError, match="--random 0: allowed: 1 to"):
        sampled(parse_parameters(["a.b=5:2"], drawn=True), Sampling("random", 0))


def test_whole_numbers_where_the_key_needs_them(scene: Path) -> None:
    _, (count, velocity) = fitted(open_job(scene), parse_parameters([f"{COUNT}=4:9", f"{VELOCITY}=1:2"], drawn=True))
    assert [type(count.at(share)) for share in (0.0, 0.3)] == [int, int]
    assert isinstance(velocity.at(0.3), float)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("body.rood.velocity.0=1,2", "--vary body.rood.velocity.0: no 'rood' in body; did you mean 'rod'? it has rod"),
        ("bdy.rod=1", "--vary bdy.rod: no 'bdy' in the scene; did you mean 'body'?"),
        ("component.rod.msh.size=1", "component.rod.msh: unknown key; did you mean 'mesh'?"),
        ("body.rod.velocity.3=1,2", "no item '3'; allowed: 0 to 2"),
        ("body.rod.velocity.x=1,2", "no item 'x'; allowed: 0 to 2"),
        ("component.rod.mesh.size=0.1,-1", "--vary component.rod.mesh.size: -1 given; input should be greater than 0"),
        ("component.rod.mesh.size=2mm", "'2mm' given; allowed: a number in m"),
        ("component.rod.modes.reduction=macneil", "did you mean 'macneal'?"),
        ("report.until=1,2", "'report' does not affect the motion"),
    ],
)
def test_keys_and_values_that_the_scene_refuses(scene: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        fitted(open_job(scene), parse_parameters([text], drawn=False))
    assert message in str(caught.value)


def test_items_of_lists() -> None:
    tables = {"body": {"rod": {"velocity": [1.0, 2.0, 3.0]}}}
    assert merged(tables, parse_override("body.rod.velocity.1=7"))["body"]["rod"]["velocity"] == [1.0, 7, 3.0]
    assert tables["body"]["rod"]["velocity"] == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match=r"velocity.3: no such item; the list has items 0 to 2"):
        merged(tables, parse_override("body.rod.velocity.3=7"))


def test_default_of_a_list_that_the_scene_leaves_out(scene: Path) -> None:
    job = open_job(scene)
    tables, _ = fitted(job, parse_parameters(["run.gravity.2=-9.81,0"], drawn=False))
    assert tables["run"]["gravity"] == [0.0, 0.0, 0.0]


def test_table_of_designs(tmp_path: Path) -> None:
    path = tmp_path / "designs.csv"
    path.write_text('\ufeffa.b, a.c \n1,one\n\n 2e-3 ,"x, y"\n-1,[1,2]\n'.replace("[1,2]", '"[1,2]"'))
    parameters, designs = read_designs(path)
    assert [one.path for one in parameters] == ["a.b", "a.c"]
    assert designs == [(1, "one"), (2e-3, "x, y"), (-1, [1, 2])]
    assert parameters[0].place(2e-3) == f"{path}: row 4, column 1 'a.b'"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; the first row has the keys"),
        ("\n \n", "is empty"),
        ("a.b,a.c\n", "has no designs below the keys"),
        ("a.b,a.c\n1,2\n3\n", "row 3: 1 cells; the first row has 2 keys"),
        ("a.b,a.c\n1,2\n3,\n", "row 3, column 2 'a.c': is empty"),
        ("a.b,a.c\n1,nan\n", "row 2, column 2 'a.c': nan given; allowed: finite numbers"),
        ("a.b,a.b\n1,2\n", "row 1: a.b: given twice"),
        ("a.b;a.c\n1;2\n", "row 1, column 1: 'a.b;a.c' given; allowed: path.to.key, separated by commas"),
        ("a.b,\n1,2\n", "row 1, column 2: '' given"),
        ('a.b\n"1\n', "row 2"),
    ],
)
def test_wrong_tables_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "designs.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_designs(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)


def test_unreadable_tables_are_refused(tmp_path: Path) -> None:
    (tmp_path / "bytes.csv").write_bytes(b"a.b\n\xff\n")
    for name in ("absent.csv", "bytes.csv", "."):
        with pytest.raises(InputError, match="cannot be read"):
            read_designs(tmp_path / name)


def test_a_bad_cell_names_row_and_column(scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "designs.csv"
    path.write_text(f"{VELOCITY},component.rod.mesh.size\n1,0.02\n2,0.02\nfast,0.02\n")
    with pytest.raises(InputError) as caught:
        fitted(open_job(scene), read_designs(path)[0])
    assert str(caught.value).startswith(f"{path}: row 4, column 1 '{VELOCITY}': 'fast' given; ")
