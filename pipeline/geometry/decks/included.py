"""Files that a deck reads besides itself, found without reading its data: what keys of its products hold."""

import re
from pathlib import Path

NAMING = {
    ".inp": re.compile(rb"^[ \t]*\*[^\r\n*][^\r\n]*?INPUT[ \t]*=[ \t]*([^,\r\n]+)", re.IGNORECASE | re.MULTILINE),
    **dict.fromkeys(
        (".bdf", ".nas", ".dat"),
        re.compile(rb"^[ \t]*INCLUDE[ \t]+('[^']*'|\"[^\"]*\"|[^\r\n$]+)", re.IGNORECASE | re.MULTILINE),
    ),
}
"""Lines that name a file, by the ending of the deck's name."""
MOST = 1000
"""Files that are looked at."""


def included_files(path: str) -> list[str]:
    """Return the files that a deck names and that exist, those of included ones too, in alphabetic order."""
    pattern = NAMING.get(Path(path).suffix.lower())
    if pattern is None:
        return []
    folder, waiting, files = Path(path).parent, [Path(path)], set[str]()
    while waiting and len(files) < MOST:
        file = waiting.pop()
        try:
            names = pattern.findall(file.read_bytes())
        except OSError:  # Reading the deck says so.
            continue
        for raw in names:
            name = re.sub(r"[\r\n]\s*", "", raw.decode(errors="replace")).strip().strip("'\"").replace("\\", "/")
            for base in (folder, file.parent):
                if (base / name).is_file() and str(base / name) not in files:
                    files.add(str(base / name))
                    waiting.append(base / name)
                    break
    return sorted(files)
