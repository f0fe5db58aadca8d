"""The life of the blade of the page: every line of that part, in order, and the numbers it quotes."""

import re
from pathlib import Path

import pytest
from test_fe_example import OF_A_LIFE, beside_docs, run, with_the_contact

PAGE = OF_A_LIFE
BLOCKS = re.findall(r"^```(sh|python)\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)

__all__ = ["beside_docs"]


@pytest.mark.long
@pytest.mark.usefixtures("beside_docs")
def test_the_page_runs_line_by_line(capsys: pytest.CaptureFixture[str]) -> None:
    said = {}
    for kind, block in BLOCKS:
        if kind == "python":
            exec(compile(block, "fe-example.md", "exec"), {"__name__": "page"})
            said["best"] = " ".join(capsys.readouterr().out.split())
            continue
        for line in block.splitlines():
            said[line.split()[1]] = " ".join(run(line, capsys).split())
            if " import " in line:
                scene = Path("blade.toml")
                scene.write_text(with_the_contact(scene.read_text(), PAGE))
    assert "foot node 103" in said["docs/fe/blade.py"]
    for key, quoted in (
        ("design", r"damper\.N0 (\d+)\.\d+ N objective (0\.\d\d)"),
        ("wear", r"damper [\d.]+ mm \d+ N (\d+) N"),
        ("transient", r"largest max\|x\| (\d\.\d+) .*mm at 284\.\d+ Hz"),
        ("best", r"best damper\.N0 = (\d+)"),
    ):
        found = re.search(quoted, said[key])
        assert found is not None, said[key]
        assert all(number[:3] in PAGE for number in found.groups()), said[key]
    assert Path("blade.html").stat().st_size > 10_000
