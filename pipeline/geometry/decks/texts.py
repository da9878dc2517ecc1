"""Text of decks: UTF-8, or the western encoding of Windows where it is none."""

from pathlib import Path

from gudgeon.pipeline.errors import InputError

PACKED = {b"\x1f\x8b": "compressed by gzip", b"PK\x03\x04": "a zip archive", b"\xff\xfe": "text in UTF-16",
          b"\xfe\xff": "text in UTF-16"}  # fmt: skip
"""What files are whose first bytes are these."""


def deck_text(path: str) -> str:
    """Return the text of a file, whose lines end in a line feed.

    Raises:
        OSError: it cannot be read.
    """
    data = Path(path).read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def refuse_packed(path: str) -> None:
    """Refuse a file that is compressed, or in UTF-16.

    Raises:
        InputError: it is; `.vol.gz` of Netgen is read as it is.
    """
    with Path(path).open("rb") as file:
        head = file.read(4)
    kind = next((text for start, text in PACKED.items() if head.startswith(start)), "")
    if kind and not path.lower().endswith(".vol.gz"):
        raise InputError(f"{path}: is {kind}; allowed: the file itself, text in UTF-8 or a western encoding")
