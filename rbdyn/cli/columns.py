"""How wide the columns of a table on a terminal are, and which of them stand together. Loads nothing heavy."""

from collections.abc import Sequence

# Columns of the terminal about the text of a table's column, and about all of them.
PADDING, FRAME = 3, 1
# Characters of a cell that is never broken.
SHORT = 20


def blocks(texts: Sequence[Sequence[str]], room: int) -> list[list[tuple[int, int]]]:
    """Columns of texts (one sequence of cells a column), in blocks that are no wider than ``room``: (place, width) of each.

    A column is never narrower than its longest word and its short cells, such as a value with its error; the first stands in
    every block. What has no room beside the first column is broken.
    """
    from rich.cells import cell_len

    room -= FRAME
    parts_of = ([*column[0].split(), *(part for text in column[1:] for part in _parts(text))] for column in texts)
    least = [max(map(cell_len, parts), default=1) for parts in parts_of]
    whole = [max((cell_len(line) for text in column for line in text.splitlines()), default=1) for column in texts]
    first = min(least[0], max(room // 2 - PADDING, 1)) if len(texts) > 1 else min(least[0], room - PADDING)
    widest = max(room - first - 2 * PADDING, 1)
    least = [first, *(min(each, widest) for each in least[1:])]
    parts: list[list[int]] = [[0]]
    for place in range(1, len(texts)):
        if sum(least[each] + PADDING for each in [*parts[-1], place]) > room and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(place)
    return [
        list(zip(part, _widths([(least[each], whole[each]) for each in part], room), strict=True)) for part in parts
    ]


def _parts(text: str) -> list[str]:
    """What of a cell stands in one line."""
    return text.split() if len(text) > SHORT else [text]


def _widths(ends: Sequence[tuple[int, int]], room: int) -> list[int]:
    """Widths from the least to the whole of each column, as far as there is room: the least is widened first."""
    widths = [least for least, _ in ends]
    spare = room - sum(width + PADDING for width in widths)
    while spare > 0:
        short = [place for place, (_, whole) in enumerate(ends) if widths[place] < whole]
        if not short:
            break
        widths[min(short, key=lambda place: widths[place])] += 1
        spare -= 1
    return widths
