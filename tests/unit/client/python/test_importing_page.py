"""The commands of docs/importing.md, run as they stand there."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import gatefield
from gatefield.importing import command

SOURCE = Path(os.environ["GATEFIELD_SOURCE_DIR"])


def commands():
    text = (SOURCE / "docs/importing.md").read_text()
    blocks = "\n".join(re.findall(r"```\n(.*?)```", text, re.DOTALL)).replace("\\\n", " ")
    return [shlex.split(line)[1:] for line in blocks.splitlines() if line.startswith("gatefield-import ")]


def test_they_all_write_what_loads(tmp_path):
    found = commands()
    assert {words[0] for words in found} >= {"lsy", "uzh", "cpc", "airsim", "rotorpy", "flightmare", "urdf", "mjcf",
                                             "ros",
                                             "realsense"}
    for words in found:
        words = [str(tmp_path / word[3:]) if word.startswith("my/") else
                 str(SOURCE / word) if word.startswith("tests/") else word for word in words]
        assert command.main(words) == 0, words
        out = words[words.index("--out") + 1]
        (gatefield.Track if words[0] in ("lsy", "uzh", "cpc", "airsim") else gatefield.Vehicle).load(out)


def test_every_kind_has_its_place_on_the_page():
    text = (SOURCE / "docs/importing.md").read_text()
    assert all(f"| `{kind}` |" in text for kind in command.KINDS)


@pytest.mark.parametrize("way", [[str(SOURCE / "client/python/programs/gatefield-import")],
                                 ["-m", "gatefield", "import"]])
def test_both_ways_to_call_it(way):
    done = subprocess.run([sys.executable, *way, "--help"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and all(kind in done.stdout for kind in command.KINDS), done.stderr
    done = subprocess.run([sys.executable, *way, "cpc", "none.yaml", "--out", "x.txt"], capture_output=True, text=True,
                          timeout=60)
    assert done.returncode == 2
    assert done.stderr == "gatefield-import: none.yaml can't be read: No such file or directory\n"
