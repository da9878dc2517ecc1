"""`gudgeon completion`: scripts by which a shell completes commands and options."""

import argparse
from collections.abc import Callable, Iterator

SHELLS = ("bash", "zsh", "fish")


def words(parser: argparse.ArgumentParser) -> Iterator[tuple[str, list[str]]]:
    """Yield each command with its subcommands and options; the program itself as the empty command."""

    def below(node: argparse.ArgumentParser, command: str) -> Iterator[tuple[str, list[str]]]:
        found: list[str] = []
        children: dict[str, argparse.ArgumentParser] = {}
        for action in node._actions:
            found += [one for one in action.option_strings if one.startswith("--")]
            if isinstance(action, argparse._SubParsersAction):
                children |= action.choices
        yield command, [*children, *found]
        for name, child in children.items():
            yield from below(child, f"{command} {name}".strip())

    return below(parser, "")


def script(shell: str, parser: Callable[[], argparse.ArgumentParser]) -> str:
    """Return the script of a shell: commands and options after `gudgeon`, files elsewhere."""
    table = list(words(parser()))
    if shell == "fish":
        lines = ["complete -c gudgeon -f -n '__fish_use_subcommand' -a '" + " ".join(table[0][1]) + "'"]
        for command, found in table[1:]:
            options = [one for one in found if one.startswith("--")]
            seen = " and ".join(f"__fish_seen_subcommand_from {part}" for part in command.split())
            condition = seen.replace(" and ", "; and ")
            lines += [f"complete -c gudgeon -n '{condition}' -l {one.removeprefix('--')}" for one in options]
        return "\n".join(lines)
    cases = "\n".join(f'        "{command}") found="{" ".join(found)}" ;;' for command, found in table)
    head = "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else ""
    return f"""{head}_gudgeon() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" first="${{COMP_WORDS[1]}}" second="${{COMP_WORDS[2]}}" found=""
    [ "$COMP_CWORD" -le 1 ] && first=""
    [ "$COMP_CWORD" -le 2 ] && second=""
    case "$first" in db|example) first="$first${{second:+ $second}}" ;; esac
    case "$first" in
{cases}
    esac
    COMPREPLY=($(compgen -W "$found" -- "$word"))
}}
complete -o default -F _gudgeon gudgeon"""
