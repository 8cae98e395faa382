"""What the tests of guides share: which files are guides, and what stands in a Markdown file: lines, blocks of code,
tables, paragraphs, comments and links."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent

COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
FENCE = re.compile(r"^(\s*(?:[-*+]|\d+\.)?\s*)(`{3,}|~{3,})(.*)$")
ITEM = re.compile(r"^\s*(?:[-*+]|\d+[.)])\s+")
HEADING = re.compile(r"^(#{1,6})\s+(.*?)\s*#*$")


def guides(root=ROOT):
    """The guides, as names relative to `root`: not the laboratory notes in docs/notes."""
    names = ["README.md", "CHANGELOG.md", "bench/README.md"]
    found = [root / name for name in names] + list(root.glob("docs/*.md")) + list(root.glob("examples/*/README.md"))
    return sorted(str(path.relative_to(root)) for path in found if path.is_file())


def all_markdown(root=ROOT):
    """Every Markdown file that git knows, or that lies outside of the build folder."""
    try:
        listed = subprocess.run(["git", "-C", str(root), "ls-files", "-co", "--exclude-standard", "*.md"],
                                capture_output=True, text=True, check=True).stdout.split("\n")
    except (OSError, subprocess.CalledProcessError):
        listed = [str(path.relative_to(root)) for path in root.rglob("*.md") if "build" not in path.parts]
    return sorted(name for name in listed if name and (root / name).is_file())


def read_list(name):
    """Names in a list beside the tests, one in a line; # begins a remark."""
    lines = (HERE / name).read_text().split("\n")
    return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


class Block:
    """A fenced block: its language, the comment that ends in the line before it, its code, and the line of its fence."""

    def __init__(self, language, tag, line):
        self.language, self.tag, self.line, self.lines = language, tag, line, []

    @property
    def code(self):
        return "\n".join(self.lines) + "\n"


class Part:
    """Text that belongs together: a heading, a paragraph, an item of a list or a row of a table. `text` has no
    comments; `comments` are the insides of those that stand in it or close behind it."""

    def __init__(self, kind, line):
        self.kind, self.line, self.raw = kind, line, []
        self.comments = []
        self.table_comments = []  # of a row: those in front of its table
        self.header = None  # of a row: the first row of its table
        self.row = 0  # of a row: its number, the first after the header is 0

    @property
    def text(self):
        return COMMENT.sub("", "\n".join(self.raw)).strip()


