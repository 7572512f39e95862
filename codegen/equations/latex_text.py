"""Plain text in LaTeX: nothing an author writes is a command, and nothing is beyond what pdflatex can set."""

import re
import unicodedata

from qddot.codegen.equations.spelling import GREEK


def greek(name: str) -> str:
    """The command of a Greek letter; SymPy spells lambda, a keyword of Python, as lamda."""
    return rf"\{'lambda' if name == 'lamda' else name}"


_LONG_WORD = re.compile(r"\S{25,}")
_PIECE = 20
_SPECIAL = re.compile(r"[^A-Za-z0-9 .,:;()\[\]+*/=?!'@-]")

_CHARACTERS = {
    "\\": r"\textbackslash{}",
    **{character: f"\\{character}" for character in "#$%&_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': "''",
    "`": r"\textasciigrave{}",
    "°": r"\ensuremath{^\circ}",
    "²": r"\textsuperscript{2}",
    "³": r"\textsuperscript{3}",
    "µ": r"\ensuremath{\mu}",
    "Ω": r"\ensuremath{\Omega}",
    "·": r"\ensuremath{\cdot}",
    "×": r"\ensuremath{\times}",
    "−": r"\ensuremath{-}",
    "±": r"\ensuremath{\pm}",
    "≤": r"\ensuremath{\leq}",
    "≥": r"\ensuremath{\geq}",
    "→": r"\ensuremath{\to}",
    "–": "--",
    "—": "---",
    "‘": "`",
    "’": "'",
    "“": "``",
    "”": "''",
    "…": r"\ldots{}",
    "\xa0": "~",
    **{"ß": r"\ss{}", "æ": r"\ae{}", "Æ": r"\AE{}", "ø": r"\o{}", "Ø": r"\O{}", "ł": r"\l{}", "Ł": r"\L{}"},
    **{letter: rf"\ensuremath{{{greek(name)}}}" for name, letter in GREEK.items()},
}


def escape(text: str) -> str:
    """Text for LaTeX. Accents are kept; a character that has no form in the default fonts is named by its code point.

    Words of 25 characters and more may break anywhere.
    """
    broken = _LONG_WORD.sub(lambda word: "\0".join(re.findall(f".{{1,{_PIECE}}}", word[0])), text)
    return _SPECIAL.sub(lambda found: _escaped(found[0]), broken)


def unit(text: str) -> str:
    """A unit in upright letters: N s/m, kg m^2 with its power raised; 1 is a dash."""
    if text.strip() == "1":
        return "--"
    parts = re.split(r"(?:\^|\*\*)(-?\d+)", text.strip())
    written = [
        rf"\textsuperscript{{{_power(part)}}}" if k % 2 else r"\,".join(map(escape, re.split(r"[ *·]+", part)))
        for k, part in enumerate(parts)
    ]
    return "".join(written)


def _power(text: str) -> str:
    return text.replace("-", r"\ensuremath{-}")


def _escaped(character: str) -> str:
    if character == "\0":
        return r"\allowbreak{}"
    if character in _CHARACTERS:
        return _CHARACTERS[character]
    base, mark = (*unicodedata.normalize("NFD", character), "", "")[:2]
    if base.isascii() and base.isalpha() and mark in _ACCENTS:
        return f"\\{_ACCENTS[mark]}{{{base}}}"
    return rf"\texttt{{U+{ord(character):04X}}}"


_ACCENTS = {
    "\u0300": "`",
    "\u0301": "'",
    "\u0302": "^",
    "\u0303": "~",
    "\u0304": "=",
    "\u0307": ".",
    "\u0308": '"',
    "\u030a": "r",
    "\u030b": "H",
    "\u030c": "v",
    "\u0327": "c",
    "\u0328": "k",
}
