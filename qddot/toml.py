"""TOML files of one's own, read as strictly as studies: what is wrong is said with file, line, key and what is valid.

class Shots(Table):          # a pydantic model: a key that it does not have is refused
study: StudyFile
times: tuple[Real, ...]

read("shots.toml", Shots)

read             a file as a Table; StudyError where it is none
Table            tables of known keys; fields may hold others
Real, Whole      numbers, which neither texts nor true and false are
Reading          what `qddot.reading` reads: greatest, least, ...
StudyFile        the name of a study below the file's own folder
unknown          the message for a name that is not among those known, with the nearest one
"""

from qddot.runner.checks import unknown
from qddot.runner.metrics.reading import Reading
from qddot.runner.study.base import Real, Table, Whole
from qddot.runner.study.checked import StudyFile, read

__all__ = ["Reading", "Real", "StudyFile", "Table", "Whole", "read", "unknown"]
