"""Tables that scripts write into a page, between comments that mark their position."""


def with_table(text: str, name: str, table: str) -> str:
    """The text of a page with the table of this name replaced."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, rest = text.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n{table}\n{end}{after}"
