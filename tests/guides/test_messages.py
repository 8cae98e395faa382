"""docs/troubleshooting.md has an entry for each code of a warning and of an error: a heading whose anchor is the code with
'-' for '_', and below it the code itself. The program's messages end with that anchor (examples/npt/remedies.hpp)."""

import re
import sys

import markdown

GUIDE = "docs/troubleshooting.md"
SILENT = {"bad_input": "found-no-mesh", "stopped": None}  # codes without an entry of their own in messages


def codes_of(text, enum):
    """The names in `enum class NAME { ... }`."""
    inside = re.search(r"enum class " + enum + r"\s*\{(.*?)\};", text, re.DOTALL).group(1)
    return re.findall(r"^\s*(\w+)\s*,?", re.sub(r"//.*", "", inside), re.MULTILINE)


def entries_of(text):
    """What the program's switches return: code -> entry."""
    return dict(re.findall(r"case (\w+):\s*return \"([\w\-]+)\";", text))


def complaints_of(guide, codes, entries):
    anchors = markdown.Document(guide).anchors()
    complaints = []
    for code in codes:
        anchor = code.replace("_", "-")
        if anchor not in anchors:
            complaints.append(f"{GUIDE}: no heading with the anchor '{anchor}' for the code {code}")
        if f"`{code}`" not in guide:
            complaints.append(f"{GUIDE}: no entry names the code `{code}`")
        if code not in SILENT and entries.get(code) != anchor:
            complaints.append(f"examples/npt/remedies.hpp: {code}: '{entries.get(code)}', expected '{anchor}'")
    return complaints


def check_rule():
    """The rule finds each kind of offence, and nothing else."""
    assert codes_of("enum class A {\n  one,  ///< of two, three\n  four_five\n};", "A") == ["one", "four_five"]
    entries = entries_of('case a_b:\n      return "a-b";\n    case c:\n      return {};')
    assert entries == {"a_b": "a-b"}
    assert not complaints_of("### A b\n\n(`a_b`)\n", ["a_b"], entries)
    assert len(complaints_of("### A b\n\n(`a_b`)\n", ["a_b", "c"], entries)) == 3
    assert len(complaints_of("### A c\n\n(`a_b`)\n", ["a_b"], {})) == 2


def main():
    check_rule()
    read = {name: (markdown.ROOT / name).read_text(encoding="utf-8")
            for name in (GUIDE, "include/npt/base/error.hpp", "include/npt/estimate/warning_code.hpp",
                         "examples/npt/remedies.hpp")}
    codes = codes_of(read["include/npt/base/error.hpp"], "ErrorCode")
    codes += codes_of(read["include/npt/estimate/warning_code.hpp"], "WarningCode")
    entries = entries_of(read["examples/npt/remedies.hpp"])
    complaints = complaints_of(read[GUIDE], dict.fromkeys(codes), entries)
    for anchor in SILENT.values():
        if anchor and (anchor not in markdown.Document(read[GUIDE]).anchors() or
                       f'"{anchor}"' not in read["examples/npt/remedies.hpp"]):
            complaints.append(f"{GUIDE}: no entry '{anchor}', with which the program's messages end")
    return markdown.report(complaints)


if __name__ == "__main__":
    sys.exit(main())
