"""A figure of matplotlib as SVG within a page."""

import io
from xml.etree import ElementTree

import matplotlib
from matplotlib.figure import Figure

SVG, XLINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"


def svg(figure: Figure, label: str) -> ElementTree.Element:
    """Return a figure as SVG for a page: with text as text, without foreign identifiers and references."""
    text = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure.savefig(
            text, format="svg", transparent=True, metadata=dict.fromkeys(("Creator", "Date", "Format", "Type"))
        )
    ElementTree.register_namespace("", SVG)
    root = ElementTree.fromstring(text.getvalue())
    drawings = {node.get("id"): node for node in root.iter(f"{{{SVG}}}path") if node.get("id")}
    for node in list(root.iter()):
        if node.tag == f"{{{SVG}}}use":
            mark = drawings[node.attrib.pop(f"{{{XLINK}}}href").removeprefix("#")]
            node.tag, node.attrib["d"] = mark.tag, mark.attrib["d"]
            node.attrib["transform"] = f"translate({node.attrib.pop('x')} {node.attrib.pop('y')})"
        if not node.get("id", "").startswith(("run-", "number-")):
            node.attrib.pop("id", None)
        node.attrib.pop("clip-path", None)
        for child in [child for child in node if child.tag in (f"{{{SVG}}}metadata", f"{{{SVG}}}defs")]:
            node.remove(child)
    root.attrib = {"viewBox": root.attrib["viewBox"], "role": "group", "aria-label": label}
    return root
