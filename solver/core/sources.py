"""Write a header with the digest of each source file of the core and of all that it includes, without comments.

The build runs it, so that a compiled module says which sources it was made of, and records are keyed by them.
"""

import hashlib
import json
import re
import sys
from pathlib import Path

INCLUDE = re.compile(r'^\s*#include "([^"]+)"', re.MULTILINE)
COMMENT = re.compile(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', re.DOTALL)


def covered(source: Path) -> list[Path]:
    """Return a source and the project's files that it includes, directly or not, sorted."""
    files, waiting = set[Path](), [source.resolve()]
    while waiting:
        path = waiting.pop()
        if path not in files and path.exists():
            files.add(path)
            waiting += [(path.parent / name).resolve() for name in INCLUDE.findall(path.read_text())]
    return sorted(files)


def digest(source: Path) -> str:
    """Return 16 digits for what a source compiles: neither comments nor the layout of lines change them."""
    total = hashlib.sha256()
    for path in covered(source):
        text = COMMENT.sub(lambda match: match[1] or " ", path.read_text())
        total.update(f"{path.name} {' '.join(text.split())}\n".encode())
    return total.hexdigest()[:16]


def write_header(header: Path, root: Path, sources: list[Path]) -> None:
    """Write the digests by paths in the checkout as a string literal, unless the header has them already."""
    digests = json.dumps({path.relative_to(root).as_posix(): digest(path) for path in sources}, sort_keys=True)
    text = f"#define GUDGEON_SOURCES {json.dumps(digests)}\n"
    if not header.exists() or header.read_text() != text:
        header.write_text(text)


if __name__ == "__main__":
    write_header(Path(sys.argv[1]), Path(sys.argv[2]), [Path(name) for name in sys.argv[3:]])
