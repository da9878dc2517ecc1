"""Who may do what: tokens with rights on databases, and signed links to single records.

There is no management of users: a token is a line in a file. Names and passwords are a proxy's business.
"""

import hashlib
import hmac
import os
import re
import secrets
import time
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gudgeon.modaldb.stores.transport import TOKEN
from gudgeon.pipeline.errors import InputError

RIGHTS = ("read", "put", "delete")
EVERY = "*"
"""Stands for all databases."""
SECRET = "GUDGEON_LINK_SECRET"
"""Variable: what links are signed with; without it, links end with the server."""
LONGEST_LINK = 7 * 86400
"""Seconds that a link may hold."""
DIGEST = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Token:
    """What the bearer of a token may do."""

    name: str
    """For the lines of the audit."""
    databases: tuple[str, ...]
    rights: tuple[str, ...]

    def may(self, right: str, database: str) -> bool:
        """Whether this is allowed."""
        return right in self.rights and (database in self.databases or EVERY in self.databases)


NOBODY = Token("anonymous", (EVERY,), ("read",))
"""Whoever asks a server that has no tokens."""


class Refused(Exception):
    """A request that is not allowed.

    Args:
        status: 401 where a token may help, 403 where this one does not.
    """

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


class Access:
    """The tokens of a server.

    Args:
        tokens: By the SHA-256 of each, 64 hexadecimal digits; without any, everybody may read and nobody may put.
    """

    def __init__(self, tokens: Mapping[str, Token]) -> None:
        self._tokens = dict(tokens)
        self._secret = (os.environ.get(SECRET) or secrets.token_hex(32)).encode()

    @property
    def guarded(self) -> bool:
        """Whether nobody may read without a token."""
        return bool(self._tokens)

    def check(self, header: str | None, right: str, database: str) -> Token:
        """Return the token of an `Authorization` header if it allows something; see `Refused`."""
        if header is None:
            if self.guarded:
                raise Refused(401, "no token; set GUDGEON_TOKEN, or GUDGEON_TOKEN_FILE to a file that has it")
            return _anybody(right, database)
        kind, _, text = header.partition(" ")
        sent = hashlib.sha256(text.strip().encode("utf-8", "surrogateescape")).hexdigest()
        if kind.lower() == "bearer":
            for digest, token in self._tokens.items():
                if hmac.compare_digest(digest, sent):
                    if token.may(right, database):
                        return token
                    raise Refused(403, f"token '{token.name}' has no right '{right}' on database '{database}'")
        if not self.guarded:
            return _anybody(right, database)
        raise Refused(401, "an unknown token")

    def signature(self, path: str, expires: int) -> str:
        """Return what makes a link to `DATABASE/KEY` or `DATABASE/KEY/ROUTE` valid until a time [s since 1970]."""
        return hmac.new(self._secret, f"{path}?{expires}".encode(), hashlib.sha256).hexdigest()

    def is_signed(self, path: str, expires: str, signature: str) -> bool:
        """Whether a link to a path holds now."""
        if not re.fullmatch(r"\d{1,12}", expires, re.ASCII) or int(expires) < time.time():
            return False
        return hmac.compare_digest(self.signature(path, int(expires)).encode(), signature.encode())


def _anybody(right: str, database: str) -> Token:
    """Return what holds on a server without tokens, whatever token is sent."""
    if NOBODY.may(right, database):
        return NOBODY
    raise Refused(403, f"this server takes nothing: start it with {TOKEN} or --tokens")


def read_access(file: Path | None) -> Access:
    """Return the tokens of a file, and the one of `GUDGEON_TOKEN`, which may do everything.

    Raises:
        InputError: the file cannot be read, or an entry is wrong.
    """
    tokens = {} if file is None else _read(file)
    if environment_token := os.environ.get(TOKEN, "").strip():
        tokens[hashlib.sha256(environment_token.encode()).hexdigest()] = Token("environment", (EVERY,), RIGHTS)
    if file is not None and not tokens:
        raise InputError(f"{file}: no [[token]]")
    return Access(tokens)


def _read(file: Path) -> dict[str, Token]:
    try:
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise InputError(f"{file}: {error}") from error
    tokens: dict[str, Token] = {}
    rows = tables.pop("token", [])
    if tables or not isinstance(rows, list):
        raise InputError(f"{file}: expected [[token]] and nothing else")
    for n, row in enumerate(rows, 1):
        entry = f"{file}: token {n}"
        if not isinstance(row, dict) or row.keys() - {"name", "sha256", "databases", "rights"}:
            raise InputError(f"{entry}: allowed are name, sha256, databases, rights")
        name, digest = row.get("name"), row.get("sha256")
        if not isinstance(name, str) or not name.isprintable() or not name:
            raise InputError(f"{entry}: name: expected a text")
        if not isinstance(digest, str) or not DIGEST.fullmatch(digest):
            raise InputError(f"{entry}: sha256: expected that of the token, 64 hexadecimal digits")
        databases, rights = _texts(row, "databases", entry), _texts(row, "rights", entry)
        if unknown := set(rights) - set(RIGHTS):
            raise InputError(f"{entry}: rights: '{min(unknown)}'; allowed: {', '.join(RIGHTS)}")
        tokens[digest] = Token(name, databases, rights)
    return tokens


def _texts(row: Mapping[str, object], name: str, entry: str) -> tuple[str, ...]:
    texts = row.get(name)
    if not isinstance(texts, list) or not texts or not all(isinstance(t, str) for t in texts):
        raise InputError(f"{entry}: {name}: expected a list of texts")
    return tuple(texts)
