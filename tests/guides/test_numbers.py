"""Numbers with a unit in README.md and docs/results.md are measured ones: each has a key into docs/results/*.json,
which bench/results.py writes, and agrees with the value there at the precision printed.

Keys stand in comments in the same paragraph, item or row, or on lines close behind a paragraph, as many as numbers
with a unit and in their order:
    Posed to 7.3 mm in 0.44 s. <!-- key: accuracy.natural.mean_mm, speed.first_result.all_threads.median_ms -->
A minus sign instead of a key: no measured number but a setting or a size that is given. {a,b} stands for both. In
front of a table, a comment that begins with `keys` gives one line for each row:
    <!-- keys
    accuracy.natural.{mean_mm,pmd}
    accuracy.wide.{mean_mm,pmd}
    -->
In a table the head of a column may give the unit. unkeyed_numbers.txt lists numbers that have no key yet."""

import json
import re
import sys

import markdown

FILES = ("README.md", "docs/results.md")
LIST = "unkeyed_numbers.txt"
# Of each unit what it measures, and how many of the base unit it is.
UNITS = {"mm": ("length", 1e-3), "cm": ("length", 1e-2), "µs": ("time", 1e-6), "ms": ("time", 1e-3), "s": ("time", 1.0),
         "seconds": ("time", 1.0), "min": ("time", 60.0), "minutes": ("time", 60.0), "kB": ("size", 1e3),
         "MB": ("size", 1e6), "GB": ("size", 1e9), "%": ("share", 1e-2), "e-4": ("area", 1e-4), "times": ("ratio", 1.0)}
KEY_UNITS = {"mm": "mm", "us": "µs", "ms": "ms", "s": "s", "mb": "MB", "percent": "%", "times": "times"}
NUMBER = r"\d[\d,]*(?:\.\d+)?"
UNIT = "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True))
MEASURED = re.compile(rf"(?<![\w.\-])({NUMBER}(?:(?:\s*[–,]\s*|\s+(?:to|and|or)\s+){NUMBER})*)[\s ]?({UNIT})(?![\w/])")
CELL = re.compile(rf"^\W*({NUMBER})\W*$")
HEAD_UNIT = re.compile(rf"(?:^|[\s,(×x1])({UNIT})\)?$")


