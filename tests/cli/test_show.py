"""Reports on the screen: whole tables where they do not fit, as in a log."""

import io

from rich.console import Console

from hrc_env.cli.show import align_tables, print_report

WIDE = " | ".join(f"column {k} with a long heading" for k in range(12))
REPORT = f"""# Title

Words.

| a | {WIDE} |
| --- |{" ---: |" * 12}
| one |{" 1.23 (1.00 to 2.00) |" * 12}

The end."""


def printed(text: str, **kwargs: object) -> str:
    out = io.StringIO()
    print_report(Console(file=out, **kwargs), text)
    return out.getvalue()


def test_no_number_of_a_table_is_cut_in_a_log_or_a_narrow_terminal():
    for kwargs in ({"width": 80}, {"width": 80, "force_terminal": True}):
        said = printed(REPORT, **kwargs)
        assert "…" not in said
        assert said.count("1.23 (1.00 to 2.00)") == 12
        assert all(f"column {k} with a long heading" in said for k in range(12))


def test_tables_are_rendered_where_they_fit():
    said = printed("| a | b |\n| --- | ---: |\n| 1 | 2 |", width=80, force_terminal=True)
    assert "---" not in said


def test_columns_are_aligned_and_nothing_else_is_touched():
    text = "a | b\n\n| name | x |\n| --- | ---: |\n| one | 1.5 |\n| eleven | 22 |\n\nend"
    assert align_tables(text).splitlines() == [
        "a | b", "",
        "| name   |    x |",
        "| ------ | ---: |",
        "| one    |  1.5 |",
        "| eleven |   22 |", "", "end",
    ]  # fmt: skip


def test_columns_are_aligned_as_their_rule_says():
    text = "| level | worker | x [mm] |\n|---|---|---:|\n| `pixels` | 45 degrees | - |"
    assert align_tables(text).splitlines() == [
        "| level    | worker     | x [mm] |",
        "| -------- | ---------- | -----: |",
        "| `pixels` | 45 degrees |      - |",
    ]
