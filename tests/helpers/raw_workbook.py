"""Workbooks written part by part, so that a test can hold what no spreadsheet writes."""

import zipfile
from collections.abc import Iterable
from pathlib import Path

OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
PACKAGE = "http://schemas.openxmlformats.org/package/2006/relationships"
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
SHEET, STYLES, STRINGS, BOOK = "xl/worksheets/sheet1.xml", "xl/styles.xml", "xl/sharedStrings.xml", "xl/workbook.xml"
CONTENT = "http://schemas.openxmlformats.org/package/2006/content-types"
KIND = "application/vnd.openxmlformats-officedocument.spreadsheetml"
HEADER = '<row r="1"><c r="A1" t="s"><v>0</v></c><c r="B1" t="s"><v>1</v></c><c r="C1" t="s"><v>2</v></c></row>'


def row(number: object, *cells: str, keys: str = "") -> str:
    """A row of a sheet of cells, by default of three numbers."""
    cells = cells or tuple(f'<c r="{letter}{number}"><v>{letter == "A"}</v></c>' for letter in "ABC")
    return f'<row r="{number}" {keys}>{"".join(cells).replace("True", "1").replace("False", "2.5")}</row>'


def sheet(*rows: str, before: str = "") -> str:
    """XML of a sheet with the names a, b and y above its rows."""
    return f'<worksheet xmlns="{MAIN}">{before}<sheetData>{HEADER}{"".join(rows)}</sheetData></worksheet>'


def book(*sheets: tuple[str, str], after: str = "") -> str:
    """XML of a workbook with sheets of a name and a state, which are the parts sheet1, sheet2 and so on."""
    listed = "".join(
        f'<sheet name="{name}" sheetId="{place}" state="{state}" r:id="s{place}"/>'
        for place, (name, state) in enumerate(sheets, 1)
    )
    return f'<workbook xmlns="{MAIN}" xmlns:r="{OFFICE}"><sheets>{listed}</sheets>{after}</workbook>'


def relations(pairs: Iterable[tuple[str, str, str]]) -> str:
    """XML that names parts by identity, kind and target."""
    listed = "".join(f'<Relationship Id="{one}" Type="{OFFICE}/{kind}" Target="{to}"/>' for one, kind, to in pairs)
    return f'<Relationships xmlns="{PACKAGE}">{listed}</Relationships>'


def write(path: Path, parts: dict[str, str] | None = None, sheets: int = 1) -> Path:
    """A sound workbook of two runs with other or more ``parts``."""
    links = [(f"s{number}", "worksheet", f"worksheets/sheet{number}.xml") for number in range(1, sheets + 1)]
    links += [("styles", "styles", "styles.xml"), ("texts", "sharedStrings", "sharedStrings.xml")]
    texts = "".join(f"<si><t>{name}</t></si>" for name in "aby")
    kinds = "".join(
        f'<Override PartName="/{name}" ContentType="{KIND}.{kind}+xml"/>'
        for name, kind in ((BOOK, "sheet.main"), (STRINGS, "sharedStrings"), (STYLES, "styles"))
    )
    usual = {
        "[Content_Types].xml": f'<Types xmlns="{CONTENT}">{kinds}</Types>',
        "_rels/.rels": relations([("main", "officeDocument", BOOK)]),
        "xl/_rels/workbook.xml.rels": relations(links),
        BOOK: book(("Runs", "visible")),
        STYLES: f'<styleSheet xmlns="{MAIN}"><cellXfs><xf numFmtId="0"/><xf numFmtId="46"/></cellXfs></styleSheet>',
        STRINGS: f'<sst xmlns="{MAIN}">{texts}</sst>',
        SHEET: sheet(row(2), row(3)),
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in {**usual, **(parts or {})}.items():
            archive.writestr(name, text)
    return path