class Document:
    def __init__(self, text):
        self.lines = text.split("\n")
        self.blocks = []
        self.in_code = [False] * len(self.lines)  # also the fences
        self.in_comment = [False] * len(self.lines)  # lines of nothing but a comment
        self._find_blocks()
        self._find_comments()
        self.parts = self._find_parts()

    def _find_blocks(self):
        fence = None
        for i, line in enumerate(self.lines):
            match = FENCE.match(line)
            if fence is None and match:
                fence = match.group(2)
                indent = len(match.group(1))
                tag = self._comment_before(i)
                self.blocks.append(Block((match.group(3).strip().split() or [""])[0].lower(), tag, i + 1))
                self.in_code[i] = True
            elif fence is not None:
                self.in_code[i] = True
                if match and match.group(2).startswith(fence) and not match.group(3).strip():
                    fence = None
                else:
                    self.blocks[-1].lines.append(line[indent:] if not line[:indent].strip() else line.lstrip())

    def _comment_before(self, i):
        """The inside of the comment that ends in the line before; None: there is none."""
        first = i - 1
        if first < 0 or not self.lines[first].strip().endswith("-->"):
            return None
        while first > 0 and not self.lines[first].strip().startswith("<!--"):
            first -= 1
            if "-->" in self.lines[first]:
                return None
        text = "\n".join(line.strip() for line in self.lines[first:i])
        return text[4:-3].strip() if text.startswith("<!--") else None

    def _find_comments(self):
        inside = False
        for i, line in enumerate(self.lines):
            if self.in_code[i]:
                continue
            if inside:
                self.in_comment[i] = True
                inside = "-->" not in line
            elif line.strip().startswith("<!--"):
                inside = "-->" not in line
                self.in_comment[i] = inside or line.strip().endswith("-->")

    def _find_parts(self):
        parts, current, comment, loose = [], None, [], []
        header, row = None, 0
        for i, line in enumerate(self.lines):
            if self.in_comment[i]:
                comment.append(line)
                if "-->" in line:
                    inside = "\n".join(comment).strip()[4:-3].strip()
                    comment = []
                    loose.append(inside)
                    if current is not None:
                        current.comments.append(inside)
                    elif parts and parts[-1].kind == "row":
                        pass
                continue
            stripped = line.strip()
            if self.in_code[i] or not stripped:
                current, header = None, None
                if self.in_code[i]:
                    loose = []
                continue
            if stripped.startswith("|"):
                part = Part("row", i + 1)
                part.raw.append(line)
                part.comments = [c[4:-3].strip() for c in COMMENT.findall(line)]
                if header is None:
                    header, row, before = part, -2, loose
                    loose = []
                part.header, part.row, part.table_comments = header, row, before
                if row >= 0 or row == -2:
                    parts.append(part)
                row += 1
                current = None
                continue
            header, loose = None, []
            heading = HEADING.match(stripped)
            if heading:
                part = Part("heading", i + 1)
                part.raw.append(heading.group(2))
                parts.append(part)
                current = None
                continue
            if re.match(r"^(-{3,}|\*{3,}|={3,})$", stripped):
                current = None
                continue
            quote = stripped.startswith(">")
            content = line.lstrip("> ") if quote else line
            if current is None or ITEM.match(content):
                current = Part("item" if ITEM.match(content) else "paragraph", i + 1)
                parts.append(current)
            current.raw.append(ITEM.sub("", content, count=1))
            current.comments += [c[4:-3].strip() for c in COMMENT.findall(line)]
        return parts

    def anchors(self):
        """As GitHub makes them of headings, and those that <a id> names."""
        found, count = set(), {}
        for part in self.parts:
            if part.kind != "heading":
                continue
            slug = slug_of(part.text)
            number = count.get(slug, 0)
            count[slug] = number + 1
            found.add(slug if number == 0 else f"{slug}-{number}")
        for i, line in enumerate(self.lines):
            if not self.in_code[i]:
                found.update(re.findall(r"""<\w+[^>]*\s(?:id|name)=["']([^"']+)["']""", line))
        return found


def slug_of(heading):
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    text = re.sub(r"<[^>]*>", "", text)
    text = re.sub(r"(?<!\w)[*_]+|[*_]+(?!\w)", "", text.replace("`", ""))
    return re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-")


def read(name, root=ROOT):
    return Document((root / name).read_text(encoding="utf-8"))


def judge(complaints_of, list_name):
    """Complains about each guide that isn't on the list, and about each name on the list that is clean or no guide;
    with the argument --list prints what the list would be today, with names of guides complains about those. The exit
    status."""
    listed = read_list(list_name)
    known = guides()
    if sys.argv[1:] == ["--list"]:
        print("\n".join(name for name in known if complaints_of(name)))
        return 0
    if len(sys.argv) > 1:
        return report([complaint for name in sys.argv[1:] for complaint in complaints_of(name)])
    complaints = [f"{name}: stands in tests/guides/{list_name}, but is no guide"
                  for name in listed if name not in known]
    for name in known:
        found = complaints_of(name)
        if name not in listed:
            complaints += found
        elif not found:
            complaints.append(f"{name}: is clean now: take it out of tests/guides/{list_name}")
    return report(complaints)


def report(complaints):
    for complaint in complaints:
        print(complaint)
    print(f"{len(complaints)} FAILED" if complaints else "no complaints")
    sys.stdout.flush()
    return 1 if complaints else 0
