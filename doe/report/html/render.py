"""Blocks as HTML; every text is escaped here."""

from html import escape

from doe.report.sections.blocks import Block, Bullets, Figures, Heading, Table, Tile, Tiles, Words


def render(block: Block) -> str:
    """HTML of a block that needs no scripts."""
    match block:
        case Words(text, role):
            return f'<p class="{role}">{prose(text)}</p>' if role else f"<p>{prose(text)}</p>"
        case Heading(text):
            return f"<h3>{escape(text)}</h3>"
        case Bullets(items):
            return f"<ul>{''.join(f'<li>{prose(item)}</li>' for item in items)}</ul>"
        case Tiles(tiles):
            return f'<dl class="tiles">{"".join(map(_tile, tiles))}</dl>'
        case Table():
            return _table(block)
        case Figures(pictures, caption, key):
            name = f' id="{key}"' if key else ""
            words = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
            four = " four" if len(pictures) == 4 and not key else ""
            return f'<figure{name}><div class="pictures{four}">{"".join(pictures)}</div>{words}</figure>'
    raise TypeError(f"{type(block).__name__} has no HTML of its own")


def prose(text: str) -> str:
    """Escaped text whose numbers stay with their signs and units."""
    return escape(text).replace(" %", "&nbsp;%").replace(" ± ", "&nbsp;±&nbsp;")


def _tile(tile: Tile) -> str:
    unit = f' <span class="unit">{escape(tile.unit)}</span>' if tile.unit else ""
    beneath = "".join(f'<span class="beneath">{escape(words)}</span>' for words in tile.beneath)
    return f'<div class="tile"><dt>{escape(tile.name)}</dt><dd><strong>{escape(tile.value)}{unit}</strong>{beneath}</dd></div>'


def _table(table: Table) -> str:
    words = {0, *table.text_columns}
    header = "".join(
        f"<th scope='col'{_kind(place, words)}>{escape(cell)}</th>" for place, cell in enumerate(table.header)
    )
    rows = []
    for name, *cells in table.rows:
        columns = "".join(f"<td{_kind(place, words)}>{_cell(cell)}</td>" for place, cell in enumerate(cells, 1))
        rows.append(f"<tr><th scope='row'>{escape(name)}</th>{columns}</tr>")
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    caption, sort = escape(table.caption), ' class="sortable"' if table.sortable else ""
    body = (
        f'<div class="scroll" role="region" aria-label="{caption}"><table{sort}><caption>{caption}</caption>'
        f"<thead><tr>{header}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>{note}"
    )
    return (
        f"<details><summary>{caption}</summary>{body}</details>" if table.folded else f'<div class="table">{body}</div>'
    )


def _cell(text: str) -> str:
    """Escaped; on a narrow page it may break before its error, nowhere else."""
    return escape(text).replace(" %", "&nbsp;%").replace("± ", "±&nbsp;")


def _kind(place: int, words: set[int]) -> str:
    return " class='words'" if place in words else ""
