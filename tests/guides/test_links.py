"""Every relative link and anchor of every Markdown file leads somewhere, and so does every guide that the program, the
library or a script names with its anchor (docs/NAME.md#ANCHOR)."""

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import markdown

INLINE = re.compile(r"\[(?:[^\[\]]|\[[^\]]*\](?:\([^)]*\))?)*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
INNER = re.compile(r"\[!\[[^\]]*\]\(([^)\s]+)\)")
PICTURE = re.compile(r"!\[[^\]]*\]\(\s*<?([^)\s>]+)>?[^)]*\)")
REFERENCE = re.compile(r"^\s*\[[^\]]+\]:\s*<?(\S+?)>?\s*(?:\"[^\"]*\")?$", re.MULTILINE)
HTML = re.compile(r"""<(?:a|img|source|video)\b[^>]*?\s(?:href|src|srcset)=["']([^"']+)["']""")
NAMED = re.compile(r"\b((?:docs|examples|bench)/[\w/\-]+\.md)(?:#([\w\-]+))?")
SOURCES = (".hpp", ".h", ".cpp", ".py", ".sh", ".js", ".mjs", ".cmake", ".txt", ".in", ".html", ".toml")


def links_of(document):
    """Pairs of a line's number and a target."""
    kept = ["" if document.in_code[i] or document.in_comment[i] else line for i, line in enumerate(document.lines)]
    text = re.sub(r"(`+)(?:(?!\1)[^\n])*\1", lambda code: " " * len(code.group(0)), "\n".join(kept))
    found = set()
    for pattern in (INLINE, INNER, PICTURE, REFERENCE, HTML):
        for match in pattern.finditer(text):
            found.add((text.count("\n", 0, match.start(1)) + 1, match.group(1)))
    return sorted(found)


def complaints_of_text(name, text, exists, anchors_of):
    """`exists(path)` and `anchors_of(path)` take names relative to the root."""
    complaints = []
    for line, target in links_of(markdown.Document(text)):
        if re.match(r"[a-z][a-z0-9+.\-]*:", target) or target.startswith("//"):
            continue
        path, _, anchor = unquote(target).partition("#")
        if path.startswith("/"):
            complaints.append(f"{name}:{line}: {target}: not relative")
            continue
        parts = []
        for part in (Path(name).parent / path).parts if path else Path(name).parts:
            if part == ".." and parts:
                parts.pop()
            elif part != ".":
                parts.append(part)
        place = "/".join(parts)
        if not exists(place):
            complaints.append(f"{name}:{line}: {target}: no such file")
        elif anchor and place.endswith(".md") and anchor not in anchors_of(place):
            complaints.append(f"{name}:{line}: {target}: no such anchor")
    return complaints


def named_in_sources():
    """Triples of a place, a guide and an anchor that sources name."""
    command = ["git", "-C", str(markdown.ROOT), "ls-files"]
    for name in subprocess.run(command, capture_output=True, text=True).stdout.split("\n"):
        if not name.endswith(SOURCES) or name.startswith("tests/guides/") or not (markdown.ROOT / name).is_file():
            continue
        for i, line in enumerate((markdown.ROOT / name).read_text(encoding="utf-8", errors="replace").split("\n")):
            for path, anchor in NAMED.findall(line):
                yield f"{name}:{i + 1}", path, anchor


def check_rule():
    """The rule finds each kind of offence, and nothing else."""
    files = {"docs/b.md": {"one-two", "it"}, "docs/a.md": {"here"}, "docs/images/c.png": set()}

    def count(text):
        return len(complaints_of_text("docs/a.md", text, files.__contains__, files.__getitem__))

    assert count("[b](b.md) [b `c`](b.md#one-two) [x](#here) [w](https://a.b/c.md) ![c](images/c.png)\n") == 0
    assert count("[b](c.md) [b](b.md#one) [x](#there) ![c](images/d.png) [r](/docs/b.md)\n") == 5
    assert count("[![c](images/d.png)](b.md) [![c](images/c.png)](d.md)\n") == 2
    assert count("`[b](c.md)` <!-- x -->\n\n```md\n[b](c.md)\n```\n") == 0
    assert count("[b][r]\n\n[r]: c.md\n") == 1
    assert count('<img src="images/d.png" width="3">\n') == 1
    document = markdown.Document("# One `two`: three's\n\n## Again\n\n## Again\n\n```sh\n# no\n```\n<a id=\"x\"></a>\n")
    assert document.anchors() == {"one-two-threes", "again", "again-1", "x"}, document.anchors()


def main():
    check_rule()
    anchors = {}

    def exists(place):
        return (markdown.ROOT / place).exists()

    def anchors_of(place):
        if place not in anchors:
            anchors[place] = markdown.read(place).anchors()
        return anchors[place]

    complaints = []
    for name in markdown.all_markdown():
        text = (markdown.ROOT / name).read_text(encoding="utf-8")
        complaints += complaints_of_text(name, text, exists, anchors_of)
    for place, path, anchor in named_in_sources():
        if not exists(path):
            complaints.append(f"{place}: {path}: no such file")
        elif anchor and anchor not in anchors_of(path):
            complaints.append(f"{place}: {path}#{anchor}: no such anchor")
    return markdown.report(complaints)


if __name__ == "__main__":
    sys.exit(main())