def plain(text):
    """Without code, pictures, addresses and other marks."""
    text = re.sub(r"`+[^`]*`+", "`", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return re.sub(r"<[^>]*>|https?://\S+", "", text)


def cells_of(row):
    return [cell.strip() for cell in row.strip().strip("|").split("|")]


def numbers_of(part):
    """Pairs of a number as printed and its unit."""
    found = []
    if part.kind != "row":
        for numbers, unit in MEASURED.findall(plain(part.text)):
            found += [(number, unit) for number in re.findall(NUMBER, numbers)]
        return found
    if part.row < 0:
        return []  # the header
    heads = cells_of(plain(part.header.text))
    for i, cell in enumerate(cells_of(plain(part.text))):
        own = [(number, unit) for numbers, unit in MEASURED.findall(cell) for number in re.findall(NUMBER, numbers)]
        if not own and i < len(heads):
            head, bare = HEAD_UNIT.search(heads[i]), CELL.match(cell)
            if head and bare:
                own = [(bare.group(1), head.group(1))]
        found += own
    return found


def expand(keys):
    """Keys of a text: separated by commas, with {a,b} spelt out."""
    expanded = []
    for key in re.findall(r"(?:[^,{}]|\{[^}]*\})+", keys):
        group = re.search(r"\{([^}]*)\}", key)
        names = group.group(1).split(",") if group else [None]
        for name in names:
            expanded.append(key.strip() if name is None else key.replace(group.group(0), name.strip()).strip())
    return [key for key in expanded if key]


def keys_of(part):
    keys = []
    for comment in part.comments:
        if re.match(r"keys?:", comment):
            keys += expand(comment.split(":", 1)[1])
    for comment in part.table_comments:
        if re.match(r"keys\b:?\s*\n", comment) and part.row >= 0:
            lines = [line.strip() for line in comment.split("\n")[1:] if line.strip()]
            if part.row < len(lines):
                keys += expand(lines[part.row])
    return keys


class NoValue(Exception):
    pass


def value_of(key, results):
    """The value and its unit; None: a bare number."""
    value = results
    for name in key.split("."):
        if not isinstance(value, dict) or name not in value:
            raise NoValue(f"no value {key} in docs/results (bench/results.py writes it)")
        value = value[name]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise NoValue(f"{key} is no number in docs/results")
    last = key.split(".")[-1]
    return value, "m2" if last.startswith("pmd") else KEY_UNITS.get(last.rsplit("_", 1)[-1])


def complaint_of(number, unit, key, results):
    """What is wrong with a printed number; None: nothing."""
    try:
        value, value_unit = value_of(key, results)
    except NoValue as error:
        return str(error)
    kind, scale = UNITS[unit]
    value_kind, value_scale = ("area", 1.0) if value_unit == "m2" else UNITS.get(value_unit, (kind, scale))
    if kind != value_kind:
        return f"{number} {unit}, but {key} is in {value_unit}"
    decimals = len(number.split(".")[1]) if "." in number else 0
    printed = float(number.replace(",", ""))
    expected = value * value_scale / scale
    if abs(printed - expected) <= 0.5 * 10.0 ** -decimals * (1 + 1e-6):
        return None
    return f"{number} {unit}, expected {expected:.{decimals}f} {unit} ({key})"


def check(name, text, results):
    """Complaints, and the numbers without a key."""
    complaints, unkeyed = [], []
    for part in markdown.Document(text).parts:
        numbers, keys = numbers_of(part), keys_of(part)
        printed = [f"{number}{'' if unit == 'e-4' else ' '}{unit}" for number, unit in numbers]
        if not keys:
            unkeyed += [(part.line, number) for number in printed]
        elif len(keys) != len(numbers):
            complaints.append(f"{name}:{part.line}: {len(keys)} keys for {len(numbers)} numbers: {'; '.join(printed)}")
        else:
            for (number, unit), key in zip(numbers, keys):
                wrong = None if key == "-" else complaint_of(number, unit, key, results)
                if wrong:
                    complaints.append(f"{name}:{part.line}: {wrong}")
    return complaints, unkeyed


def read_results():
    folder = markdown.ROOT / "docs" / "results"
    return {path.stem: json.loads(path.read_text())["values"] for path in sorted(folder.glob("*.json"))}


def check_rule():
    """The rule finds each kind of offence, and nothing else."""
    results = {"a": {"b_mm": 7.34, "c_ms": 436.0, "pmd": 0.0000384, "d_percent": 97.2, "n": 3}}

    def count(text):
        complaints, unkeyed = check("a.md", text, results)
        return len(complaints), len(unkeyed)

    assert count("It is 7.3 mm and 0.44 s and 0.4e-4. <!-- key: a.b_mm, a.c_ms, a.pmd -->\n") == (0, 0)
    assert count("It is 7.3 mm\nand 97 %.\n<!-- key: a.{b_mm,d_percent} -->\n") == (0, 0)
    assert count("It is 7.4 mm. <!-- key: a.b_mm -->\n") == (1, 0)
    assert count("It is 7 mm. <!-- key: a.c_ms -->\n") == (1, 0)
    assert count("It is 7 mm. <!-- key: a.e_mm -->\n") == (1, 0)
    assert count("It is 7 mm. <!-- key: - -->\n") == (0, 0)
    assert count("It is 7 mm, 8 mm. <!-- key: a.b_mm -->\n") == (1, 0)
    assert count("It is 7 to 8 mm, 13e-4, 97% and 3 times.\n") == (0, 5)
    assert count("Code `7 mm`, version 3, 24 joints, x86-64 s, [a](7mm).\n\n```\n7 mm\n```\n") == (0, 0)
    table = "| set | mean, mm | PMD x 1e-4 |\n|---|---|---|\n| 12 s | 7.3 | 0.38 |\n"
    assert count("| set | n | mean, mm | PMD x 1e-4 |\n|---|---|---|---|\n| x | 12 | 7.3 | 0.38 |\n") == (0, 2)
    assert count("<!-- keys\n-, a.{b_mm,pmd}\n-->\n" + table) == (0, 0)
    assert count(table.replace("0.38 |", "0.38 | <!-- key: -, a.b_mm, a.pmd -->")) == (0, 0)
    assert count("<!-- keys\n-, a.pmd, a.pmd\n-->\n" + table) == (1, 0)


def main():
    check_rule()
    results = read_results()
    complaints, unkeyed = [], []
    for name in FILES:
        if not (markdown.ROOT / name).is_file():
            continue
        wrong, without = check(name, (markdown.ROOT / name).read_text(encoding="utf-8"), results)
        complaints += wrong
        unkeyed += [(name, line, number) for line, number in without]
    if sys.argv[1:] == ["--list"]:
        print("\n".join(f"{name}: {number}" for name, _, number in unkeyed))
        return 0
    listed = markdown.read_list(LIST)
    for name, line, number in unkeyed:
        if f"{name}: {number}" in listed:
            listed.remove(f"{name}: {number}")
        else:
            complaints.append(f"{name}:{line}: {number}: has no key into docs/results")
    complaints += [f"{entry}: has a key now, or is gone: take it out of tests/guides/{LIST}" for entry in listed]
    return markdown.report(complaints)


if __name__ == "__main__":
    sys.exit(main())
