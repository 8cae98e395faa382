"""Guides are easy to read: no line beyond 100 columns, rows of tables 120 (comments, which nobody sees, don't count);
no sentence beyond 30 words, and at most 18 a sentence in the mean of a file. Code, tables and headings hold no
sentences; a link and a piece of code are one word each, a picture none. Guides that aren't so yet stand in
long_guides.txt."""

import re
import sys

import markdown

COLUMNS, TABLE_COLUMNS = 100, 120
WORDS, MEAN_WORDS = 30, 18
# A point behind these ends no sentence, unless the next word begins with a capital.
SHORT = re.compile(r"(?:\b(?:e\.g|i\.e|etc|al|vs|cf|fig|approx|no)\.)$", re.IGNORECASE)


def sentences_of(text):
    """Sentences as lists of words."""
    text = re.sub(r"`+[^`]*`+", "Code", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[[^\]]*\](?:\([^)]*\)|\[[^\]]*\])", "Link", text)
    text = re.sub(r"^\[[^\]]*\]:.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"<https?://[^>]*>|https?://\S+", "Link", text)
    text = re.sub(r"<[^>]*>", " ", text)
    sentences, current = [], []
    tokens = text.split()
    for i, token in enumerate(tokens):
        if re.search(r"\w", token):
            current.append(token)
        end = re.sub(r"""[)\]"'*_”’]+$""", "", token)
        following = tokens[i + 1] if i + 1 < len(tokens) else "End"
        if SHORT.search(end) and not following[:1].isupper():
            continue
        if end.endswith((".", "!", "?")) or token == "·":
            sentences.append(current)
            current = []
    sentences.append(current)
    return [words for words in sentences if words]


def complaints_of_text(name, text):
    document = markdown.Document(text)
    complaints = []
    for i, line in enumerate(document.lines):
        if document.in_comment[i]:
            continue
        shown = line if document.in_code[i] else markdown.COMMENT.sub("", line).rstrip()
        table = not document.in_code[i] and line.lstrip().startswith("|")
        most = TABLE_COLUMNS if table else COLUMNS
        if len(shown) > most:
            complaints.append(f"{name}:{i + 1}: {len(shown)} columns, at most {most}")
    counts = []
    for part in document.parts:
        if part.kind in ("row", "heading"):
            continue
        for words in sentences_of(part.text):
            counts.append(len(words))
            if len(words) > WORDS:
                complaints.append(f"{name}:{part.line}: a sentence of {len(words)} words, at most {WORDS}: "
                                  f"{' '.join(words[:8])} ...")
    mean = sum(counts) / len(counts) if counts else 0
    if mean > MEAN_WORDS:
        complaints.append(f"{name}: {mean:.1f} words a sentence, at most {MEAN_WORDS}")
    return complaints


def complaints_of(name):
    return complaints_of_text(name, (markdown.ROOT / name).read_text(encoding="utf-8"))


def check_rule():
    """The rule finds each kind of offence, and nothing else."""

    def count(text):
        return len(complaints_of_text("a.md", text))

    long = " ".join(["word"] * 31)
    short = " ".join(["word"] * 15)
    assert count("# " + long + "\n\n" + short + ".\n") == 1  # the heading is too wide, and no sentence
    assert count("w" * 101 + "\n") == 1
    assert count("| " + "w" * 110 + " |\n|---|\n") == 0
    assert count("| " + "w" * 120 + " |\n|---|\n") == 1
    assert count("w <!-- key: " + "w" * 101 + " -->\n") == 0
    assert count(long.replace("word", "w") + ".\n") == 2  # also the mean
    assert count((" ".join(["w"] * 19) + ".\n\n") * 2) == 1  # the mean alone
    assert count(short + ".\n" + short + ".\n\n- " + short + "\n- " + short + "\n") == 0
    assert count("```sh\n" + "\n".join(["w w w w w w w w w w w"] * 9) + "\n```\n") == 0
    assert count("```sh\n" + "w" * 101 + "\n```\n") == 1
    assert count("<!-- " + long + " -->\n") == 0
    assert count(" ·\n".join(["[a b c d](e.md)"] * 40) + "\n") == 0
    assert sentences_of("One e.g. two. npt `a b` [c d](e) ends.") == [["One", "e.g.", "two."],
                                                                     ["npt", "Code", "Link", "ends."]]
    assert sentences_of("A mean of 0.6e-4 (of 3). It ends!") == [["A", "mean", "of", "0.6e-4", "(of", "3)."],
                                                                ["It", "ends!"]]


if __name__ == "__main__":
    check_rule()
    sys.exit(markdown.judge(complaints_of, "long_guides.txt"))
