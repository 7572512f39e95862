"""A table without lines, for the terminal, that is written at once where nothing of it need be wrapped."""

from collections.abc import Iterable

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.table import Table

#: What stands between two columns.
_GAP = "  "
#: What begins markup or the name of a picture, which rich has to read.
_READ = ("[", ":")


class PlainTable(Table):
    """As rich draws it, which takes a millisecond a row: most of the time that a short run's command takes."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The heading and the rows; those of rich where there is a title, texts that it reads, or too little room."""
        columns = [[str(column.header), *map(str, column.cells)] for column in self.columns]
        widths = [max(map(cell_len, texts)) for texts in columns]
        room = sum(widths) + len(_GAP) * (len(widths) - 1)
        if self.title or not columns or room > options.max_width or not all(map(_plain, columns)):
            yield from super().__rich_console__(console, options)
            return
        left = [column.justify == "left" for column in self.columns]
        for number, row in enumerate(zip(*columns, strict=True)):
            cells = (
                text + blank if first else blank + text
                for text, first, blank in zip(row, left, self._blanks(row, widths), strict=True)
            )
            yield Segment(_GAP.join(cells), console.get_style(self.header_style) if not number else None)
            yield Segment.line()

    @staticmethod
    def _blanks(row: Iterable[str], widths: Iterable[int]) -> Iterable[str]:
        """What fills each cell of a row up to the width of its column."""
        return (" " * (width - cell_len(text)) for text, width in zip(row, widths, strict=True))


def _plain(texts: Iterable[str]) -> bool:
    """Whether texts stand on one line each, as they are."""
    return all(text.isprintable() and not any(sign in text for sign in _READ) for text in texts)
