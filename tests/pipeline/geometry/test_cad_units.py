"""Units of length of STEP files with several contexts."""

from pathlib import Path

import pytest

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cad.units import stated_unit

STEP = """ISO-10303-21;
#1 = (LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.CENTI.,.METRE.));
#2 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.54),#1);
#3 = (CONVERSION_BASED_UNIT('INCH',#2) LENGTH_UNIT() NAMED_UNIT(#9));
#4 = (LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.));
#5 = (GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#7,#3)) REPRESENTATION_CONTEXT('',''));
#6 = (GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#7,#4)) REPRESENTATION_CONTEXT('','3D'));
#10 = ADVANCED_BREP_SHAPE_REPRESENTATION('part',(#20,
  #21),#5);
#11 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#30),#6);
END-ISO-10303-21;
"""


def test_the_unit_is_that_of_shapes(tmp_path: Path) -> None:
    """Colours have a context of their own."""
    path = tmp_path / "part.step"
    path.write_text(STEP)
    assert stated_unit(str(path)) == pytest.approx(0.0254)


def test_shapes_of_two_units_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "part.step"
    path.write_text(STEP.replace("#11 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION", "#11 = SHAPE"))
    with pytest.raises(InputError, match=r"several units of length \(0\.001 m, 0\.0254 m\)"):
        stated_unit(str(path))
